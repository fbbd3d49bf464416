"""Variants of a robot: other actuators, no meshes, a base with a mass."""

from __future__ import annotations

from dataclasses import replace

from dh2sim.model.actuators import actuator_model, seen_inertias
from dh2sim.model.mass import ASSUMED_DENSITY, of_shapes
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.spec import ActuatorSpec, ActuatorType


def with_actuators(model: RobotModel, kind: ActuatorType) -> RobotModel:
    """Drive every moving joint by an actuator of one kind.

    Args:
        model: The robot; where it has actuators of that kind already, their gains stay.
        kind: Position, velocity, motor, or none to drive no joint at all.

    Returns:
        The robot, with gains chosen like those that a robot file leaves open.
    """
    joints = []
    for joint in model.joints:
        if joint.actuator.type is kind:
            joints.append(joint)
        else:
            actuator = actuator_model(ActuatorSpec(type=kind), joint.duty.inertia + joint.dynamics.armature)
            joints.append(replace(joint, actuator=actuator))
    return replace(model, joints=tuple(joints))


def unloaded_gains(model: RobotModel) -> list[tuple[float, float]]:
    """Return kp and kv of the moving joints for controllers with motors: N·m/rad, N·m·s/rad, or N/m and N·s/m.

    Those of the position actuators that the robot file describes; what it leaves open is chosen for the arm without a
    payload, as damping that is held for a time step makes a light arm oscillate.
    """
    seen = seen_inertias(model.chain, model.bodies, model.home)
    gains = []
    for joint, row, inertia in zip(model.moving_joints, model.spec.moving_rows, seen, strict=True):
        given = row.actuator if row.actuator.type is ActuatorType.POSITION else ActuatorSpec()
        actuator = actuator_model(given, inertia + joint.dynamics.armature)
        gains.append((actuator.kp, actuator.kv))
    return gains


def without_meshes(model: RobotModel) -> RobotModel:
    """Show every link by its shapes, so that an MJCF needs no other file."""
    return replace(
        model,
        base=replace(model.base, mesh=None),
        links=tuple(replace(link, mesh=None) for link in model.links),
    )


def with_base_mass(model: RobotModel) -> RobotModel:
    """Give base_link the mass of its shapes at the assumed density, as a base that floats needs."""
    inertial = of_shapes(model.base.shapes, ASSUMED_DENSITY)
    base = replace(model.base, inertial=inertial, estimated=("mass", "com", "inertia"))
    return replace(model, base=base)
