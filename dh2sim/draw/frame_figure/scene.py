"""What a picture of assigned frames shows, in three dimensions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dh2sim.importing.result import Imported, PlacedFrames, placed_frames
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array

SAME = 1e-6
"""Points closer than this share of the reach are one; so are directions closer than this, rad."""
_EXTENSION = 0.25
"""Of the reach: how far a prismatic joint is extended whose length would be hidden."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Segment:
    """A length of the table."""

    letter: str
    """a or d."""
    index: int
    start: Array
    """m, shape (3,)."""
    end: Array
    """m, shape (3,)."""
    name: str = ""
    """Of the parameter that it is, if any."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointAxis:
    """A line that one joint, or several in line, move about or along."""

    joints: tuple[int, ...]
    """Counted from 1, in their order along the line."""
    senses: tuple[int, ...]
    """1 where a joint's z points along ``direction``, else -1."""
    start: Array
    """The first point of the robot on it, m, shape (3,)."""
    end: Array
    """The last one, m, shape (3,)."""
    direction: Array
    """Unit vector, shape (3,)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pointer:
    """x, y or z axes of frames that share their origin and this direction."""

    letter: str
    indices: tuple[int, ...]
    origin: Array
    """m, shape (3,)."""
    direction: Array
    """Unit vector, shape (3,)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """Everything that is drawn."""

    spec: RobotSpec
    segments: tuple[Segment, ...]
    axes: tuple[JointAxis, ...]
    pointers: tuple[Pointer, ...]
    origins: tuple[Array, ...]
    """Origins of frames, each place once, m."""
    tip: Array
    """m, shape (3,)."""
    last_origin: Array
    """Of frame n, m, shape (3,)."""
    extended: tuple[tuple[int, float], ...]
    """Prismatic joints that are not at zero, and their coordinates, m."""

    @property
    def corners(self) -> Array:
        """Points of the robot, shape (number, 3)."""
        ends = [point for segment in self.segments for point in (segment.start, segment.end)]
        return np.array([np.zeros(3), *self.origins, *ends, self.tip])


def make_scene(imported: Imported) -> Scene:
    """Collect what is drawn, at joint coordinates zero; prismatic joints whose length would be hidden are extended.

    Raises:
        ValueError: The robot was made of a table, to which no frames were assigned.
    """
    zero = placed_frames(imported)
    q = _coordinates(zero.spec, zero.reach)
    placed = placed_frames(imported, q)
    least = SAME * placed.reach
    segments = tuple(_segments(placed, least))
    return Scene(
        spec=placed.spec,
        segments=segments,
        axes=tuple(_axes(placed, segments, least)),
        pointers=tuple(pointers_of(placed.frames, least)),
        origins=tuple(distinct([T[:3, 3] for T in placed.frames], least)),
        tip=placed.T_base_tip[:3, 3],
        last_origin=placed.frames[-1][:3, 3],
        extended=tuple((i, float(value)) for i, value in enumerate(q, start=1) if value != 0.0),
    )


def _coordinates(spec: RobotSpec, reach: float) -> Array:
    q = np.zeros(len(spec.rows))
    for i, row in enumerate(spec.rows):
        if not row.type.turns and abs(row.d) <= SAME * reach:
            lower, upper = row.limits.position or (-np.inf, np.inf)
            shown = min(max(_EXTENSION * reach, lower), upper)
            q[i] = float(f"{shown if shown > 0.0 else max(-_EXTENSION * reach, lower):.2g}")
    return q


def _segments(placed: PlacedFrames, least: float) -> Iterator[Segment]:
    for i in range(1, placed.n + 1):
        before, here = placed.frames[i - 1], placed.frames[i]
        start, end = before[:3, 3], here[:3, 3]
        if i <= placed.distal:
            corner = start + float((end - start) @ before[:3, 2]) * before[:3, 2]
            pieces = (("d", i, start, corner), ("a", i, corner, end))
        else:
            corner = start + placed.spec.rows[i - 1].a * before[:3, 0]
            pieces = (("a", i - 1, start, corner), ("d", i, corner, end))
        for letter, index, first, last in pieces:
            if np.linalg.norm(last - first) > least:
                yield Segment(letter=letter, index=index, start=first, end=last)


def _axes(placed: PlacedFrames, segments: Sequence[Segment], least: float) -> Iterator[JointAxis]:
    left = list(range(1, placed.n + 1))
    points = np.array(
        [T[:3, 3] for T in placed.frames]
        + [p for s in segments for p in (s.start, s.end)]
        + [placed.T_base_tip[:3, 3]]
    )
    while left:
        line = placed.axis(left[0])
        together = [
            joint
            for joint in left
            if np.linalg.norm(np.cross(line.direction, placed.axis(joint).direction)) <= SAME
            and np.linalg.norm(placed.axis(joint).point - line.foot_of(placed.axis(joint).point)) <= least
        ]
        left = [joint for joint in left if joint not in together]
        along = (points - line.point) @ line.direction
        beside = np.linalg.norm(points - line.point - along[:, None] * line.direction, axis=1)
        on = along[beside <= least]
        together.sort(key=lambda joint: (_middle(placed, joint, line.point, line.direction), joint))
        yield JointAxis(
            joints=tuple(together),
            senses=tuple(1 if placed.axis(joint).direction @ line.direction > 0.0 else -1 for joint in together),
            start=line.point + on.min() * line.direction,
            end=line.point + on.max() * line.direction,
            direction=line.direction,
        )


def _middle(placed: PlacedFrames, joint: int, point: Array, direction: Array) -> float:
    """Return where a joint is along a line: in the middle of its d, rounded so that noise does not decide."""
    own = placed.axis(joint)
    ends = own.point, placed.foot(joint) if joint < placed.n else own.foot_of(placed.frames[joint][:3, 3])
    return round(float(sum((end - point) @ direction for end in ends)) / placed.reach, 5)


def pointers_of(frames: Array, least: float) -> Iterator[Pointer]:
    """Yield the axes of frames, shape (count, 4, 4); those that coincide within ``least``, m, are one."""
    found: list[tuple[str, Array, Array, list[int]]] = []
    for column, letter in enumerate("xyz"):
        for index, T in enumerate(frames):
            for other, origin, direction, indices in found:
                if (
                    other == letter
                    and np.linalg.norm(T[:3, 3] - origin) <= least
                    and np.linalg.norm(T[:3, column] - direction) <= SAME
                ):
                    indices.append(index)
                    break
            else:
                found.append((letter, T[:3, 3], T[:3, column], [index]))
    for letter, origin, direction, indices in found:
        yield Pointer(letter=letter, indices=tuple(indices), origin=origin, direction=direction)


def distinct(points: Sequence[Array], least: float) -> list[Array]:
    """Return points without those that are within ``least`` of an earlier one."""
    kept: list[Array] = []
    for point in points:
        if all(np.linalg.norm(point - other) > least for other in kept):
            kept.append(point)
    return kept
