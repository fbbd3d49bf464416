"""Points where an arm's links meet: they follow the axes of the mechanism, not the frames of the table.

A table may put its frames anywhere along parallel axes, and far away along nearly parallel ones: calibrated arms have
rows with d = 574 m that the next rows take back. What hangs on the frames' origins would be 574 m long. The points
here are made of lines and two points that belong to the arm, the origin of base_link and tool0:

    exit_n = tool0 projected onto axis n;  exit_i = exit_(i+1) projected onto axis i
    entry_1 = the origin of base_link projected onto axis 1;  entry_(i+1) = exit_i projected onto axis i+1

A point on a revolute axis does not move with that joint, so every point is fixed in its links. A projection onto a
line is well conditioned whatever the angle to the next. From the tool inwards, because then arms whose axes are all
parallel to the first stand as high as their tool, on a column.

Plain double arithmetic in a fixed order, so that every machine gets the same bits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.transforms import Rows, compose
from dh2sim.robot.row import JointType
from dh2sim.typing import Point

Travel = tuple[float, float]
"""Lowest and highest displacement of a joint along its frame's +z, m; (0, 0) of one that does not slide."""

SLIDE_MARGIN = 0.25
"""How far a slide's guide is from where its link leaves the axis, as a share of a travel that begins at zero."""

ROUNDS = 5
"""Of pulling the string tight."""
WEAKEST = 1e-3
"""Segments shorter than this share of the string pull no harder."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Skeleton:
    """Where links meet; joint i counts from 0, link 0 is base_link, link i + 1 is moved by joint i."""

    entries: tuple[Point, ...] = field(repr=False)
    """The point of axis i where link i arrives, in the frame of link i with all coordinates zero, m."""
    entry_heights: tuple[float, ...]
    """The same along z of joint frame i at zero, m."""
    exit_heights: tuple[float, ...]
    """The point of axis i where link i + 1 leaves, along its own z, m."""
    arrivals: tuple[Point, ...] = field(repr=False)
    """The point where link i + 1 leaves axis i, in the frame of link i with all coordinates zero, m."""
    tip: Point = field(repr=False)
    """tool0 in the last link's frame, m."""
    slides: tuple[Travel | None, ...]
    """Travels along the axes, m; None where a joint does not slide."""
    directions: tuple[Point, ...] = field(repr=False)
    """Of axis i in the frame of link i with all coordinates zero, unit vectors."""

    def leaving(self, link: int) -> Point:
        """Return the point where a link begins, in its frame, m: base_link's origin, or on its axis."""
        return 0.0, 0.0, 0.0 if link == 0 else self.exit_heights[link - 1]

    @property
    def steps(self) -> tuple[float, ...]:
        """Greatest distances from exit to exit over all coordinates, from base_link's origin to the tip, m."""
        n = len(self.entries)
        return tuple(_norm(self._span(k)) + (self._slide(k) if k < n else 0.0) for k in range(n + 1))

    @property
    def taut_length(self) -> float:
        """Length, m, of a string from base_link over all axes to the tip, pulled tight: a bound on the reach.

        Slides count with their greatest extension. The points on the axes minimise the weighted sum of squared
        distances; weights of one over the distances turn it into the sum of distances in a few rounds (Weiszfeld).
        """
        n = len(self.entries)
        spans = [self._span(k) for k in range(n + 1)]
        fixed = math.fsum(self._slide(k) for k in range(n))
        lengths = [_norm(span) for span in spans]
        shortest = math.fsum(lengths)
        weights = [1.0] * (n + 1)
        for _ in range(ROUNDS if shortest > 0.0 else 0):
            moved = self._pulled(spans, weights)
            lengths = [_norm(span) for span in moved]
            total = math.fsum(lengths)
            shortest = min(shortest, total)
            weights = [1.0 / max(length, WEAKEST * total) for length in lengths]
        return shortest + fixed

    def _span(self, link: int) -> Point:
        """Return the vector across a link, from where it begins to where it ends."""
        if link == len(self.entries):
            x, y, z = self.tip
        else:
            x, y, z = self.arrivals[link] if self.slides[link] is None else self.entries[link]
        return x, y, z - self.leaving(link)[2]

    def _slide(self, joint: int) -> float:
        """Return the greatest distance from entry to exit of a slide, 0 of a joint that does not slide."""
        slide = self.slides[joint]
        if slide is None:
            return 0.0
        along = self.exit_heights[joint] - self.entry_heights[joint]
        return max(abs(along + slide[0]), abs(along + slide[1]))

    def _pulled(self, spans: Sequence[Point], weights: Sequence[float]) -> list[Point]:
        """Return the spans when the points that no slide holds have moved along their axes to the least energy."""
        n = len(self.entries)
        free = [slide is None for slide in self.slides]
        diagonal, beside, right = [0.0] * n, [0.0] * n, [0.0] * n
        for k, (c, w) in enumerate(zip(spans, weights, strict=True)):
            if k < n and free[k]:
                z = self.directions[k]
                diagonal[k] += w
                right[k] -= w * (c[0] * z[0] + c[1] * z[1] + c[2] * z[2])
                if k > 0 and free[k - 1]:
                    beside[k] = -w * z[2]
            if k > 0 and free[k - 1]:
                diagonal[k - 1] += w
                right[k - 1] += w * c[2]
        shifts = _tridiagonal([d or 1.0 for d in diagonal], beside, right)
        ahead, back = [*shifts, 0.0], [0.0, *shifts]
        along = (*self.directions, (0.0, 0.0, 0.0))
        return [
            (x + by * u, y + by * v, z + by * w - less)
            for (x, y, z), by, less, (u, v, w) in zip(spans, ahead, back, along, strict=True)
        ]

    @property
    def segments(self) -> tuple[float, ...]:
        """Lengths of what the arm is made of, m: from one axis to the next, and along every axis, slides included."""
        lengths = []
        for link, entry in enumerate(self.entries):
            lengths.append(math.dist(self.leaving(link), entry))
            low, high = self.slides[link] or (0.0, 0.0)
            along = self.exit_heights[link] - self.entry_heights[link]
            lengths.append(max(0.0, along + high) - min(0.0, along + low))
        lengths.append(math.dist(self.leaving(len(self.entries)), self.tip))
        return tuple(lengths)


def build_skeleton(chain: KinematicChain, travels: Sequence[Travel]) -> Skeleton:
    """Return the points where a chain's links meet.

    Args:
        chain: The chain, n rows.
        travels: Of every joint, m.

    Returns:
        The points; the same to within rounding for every table of the same arm.
    """
    joints = chain.joints
    x, y, z = compose(joints[-1].T_joint_dh, chain.T_dhn_tool0)[:3, 3].tolist()
    tip = point = (x, y, z)
    exits, arrivals = [0.0] * len(joints), [tip] * len(joints)
    poses = [joint.T_parent_joint.tolist() for joint in joints]
    for i in reversed(range(len(joints))):
        exits[i] = point[2]
        point = arrivals[i] = _on_axis(poses[i], exits[i])
        if joints[i].type is JointType.PRISMATIC:
            point = _on_axis(poses[i], exits[i] + _guide(travels[i]))
    starts = [0.0, *exits[:-1]]
    entry_heights = [_height(T, (0.0, 0.0, start)) for T, start in zip(poses, starts, strict=True)]
    return Skeleton(
        directions=tuple((a[2], b[2], c[2]) for a, b, c, _ in poses),
        entries=tuple(_on_axis(T, height) for T, height in zip(poses, entry_heights, strict=True)),
        entry_heights=tuple(entry_heights),
        exit_heights=tuple(exits),
        arrivals=tuple(arrivals),
        tip=tip,
        slides=tuple(
            travel if joint.type is JointType.PRISMATIC else None
            for joint, travel in zip(joints, travels, strict=True)
        ),
    )


def _tridiagonal(diagonal: Sequence[float], beside: Sequence[float], right: Sequence[float]) -> list[float]:
    """Solve a symmetric positive definite system; ``beside[k]`` couples k with k - 1."""
    d, r = list(diagonal), list(right)
    for k in range(1, len(d)):
        share = beside[k] / d[k - 1]
        d[k] -= share * beside[k]
        r[k] -= share * r[k - 1]
    x = [0.0] * len(d)
    for k in reversed(range(len(d))):
        x[k] = (r[k] - (beside[k + 1] * x[k + 1] if k + 1 < len(d) else 0.0)) / d[k]
    return x


def _norm(vector: Sequence[float]) -> float:
    return math.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])


def _guide(travel: Travel) -> float:
    """Return how far along the axis from its exit a slide is held at coordinate zero, where only that says it."""
    low, high = travel
    return min(max(0.0, low), high) - SLIDE_MARGIN * (low + high)


def _on_axis(T: Rows, height: float) -> Point:
    """Return the point at a height, m, on the axis of a joint of this pose in its parent, in the parent's frame."""
    (_, _, a, x), (_, _, b, y), (_, _, c, z), _ = T
    return x + height * a, y + height * b, z + height * c


def _height(T: Rows, point: Point) -> float:
    """Return where a point of the parent's frame is projected onto a joint's axis, m along z from its origin."""
    return math.fsum([row[2] * (x - row[3]) for row, x in zip(T[:3], point, strict=True)])
