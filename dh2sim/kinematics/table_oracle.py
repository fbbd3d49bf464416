"""The oracle: poses straight from the Denavit-Hartenberg table, by the textbooks' matrices, row by row.

Nothing here may use the kinematic chain or its helpers: were the chain wrong, everything made from it would
be wrong in the same way. This module has its own sines, its own matrices and its own product.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Context, Decimal, localcontext
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.robot.links import Pose
from dh2sim.robot.row import Convention, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array

_Coordinate = TypeVar("_Coordinate", float, Array)
_Number = TypeVar("_Number", float, Array, Decimal)

_BLOCK = 2048
"""Configurations handled at a time, so that a block's matrices stay in the processor's cache."""


def table_frame_poses(spec: RobotSpec, q: ArrayLike) -> Array:
    """Return the poses of all DH frames in base_link, T_base_link_dh0 A_1 … A_i.

    Args:
        spec: The robot.
        q: Joint vectors, rad and m, shape (..., n) with one coordinate for each row that moves.

    Returns:
        Poses of DH frames 0 … number of rows, shape (..., number of rows + 1, 4, 4).

    Raises:
        ConfigurationError: ``q`` does not have n coordinates along its last axis.
    """
    joint_vectors = np.asarray(q, dtype=np.float64)
    n = len(spec.moving_rows)
    if joint_vectors.ndim == 0 or joint_vectors.shape[-1] != n:
        raise ConfigurationError(f"expected an array of shape (..., {n}), got shape {joint_vectors.shape}")
    count = math.prod(joint_vectors.shape[:-1])
    poses = np.empty((count, len(spec.rows) + 1, 4, 4))
    columns = joint_vectors.reshape(count, n).T
    for start in range(0, count, _BLOCK):
        block = slice(start, start + _BLOCK)
        _block_poses(spec, columns[:, block], poses[block])
    return poses.reshape(*joint_vectors.shape[:-1], len(spec.rows) + 1, 4, 4)


def table_tool_pose(spec: RobotSpec, q: ArrayLike) -> Array:
    """Return the pose of tool0 in base_link, T_base_link_dh0 A_1 … A_n T_dhn_tool0.

    Args:
        spec: The robot.
        q: Joint vectors, rad and m, shape (..., n).

    Returns:
        Shape (..., 4, 4).

    Raises:
        ConfigurationError: ``q`` does not have n coordinates along its last axis.
    """
    return table_frame_poses(spec, q)[..., -1, :, :] @ _pose_matrix(spec.tool)


def table_mechanism_frames(spec: RobotSpec, q: ArrayLike) -> dict[str, Array]:
    """Return the poses of the DH frames of all chains of a mechanism, and of base_link and tool0, in base_link.

    Args:
        spec: The robot.
        q: One joint vector, rad and m, shape (n,): main chain, then branches.

    Returns:
        By name, such as dh_1 or rocker/dh_1; of branches that start from a link's own frame, which no table knows,
        there is none.
    """
    values = np.asarray(q, dtype=np.float64)
    frames = {"base_link": np.eye(4)}
    start = _chain_frames(frames, "", _pose_matrix(spec.base.pose), spec.rows, values)
    frames["tool0"] = frames[f"dh_{len(spec.rows)}"] @ _pose_matrix(spec.tool)
    for name, branch in spec.branches.items():
        rest = values[start:]
        if branch.origin in frames:
            origin = frames[branch.origin] @ _pose_matrix(branch.pose)
            _chain_frames(frames, f"{name}/", origin, branch.rows, rest)
        start += sum(row.type.moves for row in branch.rows)
    return frames


def _chain_frames(frames: dict[str, Array], prefix: str, T: Array, rows: Sequence[Row], q: Array) -> int:
    """Add the frames of a chain that starts at ``T``; return how many coordinates it has."""
    frames[f"{prefix}dh_0"] = T
    count = 0
    for i, row in enumerate(rows, start=1):
        coordinate = float(q[count]) if row.type.moves else 0.0
        count += row.type.moves
        theta, d = _moved(row, coordinate)
        turn, twist, second = ((math.cos(angle), math.sin(angle)) for angle in (theta, row.alpha, row.beta))
        upper = _entries(row.convention, turn, twist, second, row.a, d, 0.0, 1.0)
        T = T @ np.array([*upper, [0.0, 0.0, 0.0, 1.0]])
        frames[f"{prefix}dh_{i}"] = T
    return count


def row_matrix(row: Row, q: Array) -> Array:
    """Return A_i, the pose of DH frame i in DH frame i - 1, as the textbooks print it.

    Standard: M. W. Spong, S. Hutchinson, M. Vidyasagar, Robot Modeling and Control, 2006, section 3.2.
    Modified: J. J. Craig, Introduction to Robotics, 3rd ed., 2005, section 3.6.
    Hayati: S. Hayati, M. Mirmirani, Improving the absolute positioning accuracy of robot manipulators, J. Robotic
    Systems 2(4), 1985; a prismatic row's d slides along z before a.

    Args:
        row: The row of the table.
        q: Joint coordinates, rad or m, shape (N,); not used for a fixed row.

    Returns:
        Shape (4, 4, N).
    """
    theta, d = map(np.asarray, _moved(row, q))
    ct, st = np.cos(theta), np.sin(theta)
    ca, sa, cb, sb = (np.asarray(f(angle)) for angle in (row.alpha, row.beta) for f in (math.cos, math.sin))
    zero, one, a = np.asarray(0.0), np.asarray(1.0), np.asarray(row.a)
    matrix = np.zeros((4, 4, *q.shape))
    matrix[3, 3] = 1.0
    for i, entries in enumerate(_entries(row.convention, (ct, st), (ca, sa), (cb, sb), a, d, zero, one)):
        for k, entry in enumerate(entries):
            matrix[i, k] = entry
    return matrix


def _moved(row: Row, q: _Coordinate) -> tuple[_Coordinate | float, _Coordinate | float]:
    """Return theta and d of a row at a coordinate."""
    coordinate = -q if row.flip else q
    return (
        row.theta + coordinate if row.type.turns else row.theta,
        row.d + coordinate if row.type.moves and not row.type.turns else row.d,
    )


def _entries(
    convention: Convention,
    theta: tuple[_Number, _Number],
    alpha: tuple[_Number, _Number],
    beta: tuple[_Number, _Number],
    a: _Number,
    d: _Number,
    zero: _Number,
    one: _Number,
) -> list[list[_Number]]:
    """The upper three rows of A_i, as the textbooks print them; angles as cosine and sine."""
    (ct, st), (ca, sa), (cb, sb) = theta, alpha, beta
    match convention:
        case Convention.STANDARD:  # Rz(theta) Tz(d) Tx(a) Rx(alpha)
            return [
                [ct, -st * ca, st * sa, a * ct],
                [st, ct * ca, -ct * sa, a * st],
                [zero, one * sa, one * ca, d],
            ]
        case Convention.MODIFIED:  # Tx(a) Rx(alpha) Rz(theta) Tz(d)
            return [
                [ct, -st, zero, a],
                [st * ca, ct * ca, -one * sa, -sa * d],
                [st * sa, ct * sa, one * ca, ca * d],
            ]
        case Convention.HAYATI:  # Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta)
            return [
                [ct * cb - st * sa * sb, -st * ca, ct * sb + st * sa * cb, a * ct],
                [st * cb + ct * sa * sb, ct * ca, st * sb - ct * sa * cb, a * st],
                [-one * ca * sb, one * sa, one * ca * cb, d],
            ]


def _block_poses(spec: RobotSpec, columns: Array, poses: Array) -> None:
    """Fill ``poses`` (N, rows + 1, 4, 4) for the joint coordinates ``columns`` (n, N)."""
    count = columns.shape[1]
    product = np.repeat(_pose_matrix(spec.base.pose)[:, :, None], count, axis=2)
    poses[:, 0] = product.transpose(2, 0, 1)
    coordinate = iter(columns)
    for index, row in enumerate(spec.rows, start=1):
        q = next(coordinate) if row.type.moves else np.zeros(count)
        product = _product(product, row_matrix(row, q))
        poses[:, index] = product.transpose(2, 0, 1)


def _product(left: Array, right: Array) -> Array:
    """Matrix products of stacks of shape (4, 4, N): the sum over k of left[i, k] right[k, j]."""
    total = left[:, 0, None] * right[None, 0]
    for k in range(1, 4):
        total += left[:, k, None] * right[None, k]
    return total


def _pose_matrix(pose: Pose) -> Array:
    """Rz(yaw) Ry(pitch) Rx(roll) and the position, shape (4, 4)."""
    roll, pitch, yaw = (float(angle) for angle in pose.rpy)
    Rx = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
    Ry = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]])
    Rz = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    matrix = np.eye(4)
    matrix[:3, :3] = Rz @ Ry @ Rx
    matrix[:3, 3] = pose.xyz
    return matrix


_DIGITS = Context(prec=60)
_HALF_PI = Decimal("1.5707963267948966192313216916397514420985846996875529104874722961539")
_ROUNDING = Decimal("4e-16")
"""What a double leaves of a quarter turn, in quarter turns of 1 and more."""


def table_tool_errors(spec: RobotSpec, reference: RobotSpec, q: ArrayLike) -> tuple[float, float]:
    """Return how far tool0 of one table is from tool0 of another at most, to 60 digits.

    For tables whose rows lead so far out and back that doubles would measure themselves. Angles within the rounding
    of a double of a right one are taken for that.

    Args:
        spec: The robot.
        reference: The robot to compare it with.
        q: Joint vectors, rad and m, shape (N, n).

    Returns:
        Distance, m, and Frobenius norm of the difference of the rotations over sqrt(2), which for small angles is
        the angle between them, rad.
    """
    position, rotation = Decimal(0), Decimal(0)
    with localcontext(_DIGITS):
        for vector in np.asarray(q, dtype=np.float64).tolist():
            T, T_reference = _decimal_tool_pose(spec, vector), _decimal_tool_pose(reference, vector)
            gaps = [[(T[i][k] - T_reference[i][k]) ** 2 for k in range(4)] for i in range(3)]
            position = max(position, sum((row[3] for row in gaps), Decimal(0)))
            rotation = max(rotation, sum((sum(row[:3], Decimal(0)) for row in gaps), Decimal(0)))
        return float(position.sqrt()), float((rotation / 2).sqrt())


def _decimal_tool_pose(spec: RobotSpec, q: Sequence[float]) -> list[list[Decimal]]:
    zero, one = Decimal(0), Decimal(1)
    product = _decimal_pose(spec.base.pose)
    coordinates = iter(q)
    for row in spec.rows:
        theta, d = Decimal(row.theta), Decimal(row.d)
        cosine_sine = _decimal_cos_sin(theta)
        if row.type.moves:
            coordinate = Decimal(next(coordinates)) * (-1 if row.flip else 1)
            if row.type.turns:
                (c, s), (cq, sq) = cosine_sine, _decimal_cos_sin(coordinate)
                cosine_sine = c * cq - s * sq, s * cq + c * sq
            else:
                d += coordinate
        twists = _decimal_cos_sin(Decimal(row.alpha)), _decimal_cos_sin(Decimal(row.beta))
        matrix = _entries(row.convention, cosine_sine, *twists, Decimal(row.a), d, zero, one)
        product = _decimal_product(product, matrix)
    return _decimal_product(product, _decimal_pose(spec.tool))


def _decimal_pose(pose: Pose) -> list[list[Decimal]]:
    (cr, sr), (cp, sp), (cy, sy) = (_decimal_cos_sin(Decimal(angle)) for angle in pose.rpy.tolist())
    x, y, z = (Decimal(value) for value in pose.xyz.tolist())
    zero, one = Decimal(0), Decimal(1)
    Rx = [[one, zero, zero, zero], [zero, cr, -sr, zero], [zero, sr, cr, zero]]
    Ry = [[cp, zero, sp, zero], [zero, one, zero, zero], [-sp, zero, cp, zero]]
    Rz = [[cy, -sy, zero, x], [sy, cy, zero, y], [zero, zero, one, z]]
    return _decimal_product(_decimal_product(Rz, Ry), Rx)


def _decimal_product(A: list[list[Decimal]], B: list[list[Decimal]]) -> list[list[Decimal]]:
    return [
        [row[0] * B[0][k] + row[1] * B[1][k] + row[2] * B[2][k] + (row[3] if k == 3 else 0) for k in range(4)]
        for row in A
    ]


@lru_cache(maxsize=256)
def _decimal_cos_sin(angle: Decimal) -> tuple[Decimal, Decimal]:
    """By the Taylor series of what is left of an angle, rad, beyond quarter turns."""
    quarters = int((angle / _HALF_PI).to_integral_value())
    rest = angle - quarters * _HALF_PI
    if abs(rest) <= _ROUNDING * max(1, abs(quarters)):
        rest = Decimal(0)
    sums, term, k = [Decimal(0), Decimal(0)], Decimal(1), 0
    while term and abs(term) > Decimal("1e-70"):
        sums[k % 2] += term if k % 4 < 2 else -term
        k += 1
        term = term * rest / k
    cosine, sine = sums
    return ((cosine, sine), (-sine, cosine), (-cosine, -sine), (sine, -cosine))[quarters % 4]
