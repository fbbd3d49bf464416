"""Vectors and poses in decimal arithmetic, for tables whose rows lead hundreds of metres out and back.

Doubles lose there what the table says: after 574 m a double is good to 1e-13 m, after 1e6 m to 1e-10 m. A table's own
numbers are exact as decimals, sines and cosines are computed to more digits than are kept, and whoever uses the
result rounds it once. Every product is to be made inside ``with exact_arithmetic():``.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from decimal import Context, Decimal, localcontext
from functools import lru_cache, reduce
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.kinematics.trig import atan2, scaled_sin_cos
from dh2sim.typing import Array, read_only

Vector: TypeAlias = tuple[Decimal, Decimal, Decimal]
Matrix: TypeAlias = tuple[tuple[Decimal, Decimal, Decimal, Decimal], ...]
"""The upper three rows of a homogeneous transform."""

ZERO, ONE = Decimal(0), Decimal(1)
_DIGITS = 60
_NOTHING = Decimal("1e-40")


def exact_arithmetic() -> AbstractContextManager[Context]:
    """Return the context in which decimals are computed with."""
    return localcontext(Context(prec=_DIGITS))


@lru_cache(maxsize=256)
def exact_sin_cos(angle: float) -> tuple[Decimal, Decimal]:
    """Return sine and cosine of an angle, rad; multiples of pi/2 are exact, as in ``trig.sin_cos``."""
    sine, cosine, bits = scaled_sin_cos(angle)
    with exact_arithmetic():
        one = Decimal(1 << bits)
        return Decimal(sine) / one, Decimal(cosine) / one


def exact_joint_part(theta: float, d: float) -> Matrix:
    """Return Z = Rz(theta) Tz(d); rad and m."""
    s, c = exact_sin_cos(theta)
    return ((c, -s, ZERO, ZERO), (s, c, ZERO, ZERO), (ZERO, ZERO, ONE, Decimal(d)))


def exact_link_part(a: float, alpha: float, beta: float = 0.0) -> Matrix:
    """Return X = Tx(a) Rx(alpha) Ry(beta); m and rad."""
    s, c = exact_sin_cos(alpha)
    X: Matrix = ((ONE, ZERO, ZERO, Decimal(a)), (ZERO, c, -s, ZERO), (ZERO, s, c, ZERO))
    if beta == 0.0:
        return X
    s, c = exact_sin_cos(beta)
    return exact_product(X, ((c, ZERO, s, ZERO), (ZERO, ONE, ZERO, ZERO), (-s, ZERO, c, ZERO)))


def exact_pose(xyz: ArrayLike, rpy: ArrayLike) -> Matrix:
    """Return the pose of a position, m, and URDF angles, rad: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    (sr, cr), (sp, cp), (sy, cy) = (exact_sin_cos(angle) for angle in read_only(rpy).tolist())
    x, y, z = (Decimal(value) for value in read_only(xyz).tolist())
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, x),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, y),
        (-sp, cp * sr, cp * cr, z),
    )


def exact_frame(origin: Vector, x: Vector, z: Vector) -> Matrix:
    """Return the pose of a frame with its origin and two of its axes given."""
    columns = (x, exact_cross(z, x), z, origin)
    return tuple((columns[0][i], columns[1][i], columns[2][i], columns[3][i]) for i in range(3))


def exact_product(*poses: Matrix) -> Matrix:
    """Return the product of transforms."""
    return reduce(_times, poses)


def _times(A: Matrix, B: Matrix) -> Matrix:
    columns = tuple(zip(*B, strict=True))
    return tuple(
        (
            exact_dot(row[:3], columns[0]),
            exact_dot(row[:3], columns[1]),
            exact_dot(row[:3], columns[2]),
            exact_dot(row[:3], columns[3]) + row[3],
        )
        for row in A
    )


def exact_inverse(T: Matrix) -> Matrix:
    """Return the transform that leads back."""
    x, y, z, p = zip(*T, strict=True)
    return tuple((*axis, -exact_dot(axis, p)) for axis in (x, y, z))


def column(T: Matrix, k: int) -> Vector:
    """Return an axis of a frame, k = 0, 1, 2, or its origin, k = 3."""
    return (T[0][k], T[1][k], T[2][k])


def exact_dot(a: Sequence[Decimal], b: Sequence[Decimal]) -> Decimal:
    """Return a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def exact_cross(a: Vector, b: Vector) -> Vector:
    """Return a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def exact_sum(a: Vector, b: Vector, factor: Decimal) -> Vector:
    """Return a + factor b."""
    return (a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2])


def exact_length(a: Vector) -> Decimal:
    """Return the Euclidean norm."""
    return exact_dot(a, a).sqrt()


def exact_unit(a: Vector) -> Vector:
    """Return the unit vector along ``a``."""
    size = exact_length(a)
    return (a[0] / size, a[1] / size, a[2] / size)


def rounded(value: Decimal) -> float:
    """Return a number as a double; what the last digits leave of nothing is 0.0."""
    return 0.0 if abs(value) < _NOTHING else float(value)


def rounded_atan2(y: Decimal, x: Decimal) -> float:
    """Return the angle of the point (``x``, ``y``), rad, of which at least one is about 1."""
    return atan2(rounded(y), rounded(x))


def rounded_matrix(T: Matrix) -> Array:
    """Return a transform in doubles, read-only, shape (4, 4)."""
    return read_only(np.array([*([rounded(value) for value in row] for row in T), [0.0, 0.0, 0.0, 1.0]]))
