"""The first and the last frame, of which the axes leave much open."""

from __future__ import annotations

import math

import numpy as np

from dh2sim.kinematics.assignment.findings import BaseRule, JointPart, LinkPart, TipRule
from dh2sim.kinematics.assignment.lines import Line, across, common_normal, frame, length, sine_between
from dh2sim.kinematics.assignment.tolerances import LOOSE, Tolerances
from dh2sim.typing import Array

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
    """Choose the last joint's part and the link part behind it so that as little as possible is left to the tool.

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
