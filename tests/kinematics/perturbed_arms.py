"""Arms whose axes are meant to be parallel and are not quite, as calibration finds, and their textbook tables."""

from __future__ import annotations

import numpy as np

from dh2sim.kinematics.transforms import rpy_from_rotation
from dh2sim.robot.links import BaseSpec, Pose, ToolSpec
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.kinematics.frame_assignment.chains import Axis, pose, turn, unit

X, Y, Z = np.eye(3)
R, P = JointType.REVOLUTE, JointType.PRISMATIC
_ARMS = {
    "ur": (
        [
            ([0, 0, 0], Z, R),
            ([0, 0, 0.089159], -Y, R),
            ([-0.425, 0, 0.089159], -Y, R),
            ([-0.81725, 0, 0.089159], -Y, R),
            ([-0.81725, -0.10915, 0], -Z, R),
            ([-0.81725, 0, -0.005491], -Y, R),
        ],
        [-0.81725, -0.19145, -0.005491],
    ),
    "scara": (
        [([0, 0, 0], Z, R), ([0.3, 0, 0.4], Z, R), ([0.55, 0, 0.35], -Z, P), ([0.55, 0, 0.3], -Z, R)],
        [0.55, 0, 0.25],
    ),
    "planar": ([([0, 0, 0], Z, R), ([0.5, 0, 0], Z, R), ([0.9, 0, 0], Z, R)], [1.1, 0, 0]),
    "elbow": (
        [
            ([0, 0, 0], Z, R),
            ([0.1, 0, 0.45], -Y, R),
            ([0.1, 0, 1.05], -Y, R),
            ([0.3, 0, 1.17], X, R),
            ([0.72, 0, 1.17], -Y, R),
            ([0.9, 0, 1.17], X, R),
        ],
        [1.0, 0, 1.17],
    ),
}
KINDS = tuple(_ARMS)
REACHES = {"ur": 1.2, "scara": 1.0, "planar": 1.1, "elbow": 2.0}
"""Bounds of their reach from base_link, m, a little above the sum of their lengths."""


def perturbed(kind: str, size: float, seed: int) -> tuple[list[Axis], Array]:
    """Return an arm's axes in the base at zero, each turned by about ``size``, rad, and the pose of its tip."""
    rng = np.random.default_rng(seed)
    given, tip = _ARMS[kind]
    axes = []
    for point, direction, joint_type in given:
        R_small = turn(unit(rng.normal(size=3)), size)
        axes.append(Axis(point=np.array(point, dtype=float), direction=unit(R_small @ direction), type=joint_type))
    return axes, pose(turn(unit(np.array([1.0, 2.0, -0.5])), 0.7), np.array(tip, dtype=float))


def textbook_table(axes: list[Axis], T_base_tip: Array) -> RobotSpec:
    """Return the standard table by common normals, however far out they are; sliding axes as they are given."""
    T = _frame(
        axes[0].point, _across(X if abs(axes[0].direction @ X) < 0.9 else Y, axes[0].direction), axes[0].direction
    )
    base = T
    rows = []
    for i, axis in enumerate(axes, start=1):
        z, origin = T[:3, 2], T[:3, 3]
        if i < len(axes):
            following = axes[i]
            n = np.cross(z, following.direction)
            gap = following.point - origin
            square = float(n @ n)
            along = float(gap @ np.cross(following.direction, n)) / square if square > 1e-30 else 0.0
            foot = origin + along * z
            end = following.point + float((foot - following.point) @ following.direction) * following.direction
            apart = end - foot if np.linalg.norm(end - foot) > 1e-12 else T[:3, 0]
            x = _across(n if square > 1e-30 else apart, z)
            T_next = _frame(end, x, following.direction)
        else:
            foot, x = origin, T[:3, 0]
            T_next = T
        a = float((T_next[:3, 3] - foot) @ x)
        rows.append(
            Row(
                type=axis.type,
                a=a,
                alpha=float(np.arctan2(np.cross(z, T_next[:3, 2]) @ x, z @ T_next[:3, 2])),
                d=float((foot - origin) @ z),
                theta=float(np.arctan2(np.cross(T[:3, 0], x) @ z, T[:3, 0] @ x)),
            )
        )
        T = T_next
    tool = np.linalg.inv(T) @ T_base_tip
    return RobotSpec(
        name="arm",
        convention=Convention.STANDARD,
        rows=tuple(rows),
        base=BaseSpec(pose=_pose(base)),
        tool=ToolSpec.at(_pose(tool)),
    )


def _pose(T: Array) -> Pose:
    return Pose(xyz=read_only(T[:3, 3]), rpy=rpy_from_rotation(T[:3, :3]))


def _across(vector: Array, z: Array) -> Array:
    return unit(vector - (vector @ z) * z)


def _frame(origin: Array, x: Array, z: Array) -> Array:
    return pose(np.column_stack([x, np.cross(z, x), z]), origin)
