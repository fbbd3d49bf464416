"""Closed-form forward kinematics of the course systems, one scalar expression an entry.

There is no matrix product in this file, so these are oracles that share nothing with any Denavit-Hartenberg
code, the library's table oracle included. Each was proved equal to the product of its table's matrices,
symbolically and numerically. Where a source misprints an entry, the corrected one stands here;
``docs/misprints.md`` lists them.

Every function takes the joint coordinates (rad and m; scalars or arrays of one shape) and, by keyword, the
robot file's parameters (m), and returns the pose of the last DH frame in DH frame 0, shape (..., 4, 4). A
part, such as ``stanford_t03``, is the pose of one DH frame in another, as ``PARTS`` says.

Sources: (S) course slides in Spanish on the Stanford arm; (R) E. Rivera's tutorial in Spanish on the Space
Station arm; (C) course slides with modified tables after Craig; (P) 'Robotics: Fundamentals', week 5,
University of Pennsylvania.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np

from dh2sim.typing import Array

Form = Callable[..., Array]


class Part(NamedTuple):
    """A closed form of a few rows of a table."""

    form: Form
    robot: str
    """Name of the robot file."""
    first: int
    """The first row of the part, counted from 1: the pose is given in DH frame first - 1."""
    last: int
    """The last row of the part: the pose is that of DH frame last."""


PROVENANCE: Final = {
    "stanford": "S: printed, all 16 entries unchanged",
    "stanford_t03": "S: printed, unchanged",
    "ssrms": "R: derived, the axis vectors summed; the tutorial prints no closed form",
    "scara": "P: printed, unchanged but for the last row, which is cut off",
    "cylindrical": "P: printed, unchanged",
    "spherical_wrist": "P: corrected, r12 s5 c6 -> s4 c6",
    "cylindrical_wrist": "P: r11, r21, r31 and r33 printed; the other eight derived",
    "planar_2r": "P: derived; the matrices of its two rows are printed, with a misprint",
    "stanford_shoulder_origin": "P: corrected, r11, r21, r12, r22, r32",
    "stanford_shoulder_origin_t03": "P: printed, unchanged",
    "puma560": "C: corrected, r11 s4 s5 -> s4 s6 and s23 s5 c5 -> s23 s5 c6; r21 lacks a bracket",
    "puma560_t46": "C: printed",
    "puma560_t36": "C: printed",
    "puma560_t13": "C: printed",
    "arm_5r": "C: derived",
    "rpr": "C: derived",
}


def stanford(
    q1: Array, q2: Array, q3: Array, q4: Array, q5: Array, q6: Array, *, d1: float, d2: float, d6: float
) -> Array:
    S1, C1, S2, C2, S4, C4, S5, C5, S6, C6 = _sines_and_cosines(q1, q2, q4, q5, q6)
    return _matrix(
        [
            -S6 * (C4 * S1 + C1 * C2 * S4) - C6 * (C5 * (S1 * S4 - C1 * C2 * C4) + C1 * S2 * S5),
            S6 * (C5 * (S1 * S4 - C1 * C2 * C4) + C1 * S2 * S5) - C6 * (C4 * S1 + C1 * C2 * S4),
            C1 * C5 * S2 - S5 * (S1 * S4 - C1 * C2 * C4),
            C1 * S2 * q3 - d2 * S1 - d6 * (S5 * (S1 * S4 - C1 * C2 * C4) - C1 * C5 * S2),
        ],
        [
            S6 * (C1 * C4 - C2 * S1 * S4) + C6 * (C5 * (C1 * S4 + C2 * C4 * S1) - S1 * S2 * S5),
            C6 * (C1 * C4 - C2 * S1 * S4) - S6 * (C5 * (C1 * S4 + C2 * C4 * S1) - S1 * S2 * S5),
            S5 * (C1 * S4 + C2 * C4 * S1) + C5 * S1 * S2,
            d6 * (S5 * (C1 * S4 + C2 * C4 * S1) + C5 * S1 * S2) + C1 * d2 + S1 * S2 * q3,
        ],
        [
            S2 * S4 * S6 - C6 * (C2 * S5 + C4 * C5 * S2),
            S6 * (C2 * S5 + C4 * C5 * S2) + C6 * S2 * S4,
            C2 * C5 - C4 * S2 * S5,
            d1 + C2 * q3 + d6 * (C2 * C5 - C4 * S2 * S5),
        ],
    )


def stanford_t03(q1: Array, q2: Array, q3: Array, *, d1: float, d2: float) -> Array:
    S1, C1, S2, C2 = _sines_and_cosines(q1, q2)
    return _matrix(
        [C1 * C2, -S1, C1 * S2, C1 * S2 * q3 - d2 * S1],
        [C2 * S1, C1, S1 * S2, C1 * d2 + S1 * S2 * q3],
        [-S2, 0, C2, d1 + C2 * q3],
    )


def stanford_shoulder_origin(
    q1: Array, q2: Array, q3: Array, q4: Array, q5: Array, q6: Array, *, d2: float, d6: float
) -> Array:
    s1, c1, s2, c2, s4, c4, s5, c5, s6, c6 = _sines_and_cosines(q1, q2, q4, q5, q6)
    return _matrix(
        [
            c1 * (c2 * (c4 * c5 * c6 - s4 * s6) - s2 * s5 * c6) - s1 * (s4 * c5 * c6 + c4 * s6),
            c1 * (-c2 * (c4 * c5 * s6 + s4 * c6) + s2 * s5 * s6) - s1 * (-s4 * c5 * s6 + c4 * c6),
            c1 * (c2 * c4 * s5 + s2 * c5) - s1 * s4 * s5,
            c1 * s2 * q3 - s1 * d2 + d6 * (c1 * c2 * c4 * s5 + c1 * s2 * c5 - s1 * s4 * s5),
        ],
        [
            s1 * (c2 * (c4 * c5 * c6 - s4 * s6) - s2 * s5 * c6) + c1 * (s4 * c5 * c6 + c4 * s6),
            s1 * (-c2 * (c4 * c5 * s6 + s4 * c6) + s2 * s5 * s6) + c1 * (-s4 * c5 * s6 + c4 * c6),
            s1 * (c2 * c4 * s5 + s2 * c5) + c1 * s4 * s5,
            s1 * s2 * q3 + c1 * d2 + d6 * (s1 * c2 * c4 * s5 + s1 * s2 * c5 + c1 * s4 * s5),
        ],
        [
            -s2 * (c4 * c5 * c6 - s4 * s6) - c2 * s5 * c6,
            s2 * (c4 * c5 * s6 + s4 * c6) + c2 * s5 * s6,
            -s2 * c4 * s5 + c2 * c5,
            c2 * q3 + d6 * (c2 * c5 - s2 * c4 * s5),
        ],
    )


def stanford_shoulder_origin_t03(q1: Array, q2: Array, q3: Array, *, d2: float) -> Array:
    s1, c1, s2, c2 = _sines_and_cosines(q1, q2)
    return _matrix(
        [c1 * c2, -s1, c1 * s2, c1 * q3 * s2 - d2 * s1],
        [c2 * s1, c1, s1 * s2, c1 * d2 + q3 * s1 * s2],
        [-s2, 0, c2, c2 * q3],
    )


def spherical_wrist(q4: Array, q5: Array, q6: Array, *, d6: float) -> Array:
    s4, c4, s5, c5, s6, c6 = _sines_and_cosines(q4, q5, q6)
    return _matrix(
        [c4 * c5 * c6 - s4 * s6, -c4 * c5 * s6 - s4 * c6, c4 * s5, c4 * s5 * d6],
        [s4 * c5 * c6 + c4 * s6, -s4 * c5 * s6 + c4 * c6, s4 * s5, s4 * s5 * d6],
        [-s5 * c6, s5 * s6, c5, c5 * d6],
    )


def cylindrical(q1: Array, q2: Array, q3: Array, *, d1: float) -> Array:
    s1, c1 = _sines_and_cosines(q1)
    return _matrix([c1, 0, -s1, -s1 * q3], [s1, 0, c1, c1 * q3], [0, -1, 0, d1 + q2])


def cylindrical_wrist(
    q1: Array, q2: Array, q3: Array, q4: Array, q5: Array, q6: Array, *, d1: float, d6: float
) -> Array:
    s1, c1, s4, c4, s5, c5, s6, c6 = _sines_and_cosines(q1, q4, q5, q6)
    return _matrix(
        [
            c1 * c4 * c5 * c6 - c1 * s4 * s6 + s1 * s5 * c6,
            -c1 * c4 * c5 * s6 - c1 * s4 * c6 - s1 * s5 * s6,
            c1 * c4 * s5 - s1 * c5,
            c1 * c4 * s5 * d6 - s1 * c5 * d6 - s1 * q3,
        ],
        [
            s1 * c4 * c5 * c6 - s1 * s4 * s6 - c1 * s5 * c6,
            -s1 * c4 * c5 * s6 - s1 * s4 * c6 + c1 * s5 * s6,
            s1 * c4 * s5 + c1 * c5,
            s1 * c4 * s5 * d6 + c1 * c5 * d6 + c1 * q3,
        ],
        [-s4 * c5 * c6 - c4 * s6, s4 * c5 * s6 - c4 * c6, -s4 * s5, -s4 * s5 * d6 + d1 + q2],
    )


def scara(q1: Array, q2: Array, q3: Array, q4: Array, *, a1: float, a2: float, d4: float) -> Array:
    s1, c1, s12, c12, s4, c4 = _sines_and_cosines(q1, q1 + q2, q4)
    return _matrix(
        [c12 * c4 + s12 * s4, -c12 * s4 + s12 * c4, 0, a1 * c1 + a2 * c12],
        [s12 * c4 - c12 * s4, -s12 * s4 - c12 * c4, 0, a1 * s1 + a2 * s12],
        [0, 0, -1, -q3 - d4],
    )


def planar_2r(q1: Array, q2: Array, *, a1: float, a2: float) -> Array:
    s1, c1, s12, c12 = _sines_and_cosines(q1, q1 + q2)
    return _matrix([c12, -s12, 0, a1 * c1 + a2 * c12], [s12, c12, 0, a1 * s1 + a2 * s12], [0, 0, 1, 0])


def puma560(
    q1: Array,
    q2: Array,
    q3: Array,
    q4: Array,
    q5: Array,
    q6: Array,
    *,
    a2: float,
    a3: float,
    d3: float,
    d4: float,
) -> Array:
    s1, c1, s2, c2, s4, c4, s5, c5, s6, c6, s23, c23 = _sines_and_cosines(q1, q2, q4, q5, q6, q2 + q3)
    return _matrix(
        [
            c1 * (c23 * (c4 * c5 * c6 - s4 * s6) - s23 * s5 * c6) + s1 * (s4 * c5 * c6 + c4 * s6),
            c1 * (c23 * (-c4 * c5 * s6 - s4 * c6) + s23 * s5 * s6) + s1 * (c4 * c6 - s4 * c5 * s6),
            -c1 * (c23 * c4 * s5 + s23 * c5) - s1 * s4 * s5,
            c1 * (a2 * c2 + a3 * c23 - d4 * s23) - d3 * s1,
        ],
        [
            s1 * (c23 * (c4 * c5 * c6 - s4 * s6) - s23 * s5 * c6) - c1 * (s4 * c5 * c6 + c4 * s6),
            s1 * (c23 * (-c4 * c5 * s6 - s4 * c6) + s23 * s5 * s6) - c1 * (c4 * c6 - s4 * c5 * s6),
            -s1 * (c23 * c4 * s5 + s23 * c5) + c1 * s4 * s5,
            s1 * (a2 * c2 + a3 * c23 - d4 * s23) + d3 * c1,
        ],
        [
            -s23 * (c4 * c5 * c6 - s4 * s6) - c23 * s5 * c6,
            -s23 * (-c4 * c5 * s6 - s4 * c6) + c23 * s5 * s6,
            s23 * c4 * s5 - c23 * c5,
            -a3 * s23 - a2 * s2 - d4 * c23,
        ],
    )


def puma560_t46(q5: Array, q6: Array) -> Array:
    s5, c5, s6, c6 = _sines_and_cosines(q5, q6)
    return _matrix([c5 * c6, -c5 * s6, -s5, 0], [s6, c6, 0, 0], [s5 * c6, -s5 * s6, c5, 0])


def puma560_t36(q4: Array, q5: Array, q6: Array, *, a3: float, d4: float) -> Array:
    s4, c4, s5, c5, s6, c6 = _sines_and_cosines(q4, q5, q6)
    return _matrix(
        [c4 * c5 * c6 - s4 * s6, -c4 * c5 * s6 - s4 * c6, -c4 * s5, a3],
        [s5 * c6, -s5 * s6, c5, d4],
        [-s4 * c5 * c6 - c4 * s6, s4 * c5 * s6 - c4 * c6, s4 * s5, 0],
    )


def puma560_t13(q2: Array, q3: Array, *, a2: float, d3: float) -> Array:
    s2, c2, s23, c23 = _sines_and_cosines(q2, q2 + q3)
    return _matrix([c23, -s23, 0, a2 * c2], [0, 0, 1, d3], [-s23, -c23, 0, -a2 * s2])


def arm_5r(q1: Array, q2: Array, q3: Array, q4: Array, q5: Array, *, L2: float, L3: float) -> Array:
    s1, c1, s2, c2, s5, c5 = _sines_and_cosines(q1, q2, q5)
    s23, c23, s234, c234 = _sines_and_cosines(q2 + q3, q2 + q3 + q4)
    return _matrix(
        [c1 * c234 * c5 - s1 * s5, -c1 * c234 * s5 - s1 * c5, c1 * s234, c1 * (L2 * c2 + L3 * c23)],
        [s1 * c234 * c5 + c1 * s5, -s1 * c234 * s5 + c1 * c5, s1 * s234, s1 * (L2 * c2 + L3 * c23)],
        [-s234 * c5, s234 * s5, c234, -L2 * s2 - L3 * s23],
    )


def rpr(q1: Array, q2: Array, q3: Array, *, L2: float) -> Array:
    s1, c1, s3, c3 = _sines_and_cosines(q1, q3)
    return _matrix([c1 * c3, -c1 * s3, s1, s1 * (q2 + L2)], [s1 * c3, -s1 * s3, -c1, -c1 * (q2 + L2)], [s3, c3, 0, 0])


def ssrms(q1: Array, q2: Array, q3: Array, q4: Array, q5: Array, q6: Array, q7: Array) -> Array:
    """Sum the axes: p = 2.5 z0 + 6 z1 + 13 z2 + 12 (c3 + c34) x2 + 12 (s3 + s34) y2 + 6 z5, where

    z1 = (-s1, c1, 0), z2 = z3 = z4 = (-c1 s2, -s1 s2, -c2), x2 = (c1 c2, s1 c2, -s2), y2 = (s1, -c1, 0) and
    z5 = -s345 x2 + c345 y2.
    """
    s1, c1, s2, c2, s6, c6, s7, c7 = _sines_and_cosines(q1, q2, q6, q7)
    s3, c3, s34, c34, s, c = _sines_and_cosines(q3, q3 + q4, q3 + q4 + q5)
    return _matrix(
        [
            c7 * (c6 * (c * c1 * c2 + s * s1) + s6 * c1 * s2) + s7 * (s * c1 * c2 - c * s1),
            -s7 * (c6 * (c * c1 * c2 + s * s1) + s6 * c1 * s2) + c7 * (s * c1 * c2 - c * s1),
            -s6 * (c * c1 * c2 + s * s1) + c6 * c1 * s2,
            -6 * s1 - 13 * c1 * s2 + 12 * (c3 + c34) * c1 * c2 + 12 * (s3 + s34) * s1 + 6 * (c * s1 - s * c1 * c2),
        ],
        [
            c7 * (c6 * (c * s1 * c2 - s * c1) + s6 * s1 * s2) + s7 * (s * s1 * c2 + c * c1),
            -s7 * (c6 * (c * s1 * c2 - s * c1) + s6 * s1 * s2) + c7 * (s * s1 * c2 + c * c1),
            -s6 * (c * s1 * c2 - s * c1) + c6 * s1 * s2,
            6 * c1 - 13 * s1 * s2 + 12 * (c3 + c34) * s1 * c2 - 12 * (s3 + s34) * c1 + 6 * (-c * c1 - s * s1 * c2),
        ],
        [
            c7 * (-c6 * c * s2 + s6 * c2) - s7 * s * s2,
            -s7 * (-c6 * c * s2 + s6 * c2) - c7 * s * s2,
            s6 * c * s2 + c6 * c2,
            2.5 - 13 * c2 - 12 * (c3 + c34) * s2 + 6 * s * s2,
        ],
    )


ROBOTS: Final[dict[str, Form]] = {
    "arm_5r": arm_5r,
    "cylindrical": cylindrical,
    "cylindrical_wrist": cylindrical_wrist,
    "planar_2r": planar_2r,
    "puma560": puma560,
    "rpr": rpr,
    "scara": scara,
    "spherical_wrist": spherical_wrist,
    "ssrms": ssrms,
    "stanford": stanford,
    "stanford_shoulder_origin": stanford_shoulder_origin,
}
"""Whole robots by the name of their file; puma560_standard has none, it is compared with puma560."""

PARTS: Final[dict[str, Part]] = {
    "stanford_t03": Part(stanford_t03, "stanford", 1, 3),
    "stanford_shoulder_origin_t03": Part(stanford_shoulder_origin_t03, "stanford_shoulder_origin", 1, 3),
    "puma560_t46": Part(puma560_t46, "puma560", 5, 6),
    "puma560_t36": Part(puma560_t36, "puma560", 4, 6),
    "puma560_t13": Part(puma560_t13, "puma560", 2, 3),
    "wrist_of_stanford": Part(spherical_wrist, "stanford", 4, 6),
    "wrist_of_cylindrical_wrist": Part(spherical_wrist, "cylindrical_wrist", 4, 6),
    "arm_of_cylindrical_wrist": Part(cylindrical, "cylindrical_wrist", 1, 3),
}
"""Poses of DH frame ``last`` in DH frame ``first - 1``."""


def _sines_and_cosines(*angles: Array) -> list[Array]:
    """Return sin, cos of the first angle, sin, cos of the second, …"""
    return [function(angle) for angle in angles for function in (np.sin, np.cos)]


def _matrix(*rows: Sequence[Array | float]) -> Array:
    """Put three rows of entries, arrays of shape (...) or constants, on top of (0, 0, 0, 1)."""
    entries = np.broadcast_arrays(*(np.asarray(entry) for row in (*rows, (0.0, 0.0, 0.0, 1.0)) for entry in row))
    flat = np.stack(entries, axis=-1).astype(np.float64)
    return flat.reshape(*flat.shape[:-1], 4, 4)
