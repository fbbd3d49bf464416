"""The link part: from one axis to the next, in all cases."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from dh2sim.kinematics.assignment.findings import FootRule, LinkPart, SenseRule
from dh2sim.kinematics.assignment.lines import (
    Case,
    Line,
    across,
    angle_about,
    common_normal,
    distance_of_parallels,
    frame,
    length,
    sine_between,
)
from dh2sim.kinematics.assignment.tolerances import LOOSE, Tolerances
from dh2sim.typing import Array

_ABOUT_SQUARE = 0.02
"""Cosine of a theta 1 degree off a quarter turn: nearer than that, rounding decides which of two is the smaller."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Passage:
    """How a link leads from its own axis to the next."""

    case: Case
    T_link_before: Array = field(repr=False)
    """Frame on the link's own axis, x along the common normal, shape (4, 4)."""
    part: LinkPart
    foot_rule: FootRule
    sense_rule: SenseRule
    distance: float
    """Between the axes, m."""
    normal_at: float | None = None
    """How far the common normal of nearly parallel axes is from the joint, m."""


def lead(T: Array, own: Line, following: Line, *, height: float | None, tolerances: Tolerances) -> Passage:
    """Choose the frame on a link's own axis, and the link part from there to the next axis.

    Args:
        T: The frame that the previous row ends with, on the own axis, in the link's frame, shape (4, 4).
        own: The joint's axis in the link's frame.
        following: The next joint's axis in the link's frame.
        height: Where x may begin if the axes leave it free, m along the own axis from the frame ``T``; None: at its
            origin.
        tolerances: What counts as parallel and as far.
    """
    if sine_between(own, following) <= tolerances.angle:
        return _parallel(T, own, following, height, tolerances)
    if sine_between(own, following) > LOOSE:
        normal = common_normal(own, following)
        far = max(length(normal.foot - T[:3, 3]), length(normal.next_foot - following.point))
        if far <= tolerances.far and length(normal.next_foot - normal.foot) <= tolerances.far:
            return _at_common_normal(T, own, following, tolerances)
        return _nearly_parallel(T, own, following, far, tolerances)
    return _nearly_parallel(T, own, following, None, tolerances)


def _parallel(T: Array, own: Line, following: Line, height: float | None, tolerances: Tolerances) -> Passage:
    """Parallel, antiparallel or coincident: the foot is free, and of coincident axes x too."""
    alpha = 0.0 if float(own.direction @ following.direction) > 0.0 else math.pi
    foot = T[:3, 3] + (height or 0.0) * own.direction
    foot_rule = FootRule.SAME_ORIGIN if height is None else FootRule.NEXT_JOINT
    apart = distance_of_parallels(own, following)
    if apart <= tolerances.length:
        x, case, sense_rule, a = across(T[:3, 0], own.direction), Case.COINCIDENT, SenseRule.FREE, 0.0
    else:
        gap = following.foot_of(foot) - foot
        x, sense_rule = _sense(T[:3, 0], across(gap, own.direction), own.direction, apart, tolerances)
        a, case = float(gap @ x), Case.PARALLEL
    return Passage(
        case=case,
        T_link_before=frame(foot, x, own.direction),
        part=LinkPart(a=a, alpha=alpha),
        foot_rule=foot_rule,
        sense_rule=sense_rule,
        distance=apart,
    )


def _at_common_normal(T: Array, own: Line, following: Line, tolerances: Tolerances) -> Passage:
    """Intersecting or skew: x lies along the common normal."""
    normal = common_normal(own, following)
    gap = normal.next_foot - normal.foot
    apart = float(gap @ normal.direction)
    forwards = normal.direction if apart >= 0.0 else -normal.direction
    x, sense_rule = _sense(T[:3, 0], forwards, own.direction, abs(apart), tolerances)
    return Passage(
        case=Case.INTERSECTING if abs(apart) <= tolerances.near else Case.SKEW,
        T_link_before=frame(normal.foot, x, own.direction),
        part=LinkPart(a=float(gap @ x), alpha=angle_about(x, own.direction, following.direction)),
        foot_rule=FootRule.COMMON_NORMAL,
        sense_rule=sense_rule,
        distance=abs(apart),
    )


def _nearly_parallel(T: Array, own: Line, following: Line, far: float | None, tolerances: Tolerances) -> Passage:
    """Hayati: x leads to where the next axis crosses the plane through the origin, and two twists turn z onto it.

    S. Hayati, M. Mirmirani, Improving the absolute positioning accuracy of robot manipulators, J. Robotic Systems
    2(4), 1985. With z_2 = Rx(alpha) Ry(beta) z = (sin beta, -sin alpha cos beta, cos alpha cos beta) in the frame
    before.
    """
    z = own.direction
    foot = T[:3, 3]
    along = float((foot - following.point) @ z) / float(following.direction @ z)
    gap = following.point + along * following.direction - foot
    apart = length(gap)
    if apart <= tolerances.length:
        x, sense_rule, a = across(T[:3, 0], z), SenseRule.FREE, 0.0
    else:
        x, sense_rule = _sense(T[:3, 0], across(gap, z), z, apart, tolerances)
        a = float(gap @ x)
    before = frame(foot, x, z)
    s_beta, minus_y, cosine = (float(component) for component in before[:3, :3].T @ following.direction)
    return Passage(
        case=Case.NEARLY_PARALLEL,
        T_link_before=before,
        part=LinkPart(
            a=a,
            alpha=math.atan2(-minus_y, cosine),
            beta=math.atan2(s_beta, math.hypot(minus_y, cosine)),
            hayati=True,
        ),
        foot_rule=FootRule.SAME_ORIGIN,
        sense_rule=sense_rule,
        distance=apart,
        normal_at=far,
    )


def _sense(
    x_before: Array, forwards: Array, z: Array, apart: float, tolerances: Tolerances
) -> tuple[Array, SenseRule]:
    """Choose between ``forwards``, towards the next axis, and its opposite."""
    cosine = float(x_before @ forwards)
    if abs(cosine) > _ABOUT_SQUARE:
        return (forwards if cosine > 0.0 else -forwards), SenseRule.LEAST_THETA
    if apart > tolerances.near:
        return forwards, SenseRule.TOWARDS_NEXT
    quarter = float(np.cross(x_before, forwards) @ z) > 0.0
    return (forwards if quarter else -forwards), SenseRule.QUARTER_TURN
