from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from dh2sim.errors import RunDiffersError
from dh2sim.simulate.store.writer import RunWriter
from tests.program import contents
from tests.refusals import refusal
from tests.simulate.store.runs import finish, lasting, layout, make, resume

refused = partial(refusal, RunDiffersError, RunWriter.resume)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("other", "reported"),
    [
        ({"settings": {"seed": 1}}, "seed was 0 and is now 1"),
        (
            {"settings": {"seed": 1, "controller": "pd:kp=10", "controller_digest": "a" * 64}},
            "seed was 0 and is now 1; controller was 'hold' and is now 'pd:kp=10'",
        ),
        (
            {"settings": {"controller_digest": "a" * 64}},
            "the controller's code or a file that it reads has changed",
        ),
        ({"settings": {"start": "q.csv", "start_digest": "a" * 64}}, "start was 'home' and is now 'q.csv'"),
        ({"settings": {"start_digest": "a" * 64}}, "the initial states have changed"),
        (
            {"settings": {"randomize": {"mass": 0.1, "gain": 0.2}}},
            "randomize was none and is now mass=0.1,gain=0.2",
        ),
        ({"settings": {"record": ["qpos", "qvel"]}}, "record was qpos,ctrl and is now qpos,qvel"),
        ({"settings": {"velocity_limits": [1.0, 3.0]}}, "velocity limit was 1.0,2.0 and is now 1.0,3.0"),
        ({"timestep": 0.001, "mjcf": "<mujoco>1</mujoco>"}, "timestep was 0.002 and is now 0.001"),
        ({"integrator": "RK4", "mjcf": "<mujoco>1</mujoco>"}, "integrator was 'Euler' and is now 'RK4'"),
        ({"mjcf": "<mujoco>1</mujoco>"}, "the model has changed"),
        (
            {"robot_file_sha256": "6" * 64, "mjcf": "<mujoco>1</mujoco>", "settings": {"home": [0.0, 0.0]}},
            "the robot file has changed (SHA-256 555555555555…, now 666666666666…)",
        ),
        (
            {"robot_file_sha256": ""},
            "the robot file has changed (SHA-256 555555555555…, now none)",
        ),
        ({"robot": "puma560", "robot_file_sha256": "6" * 64}, "robot was 'small' and is now 'puma560'"),
        (
            {"versions": {"dh2sim": "0.2.0", "mujoco": "3.18.0", "numpy": "2.4.0", "python": "3.11.0"}},
            "dh2sim was '0.1.0' and is now '0.2.0'; MuJoCo was '3.17.0' and is now '3.18.0'",
        ),
    ],
)
def test_a_run_of_other_settings_is_not_resumed_and_every_difference_named(
    tmp_path: Path, other: dict[str, Any], reported: str
) -> None:
    path = make(tmp_path / "run.zarr", layout())
    before = contents(path)
    assert refused(path, layout(**other)) == (
        f"'{path}' was made with other settings: {reported}. Use the same options, or choose another folder"
    )
    assert contents(path) == before


def test_a_run_of_another_number_of_rollouts_is_not_resumed(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", layout(rollouts=7))
    assert refused(path, layout(rollouts=8)) == (
        f"'{path}' was made with other settings: rollouts was 7 and is now 8. "
        "Use the same options, or choose another folder"
    )


def test_a_run_of_other_variables_is_not_resumed(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", layout())
    fewer = replace(layout(), variables=layout().variables[3:])
    assert refused(path, fewer) == (
        f"'{path}' was made with other settings: the variables were qpos, ctrl, tool_pose, contacts, status, "
        "stop_step, saturation and are now contacts, status, stop_step, saturation. "
        "Use the same options, or choose another folder"
    )


def test_another_python_carries_on(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", layout())
    versions = {**layout().attributes["versions"], "python": "3.13.0"}
    assert resume(path, layout(versions=versions)) == ()


@pytest.mark.parametrize("block", [1, 2, 5, 100])
def test_a_resumed_run_keeps_the_size_of_its_blocks(tmp_path: Path, block: int) -> None:
    path = tmp_path / "run.zarr"
    RunWriter.create(path, layout(block=3)).close()
    with RunWriter.resume(path, layout(block=block)) as writer:
        assert writer.layout.block == 3
        assert writer.pending() == (0, 1, 2)
        finish(writer)
    assert lasting(path) == lasting(make(tmp_path / "other.zarr", layout(block=3)))
