"""A run is shown as it was recorded."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from dh2sim.errors import PictureError, RunError
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.read import load_robot
from dh2sim.simulate import rollout
from dh2sim.simulate.block import simulate_block
from dh2sim.simulate.options import RolloutOptions
from dh2sim.simulate.prepare import prepare
from dh2sim.simulate.store.writer import RunWriter
from dh2sim.view.motion.replay import open_replay
from tests.simulate import robots

STEP, EVERY = 0.002, 5


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return build_model(load_robot("stanford"))


@pytest.fixture(scope="module")
def path(model: RobotModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("runs") / "run.zarr"
    rollout(model, out=out, rollouts=3, steps=100, every=EVERY, record=("qpos", "tool_pose"), timestep=STEP)
    return out


def test_positions_are_those_recorded_nearest_to_the_time(path: Path, model: RobotModel) -> None:
    replay = open_replay(path, model)
    run = xr.open_dataset(path, engine="zarr", consolidated=False)
    assert replay.rollouts == (0, 1, 2)
    assert replay.note == ""
    assert replay.duration(2) == pytest.approx(0.2)
    assert replay.times(2) == pytest.approx(np.arange(21) * STEP * EVERY)
    recorded = run.qpos.values[2]
    for t, number in ((-1.0, 0), (0.0, 0), (0.0049, 0), (0.0051, 1), (0.0149, 1), (0.2, 20), (9.0, 20)):
        assert np.array_equal(replay.q_at(2, t), recorded[number]), t
    assert replay.stopped(2) == ""


def test_the_tool_is_where_it_was_recorded_and_where_the_table_says(path: Path, model: RobotModel) -> None:
    replay = open_replay(path, model)
    run = xr.open_dataset(path, engine="zarr", consolidated=False)
    tools = [table_tool_pose(model.spec, replay.q_at(1, t))[:3, 3] for t in replay.times(1)]
    assert len(tools) == 21
    assert np.allclose(tools, run.tool_pose.values[1, :, :3], rtol=0, atol=1e-9)
    assert np.ptp(tools, axis=0).max() > 1e-3
    assert replay.base_at(1, 0.1) is None


def test_without_a_robot_the_run_tells_its_own_joints(path: Path, model: RobotModel) -> None:
    replay = open_replay(path, None)
    assert replay.joints == tuple(joint.name for joint in model.moving_joints)
    assert np.array_equal(replay.q_at(0, 0.1), open_replay(path, model).q_at(0, 0.1))
    assert replay.note == ""


def test_joints_are_found_by_their_names(path: Path, model: RobotModel) -> None:
    moving = list(model.joints)
    turned = replace(model, joints=tuple(reversed(moving)))
    replay = open_replay(path, turned)
    assert np.array_equal(replay.q_at(0, 0.1), open_replay(path, model).q_at(0, 0.1)[::-1])


def test_a_robot_with_other_joints_is_refused(path: Path) -> None:
    other = build_model(load_robot("scara"))
    theirs = ", ".join(joint.name for joint in build_model(load_robot("stanford")).moving_joints)
    ours = ", ".join(joint.name for joint in other.moving_joints)
    message = f"'{path}' is a run of stanford with the joints {theirs}; scara has {ours}"
    with pytest.raises(RunError, match=f"^{re.escape(message)}$"):
        open_replay(path, other)


def test_a_robot_that_was_changed_since_is_shown_with_a_note(path: Path, model: RobotModel) -> None:
    changed = replace(model, spec=replace(model.spec, source_file=None))
    note = "The run was made with another version of stanford's file: the motion shown may differ from it."
    assert open_replay(path, changed).note == note


def test_a_base_that_floats_takes_the_tool_with_it(tmp_path: Path) -> None:
    model, out = build_model(load_robot("scara")), tmp_path / "run.zarr"
    record = ("qpos", "tool_pose")
    rollout(model, out=out, rollouts=1, steps=200, record=record, floating_base=True, controller="passive")
    replay = open_replay(out, model)
    run = xr.open_dataset(out, engine="zarr", consolidated=False)
    assert replay.q_at(0, 9.0).shape == (4,)
    base = replay.base_at(0, 9.0)
    assert base is not None
    assert base[:3, 3] == pytest.approx(run.base_pose.values[0, -1, :3])
    assert base[2, 3] < -0.5, "it falls"
    for k, t in enumerate(replay.times(0)):
        base = replay.base_at(0, t)
        assert base is not None
        tool = base @ table_tool_pose(model.spec, replay.q_at(0, t))
        assert tool[:3, 3] == pytest.approx(run.tool_pose.values[0, k, :3], abs=1e-9)


def test_a_rollout_that_stopped_early_ends_where_it_stopped(tmp_path: Path) -> None:
    out = tmp_path / "run.zarr"
    controller = "tests.simulate.drivers:BadOpen:value=nan"
    rollout(robots.arm(), out=out, rollouts=4, steps=40, timestep=0.004, record=("qpos",), controller=controller)
    replay = open_replay(out, robots.arm())
    assert replay.duration(0) == pytest.approx(0.16)
    assert replay.duration(3) == pytest.approx(0.04)
    assert len(replay.times(3)) == 11
    assert replay.stopped(3) == "Rollout 3 stopped in time step 10: bad ctrl."


def test_without_positions_there_is_nothing_to_show(tmp_path: Path, model: RobotModel) -> None:
    out = tmp_path / "run.zarr"
    rollout(model, out=out, rollouts=1, steps=4, record=("ctrl",))
    message = "run.zarr: a replay needs qpos, which the run does not contain; record again with qpos (recorded: ctrl)"
    with pytest.raises(PictureError, match=f"^{re.escape(message)}$"):
        open_replay(out, model).times(0)


def test_a_rollout_that_is_not_there_is_named(path: Path, model: RobotModel) -> None:
    with pytest.raises(PictureError, match=r"^run\.zarr has no rollout 3; it contains rollouts 0 to 2$"):
        open_replay(path, model).q_at(3, 0.0)


def test_rollouts_that_have_not_been_run_are_left_out(tmp_path: Path, model: RobotModel) -> None:
    out = tmp_path / "run.zarr"
    job = prepare(model, RolloutOptions(rollouts=3, steps=4, record=("qpos",)))
    with RunWriter.create(out, replace(job.layout, block=1)) as writer:
        with pytest.raises(RunError, match=f"^'{re.escape(str(out))}': no rollout has been run yet$"):
            open_replay(out, model)
        writer.write(1, simulate_block(job, range(1, 2)), 0.1)
        replay = open_replay(out, model)
        assert replay.rollouts == (1,)
        assert replay.duration(1) == pytest.approx(4 * STEP)
        with pytest.raises(PictureError, match=r"^run\.zarr: rollout 0 has not been run yet; resume the run"):
            replay.times(0)


def test_something_that_is_not_a_run_is_refused(tmp_path: Path, model: RobotModel) -> None:
    with pytest.raises(RunError, match=f"^'{re.escape(str(tmp_path))}' is not a run of dh2sim$"):
        open_replay(tmp_path, model)
