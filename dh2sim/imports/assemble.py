"""A chain's table and what hangs on its links, put together as a robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dh2sim.formats.serial_robot import SerialLink, SerialMesh, SerialRobot
from dh2sim.kinematics.assignment.recover import Recovery
from dh2sim.kinematics.assignment.simple import simple_angles, simple_length, simple_turn, simple_vector
from dh2sim.kinematics.assignment.tolerances import Tolerances
from dh2sim.kinematics.tensors import rotate_tensor
from dh2sim.kinematics.transforms import invert, pose_from_rpy, rpy_from_rotation
from dh2sim.model.mass import is_possible
from dh2sim.robot.spec import ActuatorSpec, BaseSpec, Limits, LinkSpec, MeshSpec, Pose, RobotSpec, Row
from dh2sim.typing import Array, read_only

_DIGITS = range(6, 16)
"""That an inertia may be written with; those of most files have six at most."""
_ROUNDING = 1e-15
"""Of an inertia, relative to its trace: what turning it may change."""


def assemble(robot: SerialRobot, recovery: Recovery, *, name: str, joint_names: Sequence[str]) -> RobotSpec:
    """Return the robot with its table, limits, dynamics, actuators, masses and meshes.

    What stands in a link's own frame in the file stands in DH frame i here.

    Args:
        robot: As read from its file.
        recovery: Its table.
        name: Of the robot; one that a robot file allows.
        joint_names: Of the joints, base first; names that a robot file allows.
    """
    tolerances = recovery.tolerances
    actuators = robot.actuators or [ActuatorSpec()] * len(robot.links)
    rows = [
        replace(
            row,
            name=joint_name,
            limits=_limits(limits, row, tolerances),
            dynamics=dynamics,
            actuator=actuator,
            link=link,
        )
        for row, joint_name, limits, dynamics, actuator, link in zip(
            recovery.spec.rows,
            joint_names,
            robot.limits,
            robot.dynamics,
            actuators,
            _links(robot, recovery),
            strict=True,
        )
    ]
    base = recovery.spec.base.pose
    T_dh0_base = invert(pose_from_rpy(base.xyz, base.rpy))
    return replace(
        recovery.spec,
        name=name,
        rows=tuple(rows),
        base=BaseSpec(pose=base, mesh=_mesh(robot.base.mesh, T_dh0_base, tolerances), color=robot.base.color),
        gravity=robot.gravity,
        configurations=robot.configurations,
    )


def _links(robot: SerialRobot, recovery: Recovery) -> list[LinkSpec]:
    return [
        _link(link, invert(T_link_dh), recovery.tolerances)
        for link, T_link_dh in zip(robot.links, recovery.T_link_dh, strict=True)
    ]


def _limits(limits: Limits, row: Row, tolerances: Tolerances) -> Limits:
    """Return limits that are as simple as the table: a file's 2.9670597 rad may have been meant for 170 degrees."""
    simple = simple_turn if row.type.turns else simple_length
    if limits.velocity is not None:
        limits = replace(limits, velocity=simple(limits.velocity, tolerances) or limits.velocity)
    if limits.position is None:
        return limits
    lower, upper = (simple(value, tolerances) for value in limits.position)
    return replace(limits, position=(lower, upper)) if lower < upper else limits


def _link(link: SerialLink, T_dh_link: Array, tolerances: Tolerances) -> LinkSpec:
    com, inertia = None, None
    if link.com is not None:
        com = simple_vector(T_dh_link[:3, :3] @ link.com + T_dh_link[:3, 3], tolerances)
    if link.inertia is not None:
        inertia = _rounded(rotate_tensor(T_dh_link, link.inertia), tolerances)
    return LinkSpec(
        mass=link.mass, com=com, inertia=inertia, color=link.color, mesh=_mesh(link.mesh, T_dh_link, tolerances)
    )


def _rounded(tensor: Array, tolerances: Tolerances) -> Array:
    """Return an inertia with as few digits as the tolerance allows, relative to the largest moment."""
    for share in (max(tolerances.angle, _ROUNDING), _ROUNDING):
        allowed = share * float(np.trace(tensor))
        rounded = read_only([[_fewest_digits(value, allowed) for value in row] for row in tensor.tolist()])
        if is_possible(rounded):  # that of a flat body may not be once it is rounded
            return rounded
    return tensor


def _fewest_digits(value: float, allowed: float) -> float:
    candidates = (float(f"{value:.{digits}g}") for digits in _DIGITS)
    return next((number for number in (0.0, *candidates) if abs(number - value) <= allowed), value)


def _mesh(mesh: SerialMesh | None, T_dh_link: Array, tolerances: Tolerances) -> MeshSpec | None:
    if mesh is None or mesh.path is None:
        return None
    T = T_dh_link @ mesh.T_link_mesh
    pose = Pose(xyz=simple_vector(T[:3, 3], tolerances), rpy=simple_angles(rpy_from_rotation(T[:3, :3]), tolerances))
    return MeshSpec(file=mesh.path, scale=mesh.scale, pose=pose)
