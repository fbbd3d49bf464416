"""The primitive shapes that links are made of, placed in the joint frame of their link."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

from dh2sim.kinematics.transforms import compose, pose_from_rpy
from dh2sim.robot.links import ShapeSpec
from dh2sim.typing import Array, read_only


class ShapeKind(StrEnum):
    """A primitive; its axis is its own z, and its centre is its origin."""

    CYLINDER = "cylinder"
    CAPSULE = "capsule"
    SPHERE = "sphere"
    BOX = "box"


class ShapePart(StrEnum):
    """The part that a shape shows; joints and trim are drawn darker than links."""

    JOINT = "joint"
    LINK = "link"
    TRIM = "trim"
    """Only shown: it has no mass, and nothing touches it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shape:
    """A primitive that belongs to a link."""

    kind: ShapeKind
    part: ShapePart
    radius: float
    """m, positive; of a box, that of the cylinder around it."""
    length: float
    """Of the cylindrical part or the box along z, m, positive, 0 for a sphere; a capsule has half a ball more at each
    end."""
    T_link_shape: Array = field(repr=False)
    """Pose of the shape's centre in the link's (joint-placed) frame, shape (4, 4)."""
    size: tuple[float, float, float] | None = None
    """Of a box along x, y and z, m."""

    @property
    def solid(self) -> bool:
        """Whether it weighs and collides."""
        return self.part is not ShapePart.TRIM

    @property
    def ends(self) -> tuple[Array, Array]:
        """The ends of the cylindrical part's axis in the link frame, m, two arrays of shape (3,)."""
        centre, half = self.T_link_shape[:3, 3], 0.5 * self.length * self.T_link_shape[:3, 2]
        return centre - half, centre + half


def between(kind: ShapeKind, part: ShapePart, radius: float, start: Sequence[float], end: Sequence[float]) -> Shape:
    """Make a shape whose axis runs from ``start`` to ``end`` (link frame, m, three numbers each, not the same)."""
    (a, b, c), (d, e, f) = start, end
    x, y, z = d - a, e - b, f - c
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0.0:  # the ends of a shape that is tiny beside its distance are rounded to one point
        x, y, z, length = 0.0, 0.0, radius, radius
    return Shape(
        kind=kind,
        part=part,
        radius=radius,
        length=length,
        T_link_shape=pose_with_z((0.5 * (a + d), 0.5 * (b + e), 0.5 * (c + f)), (x / length, y / length, z / length)),
    )


def placed(shape: Shape, T_link_frame: Array) -> Shape:
    """Return ``shape``, given in some frame, in the link in which that frame has pose ``T_link_frame``."""
    return replace(shape, T_link_shape=compose(T_link_frame, shape.T_link_shape))


def given_shape(spec: ShapeSpec) -> Shape:
    """Return a shape that a robot file gives, in the frame that it is given in."""
    T = pose_from_rpy(spec.pose.xyz, spec.pose.rpy)
    part = ShapePart.LINK
    if spec.size is not None:
        x, y, z = (float(side) for side in spec.size)
        around = 0.5 * math.sqrt(x * x + y * y)
        return Shape(kind=ShapeKind.BOX, part=part, radius=around, length=z, T_link_shape=T, size=(x, y, z))
    kind = ShapeKind.SPHERE if spec.length is None else ShapeKind.CYLINDER
    return Shape(kind=kind, part=part, radius=spec.radius or 0.0, length=spec.length or 0.0, T_link_shape=T)


def pose_with_z(origin: Sequence[float], z: Sequence[float]) -> Array:
    """Return a pose, shape (4, 4), at ``origin`` (m) whose z axis is the unit vector ``z``; x is any normal to it.

    The frame is turned about the coordinate axis that z is farthest from, so axes along x, y or z stay exact.
    """
    if z[2] == 1.0:
        x, y = [1.0, 0.0, -z[0]], [0.0, 1.0, -z[1]]  # components too small to show in z[2]
    else:
        sizes = [*map(abs, z)]
        other = [0.0, 0.0, 0.0]
        other[sizes.index(min(sizes))] = 1.0
        y = cross(z, other)
        norm = math.sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2])
        y = [component / norm for component in y]
        x = cross(y, z)
    return read_only(
        [[x[i] + 0.0, y[i] + 0.0, z[i] + 0.0, origin[i] + 0.0] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]]
    )


def cross(a: Sequence[float], b: Sequence[float]) -> list[float]:
    """Return the cross product of two vectors."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def neat(size: float) -> float:
    """Round to three significant digits, which are enough for a size that was chosen.

    By way of ten digits, so that sizes which differ by rounding alone do not end on both sides of a tie.
    """
    return float(f"{float(f'{size:.10g}'):.3g}")
