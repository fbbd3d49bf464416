"""Inertial parameters of a robot's links, regrouped until few are left: the base parameters.

What does not change when a joint moves may as well belong to the link before. Of a link that turns, that is its
mass, its first moment along the axis and a moment of inertia across it, as of a thin rod along the axis; of a link
that slides, its inertia, for it turns as the link before does, and if it can turn about the slide's direction alone,
its first moment.

M. Gautier, W. Khalil, Direct calculation of minimum set of inertial parameters of serial robots, IEEE Transactions on
Robotics and Automation 6(3), 1990.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np

from dh2sim.codegen.mechanism import Mechanism, MovingJoint, Turn
from dh2sim.codegen.newton_euler import InertialParameters
from dh2sim.kinematics.trace import Number, Trace
from dh2sim.kinematics.transforms import compose, identity, joint_part, rotate_tensor
from dh2sim.kinematics.trig import sin_cos
from dh2sim.model.mass import MassProperties, in_frame, shifted_inertia
from dh2sim.model.robot_model import RobotModel

_ROUNDING: Final = 4e-15
"""Share of the greatest parameter of its kind and link, below which a parameter is rounding."""

_PARALLEL: Final = 1e-12
"""Sine of the angle between axes that are parallel but for rounding."""
_Tensor: TypeAlias = list[list[float]]


@dataclass(slots=True)
class _Link:
    """Mass, first moment and inertia about a frame's origin."""

    mass: float
    moment: list[float]
    inertia: _Tensor


def base_parameters(model: RobotModel, mechanism: Mechanism, trace: Trace) -> list[InertialParameters]:
    """Return the base parameters of the links, as constants that are named XX1, …, ZZ1, MX1, MY1, MZ1, M1.

    Args:
        model: The robot.
        mechanism: The same.
        trace: Takes the constants.

    Returns:
        For each moving joint, in its frame.
    """
    links = _links(model, mechanism)
    rotations = [_rotation(_value(trace, joint.twist), joint.angle) for joint in mechanism.joints]
    spins = _spin_axes(mechanism, rotations)
    sizes = [(0.0, 0.0)] * len(links)
    for i in reversed(range(len(links))):
        joint, link = mechanism.joints[i], links[i]
        sizes[i] = _largest([link.moment]), _largest(link.inertia)
        regrouped = _taken(joint, link, spins[i])
        if i > 0:
            _add(links[i - 1], _moved(regrouped, rotations[i], [trace.value(value) for value in joint.offset]))
    return [
        _named(trace, joint.row, link, *size)
        for joint, link, size in zip(mechanism.joints, links, sizes, strict=True)
    ]


def _value(trace: Trace, turn: Turn) -> tuple[float, float]:
    return trace.value(turn.cosine), trace.value(turn.sine)


def _spin_axes(mechanism: Mechanism, rotations: Sequence[_Tensor]) -> list[list[float] | None]:
    """Return, for each joint, the one direction in its frame that its link can turn about; None if there are more.

    The vector is zero where the link cannot turn at all.
    """
    axes: list[list[float] | None] = []
    axis: list[float] | None = [0.0, 0.0, 0.0]
    for joint, R in zip(mechanism.joints, rotations, strict=True):
        if axis is not None:
            axis = [R[0][k] * axis[0] + R[1][k] * axis[1] + R[2][k] * axis[2] for k in range(3)]
            if joint.turns:
                axis = [0.0, 0.0, 1.0] if max(abs(axis[0]), abs(axis[1])) <= _PARALLEL else None
        axes.append(axis)
    return axes


def _links(model: RobotModel, mechanism: Mechanism) -> list[_Link]:
    """Return what each moving joint moves up to the next, in its frame in the mechanism."""
    links: list[_Link] = []
    T = identity()
    for joint, body in zip(model.joints, model.bodies, strict=True):
        if joint.type.moves:
            own = mechanism.joints[len(links)]
            links.append(_Link(0.0, [0.0] * 3, [[0.0] * 3 for _ in range(3)]))
            T = compose(joint_part(-own.chain_angle, 0.0), joint_part(0.0, own.chain_offset))
        else:
            T = compose(T, joint.T_parent_joint)
        if body is not None and links:
            _add(links[-1], _about_origin(in_frame(T, body)))
    return links


def _about_origin(body: MassProperties) -> _Link:
    com = body.com.tolist()
    inertia = shifted_inertia(body.inertia.tolist(), body.mass, com)
    return _Link(body.mass, [body.mass * value for value in com], inertia)


def _taken(joint: MovingJoint, link: _Link, spin: Sequence[float] | None) -> _Link:
    """Take from a link, and return, what may belong to the link before; what has no effect is taken and lost.

    Args:
        joint: The joint that moves the link.
        link: The link.
        spin: The one direction that it can turn about, if there is no other: its first moment along that has no
            effect; and across, sliding along that direction does not change it.
    """
    if joint.turns:
        across = link.inertia[1][1]
        rod = _Link(link.mass, [0.0, 0.0, link.moment[2]], [[across, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, 0.0]])
        link.mass, link.moment[2], link.inertia[1][1] = 0.0, 0.0, 0.0
        link.inertia[0][0] -= across
        return rod
    taken = _Link(0.0, [0.0] * 3, link.inertia)
    link.inertia = [[0.0] * 3 for _ in range(3)]
    if spin is not None and any(spin):
        k = max(range(3), key=lambda axis: abs(spin[axis]))
        share = link.moment[k] / spin[k]
        across_spin = [0.0 if i == k else link.moment[i] - share * spin[i] for i in range(3)]
        if max(abs(spin[0]), abs(spin[1])) <= _PARALLEL:
            taken.moment, link.moment = across_spin, [0.0] * 3
        else:
            link.moment = across_spin
    return taken


def _rotation(twist: tuple[float, float], angle: float) -> _Tensor:
    """Return Rx(twist) Rz(angle)."""
    (ca, sa), (s, c) = twist, sin_cos(angle)
    return [[c, -s, 0.0], [ca * s, ca * c, -sa], [sa * s, sa * c, ca]]


def _moved(link: _Link, R: _Tensor, offset: Sequence[float]) -> _Link:
    """Return it in the frame of the joint before; it is the same for every coordinate of the joint."""
    inertia = rotate_tensor(np.array(R), np.array(link.inertia)).tolist()
    x, y, z = link.moment
    moment = [row[0] * x + row[1] * y + row[2] * z for row in R]
    along = offset[0] * moment[0] + offset[1] * moment[1] + offset[2] * moment[2]
    square = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2]
    for i in range(3):
        inertia[i][i] += 2 * along + link.mass * square
        for k in range(3):
            inertia[i][k] -= offset[i] * moment[k] + moment[i] * offset[k] + link.mass * offset[i] * offset[k]
    return _Link(link.mass, [m + link.mass * o for m, o in zip(moment, offset, strict=True)], inertia)


def _add(link: _Link, other: _Link) -> None:
    link.mass += other.mass
    for i in range(3):
        link.moment[i] += other.moment[i]
        for k in range(3):
            link.inertia[i][k] += other.inertia[i][k]


def _largest(values: Sequence[Sequence[float]]) -> float:
    return max(abs(value) for row in values for value in row)


def _named(trace: Trace, row: int, link: _Link, largest_moment: float, largest_inertia: float) -> InertialParameters:
    """Return parameters as constants, rounding left out."""

    def constant(name: str, value: float, largest: float, unit: str) -> Number:
        return trace.constant(f"{name}{row}", 0.0 if abs(value) <= _ROUNDING * largest else value, unit)

    xx, xy, xz, yy, yz, zz = (
        constant("XYZ"[i] + "XYZ"[k], link.inertia[i][k], largest_inertia, "kg m^2")
        for i in range(3)
        for k in range(i, 3)
    )
    x, y, z = (
        constant(f"M{axis}", value, largest_moment, "kg m") for axis, value in zip("XYZ", link.moment, strict=True)
    )
    return InertialParameters(
        mass=constant("M", link.mass, 0.0, "kg"), first_moment=(x, y, z), inertia=(xx, xy, xz, yy, yz, zz)
    )
