"""The table as joints about z, each an offset and a twist from the one before, with constants that have names.

Between two joints a table may have rows of any convention, fixed rows and second twists. Whatever they are, the
constant motion between them is T(p) Rz(gamma) Rx(alpha) Rz(theta): gamma and theta turn about the axes of the joints
themselves and are added to their angles, so that one twist remains. What slides along an axis commutes with the
joint: it is moved on to the next offset, past all axes that are parallel. Rows as in textbooks keep their numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple, TypeAlias, cast

from dh2sim.kinematics.trace import Number, Trace
from dh2sim.kinematics.trig import atan2, sin_cos
from dh2sim.robot.links import Pose
from dh2sim.robot.row import Convention, Row
from dh2sim.robot.spec import RobotSpec

Vector: TypeAlias = tuple[Number, Number, Number]
ORIGIN: Final[Vector] = (0.0, 0.0, 0.0)
_NO_TILT = 4e-16
"""Sine of a twist, at and below which nothing but rounding is left of it."""


class Turn(NamedTuple):
    """A rotation about an axis."""

    cosine: Number
    sine: Number

    @property
    def inverse(self) -> Turn:
        """The opposite rotation."""
        return Turn(self.cosine, -self.sine)


NO_TURN: Final = Turn(1.0, 0.0)
HALF_TURN: Final = Turn(-1.0, 0.0)


def about_x(turn: Turn, v: Sequence[Number]) -> Vector:
    """Rotate a vector: Rx v."""
    (c, s), (x, y, z) = turn, v
    return x, c * y - s * z, s * y + c * z


def about_z(turn: Turn, v: Sequence[Number]) -> Vector:
    """Rotate a vector: Rz v."""
    (c, s), (x, y, z) = turn, v
    return c * x - s * y, s * x + c * y, z


Frame: TypeAlias = tuple[Vector, Vector, Vector]
"""Axes x, y and z: the columns of a rotation matrix."""
AXES: Final[Frame] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def turned_about_x(frame: Frame, turn: Turn) -> Frame:
    """Return a frame turned about its own x."""
    X, Y, Z = frame
    return X, *_turned_pair(Y, Z, turn)


def turned_about_y(frame: Frame, turn: Turn) -> Frame:
    """Return a frame turned about its own y."""
    X, Y, Z = frame
    z, x = _turned_pair(Z, X, turn)
    return x, Y, z


def turned_about_z(frame: Frame, turn: Turn) -> Frame:
    """Return a frame turned about its own z."""
    X, Y, Z = frame
    return *_turned_pair(X, Y, turn), Z


def _turned_pair(a: Vector, b: Vector, turn: Turn) -> tuple[Vector, Vector]:
    c, s = turn
    first = (c * a[0] + s * b[0], c * a[1] + s * b[1], c * a[2] + s * b[2])
    second = (c * b[0] - s * a[0], c * b[1] - s * a[1], c * b[2] - s * a[2])
    return first, second


def in_frame_before(frame: Frame, v: Sequence[Number]) -> Vector:
    """Return a vector along a frame's axes along those that the axes are given in."""
    x, y, z = ((a * v[0] + b * v[1] + c * v[2]) for a, b, c in zip(*frame, strict=True))
    return x, y, z


def added(v: Sequence[Number], w: Sequence[Number]) -> Vector:
    """Return the sum of two vectors."""
    return v[0] + w[0], v[1] + w[1], v[2] + w[2]


@dataclass(frozen=True, slots=True, kw_only=True)
class MovingJoint:
    """A joint; its frame in that of the joint before is T(offset) Rx(twist) Rz(angle), then Tz if it slides."""

    row: int
    """Number of its row in the table, from 1."""
    turns: bool
    sign: float
    """-1 where the coordinate subtracts."""
    offset: Vector
    twist: Turn
    angle: float
    """rad; the coordinate of one that turns adds to it."""
    chain_angle: float
    """rad, about z, from the joint frame of the kinematic chain to this one."""
    chain_offset: float
    """m, along z, from this frame to the joint frame of the kinematic chain."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mechanism:
    """What a table makes of base_link, the joints that move, and tool0."""

    base: Turn
    """About z of base_link, between the first joint's offset and its twist."""
    joints: tuple[MovingJoint, ...]
    tool_offset: Vector
    """tool0 is T(tool_offset) Rx(tool_twist) Rz(tool_angle) in the frame of the last joint."""
    tool_twist: Turn
    tool_angle: Turn


Lengths: TypeAlias = Callable[[int | str, str, float, str], Number]
"""Returns a constant for the length of a part (the number of a row, ``base``, ``tool``) and an axis (``a``, ``x``).

Then follow its value, m, and the name that it has if it has no other.
"""


def build_mechanism(spec: RobotSpec, trace: Trace, length: Lengths) -> Mechanism:
    """Turn a table into a mechanism whose numbers are constants of a trace.

    Args:
        spec: The robot; rows of all conventions may be mixed.
        trace: Takes the constants.
        length: Makes the constants for lengths.
    """
    constants = _Constants(trace)
    moving: list[tuple[int, Row]] = []
    segments: list[_Segment] = []
    steps = _pose_steps("base", spec.base.pose, length)
    for number, row in enumerate(spec.rows, start=1):
        before, after = _row_steps(number, row, length)
        steps += before
        if row.type.moves:
            moving.append((number, row))
            segments.append(_reduced(steps, constants, str(number), first=not segments))
            steps = []
        steps += after
    steps += _pose_steps("tool", spec.tool.pose, length)
    last = _reduced(steps, constants, "_tool", first=not segments, last=True)

    joints: list[MovingJoint] = []
    carried: Number = 0.0
    for (number, row), segment, following in zip(moving, segments, [*segments, last][1:], strict=True):
        x, y, z = segment.offset
        if segment.twist in (NO_TURN, HALF_TURN):  # parallel axes: on along them
            z, carried = 0.0, segment.twist.cosine * (z + carried) + segment.lift
        else:
            z, carried = z + carried, segment.lift
        joints.append(
            MovingJoint(
                row=number,
                turns=row.type.turns,
                sign=-1.0 if row.flip else 1.0,
                offset=(x, y, z),
                twist=segment.twist,
                angle=segment.theta + following.gamma,
                chain_angle=following.gamma,
                chain_offset=trace.value(carried) + row.d,
            )
        )
    return Mechanism(
        base=constants.turn((segments[0] if segments else last).gamma, "base"),
        joints=tuple(joints),
        tool_offset=added(last.offset, (0.0, 0.0, carried)),
        tool_twist=last.twist,
        tool_angle=constants.turn(last.theta, "tool"),
    )


def origin_moved(mechanism: Mechanism, i: int, trace: Trace) -> Mechanism | None:
    """Return the same mechanism with the frame of joint i elsewhere on its axis: where the next offset begins.

    A length along the axis of joint i may be in front of the joint or behind it. None where there is none, or where
    it would make two lengths of it.
    """
    joint, following = mechanism.joints[i : i + 2]
    x, y, along = following.offset
    if trace.value(along) == 0.0 or (joint.twist.cosine != 0.0 and joint.twist.sine != 0.0):
        return None
    moved = replace(
        joint,
        offset=added(joint.offset, about_x(joint.twist, (0.0, 0.0, along))),
        chain_offset=joint.chain_offset - trace.value(along),
    )
    rest = (moved, replace(following, offset=(x, y, 0.0)))
    return replace(mechanism, joints=(*mechanism.joints[:i], *rest, *mechanism.joints[i + 2 :]))


class _Step(NamedTuple):
    """An elementary motion."""

    axis: str
    """x, y or z: a rotation about it; t: a translation."""
    angle: float = 0.0
    """rad."""
    name: str = ""
    """Of the angle."""
    offset: Vector = ORIGIN


class _Segment(NamedTuple):
    """The constant motion between two joints: T(offset) Rz(gamma) Rx(twist) Rz(theta) Tz(lift).

    Where there is a joint before it, gamma belongs to that joint's angle, and the offset is in the turned frame.
    """

    offset: Vector
    gamma: float
    twist: Turn
    theta: float
    lift: Number


class _Constants:
    """Makes sines and cosines of constant angles; equal ones are one constant."""

    def __init__(self, trace: Trace) -> None:
        self._trace = trace
        self._known: dict[float, Number] = {}
        self._turns: dict[float, Turn] = {}

    def turn(self, angle: float, name: str) -> Turn:
        """Return a constant rotation by an angle, rad."""
        if angle not in self._turns:
            s, c = sin_cos(angle)
            note = f"of {angle!r} rad"
            self._turns[angle] = Turn(self._shared(c, f"cos_{name}", note), self._shared(s, f"sin_{name}", note))
        return self._turns[angle]

    def _shared(self, value: float, name: str, note: str) -> Number:
        size = abs(value)
        if size not in self._known:
            self._known[size] = self._trace.constant(name, size, note)
        return self._known[size] if value >= 0 else -self._known[size]


def _pose_steps(name: str, pose: Pose, length: Lengths) -> list[_Step]:
    """Return T(xyz) Rz(yaw) Ry(pitch) Rx(roll)."""
    values = zip("xyz", pose.xyz.tolist(), strict=True)
    x, y, z = (length(name, axis, value, f"{name}_{axis}") for axis, value in values)
    roll, pitch, yaw = (float(angle) for angle in pose.rpy)
    return [
        _Step("t", offset=(x, y, z)),
        _Step("z", yaw, f"{name}_yaw"),
        _Step("y", pitch, f"{name}_pitch"),
        _Step("x", roll, f"{name}_roll"),
    ]


def _row_steps(number: int, row: Row, length: Lengths) -> tuple[list[_Step], list[_Step]]:
    """Return what comes before the joint of a row and what comes after it; names have the textbooks' indices."""
    link_number = number - 1 if row.convention is Convention.MODIFIED else number
    link = [
        _Step("t", offset=(length(number, "a", row.a, f"a{link_number}"), 0.0, 0.0)),
        _Step("x", row.alpha, f"alpha{link_number}"),
    ]
    turn = _Step("z", row.theta, f"theta{number}")
    slide = _Step("t", offset=(0.0, 0.0, length(number, "d", row.d, f"d{number}")))
    match row.convention:
        case Convention.STANDARD:
            return [turn], [slide, *link]
        case Convention.MODIFIED:
            return [*link, turn], [slide]
        case Convention.HAYATI:
            return [turn], [slide, *link, _Step("y", row.beta, f"beta{number}")]


_TURNED: Final = {"x": turned_about_x, "y": turned_about_y, "z": turned_about_z}


def _reduced(
    steps: Iterable[_Step], constants: _Constants, name: str, *, first: bool = False, last: bool = False
) -> _Segment:
    """Return the constant motion that elementary motions make.

    Args:
        steps: The motions.
        constants: Makes the constants.
        name: Of the twist, where the table has none for it.
        first: Whether no joint comes before, to whose angle gamma could be added.
        last: Whether no joint comes after, past which the lift could be moved.
    """
    offset: Vector = ORIGIN
    lift: Number = 0.0
    rotations: list[_Step] = []
    frame = AXES
    for step in steps:
        if step.axis == "t":
            x, y, z = step.offset
            offset, lift = added(offset, in_frame_before(frame, (x, y, 0.0))), lift + z
        elif not _is_nothing(step.angle):
            if step.axis != "z":
                offset, lift = added(offset, in_frame_before(frame, (0.0, 0.0, lift))), 0.0
            frame = _TURNED[step.axis](frame, constants.turn(step.angle, step.name))
            if rotations and rotations[-1].axis == step.axis:
                step = step._replace(angle=rotations.pop().angle + step.angle)
            if not _is_nothing(step.angle):
                rotations.append(step)
    if last:
        offset, lift = added(offset, in_frame_before(frame, (0.0, 0.0, lift))), 0.0
    gamma, alpha, theta = _zxz_angles(rotations)
    if not first:
        offset = about_z(constants.turn(-gamma, f"gamma{name}"), offset)
    twists = [step.name for step in rotations if step.axis == "x"]
    return _Segment(
        offset, gamma, constants.turn(alpha, twists[0] if len(twists) == 1 else f"twist{name}"), theta, lift
    )


def _is_nothing(angle: float) -> bool:
    return sin_cos(angle) == (0.0, 1.0)


def _zxz_angles(rotations: Sequence[_Step]) -> tuple[float, float, float]:
    """Return gamma, alpha and theta, rad: the product of the rotations is Rz(gamma) Rx(alpha) Rz(theta)."""
    axes = "".join(step.axis for step in rotations)
    if axes in ("", "x", "z", "xz", "zx", "zxz"):  # as they are, without rounding
        angles = [step.angle for step in rotations]
        gamma = angles.pop(0) if axes.startswith("zx") else 0.0
        theta = angles.pop() if axes.endswith("z") else 0.0
        return gamma, sum(angles), theta
    frame = AXES
    for step in rotations:
        s, c = sin_cos(step.angle)
        frame = _TURNED[step.axis](frame, Turn(c, s))
    (r11, r21, _), (r12, r22, _), (r13, r23, r33) = cast("tuple[tuple[float, float, float], ...]", frame)
    if math.sqrt(r13 * r13 + r23 * r23) <= _NO_TILT:
        return 0.0, 0.0 if r33 > 0 else math.pi, atan2(-r12, r11)
    # near no tilt gamma is badly determined, and what remains makes up for its error
    gamma = atan2(r13, -r23)
    s, c = sin_cos(gamma)
    return gamma, atan2(s * r13 - c * r23, r33), atan2(-(c * r12 + s * r22), c * r11 + s * r21)
