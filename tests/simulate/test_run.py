"""Runs as the library makes them."""

from __future__ import annotations

import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import dh2sim
import dh2sim.simulate
from dh2sim.errors import ControllerError, RunDiffersError, RunExistsError, SettingsError, UnknownRobotError
from dh2sim.simulate import open_dataset, rollout
from dh2sim.simulate.options import RolloutOptions
from dh2sim.simulate.prepare import prepare
from dh2sim.simulate.run import fill, open_run
from tests.program import contents
from tests.sample_robots import model
from tests.simulate import robots

EVERYTHING: dict[str, Any] = {
    "rollouts": 5,
    "steps": 12,
    "every": 3,
    "controller": "pd",
    "start": "random",
    "integrator": "Euler",
    "record": "qpos,qvel,ctrl,tool_pose,reference,qacc,torque,energy,contacts",
    "floating_base": True,
    "randomize": {"mass": 0.1},
}


@pytest.mark.parametrize(
    "how", [EVERYTHING, {"rollouts": 3, "steps": 4}, {"rollouts": 2, "steps": 5, "controller": "passive"}]
)
def test_a_run_in_memory_is_the_one_on_disk(how: dict[str, Any], tmp_path: Path) -> None:
    in_memory = rollout(model("odd"), **how)
    on_disk = rollout(model("odd"), out=tmp_path / "run.zarr", **how)
    opened = xr.open_zarr(tmp_path / "run.zarr")
    for other in (on_disk.load(), open_dataset(tmp_path / "run.zarr").load(), opened.load()):
        a, b = ({**run.attrs, "created": ""} for run in (in_memory, other))
        assert a == b
        xr.testing.assert_identical(in_memory.drop_attrs(deep=False), other.drop_attrs(deep=False))
        for name in in_memory.variables:
            assert in_memory[name].dims == other[name].dims
            if in_memory[name].dtype.kind != "U":
                assert in_memory[name].dtype == other[name].dtype


@pytest.mark.parametrize("robot", ["planar_2r", Path("planar_2r.yaml"), "model"])
def test_a_robot_may_be_a_name_a_file_or_a_model(robot: Any) -> None:
    given = dh2sim.build_model(dh2sim.load_robot("planar_2r")) if robot == "model" else robot
    run = rollout(given, rollouts=2, steps=3)
    assert run.attrs["robot"] == "planar_2r"
    assert run.qpos.shape == (2, 4, 2)


def test_an_unknown_robot_is_reported() -> None:
    with pytest.raises(UnknownRobotError) as caught:
        rollout("planar_2q", rollouts=2, steps=3)
    assert "Did you mean 'planar_2r'?" in str(caught.value)


@pytest.mark.parametrize("name", ["rollouts", "steps", "seed", "every"])
@pytest.mark.parametrize(("value", "shown"), [(2.0, "2.0"), ("2", "'2'")])
def test_numbers_that_count_are_whole(name: str, value: Any, shown: str) -> None:
    with pytest.raises(SettingsError) as caught:
        rollout("planar_2r", **{name: value})
    assert str(caught.value) == f"{name} must be a whole number, got {shown}"


def test_numbers_may_be_numpys(tmp_path: Path) -> None:
    how = {"rollouts": np.int64(2), "steps": np.int32(4), "seed": np.uint8(3), "every": np.int16(2)}
    run = rollout("planar_2r", out=tmp_path / "run.zarr", timestep=np.float64(0.002), **how)  # type: ignore[arg-type]
    assert run.attrs["settings"]["seed"] == 3
    assert run.sizes["step"] == 3


@pytest.mark.parametrize("out", [None, "run.zarr"])
def test_progress_is_reported_as_rollouts_are_done(out: str | None, tmp_path: Path) -> None:
    reported: list[int] = []
    rollout("planar_2r", rollouts=600, steps=2, out=None if out is None else tmp_path / out, advance=reported.append)
    assert sum(reported) == 600
    assert len(reported) >= 3


@pytest.mark.parametrize("threads", [0, 1, 3])
def test_threads_do_not_matter(threads: int) -> None:
    run = rollout("planar_2r", rollouts=3, steps=4, threads=threads)
    assert run.equals(rollout("planar_2r", rollouts=3, steps=4))


def test_a_run_is_not_overwritten_unless_asked_to(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    rollout("planar_2r", rollouts=2, steps=4, out=path)
    before = contents(path)
    with pytest.raises(RunExistsError) as exists:
        rollout("planar_2r", rollouts=2, steps=4, out=path)
    assert str(exists.value) == f"'{path}' already exists; resume it, overwrite it, or choose another folder"
    with pytest.raises(RunDiffersError) as differs:
        rollout("planar_2r", rollouts=2, steps=6, out=path, resume=True)
    assert "steps was 4 and is now 6" in str(differs.value)
    assert contents(path) == before
    assert rollout("planar_2r", rollouts=2, steps=6, out=path, overwrite=True).sizes["step"] == 7


def test_resuming_and_replacing_exclude_each_other(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    with pytest.raises(SettingsError) as caught:
        rollout("planar_2r", rollouts=2, steps=4, out=path, resume=True, overwrite=True)
    assert str(caught.value) == "resume must not be given together with overwrite"
    assert not path.exists()


def test_a_failing_controller_leaves_what_is_safe(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    with pytest.raises(ControllerError):
        rollout(robots.arm(), rollouts=3, steps=7, out=path, controller="tests.simulate.drivers:Late")
    assert open_dataset(path).status.values.tolist() == [-1, -1, -1]


def test_a_run_larger_than_memory_is_refused() -> None:
    with pytest.raises(SettingsError) as caught:
        rollout("planar_2r", rollouts=10**7, steps=10**6)
    assert str(caught.value) == "the run does not fit into memory; give 'out' to write it block by block"


def test_blocks_are_filled_until_one_is_asked_to_stop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dh2sim.simulate.prepare.BLOCK_BYTES", 2**14)
    job = prepare(model("planar_2r"), RolloutOptions(rollouts=100, steps=4))
    answers = iter([False, False, True])
    with open_run(job, tmp_path / "run.zarr") as writer:
        blocks = writer.layout.blocks
        progress = fill(writer, job, stopping=lambda: next(answers))
        assert blocks > 2
        assert not progress.finished
        assert progress.rollouts == 2 * writer.layout.block
        assert len(writer.pending()) == blocks - 2
    with open_run(job, tmp_path / "run.zarr", resume=True) as writer:
        reported: list[int] = []
        again = fill(writer, job, advance=reported.append)
        assert again.finished
        assert again.rollouts == 100 - progress.rollouts
        assert reported[0] == progress.rollouts
        assert sum(reported) == 100
    assert (open_dataset(tmp_path / "run.zarr").status == 0).all()


@pytest.mark.slow
def test_memory_is_bounded_by_the_block_and_not_by_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dh2sim.simulate.prepare.BLOCK_BYTES", 2**21)
    monkeypatch.setattr("dh2sim.simulate.loops.SEGMENT_BYTES", 2**20)
    rollout("planar_2r", rollouts=10, steps=200, out=tmp_path / "warm.zarr", threads=2)
    peaks = []
    for name, how in (
        ("many", {"rollouts": 2000, "steps": 200}),
        ("long", {"rollouts": 1000, "steps": 400, "every": 40}),
    ):
        tracemalloc.start()
        rollout("planar_2r", out=tmp_path / name, threads=2, controller="hold", **how)  # type: ignore[arg-type]
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert sum(map(len, contents(tmp_path / "many").values())) < open_dataset(tmp_path / "many").nbytes
    assert open_dataset(tmp_path / "many").nbytes > 40e6
    assert peaks[0] < 15e6
    assert peaks[1] < 15e6
