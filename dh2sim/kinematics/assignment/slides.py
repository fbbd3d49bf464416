"""Where the axis of a sliding joint is put: only its direction matters to the motion."""

from __future__ import annotations

import numpy as np

from dh2sim.kinematics.assignment.findings import SlideRule
from dh2sim.kinematics.assignment.lines import Line, distance_of_parallels, length, sine_between, transversal
from dh2sim.kinematics.assignment.tolerances import LEAST_VOLUME, LOOSE, Tolerances
from dh2sim.kinematics.serial import SerialChain
from dh2sim.typing import Array


def place_slide(
    chain: SerialChain, index: int, previous: Line | None, origin: Array, tolerances: Tolerances
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
        tolerances: What counts as parallel and as near.

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
        if meeting is not None and length(meeting - origin) <= tolerances.far:
            return _through(meeting, given), SlideRule.MEETS_BOTH
    return _through(origin, given), SlideRule.PREVIOUS_ORIGIN


def next_axis(chain: SerialChain, index: int, T: Array) -> Line | None:
    """Return the axis of the joint behind joint ``index``, if its place is not free.

    Args:
        chain: The chain.
        index: Of the joint, from 0.
        T: Pose of that joint's link in the frame that the axis is wanted in, shape (4, 4).
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


def same_line(first: Line, second: Line, tolerances: Tolerances) -> bool:
    """Whether two parallel lines are one."""
    return distance_of_parallels(first, second) <= tolerances.length


def _through(point: Array, line: Line) -> Line:
    return Line(point=np.asarray(point), direction=line.direction)
