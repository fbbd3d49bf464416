"""The joint axes of a robot at coordinate zero, as directed lines: all that its kinematics are made of.

A mechanism is given by the screws of its joints at one configuration, up to one rigid motion; a table, a URDF and an
MJCF are ways of writing them down. Axes of prismatic joints have a direction, and no place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ScrewAxes:
    """The axes of the joints that move, base first, in base_link at coordinate zero."""

    names: tuple[str, ...]
    turns: tuple[bool, ...]
    """Whether the joint turns; otherwise it slides."""
    points: Array = field(repr=False)
    """The point of each axis nearest to base_link's origin, m, shape (n, 3); of no meaning for a sliding joint."""
    directions: Array = field(repr=False)
    """Unit vectors, shape (n, 3): a positive coordinate turns about them, or slides along them."""
    T_base_tool: Array = field(repr=False)
    """Pose of tool0 in base_link at coordinate zero, shape (4, 4)."""
    reach: float
    """Length of the shortest string from axis to axis, point by point, from base_link to tool0, m."""

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.turns)


def axes_of(spec: RobotSpec) -> ScrewAxes:
    """Return the axes of a serial robot; fixed rows are merged with the links that they are part of."""
    return axes_of_rows(
        spec.rows,
        pose_from_rpy(spec.base.pose.xyz, spec.base.pose.rpy),
        pose_from_rpy(spec.tool.xyz, spec.tool.rpy),
    )


def axes_of_rows(rows: Sequence[Row], T_base_dh0: Array, T_dhn_tool: Array) -> ScrewAxes:
    """Return the axes that the rows of a table describe.

    Args:
        rows: The table; it need not be one that a robot file allows.
        T_base_dh0: Pose of DH frame 0 in base_link, shape (4, 4).
        T_dhn_tool: Pose of tool0 in the last DH frame, shape (4, 4).
    """
    names = tuple(row.name for row in rows if row.type.moves)
    turns, points, directions, T = joint_lines(rows, T_base_dh0)
    T_base_tool = T @ T_dhn_tool
    z = np.array(directions).reshape(-1, 3)
    p = np.array(points).reshape(-1, 3)
    p = p - (p * z).sum(axis=1)[:, None] * z
    return ScrewAxes(
        names=names,
        turns=turns,
        points=p,
        directions=z,
        T_base_tool=T_base_tool,
        reach=_string_length(turns, p.tolist(), z.tolist(), T_base_tool[:3, 3].tolist()),
    )


def joint_lines(
    rows: Sequence[Row], T_base_dh0: Array
) -> tuple[tuple[bool, ...], list[list[float]], list[list[float]], Array]:
    """Return of a table which joints turn, a point and the direction of each axis, and the pose of the last DH frame.

    In plain numbers, as hundreds of tables are looked at for a misreading.
    """
    frame = _MovingFrame(T_base_dh0)
    turns, points, directions = [], [], []
    for row in rows:
        modified = row.convention is Convention.MODIFIED
        if modified:
            frame.link(row.a, row.alpha)
        if row.type is not JointType.FIXED:
            turns.append(row.type is not JointType.PRISMATIC)
            points.append(frame.p)
            directions.append([-value for value in frame.z] if row.flip else frame.z)
        frame.joint(row.theta, row.d)
        if not modified:
            frame.link(row.a, row.alpha)
        if row.beta:
            frame.second_twist(row.beta)
    return tuple(turns), points, directions, frame.pose()


class _MovingFrame:
    """A frame that is carried along a table: its axes x, y, z and its origin p, as lists of three floats."""

    def __init__(self, T: Array) -> None:
        self.x, self.y, self.z, self.p = T[:3].T.tolist()

    def joint(self, theta: float, d: float) -> None:
        """Apply Rz(theta) Tz(d)."""
        c, s = math.cos(theta), math.sin(theta)
        self.x, self.y = _mixed(c, self.x, s, self.y), _mixed(-s, self.x, c, self.y)
        self.p = _mixed(1.0, self.p, d, self.z)

    def link(self, a: float, alpha: float) -> None:
        """Apply Tx(a) Rx(alpha)."""
        c, s = math.cos(alpha), math.sin(alpha)
        self.p = _mixed(1.0, self.p, a, self.x)
        self.y, self.z = _mixed(c, self.y, s, self.z), _mixed(-s, self.y, c, self.z)

    def second_twist(self, beta: float) -> None:
        """Apply Ry(beta)."""
        c, s = math.cos(beta), math.sin(beta)
        self.x, self.z = _mixed(c, self.x, -s, self.z), _mixed(s, self.x, c, self.z)

    def pose(self) -> Array:
        """Return the frame's pose, shape (4, 4)."""
        T = np.eye(4)
        T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = self.x, self.y, self.z, self.p
        return T


def _mixed(f: float, u: list[float], g: float, v: list[float]) -> list[float]:
    return [f * u[0] + g * v[0], f * u[1] + g * v[1], f * u[2] + g * v[2]]


def _string_length(
    turns: Sequence[bool], points: list[list[float]], directions: list[list[float]], tool: list[float]
) -> float:
    """Sum of the steps from each point to its foot on the next axis, beginning at the first axis's own point."""
    place, length = None, 0.0
    for turn, p, z in zip(turns, points, directions, strict=True):
        if not turn:
            continue
        if place is None:
            place = p
            continue
        gap = _mixed(1.0, place, -1.0, p)
        foot = _mixed(1.0, p, gap[0] * z[0] + gap[1] * z[1] + gap[2] * z[2], z)
        length += math.dist(place, foot)
        place = foot
    return length + math.dist(place or [0.0, 0.0, 0.0], tool)
