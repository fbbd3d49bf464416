"""DH frames far from the arm, as between nearly parallel axes, whose common normal may be hundreds of metres away."""

from __future__ import annotations

import math
from collections.abc import Set
from dataclasses import dataclass
from decimal import Decimal
from typing import Final

import numpy as np

from dh2sim.kinematics.arm_path import NEAR, ROUNDING, ArmPath, arm_path
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.exact import (
    ZERO,
    Matrix,
    Vector,
    column,
    exact_arithmetic,
    exact_length,
    exact_link_part,
    exact_pose,
    exact_product,
    rounded_atan2,
)
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array

PARALLEL: Final = Decimal("4e-16")
"""Sine of an angle that is none: what doubles leave of a right angle."""
_BEHIND_TOOL: Final = 0.1
"""Of the reach: a last frame may be that far behind the tool."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FarFrame:
    """A DH frame that is far from the arm."""

    frame: int
    """0 … number of rows."""
    distance: float
    """From the arm's path in its link, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FarFrames:
    """The DH frames of a table that are far from the arm, and how long the arm itself is."""

    frames: tuple[FarFrame, ...]
    """Base first; empty where the table is compact."""
    length: float
    """Of the arm along its links, m, whatever its frames."""

    @property
    def sentence(self) -> str:
        """The frames, how far out they are, and how long the arm is."""
        names = " and ".join(str(far.frame) for far in self.frames)
        distances = " and ".join(f"{far.distance:.4g}" for far in self.frames)
        one = len(self.frames) == 1
        return (
            f"DH {'frame' if one else 'frames'} {names} {'is' if one else 'are'} {distances} m away from the arm, "
            f"which is {self.length:.3g} m long."
        )


def far_frames(spec: RobotSpec) -> FarFrames:
    """Return which DH frames of a table are far from the arm: those that ``compact_rows`` moves.

    Far is more than half the reach from the arm's path, or out of reach, where axes are nearly parallel; and out of
    reach where a frame can slide along parallel axes, at the ends, and of the axis of a prismatic joint.
    """
    with exact_arithmetic():
        survey = Survey(spec)
    far = [FarFrame(frame=i, distance=survey.distance(i)) for i in range(len(spec.rows) + 1) if survey.is_far(i)]
    return FarFrames(frames=tuple(far), length=survey.path.reach)


class Survey:
    """A table's links in exact arithmetic, and which of them lead far out; link 0 is the base, link n the last."""

    def __init__(self, spec: RobotSpec) -> None:
        rows = spec.rows
        chain = build_chain(spec)
        self.rows = rows
        self.n = len(rows)
        self.path: ArmPath = arm_path(chain)
        self.travel = math.fsum(
            self.path.reach if row.limits.position is None else max(abs(end) for end in row.limits.position)
            for row in rows
            if row.type is JointType.PRISMATIC
        )
        base, tool = (exact_pose(pose.xyz, pose.rpy) for pose in (spec.base.pose, spec.tool))
        parts = [base, *(tail_of(row) for row in rows)]
        heads = [*(head_of(row) for row in rows), tool]
        self.links: tuple[Matrix, ...] = tuple(exact_product(*pair) for pair in zip(parts, heads, strict=True))
        """From link i's own frame, behind Z_i, to where Z_(i+1) begins; from the last one to tool0."""
        frames = [
            base,
            *(exact_link_part(0.0, 0.0) if row.convention is Convention.MODIFIED else tail_of(row) for row in rows),
        ]
        self.frames = [_doubles(column(T, 3)) for T in frames]
        self.beside = [False, *(self._is_beside(i) for i in range(1, self.n + 1)), False]
        """Whether the axis of row i, which slides or is fixed, runs out of reach."""
        self.far: list[bool] = []
        for i in range(self.n + 1):
            self.far.append(self._leads_far(i))

    def is_far(self, i: int) -> bool:
        """Whether frame i is far out."""
        return self.far[i] or self.beside[i] or (i < self.n and self.beside[i + 1])

    def distance(self, i: int) -> float:
        """Return how far frame i is from the path, m."""
        return self.path.distance(i, self.frames[i])

    def _is_beside(self, i: int) -> bool:
        x, y, _ = self.path.own(i)
        return not self.rows[i - 1].type.turns and self._beyond(math.hypot(x, y))

    def _beyond(self, distance: float) -> bool:
        return self.path.reach > 0.0 and distance > (self.path.reach + self.travel) * (1.0 + ROUNDING)

    def _leads_far(self, i: int) -> bool:
        if self.path.reach == 0.0:
            return False
        if i == 0:
            ends = (self.frames[0], _doubles(column(self.links[0], 3)))
            return any(self._beyond(self.path.distance(0, end)) for end in ends)
        if i == self.n and not self.rows[-1].type.turns:
            return self._beyond(self.distance(i))
        if i == self.n:
            behind = self.path.way_to(i, self.frames[i]) - _BEHIND_TOOL * self.path.reach
            return self.distance(i) > NEAR * self.path.reach or self._beyond(behind)
        if self._sine(i) <= PARALLEL:  # then only the height at which x starts can be changed
            return self._beyond(self.path.way_along_axis(i, 0.0))
        # where the row before leads far out too, this one will begin beside the arm
        start = self.path.heights[i - 1][0] if i > 1 and self.far[i - 1] else -self.rows[i - 1].d
        return self._is_nearly_parallel(i) and self.leads_away(i, 0.0, start)

    def leads_away(self, i: int, foot: float, start: float) -> bool:
        """Whether row i, counted from 1, is to be Hayati's; see ``ArmPath.leads_away``."""
        slides = self.rows[i - 1].type is JointType.PRISMATIC  # then the row can begin elsewhere
        return self.path.is_far_along_axis(i, foot) if slides else self.path.leads_away(i, foot, start)

    def _sine(self, i: int) -> Decimal:
        z = column(self.links[i], 2)
        return exact_length((z[0], z[1], ZERO))

    def _is_nearly_parallel(self, i: int) -> bool:
        """Whether a Hayati row would end nearer than one along the common normal: the axes are within 45 degrees."""
        return PARALLEL < self._sine(i) < abs(self.links[i][2][2])

    def angle(self, i: int) -> float:
        """Return the acute angle between the axes at the ends of a link, rad."""
        return rounded_atan2(self._sine(i), abs(self.links[i][2][2]))

    def nearly_parallel_up_to_far(self) -> Set[int]:
        """Return links between nearly parallel axes that lead far out, or lead up to one that does."""
        far = [i for i in range(1, self.n) if self.far[i]]
        return {k for i in far for k in (i - 1, i) if k > 0 and self._is_nearly_parallel(k)}


def head_of(row: Row) -> Matrix:
    """What a row has before its Z."""
    return exact_link_part(row.a, row.alpha) if row.convention is Convention.MODIFIED else exact_link_part(0.0, 0.0)


def tail_of(row: Row) -> Matrix:
    """What a row has behind its Z."""
    modified = row.convention is Convention.MODIFIED
    return exact_link_part(0.0, 0.0) if modified else exact_link_part(row.a, row.alpha, row.beta)


def _doubles(point: Vector) -> Array:
    return np.array([float(value) for value in point])
