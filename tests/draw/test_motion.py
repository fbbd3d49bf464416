from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from dh2sim.draw.motion import MOST_POSES, Motion, motion_of_robot, motion_of_run
from dh2sim.errors import ConfigurationError, PictureError
from dh2sim.model.build import build_model
from dh2sim.model.mechanism import build_mechanism
from dh2sim.robot.read import load_robot
from dh2sim.typing import read_only
from tests.draw.datasets import STEPS, arm, rollout, stopped, swinging
from tests.model.test_meshes import built, text, wedge, write


def clock(*time: float) -> Motion:
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    return Motion(model=model, qpos=read_only(np.zeros((len(time), 0))), time=read_only(time))


def test_the_motion_of_a_run_puts_the_tool_where_the_run_says_that_it_was() -> None:
    run = swinging("stanford")
    motion = motion_of_run(rollout(run, 1))
    data = mujoco.MjData(motion.model)
    for number in (0, 7, STEPS // 2):
        motion.place(data, number)
        recorded = run["tool_pose"].values[1, number, :3]
        assert data.site("tool0").xpos == pytest.approx(recorded, abs=1e-12)


def test_a_rollout_that_stopped_early_ends_there() -> None:
    data = rollout(stopped(swinging(), 1, 4), 1)
    assert (data.reason, data.stop_step) == ("bad_qacc", 9)
    motion = motion_of_run(data)
    assert len(motion.qpos) == len(motion.time) == 5
    assert data.values("ctrl").shape[0] == data.values("interval_time").shape[0] == 4
    assert np.isfinite(motion.qpos).all()
    assert len(motion_of_run(rollout(stopped(swinging(), 1, 4), 0)).time) == STEPS // 2 + 1, "the other goes on"


def test_a_rollout_that_was_not_run_is_refused() -> None:
    run = swinging().copy(deep=True)
    run["status"][1] = -1
    with pytest.raises(PictureError) as caught:
        rollout(run, 1)
    assert str(caught.value) == (
        "run.zarr: rollout 1 has not been run yet; resume the run, or choose another rollout"
    )


@pytest.mark.parametrize("number", [-1, 2])
def test_a_rollout_out_of_range_is_refused(number: int) -> None:
    with pytest.raises(PictureError) as caught:
        rollout(swinging(), number)
    assert str(caught.value) == f"run.zarr has no rollout {number}; it contains rollouts 0 to 1"
    with pytest.raises(PictureError) as caught:
        rollout(swinging().isel(rollout=[0]), number)
    assert str(caught.value) == f"run.zarr has no rollout {number}; it contains rollout 0 only"


def test_a_run_without_positions_says_how_to_record_them() -> None:
    with pytest.raises(PictureError) as caught:
        motion_of_run(rollout(swinging(without=("qpos", "qpos_ref", "energy"))))
    assert str(caught.value) == (
        "run.zarr: a video needs qpos, which the run does not contain; record again with qpos (recorded: qvel, "
        "tool_pose, ctrl, torque)"
    )


def test_attributes_without_a_model_are_refused() -> None:
    run = swinging().copy()
    del run.attrs["scene"]
    with pytest.raises(PictureError) as caught:
        motion_of_run(rollout(run))
    assert str(caught.value) == "run.zarr: the attribute 'scene' is missing, so there is no model to show"
    run.attrs["scene"] = "<mujoco"
    with pytest.raises(
        PictureError,
        match=r"^run\.zarr: the model in the run's attributes is not one that dh2sim wrote: scene is not XML",
    ):
        motion_of_run(rollout(run))
    run.attrs.update(scene=arm("planar_2r").scene, mjcf=arm("planar_2r").mjcf, robot="planar_2r")
    with pytest.raises(PictureError) as caught:
        motion_of_run(rollout(run))
    assert str(caught.value) == ("run.zarr: 3 positions were recorded, but the model in the run's attributes has 2")


def test_a_robot_is_at_home_or_in_the_configuration_that_is_named() -> None:
    robot = build_model(load_robot("stanford"))
    assert motion_of_robot(robot).qpos.tolist() == [robot.home.tolist()]
    assert motion_of_robot(robot, "printed").qpos.tolist() == [list(robot.spec.configurations["printed"])]
    with pytest.raises(ConfigurationError) as caught:
        motion_of_robot(robot, "prnted")
    assert str(caught.value) == (
        "stanford has no configuration 'prnted'. Did you mean 'printed'? Configurations: home, zero, printed"
    )


def test_a_robot_is_shown_with_its_meshes(tmp_path: Path) -> None:
    robot = built(tmp_path, text(write(tmp_path, "stl", wedge())))
    assert motion_of_robot(robot).model.nmesh == 1


def test_the_position_nearest_in_time_is_taken() -> None:
    motion = clock(0.0, 0.1, 0.2, 0.3)
    assert [motion.nearest(time) for time in (-1.0, 0.0, 0.049, 0.051, 0.26, 0.3, 9.0)] == [0, 0, 0, 1, 3, 3, 3]
    assert [motion.number_at(time) for time in (None, 0.0, 0.14, 0.3)] == [3, 0, 1, 3]
    with pytest.raises(PictureError) as caught:
        motion.number_at(0.4)
    assert str(caught.value) == "the motion lasts from 0 to 0.3 s, got 0.4 s"


def test_poses_of_a_long_motion_are_sampled_from_its_first_to_its_last() -> None:
    assert clock(0.0).sampled() == [0]
    assert clock(0.0, 0.1, 0.2).sampled() == [0, 1, 2]
    sampled = clock(*np.arange(5000.0)).sampled()
    assert (len(sampled), sampled[0], sampled[-1]) == (MOST_POSES, 0, 4999)


def test_a_mechanism_is_shown_with_its_loops_closed() -> None:
    mechanism = build_mechanism(load_robot("five_bar"))
    shown = motion_of_robot(mechanism)
    data = mujoco.MjData(shown.model)
    shown.place(data, 0)
    ends = [data.site(name).xpos for name in ("dh_2", "right/dh_2")]
    assert math.dist(*ends) < 1e-12
    with pytest.raises(ConfigurationError, match=r"five_bar has no configuration 'hme'. Did you mean 'home'?"):
        motion_of_robot(mechanism, "hme")
