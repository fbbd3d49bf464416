from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.formats.urdf.write import to_urdf
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.spec import RobotSpec
from tests.formats.readers import in_check_urdf, in_mujoco, in_pinocchio, in_yourdfpy
from tests.sample_robots import COSTLY_NAMES, model
from tests.strategies import robot_specs


def assert_every_reader_accepts(built: RobotModel) -> None:
    text = to_urdf(built)
    moving = [joint.name for joint in built.moving_joints]
    assert f"robot name is: {built.name}" in in_check_urdf(text)
    assert in_yourdfpy(text).actuated_joint_names == moving
    assert list(in_pinocchio(text).names)[1:] == moving
    mj = in_mujoco(text)
    assert [mj.joint(i).name for i in range(mj.njnt)] == moving


@pytest.mark.parametrize("name", [*COSTLY_NAMES, "odd"])
def test_every_reader_accepts_the_urdf(name: str) -> None:
    assert_every_reader_accepts(model(name))


@pytest.mark.slow
@settings(max_examples=min(25, settings().max_examples))
@given(robot_specs(must_move=False))
def test_every_reader_accepts_the_urdf_of_any_robot(spec: RobotSpec) -> None:
    assert_every_reader_accepts(build_model(spec))


@pytest.mark.parametrize("name", [*COSTLY_NAMES, "odd"])
def test_every_reader_accepts_the_urdf_without_dh_frames(name: str) -> None:
    built = model(name)
    text = to_urdf(built, dh_frames=False)
    in_check_urdf(text)
    in_yourdfpy(text)
    frames = {frame.name for frame in in_pinocchio(text).frames}
    assert not any(frame.startswith("dh_") for frame in frames)
    assert {"base_link", "base", "flange", "tool0"} <= frames
    in_mujoco(text)


def test_mujoco_and_pinocchio_read_the_limits_and_dynamics() -> None:
    built = model("odd")
    mj, pin = in_mujoco(to_urdf(built)), in_pinocchio(to_urdf(built))
    for i, joint in enumerate(built.moving_joints):
        own = pin.joints[i + 1]
        assert mj.jnt_actfrcrange[i].tolist() == [-joint.effort, joint.effort]
        assert pin.effortLimit[own.idx_v] == joint.effort
        assert pin.velocityLimit[own.idx_v] == joint.velocity
        if joint.position_range is None:
            assert not mj.jnt_limited[i]
        else:
            assert mj.jnt_range[i].tolist() == list(joint.position_range)
            limits = (pin.lowerPositionLimit[own.idx_q], pin.upperPositionLimit[own.idx_q])
            assert limits == joint.position_range


def test_pinocchio_reads_the_mass_properties_that_the_model_has() -> None:
    built = model("odd")
    pin = in_pinocchio(to_urdf(built))
    total = sum(inertia.mass for inertia in pin.inertias)
    assert total == pytest.approx(built.mass, rel=1e-14)
    last = built.links[-1].inertial
    assert last is not None
    np.testing.assert_allclose(pin.inertias[5].lever, last.com, rtol=0, atol=1e-15)
    np.testing.assert_allclose(pin.inertias[5].inertia, last.inertia, rtol=0, atol=1e-15)
