"""Joint axes of a chain at zero, and how lines lie to each other: what closed forms are recognised by.

A joint axis is a line of the mechanism. Conventions, offsets, moved zeros, base and tool change where the table puts
its frames and nothing of what is computed here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.rotations import rotations_about
from dh2sim.typing import Array, read_only

EXACT: Final = 1e-9
"""Angles, rad, and lengths as a share of the arm's size, below which nothing but rounding is left."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointAxis:
    """The axis of a joint that moves, in base_link at zero."""

    name: str
    slides: bool
    direction: Array
    """Unit vector, shape (3,): the positive coordinate turns about it, or slides along it."""
    point: Array
    """A point of the axis near the arm, m, shape (3,)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArmAxes:
    """The axes of a chain's moving joints at zero, and its tool."""

    joints: tuple[JointAxis, ...]
    T_base_link_dh0: Array = field(repr=False)
    """Pose of DH frame 0 in base_link, shape (4, 4)."""
    T_home: Array = field(repr=False)
    """Pose of tool0 in base_link at zero, shape (4, 4)."""
    size: float
    """Greatest distance between points of the arm at zero, m; 1 where there is none."""
    tolerance: float
    """Angles, rad, and lengths as a share of the size, below which axes count as parallel, concurrent, …"""

    @property
    def kinds(self) -> str:
        """A letter for each joint: R turns, P slides."""
        return "".join("P" if joint.slides else "R" for joint in self.joints)

    @property
    def tip(self) -> Array:
        """Position of tool0 at zero, m, shape (3,)."""
        return self.T_home[:3, 3]

    def is_short(self, length: float) -> bool:
        """Whether a length, m, counts as none."""
        return abs(length) <= self.tolerance * self.size

    def parallel(self, *joints: int) -> bool:
        """Whether joints have parallel axes, counted from 0."""
        first = self.joints[joints[0]].direction
        return all(norm(np.cross(first, self.joints[i].direction)) <= self.tolerance for i in joints[1:])

    def perpendicular(self, one: int, other: int) -> bool:
        """Whether the axes of two joints are at right angles, counted from 0."""
        return abs(float(self.joints[one].direction @ self.joints[other].direction)) <= self.tolerance

    def meeting_point(self, joints: Sequence[int]) -> Array | None:
        """Return the point, m, shape (3,), where the axes of joints meet, counted from 0; None if they do not.

        The point has the least sum of squared distances to the lines.
        """
        projectors = [np.eye(3) - np.outer(self.joints[i].direction, self.joints[i].direction) for i in joints]
        # relative to one of the points, so that nothing cancels
        origin = self.joints[joints[0]].point
        sides = [P @ (self.joints[i].point - origin) for P, i in zip(projectors, joints, strict=True)]
        A = np.sum(projectors, axis=0)
        if np.linalg.eigvalsh(A)[0] < 1e-3:
            return None
        point = np.linalg.solve(A, np.sum(sides, axis=0))
        gaps = [norm(P @ point - side) for P, side in zip(projectors, sides, strict=True)]
        return np.asarray(origin + point) if self.is_short(max(gaps)) else None

    def foot(self, joint: int, point: Array) -> Array:
        """Return a point, m, shape (3,), projected onto a joint's axis, counted from 0."""
        axis = self.joints[joint]
        return np.asarray(axis.point + axis.direction * float(axis.direction @ (point - axis.point)))

    def motion(self, joint: int, coordinate: float | Array) -> Array:
        """Return how a joint, counted from 0, moves what it carries from where that is at zero, shape (..., 4, 4).

        Source: K. M. Lynch, F. C. Park, Modern Robotics, 2017, section 4.1.1: exp([S] q), S in the base's frame.
        """
        axis, q = self.joints[joint], np.asarray(coordinate, dtype=np.float64)
        T = np.zeros((*q.shape, 4, 4))
        T[..., range(4), range(4)] = 1.0
        if axis.slides:
            T[..., :3, 3] = q[..., None] * axis.direction
        else:
            T[..., :3, :3] = rotations_about(axis.direction, q)
            T[..., :3, 3] = axis.point - T[..., :3, :3] @ axis.point
        return T

    def motions(self, q: Sequence[float] | Array) -> Array:
        """Return how the first joints together move what they carry, exp([S1] q1) …, for q of shape (..., m)."""
        coordinates = np.asarray(q, dtype=np.float64)
        T = np.eye(4)
        for joint in range(coordinates.shape[-1]):
            T = T @ self.motion(joint, coordinates[..., joint])
        return T

    def base_frame(self, joint: int) -> Array:
        """Return the frame that heights and angles are counted in: shape (4, 4), in base_link.

        Its z axis is that of a joint that turns, its origin DH frame 0's projected onto that, its x axis DH frame 0's
        as nearly as can be. Where the table's first z axis is the joint's, it is DH frame 0.
        """
        z = self.joints[joint].direction
        R = self.T_base_link_dh0[:3, :3]
        x = R[:, 0] - z * float(z @ R[:, 0])
        if norm(x) < 0.1:
            x = R[:, 1] - z * float(z @ R[:, 1])
        x = x / norm(x)
        T = np.eye(4)
        T[:3, :3] = np.column_stack([x, np.cross(z, x), z])
        T[:3, 3] = self.foot(joint, self.T_base_link_dh0[:3, 3])
        return T


def arm_axes(chain: KinematicChain, tolerance: float = EXACT) -> ArmAxes:
    """Return the axes of a chain's moving joints at zero.

    The points on them are projections from axis to axis, from tool0 inwards: they are near the arm, wherever the
    table puts its frames along nearly parallel axes.

    Args:
        chain: The robot.
        tolerance: Angles, rad, and lengths as a share of the arm's size, that count as none.
    """
    T, found = np.eye(4), []
    for joint in chain.joints:
        T = T @ joint.T_parent_joint
        if joint.type.moves:
            found.append((joint, joint.sign * T[:3, 2], T[:3, 3].copy()))
    T_home = T @ chain.joints[-1].T_joint_dh @ chain.T_dhn_tool0
    point = T_home[:3, 3]
    points = [point]
    for _, direction, origin in reversed(found):
        point = origin + direction * float(direction @ (point - origin))
        points.append(point)
    base = chain.T_base_link_dh0[:3, 3]
    if found:
        _, direction, origin = found[0]
        points.append(origin + direction * float(direction @ (base - origin)))
    size = max(norm(a - b) for a in points for b in points)
    return ArmAxes(
        joints=tuple(
            JointAxis(
                name=joint.name, slides=not joint.type.turns, direction=read_only(direction), point=read_only(at)
            )
            for (joint, direction, _), at in zip(found, points[len(found) : 0 : -1], strict=True)
        ),
        T_base_link_dh0=chain.T_base_link_dh0,
        T_home=read_only(T_home),
        size=size if size > 0.0 else 1.0,
        tolerance=tolerance,
    )


def turn_about(axis: Array, one: Array, other: Array) -> float:
    """Return the angle, rad, about a unit vector from one vector to another, both seen along it."""
    return math.atan2(float(axis @ np.cross(one, other)), float(one @ other - (axis @ one) * (axis @ other)))


def norm(vector: Array) -> float:
    """Return the length of a vector."""
    return math.sqrt(float(vector @ vector))


def wrapped(angle: float) -> float:
    """Return an angle, rad, in (-pi, pi]; what is within rounding of -pi is pi."""
    turned = math.remainder(angle, 2.0 * math.pi)
    return math.pi if turned <= -math.pi + 1e-12 else turned + 0.0
