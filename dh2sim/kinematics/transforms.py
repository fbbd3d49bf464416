"""Rigid transforms as read-only 4x4 arrays, points and tensors in other frames, and distances between poses.

Written out in Python's own floating-point arithmetic, for the same bits on every machine: a matrix product by BLAS
may fuse multiplications and additions, and then the last bit depends on the processor.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import Problem, RobotError
from dh2sim.kinematics.trig import atan2, sin_cos
from dh2sim.robot.links import Pose
from dh2sim.typing import Array, read_only

Rows: TypeAlias = Sequence[Sequence[float]]
"""Of a matrix, as ``tolist`` gives them."""
PoseLike: TypeAlias = Pose | ArrayLike
"""A pose; or a position, m, shape (3,); or a homogeneous transform, shape (4, 4)."""
_RIGID = 1e-9
"""By which entries of R Rᵀ may differ from those of the identity."""
_LOCKED = 4e-16
"""Cosine of the pitch, at and below which nothing but rounding is left of roll."""


@cache
def identity() -> Array:
    """Return the identity, shape (4, 4)."""
    return _transform(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), (0.0, 0.0, 0.0))


def compose(T_a_b: Array, T_b_c: Array) -> Array:
    """Return the pose of frame c in frame a.

    Args:
        T_a_b: Pose of frame b in frame a, shape (4, 4).
        T_b_c: Pose of frame c in frame b, shape (4, 4).

    Returns:
        T_a_b · T_b_c, shape (4, 4).
    """
    (x1, y1, z1, p1), (x2, y2, z2, p2), (x3, y3, z3, p3), _ = T_b_c.tolist()
    rows = [
        [
            a * x1 + b * x2 + c * x3 + 0.0,
            a * y1 + b * y2 + c * y3 + 0.0,
            a * z1 + b * z2 + c * z3 + 0.0,
            a * p1 + b * p2 + c * p3 + p + 0.0,
        ]
        for a, b, c, p in T_a_b.tolist()[:3]
    ]
    return read_only([*rows, [0.0, 0.0, 0.0, 1.0]])


def invert(T_a_b: Array) -> Array:
    """Return the pose of frame a in frame b, given that of b in a; both of shape (4, 4)."""
    rows = T_a_b.tolist()
    columns = [[rows[i][k] for i in range(3)] for k in range(4)]
    position = [-(c[0] * columns[3][0] + c[1] * columns[3][1] + c[2] * columns[3][2]) for c in columns[:3]]
    return _transform(columns[:3], position)


def link_part(a: float, alpha: float) -> Array:
    """Return the link part of a Denavit-Hartenberg row, X = Tx(a) Rx(alpha).

    Args:
        a: Link length, m.
        alpha: Link twist, rad.

    Returns:
        Shape (4, 4).
    """
    s, c = sin_cos(alpha)
    return _transform(((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c)), (a, 0.0, 0.0))


def joint_part(theta: float, d: float) -> Array:
    """Return the joint part of a Denavit-Hartenberg row, Z = Rz(theta) Tz(d).

    Args:
        theta: Joint angle, rad.
        d: Joint offset, m.

    Returns:
        Shape (4, 4).
    """
    s, c = sin_cos(theta)
    return _transform(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)), (0.0, 0.0, d))


def second_twist(beta: float) -> Array:
    """Return the second twist of a Hayati row, Ry(beta).

    Args:
        beta: rad.

    Returns:
        Shape (4, 4).
    """
    s, c = sin_cos(beta)
    return _transform(((c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c)), (0.0, 0.0, 0.0))


def pose_from_rpy(xyz: ArrayLike, rpy: ArrayLike) -> Array:
    """Return the transform of a position and URDF angles, R = Rz(yaw) Ry(pitch) Rx(roll).

    Args:
        xyz: Position, m, shape (3,).
        rpy: Roll, pitch and yaw about fixed x, y and z, rad, shape (3,).

    Returns:
        Shape (4, 4).
    """
    (sr, cr), (sp, cp), (sy, cy) = (sin_cos(angle) for angle in read_only(rpy).tolist())
    rotation = (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )
    return _transform(rotation, read_only(xyz).tolist())


def rpy_from_rotation(R: Array) -> Array:
    """Return the URDF angles of a rotation: R = Rz(yaw) Ry(pitch) Rx(roll).

    Near pitch = ±pi/2 roll is badly determined, and then so is yaw. Here roll is computed first, rounded, and
    taken off; yaw and pitch come from what is left and so make up for the error of roll. At pitch = ±pi/2
    roll is 0.

    Args:
        R: Rotation matrix, shape (3, 3), or a transform, shape (4, 4).

    Returns:
        Roll in (-pi, pi], pitch in [-pi/2, pi/2], yaw in (-pi, pi]; rad, shape (3,). Building the rotation
        from them gives R again to within a few 1e-16, wherever the pitch is.
    """
    r = R.tolist()
    locked = math.sqrt(r[2][1] * r[2][1] + r[2][2] * r[2][2]) <= _LOCKED
    roll = 0.0 if locked else atan2(r[2][1], r[2][2])
    sine, cosine = sin_cos(roll)
    pitch = atan2(-r[2][0], r[2][1] * sine + r[2][2] * cosine)
    if locked:
        pitch = math.copysign(math.pi / 2, -r[2][0])
    yaw = atan2(r[0][2] * sine - r[0][1] * cosine, r[1][1] * cosine - r[1][2] * sine)
    return read_only(_clean((roll, pitch, yaw)))


def pose_of(value: PoseLike, name: str) -> Pose:
    """Return a pose that is given in any form; ``name`` is its path for messages.

    Raises:
        RobotError: A matrix is given that is not a rigid transform.
    """
    if isinstance(value, Pose):
        return value
    try:
        T = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        T = np.zeros(())
    if T.shape in ((), (3,)):
        return Pose(xyz=cast("Array", value))  # what is wrong with it is for the specification to say
    if T.shape != (4, 4):
        message = f"expected a Pose, a position of shape (3,) or a transform of shape (4, 4), found shape {T.shape}"
        raise RobotError([Problem(path=name, message=message)])
    R = T[:3, :3]
    if not (np.abs(R @ R.T - np.eye(3)).max() < _RIGID and np.linalg.det(R) > 0 and T[3].tolist() == [0, 0, 0, 1]):
        message = "the matrix is not a rigid transform: a rotation and a position above 0, 0, 0, 1"
        raise RobotError([Problem(path=name, message=message)])
    return Pose(xyz=T[:3, 3], rpy=np.array(rpy_from_rotation(R)))


def quaternion_from_rotation(R: Array) -> Array:
    """Return the unit quaternion of a rotation.

    S. W. Shepperd, Quaternion from rotation matrix, J. Guidance and Control 1(3), 1978: of the four products
    4w², 4x², 4y², 4z² the greatest is the pivot, so that nothing cancels. Here the row of products with the
    pivot is normalised as a whole.

    Args:
        R: Rotation matrix, shape (3, 3), or a transform, shape (4, 4).

    Returns:
        (w, x, y, z), shape (4,); the first component that is not zero is positive.
    """
    r = R.tolist()
    trace = r[0][0] + r[1][1] + r[2][2]
    pivot = max(range(4), key=(trace, r[0][0], r[1][1], r[2][2]).__getitem__)
    if pivot == 0:
        q = [1.0 + trace, r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]]
    else:
        i = pivot - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q = [r[k][j] - r[j][k], 0.0, 0.0, 0.0]
        q[1 + i] = 1.0 + r[i][i] - r[j][j] - r[k][k]
        q[1 + j] = r[j][i] + r[i][j]
        q[1 + k] = r[k][i] + r[i][k]
    norm = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    norm = -norm if next(value for value in q if value != 0.0) < 0.0 else norm
    return read_only(_clean([value / norm for value in q]))


def _transform(rotation: Sequence[Sequence[float]], position: Sequence[float]) -> Array:
    """Assemble a read-only transform; every zero becomes +0.0."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = position
    T = np.array([[a, b, c, x], [d, e, f, y], [g, h, i, z], [0.0, 0.0, 0.0, 1.0]])
    T += 0.0
    T.setflags(write=False)
    return T


def _clean(values: Sequence[float]) -> list[float]:
    """Turn -0.0 into 0.0."""
    return [value + 0.0 for value in values]


def move_point(T_a_b: Array, point: Array) -> list[float]:
    """Return a point of frame b in frame a.

    Args:
        T_a_b: Pose of frame b in frame a, shape (4, 4).
        point: m, in frame b, shape (3,).

    Returns:
        Its three coordinates, m.
    """
    x, y, z = point.tolist()
    return [row[0] * x + row[1] * y + row[2] * z + row[3] for row in T_a_b[:3].tolist()]


def rotate_tensor(T_a_b: Array, tensor: Array) -> Array:
    """Return a symmetric tensor given along the axes of frame b along those of frame a: R A Rᵀ.

    Args:
        T_a_b: Pose of frame b in frame a, of which the rotation R counts; shape (4, 4) or (3, 3).
        tensor: A, shape (3, 3).

    Returns:
        Exactly symmetric, shape (3, 3).
    """
    return read_only(rotated_tensor(T_a_b.tolist(), tensor.tolist()))


def rotated_tensor(T_a_b: Rows, tensor: Rows) -> list[list[float]]:
    """Return what :func:`rotate_tensor` does, of rows of numbers: for sums in which an array a term would be slow."""
    (x1, y1, z1, *_), (x2, y2, z2, *_), (x3, y3, z3, *_), *_ = T_a_b
    (a1, a2, a3), (b1, b2, b3), (c1, c2, c3) = tensor
    u, v, w = x1 * a1 + y1 * b1 + z1 * c1, x1 * a2 + y1 * b2 + z1 * c2, x1 * a3 + y1 * b3 + z1 * c3
    xx = u * x1 + v * y1 + w * z1 + 0.0
    xy = u * x2 + v * y2 + w * z2 + 0.0
    xz = u * x3 + v * y3 + w * z3 + 0.0
    u, v, w = x2 * a1 + y2 * b1 + z2 * c1, x2 * a2 + y2 * b2 + z2 * c2, x2 * a3 + y2 * b3 + z2 * c3
    yy = u * x2 + v * y2 + w * z2 + 0.0
    yz = u * x3 + v * y3 + w * z3 + 0.0
    u, v, w = x3 * a1 + y3 * b1 + z3 * c1, x3 * a2 + y3 * b2 + z3 * c2, x3 * a3 + y3 * b3 + z3 * c3
    return [[xx, xy, xz], [xy, yy, yz], [xz, yz, u * x3 + v * y3 + w * z3 + 0.0]]


_BLOCK = 2048
"""Poses handled at a time: a block fits in the cache, and is too small for BLAS to start threads for."""
_SELECTION = np.zeros((16, 2))
"""Sums the squares of a pose's rotation, and of its position."""
_SELECTION[[0, 1, 2, 4, 5, 6, 8, 9, 10], 0] = 1.0
_SELECTION[[3, 7, 11], 1] = 1.0


def pose_errors(T: Array, T_reference: Array) -> tuple[Array, Array]:
    """Return how far poses are from their reference.

    The rotation error is the angle of R^T R_reference, from ‖R - R_reference‖ = 2 sqrt(2) sin(angle/2) in the
    Frobenius norm, which keeps its precision at tiny angles, where the trace loses it.

    Args:
        T: Poses, m, shape (..., 4, 4).
        T_reference: The poses they should be, the same shape.

    Returns:
        Distances of the positions, m, and angles between the rotations, rad in [0, pi], each of shape (...).
        NaN where a pose holds NaN: compare with ``error <= tolerance``, which NaN fails.

    Raises:
        ValueError: The shapes differ, or are not of poses.
    """
    if T.shape != T_reference.shape or T.shape[-2:] != (4, 4):
        raise ValueError(f"expected two equal shapes (..., 4, 4), got {T.shape} and {T_reference.shape}")
    left, right = T.reshape(-1, 16), T_reference.reshape(-1, 16)
    squares = np.empty((len(left), 2))
    with np.errstate(invalid="ignore", over="ignore"):
        for start in range(0, len(left), _BLOCK):
            block = slice(start, start + _BLOCK)
            gap = left[block] - right[block]
            np.matmul(gap * gap, _SELECTION, out=squares[block])
        norms = np.sqrt(squares).reshape(*T.shape[:-2], 2)
        angles = 2.0 * np.arcsin(np.minimum(1.0, norms[..., 0] / (2.0 * np.sqrt(2.0))))
    return norms[..., 1], angles
