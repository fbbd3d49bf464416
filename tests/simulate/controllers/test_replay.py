from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pytest

import dh2sim
from dh2sim.robot.row import ActuatorType
from dh2sim.simulate import rollout
from dh2sim.simulate.controllers.protocol import Controller, Follows, OpenLoop
from dh2sim.simulate.controllers.registry import choose
from dh2sim.typing import Array
from tests.simulate.controllers.files import JOINTS, MOTORS, run, table
from tests.simulate.controllers.samples import arm, make


def controls(controller: Controller, first: int, count: int) -> Array:
    assert isinstance(controller, OpenLoop)
    return controller.controls(first, count)


def test_columns_that_are_actuators_are_controls_held_until_the_next(tmp_path: Path) -> None:
    file = table(tmp_path / "torques.csv", ["time", *MOTORS], [[0, 1, 2, 3], [0.01, 4, 5, 6], [0.02, 7, 8, 9]])
    choice = choose(f"replay:file={file}")
    assert choice.actuation is ActuatorType.MOTOR
    assert not choice.follows
    assert choice.digest == hashlib.sha256(file.read_bytes()).hexdigest()
    controller, _ = make(choice.text, arm())
    found = controls(controller, 0, 30)
    assert found.shape == (7, 30, 3)
    for k, row in ((0, [1, 2, 3]), (4, [1, 2, 3]), (5, [4, 5, 6]), (9, [4, 5, 6]), (10, [7, 8, 9]), (29, [7, 8, 9])):
        assert found[:, k].tolist() == [row] * 7
    assert not isinstance(controller, Follows)


def test_without_times_a_row_is_for_a_time_step(tmp_path: Path) -> None:
    file = table(tmp_path / "torques.csv", MOTORS, [[i, 2 * i, -i] for i in range(10)])
    found = controls(make(f"replay:file={file}", arm())[0], 0, 15)
    assert found[3, :, 1].tolist() == [0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 18, 18, 18, 18, 18]


def test_columns_may_stand_in_any_order(tmp_path: Path) -> None:
    file = table(tmp_path / "torques.csv", [MOTORS[2], "time", MOTORS[0], MOTORS[1]], [[3, 0, 1, 2]])
    assert controls(make(f"replay:file={file}", arm())[0], 5, 1)[0, 0].tolist() == [1, 2, 3]


def test_columns_that_are_joints_are_followed_along_straight_lines(tmp_path: Path) -> None:
    file = table(tmp_path / "motion.csv", ["time", *JOINTS], [[0, 0, 0, 1], [0.01, 1, 0, 1], [0.03, 0, 0.2, 1]])
    choice = choose(f"replay:file={file}")
    assert choice.actuation is ActuatorType.POSITION
    assert choice.follows
    controller, _ = make(choice.text, arm())
    assert isinstance(controller, Follows)
    q, v = controller.reference(0, 21)
    np.testing.assert_allclose(q[2, :6, 0], [0, 0.2, 0.4, 0.6, 0.8, 1.0], atol=1e-12)
    np.testing.assert_allclose(q[2, 5:16, 1], np.linspace(0.0, 0.2, 11), atol=1e-12)
    assert q[2, 15:].tolist() == [[0.0, 0.2, 1.0]] * 6
    np.testing.assert_allclose(v[2, [0, 4, 5, 14], 0], [100, 100, -50, -50], rtol=1e-12)
    assert not v[2, 15:].any()
    assert np.array_equal(controls(controller, 0, 20), q[:, :20])


def test_actuators_of_several_kinds_are_the_robots_own(tmp_path: Path) -> None:
    names = ["joint_1_position", "joint_2_motor", "joint_3_velocity"]
    file = table(tmp_path / "mixed.csv", names, [[1, 2, 3]])
    choice = choose(f"replay:file={file}")
    assert choice.actuation is None
    mixed = arm((ActuatorType.POSITION, ActuatorType.MOTOR, ActuatorType.VELOCITY))
    assert controls(make(choice.text, mixed)[0], 0, 1)[0, 0].tolist() == [1, 2, 3]


def test_a_numpy_file_of_one_trajectory_is_for_every_rollout(tmp_path: Path) -> None:
    rows = np.random.default_rng(1).normal(size=(20, 3)).astype(np.float32)
    np.save(tmp_path / "a.npy", rows)
    choice = choose(f"replay:file={tmp_path / 'a.npy'},as=ctrl")
    assert choice.actuation is None
    found = controls(make(choice.text, arm())[0], 3, 4)
    assert np.array_equal(found, np.broadcast_to(rows[3:7].astype(float), (7, 4, 3)))


def test_a_numpy_file_of_many_trajectories_has_one_for_each_rollout(tmp_path: Path) -> None:
    rows = np.random.default_rng(1).normal(size=(9, 20, 3))
    np.save(tmp_path / "a.npy", rows)
    text = f"replay:file={tmp_path / 'a.npy'},as=reference"
    assert choose(text).actuation is ActuatorType.POSITION
    assert np.array_equal(controls(make(text, arm(), range(2, 6))[0], 3, 4), rows[2:6, 3:7])
    for name in (f"{text},rollout=8", f"{text},rollout=8"):
        assert np.array_equal(controls(make(name, arm(), range(2, 6))[0], 3, 4), np.tile(rows[8:9, 3:7], (4, 1, 1)))


def test_a_run_is_replayed_rollout_by_rollout(tmp_path: Path) -> None:
    ctrl = run(tmp_path / "run.zarr").ctrl.values
    choice = choose(f"replay:file={tmp_path / 'run.zarr'}")
    assert choice.actuation is ActuatorType.MOTOR
    assert np.array_equal(controls(make(choice.text, arm(), range(3, 7))[0], 0, 20), ctrl[3:7])
    all_alike = make(f"{choice.text},rollout=2", arm(), range(100, 102))[0]
    assert np.array_equal(controls(all_alike, 0, 20), ctrl[[2, 2]])


def test_controls_of_a_run_that_recorded_some_are_held(tmp_path: Path) -> None:
    ctrl = run(tmp_path / "run.zarr", every=3).ctrl.values
    found = controls(make(f"replay:file={tmp_path / 'run.zarr'}", arm())[0], 0, 60)
    assert np.array_equal(found, np.repeat(ctrl, 3, axis=1))


def test_positions_of_a_run_can_be_followed(tmp_path: Path) -> None:
    qpos = run(tmp_path / "run.zarr").qpos.values
    choice = choose(f"replay:file={tmp_path / 'run.zarr'},as=reference")
    assert choice.actuation is ActuatorType.POSITION
    assert choice.follows
    assert np.array_equal(controls(make(choice.text, arm())[0], 0, 21), qpos)


@pytest.mark.parametrize("change", ["ctrl", "none"])
def test_the_digest_of_a_run_is_that_of_what_is_replayed(tmp_path: Path, change: str) -> None:
    run(tmp_path / "run.zarr")
    before = choose(f"replay:file={tmp_path / 'run.zarr'}").digest
    file = next(
        file for file in (tmp_path / "run.zarr" / "ctrl").rglob("*") if file.name != "zarr.json" and file.is_file()
    )
    if change == "ctrl":
        file.write_bytes(file.read_bytes() + b"x")
    after = choose(f"replay:file={tmp_path / 'run.zarr'}").digest
    assert (after != before) == (change == "ctrl")


@pytest.mark.parametrize("controller", ["computed-torque", "random"])
def test_a_replayed_run_gives_the_same_bits(tmp_path: Path, controller: str) -> None:
    out, robot = tmp_path / "run.zarr", dh2sim.build_model(dh2sim.load_robot("planar_2r"))
    first = rollout(robot, rollouts=3, steps=40, seed=5, start="random", controller=controller, out=out)
    again = rollout(robot, rollouts=3, steps=40, seed=5, start="random", controller=f"replay:file={out}")
    assert np.array_equal(first.qpos.values, again.qpos.values)
    assert np.array_equal(first.ctrl.values, again.ctrl.values)
    assert np.abs(np.diff(first.qpos.values, axis=1)).max() > 0.0
