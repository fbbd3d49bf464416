"""Rules of frame assignment: from one axis to the next, the first and the last frame, and axes of sliding joints.

The axes leave much of the first and the last frame open, and only the direction of a sliding joint's axis matters.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from dh2sim.kinematics.arm_path import ArmPath
from dh2sim.kinematics.frame_assignment.lines import (
    Case,
    Line,
    across,
    angle_about,
    common_normal,
    distance_of_parallels,
    frame,
    length,
    sine_between,
    transversal,
)
from dh2sim.kinematics.frame_assignment.result import (
    LEAST_VOLUME,
    LOOSE,
    BaseRule,
    FootRule,
    JointPart,
    LinkPart,
    SenseRule,
    SlideRule,
    TipRule,
    Tolerances,
)
from dh2sim.kinematics.serial_chain import SerialChain
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


def lead(
    T: Array,
    own: Line,
    following: Line,
    *,
    height: float | None,
    is_away: Callable[[Array], bool],
    tolerances: Tolerances,
) -> Passage:
    """Choose the frame on a link's own axis, and the link part from there to the next axis.

    Args:
        T: The frame that the previous row ends with, on the own axis, in the link's frame, shape (4, 4).
        own: The joint's axis in the link's frame.
        following: The next joint's axis in the link's frame.
        height: Where x may begin if the axes leave it free, m along the own axis from the frame ``T``; None: at its
            origin.
        is_away: Whether a point of the own axis is too far from the arm for x to begin there.
        tolerances: What counts as parallel.
    """
    sine, cosine = sine_between(own, following), float(own.direction @ following.direction)
    if sine <= tolerances.angle:
        return _parallel(T, own, following, height, tolerances)
    if sine >= abs(cosine):
        return _at_common_normal(T, own, following, tolerances)
    normal = common_normal(own, following)
    noise = sine <= LOOSE and length(normal.next_foot - normal.foot) <= tolerances.near
    if not (noise or is_away(normal.foot)):
        return _at_common_normal(T, own, following, tolerances)
    far = max(length(normal.foot - T[:3, 3]), length(normal.next_foot - following.point))
    return _nearly_parallel(T, own, following, None if sine <= LOOSE else far, tolerances)


def is_nearly_parallel(angle: float, case: Case) -> bool:
    """Whether a Hayati row between two axes, ``angle`` rad apart, is the better one if the common normal is far away.

    Within 45 degrees the plane across the first axis meets the second nearer than the common normal does.
    """
    return case not in (Case.PARALLEL, Case.COINCIDENT) and abs(math.cos(angle)) > math.sin(angle)


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


def place_slide(
    chain: SerialChain, index: int, previous: Line | None, origin: Array, path: ArmPath
) -> tuple[Line, SlideRule]:
    """Choose the axis of a sliding joint so that as many numbers as possible are zero.

    In this order: on the next axis, where that is parallel; for the last joint, through the tip; on the previous
    axis, where that is parallel; where it meets both neighbours, for then both link lengths are zero; else through
    the previous frame's origin (the base's, for the first joint).

    Args:
        chain: The chain.
        index: Of the joint, from 0.
        previous: The axis before, in the parent link's frame; None for the first joint.
        origin: The previous frame's origin on it (the base's origin), m, shape (3,).
        path: Where the arm runs.

    Returns:
        The axis at coordinate zero in the parent link's frame, and the rule that placed it.
    """
    joint = chain.joints[index]
    T = joint.T_parent_link
    given = Line(point=joint.point, direction=joint.axis).moved(T)
    if index == chain.n - 1:
        return _through((T @ chain.T_link_tip)[:3, 3], given), SlideRule.TIP
    following = next_axis(chain, index, T)
    if following is not None and sine_between(given, following) <= LOOSE:
        return _through(following.foot_of(given.point), given), SlideRule.NEXT_AXIS
    if previous is None:
        return _through(origin, given), SlideRule.BASE_ORIGIN
    if sine_between(previous, given) <= LOOSE:
        return _through(origin, given), SlideRule.PREVIOUS_AXIS
    if following is not None:
        meeting = transversal(previous, following, given.direction, LEAST_VOLUME)
        before = chain.joints[index - 1]
        if meeting is not None and not path.is_far_along_axis(index, float((meeting - before.point) @ before.axis)):
            return _through(meeting, given), SlideRule.MEETS_BOTH
    return _through(origin, given), SlideRule.PREVIOUS_ORIGIN


def next_axis(chain: SerialChain, index: int, T: Array) -> Line | None:
    """Return the axis of the joint behind joint ``index``, if its place is not free.

    Args:
        chain: The chain.
        index: Of the joint, from 0.
        T: Pose of that joint's link in the frame that the axis is expressed in, shape (4, 4).
    """
    if index + 1 >= chain.n:
        return None
    joint = chain.joints[index + 1]
    pose = T @ joint.T_parent_link
    if joint.type.turns:
        return Line(point=joint.point, direction=joint.axis).moved(pose)
    if index + 1 == chain.n - 1:  # the last joint slides through the tip
        return Line(point=(chain.T_link_tip)[:3, 3], direction=joint.axis).moved(pose)
    return None


def _through(point: Array, line: Line) -> Line:
    return Line(point=np.asarray(point), direction=line.direction)


X, Y, Z = np.eye(3)


def first_frame(
    first: Line, second: Line | None, tolerances: Tolerances, *, first_link: bool
) -> tuple[Array, LinkPart, BaseRule]:
    """Choose frame 0, and the link part from there to the first axis.

    Args:
        first: The first joint's axis in the base.
        second: The second joint's axis at coordinate zero in the base, if there is one.
        tolerances: What counts as zero.
        first_link: Whether the table can say X_0 = Tx(a_0) Rx(alpha_0), as one of modified rows can.

    Returns:
        Pose of frame 0 in the base, shape (4, 4), X_0, and the rule.
    """
    z = first.direction
    origin = first.foot_of(np.zeros(3))
    upright = sine_between(first, Line(point=np.zeros(3), direction=Z)) <= LOOSE and float(z @ Z) > 0.0
    if first_link and not (upright and length(origin) <= tolerances.near):
        part = _from_base(first, tolerances)
        if part is not None:
            return np.eye(4), part, BaseRule.FIRST_LINK
    if abs(float(z @ X)) > 1.0 - LOOSE:
        return frame(origin, across(Y, z), z), LinkPart(), BaseRule.BASE_Y
    square = max(abs(float(z @ Y)), abs(float(z @ Z))) > 1.0 - LOOSE
    normal = None if square else _normal(first, second)
    if normal is None:
        return frame(origin, across(X, z), z), LinkPart(), BaseRule.BASE_X
    along = float(normal @ X)
    forwards = along > 0.0 if abs(along) > LOOSE else float(normal @ Y) > 0.0
    return frame(origin, across(normal if forwards else -normal, z), z), LinkPart(), BaseRule.FIRST_NORMAL


def _from_base(first: Line, tolerances: Tolerances) -> LinkPart | None:
    """Tx(a) Rx(alpha) from the base to an axis that meets the base's x axis at a right angle, or None."""
    z = first.direction
    if abs(float(z @ X)) > tolerances.angle:
        return None
    meeting = float(first.point[0])  # the axis runs in a plane of constant x
    beside = first.foot_of(np.array([meeting, 0.0, 0.0])) - np.array([meeting, 0.0, 0.0])
    if length(beside) > tolerances.length:
        return None
    return LinkPart(a=meeting, alpha=math.atan2(-float(z[1]), float(z[2])))


def _normal(first: Line, second: Line | None) -> Array | None:
    if second is None:
        return None
    if sine_between(first, second) > LOOSE:
        return common_normal(first, second).direction
    gap = second.point - first.foot_of(second.point)
    return gap / length(gap) if length(gap) > LOOSE else None


def last_parts(T_frame_tip: Array, tolerances: Tolerances, *, last_link: bool) -> tuple[JointPart, LinkPart, TipRule]:
    """Choose the last joint's part and the link part after it so that as little as possible is left to the tool.

    Args:
        T_frame_tip: Pose of the tip in the frame that the row before ends with, shape (4, 4).
        tolerances: What counts as zero.
        last_link: Whether the table can say X_n, as one of standard rows can.

    Returns:
        Z_n at coordinate zero, X_n, and the rule.
    """
    R, p = T_frame_tip[:3, :3], T_frame_tip[:3, 3]
    height = float(p[2])
    beside = math.hypot(float(p[0]), float(p[1]))
    turned_flat = abs(float(R[2, 0])) <= LOOSE  # the tip's x is perpendicular to the axis
    theta = math.atan2(float(R[1, 0]), float(R[0, 0]))
    if last_link and turned_flat:
        c, s = math.cos(theta), math.sin(theta)
        if abs(float(p[1]) * c - float(p[0]) * s) <= tolerances.near:
            part = LinkPart(a=float(p[0]) * c + float(p[1]) * s, alpha=math.atan2(float(R[2, 1]), float(R[2, 2])))
            return JointPart(theta=theta, d=height), part, TipRule.TIP
    if turned_flat and math.hypot(float(R[0, 2]), float(R[1, 2])) <= LOOSE and (last_link or float(R[2, 2]) > 0.0):
        part = LinkPart() if float(R[2, 2]) > 0.0 else LinkPart(alpha=math.pi)
        rule = TipRule.TIP if beside <= tolerances.near else TipRule.TIP_AXES
        return JointPart(theta=theta, d=height), part, rule
    if beside <= tolerances.near:
        return JointPart(theta=0.0, d=height), LinkPart(), TipRule.TIP_HEIGHT
    return JointPart(theta=0.0, d=0.0), LinkPart(), TipRule.TOOL
