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
    seen = iter(seen_inertias(model.chain, model.bodies, model.home))
    joints = []
    for joint in model.joints:
        inertia = next(seen) if joint.type.moves else 0.0
        if joint.actuator.type is kind:
            joints.append(joint)
        else:
            actuator = actuator_model(ActuatorSpec(type=kind), inertia + joint.dynamics.armature)
            joints.append(replace(joint, actuator=actuator))
    return replace(model, joints=tuple(joints))


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
