from __future__ import annotations

import dataclasses
from collections.abc import Callable
from types import MappingProxyType

import mujoco
import numpy as np
import pytest

from dh2sim.formats.mjcf.scene import to_scene
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.row import ActuatorSpec, ActuatorType, Limits, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import read_only
from tests.formats.readers import in_mujoco
from tests.sample_robots import CONTINUOUS, COSTLY_NAMES, MODIFIED, ODD, PRISMATIC, REVOLUTE, STANDARD, model

LIMITS = Limits(position=(-1.5, 2.0), velocity=3.0, effort=40.0)
HOME, BENT = [0.1, 0.2, 0.3, -0.4, 0.5], [-1.0, 0.4, 1.9, 2.5, -0.6]


def actuated() -> RobotModel:
    """A joint for each type of actuator, and one continuous and one without limits."""
    position = ActuatorSpec(kp=1200.0, kv=34.5)
    velocity = ActuatorSpec(type=ActuatorType.VELOCITY, kv=6.5)
    kinds = [
        (REVOLUTE, LIMITS, position),
        (PRISMATIC, LIMITS, velocity),
        (REVOLUTE, LIMITS, ActuatorSpec(type=ActuatorType.MOTOR)),
        (CONTINUOUS, Limits(), ActuatorSpec(kp=55.0, kv=5.5)),
        (REVOLUTE, Limits(), ActuatorSpec(type=ActuatorType.NONE)),
    ]
    rows = [
        Row(
            name=f"j{i}",
            type=kind,
            convention=MODIFIED if i % 2 else STANDARD,
            a=0.2,
            alpha=ODD * (i + 1),
            d=0.1,
            limits=limits,
            actuator=actuator,
        )
        for i, (kind, limits, actuator) in enumerate(kinds)
    ]
    configurations = MappingProxyType({"home": read_only(HOME), "bent": read_only(BENT)})
    return build_model(RobotSpec(name="driven", rows=tuple(rows), configurations=configurations))


def test_every_type_of_actuator_has_its_gains_and_its_ranges() -> None:
    built = actuated()
    mj = in_mujoco(to_mjcf(built))
    assert [mj.actuator(i).name for i in range(mj.nu)] == ["j0_position", "j1_velocity", "j2_motor", "j3_position"]
    assert [mj.joint(mj.actuator_trnid[i, 0]).name for i in range(mj.nu)] == ["j0", "j1", "j2", "j3"]
    assert mj.actuator_gainprm[:, 0].tolist() == [1200.0, 6.5, 1.0, 55.0]
    assert mj.actuator_biasprm[:, :3].tolist() == [[0, -1200.0, -34.5], [0, 0, -6.5], [0, 0, 0], [0, -55.0, -5.5]]
    assert mj.actuator_ctrllimited.tolist() == [1, 1, 1, 0]
    assert mj.actuator_ctrlrange[:3].tolist() == [[-1.5, 2.0], [-3.0, 3.0], [-40.0, 40.0]]
    assert mj.actuator_forcelimited.tolist() == [1, 1, 1, 0]
    assert mj.actuator_forcerange[:3].tolist() == [[-40.0, 40.0]] * 3
    assert mj.actuator_gear[:, 0].tolist() == [1.0] * 4


def test_an_assumed_effort_limit_bounds_a_motors_control_and_no_force() -> None:
    row = Row(name="only", type=REVOLUTE, convention=STANDARD, a=0.5, actuator=ActuatorSpec(type=ActuatorType.MOTOR))
    built = build_model(RobotSpec(name="one", rows=(row,)))
    mj = in_mujoco(to_mjcf(built))
    assert mj.actuator_ctrlrange.tolist() == [[-built.joints[0].effort, built.joints[0].effort]]
    assert not mj.actuator_forcelimited[0]
    assert not mj.jnt_actfrclimited[0]


def test_a_robot_without_actuators_has_none() -> None:
    none = ActuatorSpec(type=ActuatorType.NONE)
    built = model("odd")
    rows = tuple(dataclasses.replace(row, actuator=none) for row in built.spec.rows)
    mj = in_mujoco(to_mjcf(build_model(dataclasses.replace(built.spec, rows=rows))))
    assert (mj.nu, mj.nkey) == (0, 1)


def test_sensors_tell_position_velocity_and_torque_of_every_joint_and_the_tools_pose() -> None:
    built = actuated()
    mj = in_mujoco(to_mjcf(built))
    names = [joint.name for joint in built.moving_joints]
    expected = [f"{name}_{what}" for what in ("position", "velocity", "torque") for name in names]
    assert [mj.sensor(i).name for i in range(mj.nsensor)] == [*expected, "tool0_pos", "tool0_quat"]
    data = mujoco.MjData(mj)
    data.qpos[:] = BENT
    data.qvel[:] = [1, 2, 3, 4, 5]
    data.ctrl[:] = [0.5, 0.25, 7.0, -0.5]
    mujoco.mj_forward(mj, data)
    np.testing.assert_array_equal([data.sensor(f"{name}_position").data[0] for name in names], BENT)
    np.testing.assert_array_equal([data.sensor(f"{name}_velocity").data[0] for name in names], [1, 2, 3, 4, 5])
    torques = [data.sensor(f"{name}_torque").data[0] for name in names]
    np.testing.assert_array_equal(torques, data.qfrc_actuator)
    assert (torques[2], torques[4]) == (7.0, 0.0)
    T = table_tool_pose(built.spec, BENT)
    np.testing.assert_allclose(data.sensor("tool0_pos").data, T[:3, 3], rtol=0, atol=1e-14)
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, data.sensor("tool0_quat").data)
    np.testing.assert_allclose(rotation.reshape(3, 3), T[:3, :3], rtol=0, atol=1e-14)


def test_named_configurations_are_keyframes_with_controls_that_hold_still() -> None:
    built = actuated()
    mj = in_mujoco(to_mjcf(built))
    assert [mj.key(i).name for i in range(mj.nkey)] == ["home", "bent"]
    for name, q in (("home", HOME), ("bent", BENT)):
        key = mj.key(name)
        np.testing.assert_array_equal(key.qpos, q)
        assert key.ctrl.tolist() == built.holding_controls(read_only(q))
        load = built.gravity_loads(read_only(q))
        assert key.ctrl[0] == np.clip(q[0] + load[0] / 1200.0, -1.5, 2.0)
        assert key.ctrl[1] == 0.0
        assert key.ctrl[2] == np.clip(load[2], -40.0, 40.0)
        assert key.ctrl[3] == q[3] + load[3] / 55.0


def test_a_position_actuator_without_gain_is_asked_for_the_position_itself() -> None:
    row = Row(name="only", type=REVOLUTE, convention=STANDARD, a=0.5)
    configurations = MappingProxyType({"home": read_only([0.3])})
    built = build_model(RobotSpec(name="limp", rows=(row,), configurations=configurations))
    limp = dataclasses.replace(
        built.joints[0], actuator=dataclasses.replace(built.joints[0].actuator, kp=0.0, kv=0.0)
    )
    built = dataclasses.replace(built, joints=(limp,))
    assert built.holding_controls(built.home) == [0.3]


@pytest.mark.parametrize("in_scene", [False, True], ids=["alone", "in its scene"])
@pytest.mark.parametrize("name", COSTLY_NAMES)
def test_a_robot_stands_still_at_home_for_ten_seconds(
    name: str, in_scene: bool, record_property: Callable[[str, object], None]
) -> None:
    built = model(name)
    files = {f"{name}.xml": to_mjcf(built).encode(), "scene.xml": to_scene(built).encode()}
    mj = mujoco.MjModel.from_xml_string(files["scene.xml" if in_scene else f"{name}.xml"].decode(), files)
    data = mujoco.MjData(mj)
    mujoco.mj_resetDataKeyframe(mj, data, mj.key("home").id)
    drift = 0.0
    for _ in range(round(10.0 / mj.opt.timestep)):
        mujoco.mj_step(mj, data)
        drift = max(drift, float(np.abs(data.qpos - built.home).max()))
    speed = float(np.abs(data.qvel).max())
    record_property("drift", drift)
    record_property("speed", speed)
    assert drift < 1e-12
    assert speed < 1e-12
    assert data.ncon == 0
