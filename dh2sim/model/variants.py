"""Variants of a robot: other actuators, no meshes, a base with a mass."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

from dh2sim.kinematics.loop_motion import actuated_joints
from dh2sim.model.actuators import actuator_model
from dh2sim.model.mass import ASSUMED_DENSITY, of_shapes
from dh2sim.model.mechanism import BranchModel, MechanismModel
from dh2sim.model.robot_model import JointModel, LinkModel, RobotModel
from dh2sim.robot.row import ActuatorSpec, ActuatorType

M = TypeVar("M", bound=RobotModel | MechanismModel)
P = TypeVar("P", bound=RobotModel | BranchModel)


def with_actuators(model: M, kind: ActuatorType) -> M:
    """Drive every moving joint by an actuator of one kind; of a mechanism, every joint that its file drives.

    Args:
        model: The robot; where it has actuators of that kind already, their gains stay.
        kind: Position, velocity, motor, or none to drive no joint at all.

    Returns:
        The robot, with gains chosen like those that a robot file leaves open.
    """
    moving = model.moving_joints
    driven = {moving[k].name for k in actuated_joints(model.spec)}

    def changed(joint: JointModel) -> JointModel:
        if joint.actuator.type is kind or (joint.type.moves and joint.name not in driven):
            return joint
        actuator = actuator_model(ActuatorSpec(type=kind), joint.duty.inertia + joint.dynamics.armature)
        return replace(joint, actuator=actuator)

    return _changed(model, joint=changed)


def _changed(
    model: M,
    *,
    joint: Callable[[JointModel], JointModel] | None = None,
    link: Callable[[LinkModel], LinkModel] | None = None,
) -> M:
    """Return a robot or a mechanism with every joint, or every link, changed."""
    if isinstance(model, MechanismModel):
        main = _changed(model.main, joint=joint, link=link)
        return replace(model, main=main, branches=tuple(_parts(branch, joint, link) for branch in model.branches))
    changed = _parts(model, joint, link)
    return changed if link is None else replace(changed, base=link(model.base))


def _parts(
    of: P, joint: Callable[[JointModel], JointModel] | None, link: Callable[[LinkModel], LinkModel] | None
) -> P:
    if joint is not None:
        of = replace(of, joints=tuple(map(joint, of.joints)))
    return of if link is None else replace(of, links=tuple(map(link, of.links)))


def unloaded_gains(model: RobotModel | MechanismModel, seen: Sequence[float]) -> list[tuple[float, float]]:
    """Return kp and kv of the moving joints for controllers with motors: N·m/rad, N·m·s/rad, or N/m and N·s/m.

    Those of the position actuators that the robot file describes; what it leaves open is chosen for the arm without a
    payload, as damping that is held for a time step makes a light arm oscillate.

    Args:
        model: The robot.
        seen: Inertia or mass that each moving joint moves at home, without the rotor's, kg·m² or kg.
    """
    gains = []
    for joint, row, inertia in zip(model.moving_joints, model.spec.moving_rows, seen, strict=True):
        given = row.actuator if row.actuator.type is ActuatorType.POSITION else ActuatorSpec()
        actuator = actuator_model(given, inertia + joint.dynamics.armature)
        gains.append((actuator.kp, actuator.kv))
    return gains


def without_meshes(model: M) -> M:
    """Show every link by its shapes, so that an MJCF needs no other file."""
    return _changed(model, link=lambda link: replace(link, mesh=None))


def with_base_mass(model: RobotModel) -> RobotModel:
    """Give base_link the mass of its shapes at the assumed density, as a base that floats needs."""
    inertial = of_shapes(model.base.shapes, ASSUMED_DENSITY)
    base = replace(model.base, inertial=inertial, estimated=("mass", "com", "inertia"))
    return replace(model, base=base)
