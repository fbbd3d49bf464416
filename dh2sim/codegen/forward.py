"""Pose and geometric Jacobian of tool0 with few operations: from the tool inwards, parallel axes at once.

Joints with parallel axes are a group. In the frame in front of a group, which none of its joints moves, all its links
are turned about one z, by sums of joint angles; a vector is rotated once a group, by two elementary rotations.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from dh2sim.codegen.mechanism import (
    AXES,
    HALF_TURN,
    NO_TURN,
    Frame,
    Mechanism,
    MovingJoint,
    Turn,
    Vector,
    about_x,
    about_z,
    added,
    turned_about_x,
    turned_about_z,
)
from dh2sim.kinematics.trace import Number, Token, Trace, cosine, count_operations, sine
from dh2sim.kinematics.trig import sin_cos

_HALF_PI: Final = math.pi / 2


def cross(a: Sequence[Number], b: Sequence[Number]) -> Vector:
    """Return the cross product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Member:
    """A joint of a group, seen in the frame in front of the group."""

    joint: MovingJoint
    axis: float
    """+1, or -1 where its z points against the group's."""
    turn: Turn
    """About the group's z: the orientation of its link, before a half turn about x where ``axis`` is -1."""
    slide: Number
    """Along the group's z."""


_Group = list[_Member]


def _turn(trace: Trace, angle: Number, constant: float, name: str) -> Turn:
    """Return the turn by ``angle`` (a token, or 0) plus a constant, rad; quarter turns cost nothing."""
    if not isinstance(angle, Token):
        sine_, cosine_ = sin_cos(constant)
        return Turn(trace.constant(f"cos_{name}", cosine_), trace.constant(f"sin_{name}", sine_))
    quarters = round(constant / _HALF_PI)
    if sin_cos(constant - quarters * _HALF_PI) != (0.0, 1.0):
        quarters = 0
        angle += trace.constant(name, constant, "rad")
        assert isinstance(angle, Token)
    c, s = cosine(angle), sine(angle)
    return (Turn(c, s), Turn(-s, c), Turn(-c, -s), Turn(s, -c))[quarters % 4]


def joint_turns(mechanism: Mechanism, q: Sequence[Token], trace: Trace) -> list[Turn]:
    """Return the turn of each joint's frame about its own z; constant where it slides.

    Args:
        mechanism: The robot.
        q: Joint coordinates, rad or m.
        trace: Takes the operations.
    """
    return [
        _turn(trace, coordinate * joint.sign if joint.turns else 0.0, joint.angle, f"theta{joint.row}")
        for joint, coordinate in zip(mechanism.joints, q, strict=True)
    ]


def _groups(mechanism: Mechanism, q: Sequence[Token], trace: Trace) -> list[_Group]:
    """Return the joints by groups of parallel axes."""
    groups: list[_Group] = []
    axis, constant = 1.0, 0.0
    angle: Number = 0.0
    for joint, coordinate in zip(mechanism.joints, q, strict=True):
        if not groups or joint.twist not in (NO_TURN, HALF_TURN):
            groups.append([])
            axis, angle, constant = 1.0, 0.0, 0.0
        elif joint.twist == HALF_TURN:
            axis = -axis
        moved = coordinate * (axis * joint.sign)
        constant += axis * joint.angle
        if joint.turns:
            angle = angle + moved
        groups[-1].append(
            _Member(
                joint=joint,
                axis=axis,
                turn=_turn(trace, angle, constant, f"theta{joint.row}"),
                slide=0.0 if joint.turns else moved,
            )
        )
    return groups


def _flipped(axis: float, v: Vector) -> Vector:
    """Turn a vector by half a turn about x where ``axis`` is -1."""
    return v[0], axis * v[1], axis * v[2]


def _levers(group: _Group, tip: Vector) -> list[Vector]:
    """Return the tip as seen from each joint of a group, in the frame in front of it; z is from the group's origin.

    Args:
        group: The group.
        tip: In the frame of its last joint.
    """
    last = group[-1]
    x, y, z = about_z(last.turn, _flipped(last.axis, tip))
    for member in group:
        z = z + member.slide
    levers: list[Vector] = [(x, y, z)]
    for member, following in zip(group[-2::-1], group[:0:-1], strict=True):
        levers.insert(0, added(levers[0], about_z(member.turn, _flipped(member.axis, following.joint.offset))))
    return levers


def _to_the_group_before(mechanism: Mechanism, group: _Group, lever: Vector) -> Vector:
    """Return a point given in front of a group in the frame of the joint before it, or in base_link."""
    first = group[0].joint
    point = about_x(first.twist, lever)
    return added(first.offset, about_z(mechanism.base, point) if first is mechanism.joints[0] else point)


def tool_pose(mechanism: Mechanism, q: Sequence[Token], trace: Trace) -> list[list[Number]]:
    """Return the pose of tool0 in base_link.

    One axis of tool0 may come from the other two, by a cross product: of the four ways the one with the fewest
    operations is taken.

    Args:
        mechanism: The robot.
        q: Joint coordinates, rad or m.
        trace: Takes the operations.

    Returns:
        4 rows of 4.
    """
    groups = _groups(mechanism, q, trace)
    point = mechanism.tool_offset
    for group in reversed(groups):
        point = _to_the_group_before(mechanism, group, _levers(group, point)[0])
    if not groups:
        point = mechanism.tool_offset
    axes = [_in_base(mechanism, groups, axis) for axis in AXES]
    ways = [axes, *([*axes[:i], cross(axes[i - 2], axes[i - 1]), *axes[i + 1 :]] for i in range(3))]
    costs = [count_operations(trace, [*way[0], *way[1], *way[2], *point]).arithmetic for way in ways]
    x, y, z = ways[costs.index(min(costs))]
    return [[x[i], y[i], z[i], point[i]] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]]


def _in_base(mechanism: Mechanism, groups: Sequence[_Group], v: Vector) -> Vector:
    """Return a vector along the axes of tool0 along those of base_link."""
    v = about_x(mechanism.tool_twist, about_z(mechanism.tool_angle, v))
    for group in reversed(groups):
        v = about_z(group[-1].turn, _flipped(group[-1].axis, v))
        v = about_x(group[0].joint.twist, v)
    return about_z(mechanism.base, v)


def tool_jacobian(mechanism: Mechanism, q: Sequence[Token], trace: Trace) -> list[list[Number]]:
    """Return the geometric Jacobian of tool0 in base_link.

    Args:
        mechanism: The robot.
        q: Joint coordinates, rad or m.
        trace: Takes the operations.

    Returns:
        6 rows of n: 3 linear, 3 angular.
    """
    groups = _groups(mechanism, q, trace)
    tips: list[Vector] = []
    point = mechanism.tool_offset
    for group in reversed(groups):
        tips.insert(0, point)
        point = _to_the_group_before(mechanism, group, _levers(group, point)[0])
    columns: list[list[Number]] = []
    frame: Frame = turned_about_z(AXES, mechanism.base)
    for group, tip in zip(groups, tips, strict=True):
        frame = turned_about_x(frame, group[0].joint.twist)
        X, Y, Z = frame
        for member, (x, y, _) in zip(group, _levers(group, tip), strict=True):
            sense = member.axis * member.joint.sign
            axis = [sense * value for value in Z]
            if member.joint.turns:
                columns.append([*(sense * (x * b - y * a) for a, b in zip(X, Y, strict=True)), *axis])
            else:
                columns.append([*axis, 0.0, 0.0, 0.0])
        last = group[-1]
        frame = turned_about_z(frame, last.turn)
        if last.axis < 0:
            frame = turned_about_x(frame, HALF_TURN)
    return [[column[i] for column in columns] for i in range(6)]
