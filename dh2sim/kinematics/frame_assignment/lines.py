"""Two axes in space: how they lie, and their common normal."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from dh2sim.typing import Array


class Case(StrEnum):
    """How an axis lies to the one before it."""

    COINCIDENT = "coincident"
    PARALLEL = "parallel"
    NEARLY_PARALLEL = "nearly parallel"
    """Turned by so little that the common normal is far away, or that noise decides where it points."""
    INTERSECTING = "intersecting"
    SKEW = "skew"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Line:
    """An axis."""

    point: Array
    """A point of it, m, shape (3,)."""
    direction: Array
    """Unit vector, shape (3,)."""

    def foot_of(self, point: Array) -> Array:
        """Return the point of the line that is nearest to ``point``, shape (3,)."""
        return self.point + float((point - self.point) @ self.direction) * self.direction

    def moved(self, T: Array) -> Line:
        """Return the line in frame a, given the pose ``T`` = T_a_b of the frame b that it is in."""
        return Line(point=T[:3, :3] @ self.point + T[:3, 3], direction=T[:3, :3] @ self.direction)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Normal:
    """Where two lines that are not parallel are nearest to each other."""

    foot: Array
    """On the first line, m, shape (3,)."""
    next_foot: Array
    """On the second line, m, shape (3,)."""
    direction: Array
    """Unit vector along z_1 x z_2, shape (3,)."""


def sine_between(first: Line, second: Line) -> float:
    """Return the sine of the angle between two directions, exact also where it is tiny."""
    return length(cross_of_directions(first.direction, second.direction))


def cross_of_directions(z1: Array, z2: Array) -> Array:
    """Return z1 x z2 of unit vectors, to full relative precision where they are almost parallel or antiparallel.

    z1 x z2 = z1 x (z2 - z1) = z1 x (z2 + z1), and the difference or sum of vectors that are nearly equal or opposite
    is exact.
    """
    return np.cross(z1, z2 - z1 if float(z1 @ z2) > 0.0 else z2 + z1)


def distance_of_parallels(first: Line, second: Line) -> float:
    """Return how far the second line's point is from the first line, m."""
    return length(second.point - first.foot_of(second.point))


def common_normal(first: Line, second: Line) -> Normal:
    """Return the common normal of two lines that are not parallel.

    The foot on the first line is P1 + t z1 with t = det(P2 - P1, z2, n) / n·n, n = z1 x z2 (every textbook of
    analytic geometry). The other foot is the projection of the first onto the second line: where the lines are
    almost parallel an error of t then moves both alike.
    """
    n = cross_of_directions(first.direction, second.direction)
    gap = second.point - first.point
    t = float(gap @ np.cross(second.direction, n)) / float(n @ n)
    foot = first.point + t * first.direction
    return Normal(foot=foot, next_foot=second.foot_of(foot), direction=n / length(n))


def transversal(first: Line, second: Line, direction: Array, least_volume: float) -> Array | None:
    """Return where the line along ``direction`` that meets both lines meets the first one.

    P1 + s z1 + t direction = P2 + u z2 is solved by Cramer's rule.

    Args:
        first: A line.
        second: Another one.
        direction: Unit vector, shape (3,).
        least_volume: Of the box that the three directions span, at least.

    Returns:
        A point of the first line, m, shape (3,); None if it is badly determined.
    """
    normal = np.cross(direction, second.direction)
    volume = float(first.direction @ normal)
    if abs(volume) < least_volume:
        return None
    return first.point + float((second.point - first.point) @ normal) / volume * first.direction


def frame(origin: Array, x: Array, z: Array) -> Array:
    """Return the pose of a frame with its origin and two of its axes given, shape (4, 4)."""
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = x, np.cross(z, x), z, origin
    return T


def across(vector: Array, z: Array) -> Array:
    """Return the unit vector along the part of ``vector`` that is perpendicular to ``z``, shape (3,)."""
    flat = vector - float(vector @ z) * z
    flat = flat / length(flat)
    flat = flat - float(flat @ z) * z  # again: the first time leaves rounding where little is left of the vector
    return flat / length(flat)


def angle_about(z: Array, start: Array, end: Array) -> float:
    """Return the angle about ``z`` that turns ``start`` into ``end``, both perpendicular to it; rad in (-pi, pi]."""
    angle = math.atan2(float(np.cross(start, end) @ z), float(start @ end))
    return math.pi if angle == -math.pi else angle


def length(vector: Array) -> float:
    """Return the Euclidean norm."""
    return math.sqrt(float(vector @ vector))
