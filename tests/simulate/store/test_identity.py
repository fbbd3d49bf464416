from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from dh2sim.errors import RunDiffersError
from dh2sim.simulate.dataset_layout import Layout
from dh2sim.simulate.store.writer import RunWriter
from tests.program import contents
from tests.simulate.store.runs import finish, lasting, layout, make, resume


def _refusal(path: Path, of: Layout) -> str:
    with pytest.raises(RunDiffersError) as caught:
        RunWriter.resume(path, of)
    return str(caught.value)


@pytest.mark.parametrize(
    ("other", "told"),
    [
        ({"settings": {"seed": 1}}, "seed is 0 there and 1 here"),
        (
            {"settings": {"seed": 1, "controller": "pd:kp=10", "controller_digest": "a" * 64}},
            "seed is 0 there and 1 here; controller is 'hold' there and 'pd:kp=10' here",
        ),
        (
            {"settings": {"controller_digest": "a" * 64}},
            "what the controller reads, or its code, is another than it was",
        ),
        ({"settings": {"start": "q.csv", "start_digest": "a" * 64}}, "start is 'home' there and 'q.csv' here"),
        ({"settings": {"start_digest": "a" * 64}}, "the states to start from are others than they were"),
        (
            {"settings": {"randomize": {"mass": 0.1, "gain": 0.2}}},
            "randomize is nothing there and mass=0.1,gain=0.2 here",
        ),
        ({"settings": {"record": ["qpos", "qvel"]}}, "record is qpos,ctrl there and qpos,qvel here"),
        ({"settings": {"velocity_limits": [1.0, 3.0]}}, "velocity limit is 1.0,2.0 there and 1.0,3.0 here"),
        ({"timestep": 0.001, "mjcf": "<mujoco>1</mujoco>"}, "timestep is 0.002 there and 0.001 here"),
        ({"integrator": "RK4", "mjcf": "<mujoco>1</mujoco>"}, "integrator is 'Euler' there and 'RK4' here"),
        ({"mjcf": "<mujoco>1</mujoco>"}, "the model is another one"),
        (
            {"robot_file_sha256": "6" * 64, "mjcf": "<mujoco>1</mujoco>", "settings": {"home": [0.0, 0.0]}},
            "the robot file is another one (SHA-256 555555555555… there and 666666666666… here)",
        ),
        (
            {"robot_file_sha256": ""},
            "the robot file is another one (SHA-256 555555555555… there and of none here)",
        ),
        ({"robot": "puma560", "robot_file_sha256": "6" * 64}, "robot is 'small' there and 'puma560' here"),
        (
            {"versions": {"dh2sim": "0.2.0", "mujoco": "3.18.0", "numpy": "2.4.0", "python": "3.11.0"}},
            "dh2sim is 0.1.0 there and 0.2.0 here; MuJoCo is 3.17.0 there and 3.18.0 here",
        ),
    ],
)
def test_a_run_of_other_settings_is_not_resumed_and_every_difference_named(
    tmp_path: Path, other: dict[str, Any], told: str
) -> None:
    path = make(tmp_path / "run.zarr", layout())
    before = contents(path)
    assert _refusal(path, layout(**other)) == (
        f"'{path}' was made with other settings: {told}. Give the same options, or write to another --out"
    )
    assert contents(path) == before


def test_a_run_of_another_number_of_rollouts_is_not_resumed(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", layout(rollouts=7))
    assert _refusal(path, layout(rollouts=8)) == (
        f"'{path}' was made with other settings: rollouts is 7 there and 8 here. "
        "Give the same options, or write to another --out"
    )


def test_a_run_of_other_variables_is_not_resumed(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", layout())
    fewer = replace(layout(), variables=layout().variables[3:])
    assert _refusal(path, fewer) == (
        f"'{path}' was made with other settings: it holds qpos, ctrl, tool_pose, contacts, status, stop_step, "
        "saturation there and would hold contacts, status, stop_step, saturation here. "
        "Give the same options, or write to another --out"
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
