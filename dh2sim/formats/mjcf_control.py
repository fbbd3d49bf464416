"""What drives a robot in an MJCF, what measures it, and where it starts: actuators, sensors, keyframes."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from dh2sim.formats.xml import child, number, numbers
from dh2sim.model.robot_model import JointModel, RobotModel
from dh2sim.robot.spec import ActuatorType


def add_actuators(mujoco: ET.Element, model: RobotModel) -> None:
    """Add an actuator for every joint that is driven, in the order of the joints."""
    driven = [joint for joint in model.moving_joints if joint.actuator.type is not ActuatorType.NONE]
    if not driven:
        return
    actuators = child(mujoco, "actuator")
    for joint in driven:
        name = f"{joint.name}_{joint.actuator.type.value}"
        match joint.actuator.type:
            case ActuatorType.POSITION:
                gains = {"kp": number(joint.actuator.kp), "kv": number(joint.actuator.kv)}
            case ActuatorType.VELOCITY:
                gains = {"kv": number(joint.actuator.kv)}
            case _:
                gains = {}
        element = child(actuators, joint.actuator.type.value, name=name, joint=joint.name, **gains)
        control = control_range(joint)
        if control is not None:
            element.set("ctrlrange", numbers(control))
        if "effort" not in joint.assumed:
            element.set("forcerange", numbers([-joint.effort, joint.effort]))


def control_range(joint: JointModel) -> tuple[float, float] | None:
    """Range of a joint's control, from its limits: rad or m, their rate, N·m or N; None where it is unlimited."""
    match joint.actuator.type:
        case ActuatorType.POSITION:
            return None if joint.range is None else (joint.range.lower, joint.range.upper)
        case ActuatorType.VELOCITY:
            return -joint.velocity, joint.velocity
        case ActuatorType.MOTOR:
            return -joint.effort, joint.effort
        case ActuatorType.NONE:
            return None


def add_sensors(mujoco: ET.Element, model: RobotModel) -> None:
    """Add sensors of every joint's position, velocity and actuator force, and of tool0's pose."""
    sensors = child(mujoco, "sensor")
    for suffix, tag in (("position", "jointpos"), ("velocity", "jointvel"), ("torque", "jointactuatorfrc")):
        for joint in model.moving_joints:
            child(sensors, tag, name=f"{joint.name}_{suffix}", joint=joint.name)
    child(sensors, "framepos", name="tool0_pos", objtype="site", objname="tool0")
    child(sensors, "framequat", name="tool0_quat", objtype="site", objname="tool0")


def add_keyframes(mujoco: ET.Element, model: RobotModel, *, floating_base: bool = False) -> None:
    """Add a keyframe for every named configuration, with the controls that hold the robot still in it.

    A base that floats starts at the origin.
    """
    if not model.spec.configurations or not model.moving_joints:
        return
    keyframe = child(mujoco, "keyframe")
    for name, q in model.spec.configurations.items():
        controls = holding_controls(model, name)
        key = child(keyframe, "key", name=name, qpos=numbers([0, 0, 0, 1, 0, 0, 0, *q] if floating_base else q))
        if controls:
            key.set("ctrl", numbers(controls))


def holding_controls(model: RobotModel, configuration: str) -> list[float]:
    """Controls, one an actuator, with which the robot stands still in a named configuration.

    A position actuator is asked for a little more than the joint's position, so that its pull balances gravity.
    Clipped to the control's range.
    """
    controls = []
    q, loads = model.spec.configurations[configuration], model.holding[configuration]
    for joint, position, load in zip(model.moving_joints, q, loads, strict=True):
        match joint.actuator.type:
            case ActuatorType.POSITION:
                control = float(position) + (load / joint.actuator.kp if joint.actuator.kp else 0.0)
            case ActuatorType.VELOCITY:
                control = 0.0
            case ActuatorType.MOTOR:
                control = load
            case ActuatorType.NONE:
                continue
        allowed = control_range(joint)
        controls.append(control if allowed is None else min(max(control, allowed[0]), allowed[1]))
    return controls
