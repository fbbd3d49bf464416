from __future__ import annotations

import json
from pathlib import Path

import pytest

from dh2sim.errors import RunDamagedError, RunError
from dh2sim.simulate.description import describe
from dh2sim.simulate.store.writer import RunWriter
from tests.program import contents
from tests.simulate.store.runs import JOINTS, layout, make, whole


def test_a_finished_run_is_described(tmp_path: Path) -> None:
    of = layout(rollouts=7, block=3, steps=4)
    path = make(tmp_path / "run.zarr", of)
    saturated = int((whole(of)["saturation"] > 0).any(axis=1).sum())
    counts = (whole(of)["saturation"] > 0).sum(axis=0)
    by_joint = dict(zip(JOINTS, map(int, counts), strict=True))
    assert describe(str(path)).to_json() == {
        "path": str(path),
        "robot": "small",
        "controller": "hold",
        "rollouts": 7,
        "finished": 6,
        "unstable": 1,
        "not_run": 0,
        "reasons": {"bad_qacc": 1},
        "touched": None,
        "first_contact": None,
        "loop_gap": None,
        "saturated": saturated,
        "saturated_joints": by_joint,
        "steps": 8,
        "timestep": 0.002,
        "every": 2,
        "duration": 0.016,
        "variables": ["qpos", "ctrl", "tool_pose", "contacts", "status", "stop_step", "saturation"],
        "bytes_on_disk": sum(map(len, contents(path).values())),
        "blocks": 3,
        "blocks_done": 3,
        "blocks_missing": [],
        "seconds": 0.75,
        "steps_per_second": (6 * 8 + 3) / 0.75,
        "seed": 0,
        "created": "2026-11-22T10:00:00+00:00",
        "versions": {"dh2sim": "0.1.0", "mujoco": "3.17.0", "numpy": "2.4.0", "python": "3.11.0"},
        "complete": True,
        "integrator": "Euler",
        "engine": "mujoco",
        "device": "",
        "start": "home",
        "randomize": {},
        "vary": {},
        "designs": None,
        "per_design": 1,
        "recorded": {
            "qpos": {"units": "rad or m", "dimensions": ["rollout", "step", "joint"], "shape": [7, 5, 2]},
            "ctrl": {"units": "N*m or N", "dimensions": ["rollout", "interval", "actuator"], "shape": [7, 4, 2]},
            "tool_pose": {"units": "m, 1", "dimensions": ["rollout", "step", "pose"], "shape": [7, 5, 7]},
            "contacts": {"units": "1", "dimensions": ["rollout", "interval"], "shape": [7, 4]},
            "status": {"units": "", "dimensions": ["rollout"], "shape": [7]},
            "stop_step": {"units": "1", "dimensions": ["rollout"], "shape": [7]},
            "saturation": {"units": "1", "dimensions": ["rollout", "actuator"], "shape": [7, 2]},
        },
        "stopped": [{"rollout": 4, "reason": "bad_qacc", "step": 3}],
        "bytes_in_memory": sum(values.nbytes for values in whole(of).values()),
        "command": "dh2sim rollout small",
        "resume_command": None,
    }


def test_a_run_that_has_not_begun_is_described(tmp_path: Path) -> None:
    RunWriter.create(tmp_path / "run.zarr", layout()).close()
    summary = describe(tmp_path / "run.zarr")
    assert (summary.finished, summary.unstable, summary.not_run, summary.blocks_done) == (0, 0, 7, 0)
    assert (summary.seconds, summary.steps_per_second, summary.complete) == (0, None, False)
    assert json.loads(json.dumps(summary.to_json())) == summary.to_json()


def test_rollouts_of_a_block_that_is_not_committed_count_as_not_run(tmp_path: Path) -> None:
    of = layout()
    path = make(tmp_path / "run.zarr", of)
    for block in (0, 2):
        (path / "blocks" / "record" / f"c.{block}").unlink()
    summary = describe(path)
    assert (summary.finished, summary.unstable, summary.not_run) == (2, 1, 4)
    assert (summary.blocks_done, summary.blocks, summary.seconds) == (1, 3, 0.25)
    assert summary.blocks_missing == (0, 2)


def test_a_chunk_that_is_missing_is_an_error(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", layout())
    (path / "qpos" / "c.0.0.0").unlink()
    with pytest.raises(RunDamagedError, match="is damaged; resume it"):
        describe(path)


def test_a_damaged_status_is_an_error(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", layout())
    chunk = path / "status" / "c.1"
    chunk.write_bytes(b"\0" + chunk.read_bytes()[1:])
    with pytest.raises(RunDamagedError) as caught:
        describe(path)
    assert str(caught.value).startswith(f"'{path}' is damaged; resume it")


def test_what_is_no_run_is_not_described(tmp_path: Path) -> None:
    with pytest.raises(RunError) as caught:
        describe(tmp_path)
    assert str(caught.value) == f"'{tmp_path}' is not a run of dh2sim"
