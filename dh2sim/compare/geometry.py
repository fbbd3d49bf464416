"""A mechanism in numbers that no choice of frames changes, and the sentence on where two of them first differ.

Between neighbouring axes: the angle between the lines and their distance. Along an axis: how far the common normals
with its neighbours are apart, carried along axes that are parallel. Angles are those of lines, 0 to 90 degrees; that
two lines are twisted the other way, or a normal lies on the other side, is found by matching.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dh2sim.compare.matching import Obstacle, ObstacleKind
from dh2sim.compare.screws import ScrewAxes
from dh2sim.compare.words import degrees, millimetres, told_apart
from dh2sim.typing import Array

LABELS = ("A", "B")


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisGeometry:
    """A joint's axis as seen from the axis before it."""

    twist: float | None
    """Angle to the axis before, rad, 0 to pi/2; None for the first."""
    distance: float | None
    """From the axis before, m; None for the first, and where sliding joints leave it open."""
    offset: float | None
    """Between the common normals along this axis, m; None where there are not two, or the joint slides."""


def axis_geometry(axes: ScrewAxes, parallel: float) -> tuple[AxisGeometry, ...]:
    """Return the numbers of each axis; axes are parallel up to this sine."""
    found = []
    place: Array | None = None
    twists: list[float | None] = [None]
    distances: list[float | None] = [None]
    offsets: list[float | None] = []
    lines = _lines(axes)
    for i in range(axes.n):
        p, z = lines[i]
        if i == axes.n - 1:
            offsets.append(None)
            break
        p_next, z_next = lines[i + 1]
        cross = np.cross(z, z_next)
        sine = float(np.linalg.norm(cross))
        twists.append(math.atan2(sine, abs(float(z @ z_next))))
        gap = p_next - p
        if sine > parallel:
            normal = cross / sine
            foot = p + float(np.cross(gap, z_next) @ cross) / sine**2 * z
            next_foot = p_next + float(np.cross(gap, z) @ cross) / sine**2 * z_next
            distances.append(abs(float(gap @ normal)))
            known = place is not None and axes.turns[i]
            offsets.append(abs(float((foot - place) @ z)) if known and place is not None else None)
            place = next_foot
        else:
            distances.append(float(np.linalg.norm(gap - (gap @ z) * z)))
            offsets.append(None)
            if place is not None:
                place = p_next + float((place - p_next) @ z_next) * z_next
        if not axes.turns[i + 1] or not axes.turns[i]:
            distances[-1] = distances[-1] if axes.turns[i] and axes.turns[i + 1] else None
    for twist, distance, offset in zip(twists, distances, offsets, strict=False):
        found.append(AxisGeometry(twist=twist, distance=distance, offset=offset))
    return tuple(found)


def _lines(axes: ScrewAxes) -> list[tuple[Array, Array]]:
    """Return a point and the direction of each axis; those of slides go through the axis before them."""
    lines: list[tuple[Array, Array]] = []
    for turns, point, direction in zip(axes.turns, axes.points, axes.directions, strict=True):
        lines.append((point if turns or not lines else lines[-1][0], direction))
    return lines


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """Where two mechanisms first differ."""

    kind: ObstacleKind
    joints: tuple[str, ...]
    """The joints of A concerned."""
    a: float | None
    """The value in A, rad or m; None where there is none to give."""
    b: float | None
    """The value in B."""
    sentence: str


def first_difference(
    a: ScrewAxes, b: ScrewAxes, obstacle: Obstacle, tolerance: float, labels: tuple[str, str]
) -> Difference:
    """Return the numbers and the words for where matching failed; ``labels`` are what A and B are called there."""
    i, k = obstacle.first, obstacle.last
    match obstacle.kind:
        case ObstacleKind.COUNT:
            text = f"{labels[0]} has {_joints(a.n)}, {labels[1]} has {_joints(b.n)}"
            return Difference(kind=obstacle.kind, joints=(), a=float(a.n), b=float(b.n), sentence=text)
        case ObstacleKind.TYPE:
            does = {True: "turns", False: "slides"}
            text = f"{a.names[i]} {does[a.turns[i]]} in {labels[0]}, {b.names[i]} {does[b.turns[i]]} in {labels[1]}"
            return Difference(kind=obstacle.kind, joints=(a.names[i],), a=None, b=None, sentence=text)
        case ObstacleKind.TWIST:
            return _twist(a, b, i, k, tolerance, labels)
        case ObstacleKind.DISTANCE:
            return _distance(a, b, i, k, tolerance, labels)
        case ObstacleKind.OFFSET:
            return _offset(a, b, i, tolerance, labels)
        case ObstacleKind.SUM:
            raise ValueError("matching ends at a joint, not at a sum")


def _twist(a: ScrewAxes, b: ScrewAxes, i: int, k: int, tolerance: float, labels: tuple[str, str]) -> Difference:
    for last in range(i + 1, k + 1):
        for first in range(i, last):
            x, y = (_angle_between(axes.directions[first], axes.directions[last]) for axes in (a, b))
            if abs(x - y) > tolerance:
                in_a, in_b = told_apart(degrees, x, y)
                text = (
                    f"the axes of {a.names[first]} and {a.names[last]} are {in_a} apart in {labels[0]}, "
                    f"{in_b} in {labels[1]}"
                )
                return Difference(
                    kind=ObstacleKind.TWIST, joints=(a.names[first], a.names[last]), a=x, b=y, sentence=text
                )
    names = a.names[i : k + 1]
    text = f"the axes of {', '.join(names)} are arranged in {labels[1]} as in a mirror image of {labels[0]}"
    return Difference(kind=ObstacleKind.TWIST, joints=names, a=None, b=None, sentence=text)


def _distance(a: ScrewAxes, b: ScrewAxes, i: int, k: int, tolerance: float, labels: tuple[str, str]) -> Difference:
    x, y = (_across(axes, i, k) for axes in (a, b))
    names = (a.names[i], a.names[k])
    if abs(x - y) > tolerance:
        in_a, in_b = told_apart(millimetres, x, y)
        text = f"the axes of {names[0]} and {names[1]} are {in_a} apart in {labels[0]}, {in_b} in {labels[1]}"
        return Difference(kind=ObstacleKind.DISTANCE, joints=names, a=x, b=y, sentence=text)
    text = (
        f"the axes of {names[0]} and {names[1]} are {millimetres(x)} apart in both, but twisted the other way in "
        f"{labels[1]}, as in a mirror image"
    )
    return Difference(kind=ObstacleKind.DISTANCE, joints=names, a=x, b=x, sentence=text)


def _offset(a: ScrewAxes, b: ScrewAxes, i: int, tolerance: float, labels: tuple[str, str]) -> Difference:
    parallel = max(1e-6, tolerance)
    of_a, of_b = axis_geometry(a, parallel), axis_geometry(b, parallel)
    for joint in range(i + 1):
        x, y = of_a[joint].offset, of_b[joint].offset
        if x is not None and y is not None and abs(x - y) > tolerance:
            in_a, in_b = told_apart(millimetres, x, y)
            text = (
                f"along the axis of {a.names[joint]}, its two common normals are {in_a} apart in {labels[0]}, "
                f"{in_b} in {labels[1]}"
            )
            return Difference(kind=ObstacleKind.OFFSET, joints=(a.names[joint],), a=x, b=y, sentence=text)
    x = of_a[i].offset
    text = (
        f"along the axis of {a.names[i]}, the next axis lies on the other side in {labels[1]}"
        if x
        else f"no turn of {a.names[i]} brings the next axis of {labels[0]} to that of {labels[1]}"
    )
    return Difference(kind=ObstacleKind.OFFSET, joints=(a.names[i],), a=x, b=of_b[i].offset, sentence=text)


def _across(axes: ScrewAxes, i: int, k: int) -> float:
    """Return the distance of two axes that no sliding between them changes, m."""
    _, S, Vt = np.linalg.svd(axes.directions[i : k + 1])
    rank = int((S > 1e-6).sum())
    return float(np.linalg.norm(Vt[rank:] @ (axes.points[k] - axes.points[i])))


def _angle_between(u: Array, v: Array) -> float:
    return math.atan2(float(np.linalg.norm(np.cross(u, v))), abs(float(u @ v)))


def _joints(count: int) -> str:
    return f"{count} joint{'' if count == 1 else 's'}"
