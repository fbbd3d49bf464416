"""What a format cannot carry of what a robot file says: told at every export, so that nothing is lost in silence."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from dh2sim.export.render import Format
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.spec import ActuatorSpec, ActuatorType

STANDARD_GRAVITY = (0.0, 0.0, -9.81)


def losses(model: RobotModel, formats: Collection[Format]) -> list[str]:
    """List what the robot file says and the formats leave out, a line each, beginning with the format's name."""
    lines = []
    if Format.URDF in formats:
        lines += [f"URDF: {loss}" for loss in _urdf(model)]
    if Format.MJCF in formats:
        lines += [f"MJCF: {loss}" for loss in _mjcf(model)]
    for link in model.all_links:
        if link.mesh is not None and link.mesh.converted_from is not None:
            lines.append(
                f"mesh of {link.name}: converted from {link.mesh.converted_from} to binary STL, "
                "which has no colours or textures"
            )
    return lines


def _urdf(model: RobotModel) -> Iterable[str]:
    if any(_said(row.actuator) for row in model.spec.moving_rows):
        yield "actuators and their gains"
    armature = [row.name for row in model.spec.rows if row.dynamics.armature]
    if armature:
        yield f"armature of {', '.join(armature)}"
    if model.spec.configurations:
        yield f"configurations ({', '.join(model.spec.configurations)})"
    if tuple(float(g) for g in model.spec.gravity) != STANDARD_GRAVITY:
        yield "gravity"
    if model.excluded:
        count = len(model.excluded)
        pairs = "1 pair" if count == 1 else f"{count} pairs"
        yield f"{pairs} of links that do not collide ('dh2sim info' lists them, as in an SRDF)"


def _mjcf(model: RobotModel) -> Iterable[str]:
    velocity = [
        row.name
        for row in model.spec.rows
        if row.limits.velocity is not None and row.actuator.type is not ActuatorType.VELOCITY
    ]
    if velocity:
        yield f"velocity limits of {', '.join(velocity)}"


def _said(actuator: ActuatorSpec) -> bool:
    """Whether the robot file drives the joint in a way of its own; 'none' is what a URDF has anyway."""
    of_its_own = actuator.type in (ActuatorType.VELOCITY, ActuatorType.MOTOR)
    return of_its_own or actuator.kp is not None or actuator.kv is not None
