"""Where an arm runs, from what its axes alone say, and how far from that a frame stands.

A table can put its frames anywhere along parallel axes, and hundreds of metres out along nearly parallel ones; the
arm is none the longer for it. Its path does not depend on frames: from base_link to the nearest point of the first
axis, from there to the nearest point of the next, and so on to the tool; or from the tool to base_link likewise. A
point on its axis does not move with a revolute joint, so each piece is fixed in its link, and their sum bounds how
far the tool can reach.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.frame_assignment.lines import Line
from dh2sim.kinematics.serial_chain import SerialChain
from dh2sim.typing import Array

NEAR = 0.5
"""Of the reach: a frame that stands farther than that from the arm's path is far out."""
ROUNDING = 1e-9
"""Of the reach."""
_ORIGIN, _Z = np.zeros(3), np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArmPath:
    """The path, piece by piece; piece i lies in link i, in that link's own coordinates, i = 0 … n."""

    outlines: tuple[Array, ...] = field(repr=False)
    """Closed polygon around both ways through each link, m, shape (5, 3), its first point repeated at its end: where
    the way from base_link and the way from the tool meet the link's own axis, and then the next one's."""
    heights: tuple[tuple[float, float], ...]
    """Where the two ways meet axis i = 1 … n, along it, m; 0 is at the link's origin (``SerialJoint.point``)."""
    lengths: tuple[tuple[float, float], ...]
    """Of the way from base_link up to the next axis, and of the way that comes from the tool, m."""
    reach: float
    """Length of the longer way, m, but for how far from base_link the arm is mounted."""
    mounting: float
    """How far from base_link's origin the first axis is, m; 0 where that joint slides."""

    def entry(self, link: int) -> Array:
        """Return where the way from base_link meets the axis behind a link, in the link's coordinates, m."""
        return np.asarray(self.outlines[link][3])

    def own(self, link: int) -> Array:
        """Return where the way from the tool meets a link's own axis, in the link's coordinates, m."""
        return np.asarray(self.outlines[link][1])

    def distance(self, link: int, point: Array) -> float:
        """Return how far a point of a link, m, shape (3,) in its coordinates, is from the ways through it, m."""
        return min(_distance_from_segment(point, *ends) for ends in pairwise(self.outlines[link]))

    def way_to(self, link: int, point: Array) -> float:
        """Return how far it is along either way, and straight from there, to a point of a link, m."""
        entry, own, leaving, arrival, _ = self.outlines[link]
        ways = [(self.lengths[link], (arrival, leaving))]
        if link > 0:
            ways.append((self.lengths[link - 1], (entry, own)))
        return min(
            length + math.dist(corner, point)
            for both, corners in ways
            for length, corner in zip(both, corners, strict=True)
        )

    def way_along_axis(self, link: int, height: float) -> float:
        """Return how far it is along either way, and along the link's own axis, to a height of that.

        Args:
            link: 1 … n.
            height: Along the axis, m; 0 is at the link's origin.
        """
        entry, own = self.heights[link - 1]
        along, back = self.lengths[link - 1]
        return min(along + abs(height - entry), back + abs(height - own))

    def is_far_along_axis(self, link: int, height: float) -> bool:
        """Whether a height is more than half the reach from where the ways meet the link's axis, or out of reach."""
        lower, upper = sorted(self.heights[link - 1])
        beside = max(lower - height, height - upper)
        return beside > NEAR * self.reach or self.way_along_axis(link, height) > self.reach * (1.0 + ROUNDING)

    def leads_away(self, link: int, foot: float, start: float) -> bool:
        """Whether a common normal begins too far along a link's axis, and farther than a Hayati row would.

        Args:
            link: 1 … n - 1.
            foot: Where the normal begins, along the axis, m.
            start: Where the row begins, which has no d if it is Hayati's, m.
        """
        gain = self.way_along_axis(link, foot) - self.way_along_axis(link, start)
        return self.is_far_along_axis(link, foot) and gain > ROUNDING * self.reach


def arm_path(arm: KinematicChain | SerialChain) -> ArmPath:
    """Return the path of an arm at coordinate zero.

    The coordinates of link i are those of joint frame i (``SerialChain``: link i), of link 0 those of base_link.
    Joints that slide and fixed rows have no place of their own: the path goes on from where it is.
    """
    if isinstance(arm, KinematicChain):
        transforms = [joint.T_parent_joint for joint in arm.joints]
        axes = [(_ORIGIN, _Z)] * len(arm.joints)
        tip = (arm.joints[-1].T_joint_dh @ arm.T_dhn_tool0)[:3, 3]
    else:
        transforms = [joint.T_parent_link for joint in arm.joints]
        axes = [(joint.point, joint.axis) for joint in arm.joints]
        tip = arm.T_link_tip[:3, 3]
    turns = [joint.type.turns for joint in arm.joints]
    lines = [Line(point=axis[0], direction=axis[1]) if turn else None for axis, turn in zip(axes, turns, strict=True)]
    n = len(lines)
    entries, arrivals = [_ORIGIN], []  # the way from base_link: on the link's own axis, and on the next one
    for T, line in zip(transforms, lines, strict=True):
        entries.append(_foot(line, _back(T, entries[-1])))
        arrivals.append(_forth(T, entries[-1]))
    arrivals.append(tip)
    leaving = [tip] * (n + 1)  # the way from the tool: on the next axis, and on the link's own
    own = [_ORIGIN] * (n + 1)
    for i in range(n, 0, -1):
        own[i] = _foot(lines[i - 1], leaving[i])
        leaving[i - 1] = _forth(transforms[i - 1], own[i])
    outlines, lengths, mounting = [], [], 0.0
    for i, corners in enumerate(zip(entries, own, leaving, arrivals, strict=True)):
        outlines.append(np.array([*corners, corners[0]]))
        entry, start, end, arrival = corners
        if i == 0 and lines[0] is not None:  # how far from base_link it is mounted does not count
            mounting = math.dist(entry, arrival)
            entry = start = arrival
        lengths.append((math.dist(entry, arrival), math.dist(start, end)))
    sums = [
        (math.fsum(ways[0] for ways in lengths[:i]), math.fsum(ways[1] for ways in lengths[:i]))
        for i in range(1, n + 2)
    ]
    heights = [
        (float((entry - start) @ z), float((end - start) @ z))
        for (start, z), entry, end in zip(axes, entries[1:], own[1:], strict=True)
    ]
    return ArmPath(
        outlines=tuple(outlines), heights=tuple(heights), lengths=tuple(sums), reach=max(sums[-1]), mounting=mounting
    )


def _foot(line: Line | None, point: Array) -> Array:
    return point if line is None else line.foot_of(point)


def _forth(T: Array, point: Array) -> Array:
    return np.asarray(T[:3, :3] @ point + T[:3, 3])


def _back(T: Array, point: Array) -> Array:
    return np.asarray(T[:3, :3].T @ (point - T[:3, 3]))


def _distance_from_segment(point: Array, start: Array, end: Array) -> float:
    along = end - start
    square = float(along @ along)
    share = min(1.0, max(0.0, float((point - start) @ along) / square)) if square > 0.0 else 0.0
    return math.dist(point, start + share * along)
