"""Inverse dynamics by the recursive Newton-Euler algorithm, on numbers or tokens, with few inertial parameters.

J. Y. S. Luh, M. W. Walker, R. P. C. Paul, On-line computational scheme for mechanical manipulators, J. Dynamic
Systems, Measurement and Control 102(2), 1980; in link frames with first moments and inertias about their origins, as
W. Khalil, J.-F. Kleinfinger, Minimum operations and minimum parameters of the dynamic models of tree structure
robots, IEEE J. Robotics and Automation 3(6), 1987.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from dh2sim.codegen.forward import cross
from dh2sim.codegen.mechanism import ORIGIN, Mechanism, Turn, Vector, about_x, about_z, added
from dh2sim.kinematics.trace import Number

Matrix: TypeAlias = tuple[Vector, Vector, Vector]


@dataclass(frozen=True, slots=True, kw_only=True)
class InertialParameters:
    """The ten inertial parameters of a link, in its joint's frame."""

    mass: Number = 0.0
    """kg."""
    first_moment: Vector = ORIGIN
    """Mass times centre of mass, kg·m."""
    inertia: tuple[Number, Number, Number, Number, Number, Number] = (0.0,) * 6
    """About the frame's origin: xx, xy, xz, yy, yz, zz, kg·m²."""


def inverse_dynamics(
    mechanism: Mechanism,
    links: Sequence[InertialParameters],
    turns: Sequence[Turn],
    q: Sequence[Number],
    qd: Sequence[Number],
    qdd: Sequence[Number],
    gravity: Vector,
) -> list[Number]:
    """Return the forces, N·m or N, that make the joints accelerate so.

    Args:
        mechanism: The robot, of n joints.
        links: For each joint, what it moves up to the next joint.
        turns: For each joint, by how much its frame is turned.
        q: Joint coordinates, rad or m; those of joints that slide are used.
        qd: Their rates.
        qdd: The rates of these.
        gravity: m/s² in base_link.

    Returns:
        n forces.
    """
    spin, spin_rate = ORIGIN, ORIGIN
    acceleration = _negative(about_z(mechanism.base.inverse, gravity))  # gravity as if the base accelerated upwards
    motion: Matrix | None = None
    forces: list[tuple[Vector, Vector]] = []
    for joint, link, turn, coordinate, rate, rate_of_rate in zip(
        mechanism.joints, links, turns, q, qd, qdd, strict=True
    ):
        if motion is not None:
            acceleration = added(acceleration, _times(motion, joint.offset))
        spin, spin_rate, acceleration = (
            about_z(turn.inverse, about_x(joint.twist.inverse, v)) for v in (spin, spin_rate, acceleration)
        )
        v, vd = joint.sign * rate, joint.sign * rate_of_rate
        if joint.turns:
            spin_rate = spin_rate[0] + spin[1] * v, spin_rate[1] - spin[0] * v, spin_rate[2] + vd
            spin = spin[0], spin[1], spin[2] + v
        motion = _motion_matrix(spin, spin_rate)
        if not joint.turns:
            s = joint.sign * coordinate
            acceleration = (
                acceleration[0] + motion[0][2] * s + 2.0 * (spin[1] * v),
                acceleration[1] + motion[1][2] * s - 2.0 * (spin[0] * v),
                acceleration[2] + motion[2][2] * s + vd,
            )
        forces.append(_force_and_moment(link, acceleration, spin, spin_rate, motion))
    force, moment = ORIGIN, ORIGIN
    result: list[Number] = []
    for i in reversed(range(len(forces))):
        joint = mechanism.joints[i]
        force, moment = added(forces[i][0], force), added(forces[i][1], moment)
        result.insert(0, joint.sign * (moment[2] if joint.turns else force[2]))
        if not joint.turns:
            s = joint.sign * q[i]
            moment = moment[0] - s * force[1], moment[1] + s * force[0], moment[2]
        force, moment = (about_x(joint.twist, about_z(turns[i], v)) for v in (force, moment))
        moment = added(moment, cross(joint.offset, force))
    return result


def _motion_matrix(w: Vector, wd: Vector) -> Matrix:
    """Return the matrix that turns a vector from a link's origin to a point of it into that point's acceleration."""
    x, y, z = w
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    return (
        (-(yy + zz), xy - wd[2], xz + wd[1]),
        (xy + wd[2], -(xx + zz), yz - wd[0]),
        (xz - wd[1], yz + wd[0], -(xx + yy)),
    )


def _force_and_moment(
    link: InertialParameters, acceleration: Vector, w: Vector, wd: Vector, motion: Matrix
) -> tuple[Vector, Vector]:
    """Return the force on a link, and its moment about the frame's origin.

    The moment is the integral of r x (motion r) over the mass, plus first moment x acceleration.
    """
    xx, xy, xz, yy, yz, zz = link.inertia
    U = motion
    a, b, c = w[1] * w[1], w[2] * w[2], w[0] * w[0]
    moment = (
        (xx * wd[0] + (zz - yy) * (w[1] * w[2]) + (xz * U[1][0] - xy * U[2][0])) + yz * (a - b),
        (yy * wd[1] + (xx - zz) * (w[0] * w[2]) + (xy * U[2][1] - yz * U[0][1])) + xz * (b - c),
        (zz * wd[2] + (yy - xx) * (w[0] * w[1]) + (yz * U[0][2] - xz * U[1][2])) + xy * (c - a),
    )
    mass = link.mass
    force = added(
        (mass * acceleration[0], mass * acceleration[1], mass * acceleration[2]), _times(U, link.first_moment)
    )
    return force, added(moment, cross(link.first_moment, acceleration))


def _times(M: Matrix, v: Vector) -> Vector:
    x, y, z = v
    first, second, third = (row[0] * x + row[1] * y + row[2] * z for row in M)
    return first, second, third


def _negative(v: Vector) -> Vector:
    return -v[0], -v[1], -v[2]
