"""The oracle: poses straight from the Denavit-Hartenberg table, by the textbooks' matrices, row by row.

Nothing here may use the kinematic chain or its helpers: were the chain wrong, everything made from it would
be wrong in the same way. This module has its own sines, its own matrices and its own product.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.robot.spec import Convention, Pose, RobotSpec, Row
from dh2sim.typing import Array

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
    coordinate = -q if row.flip else q
    theta = row.theta + coordinate if row.type.turns else np.full(q.shape, row.theta)
    d = row.d + coordinate if row.type.moves and not row.type.turns else np.full(q.shape, row.d)
    ct, st, ca, sa = np.cos(theta), np.sin(theta), math.cos(row.alpha), math.sin(row.alpha)
    cb, sb = math.cos(row.beta), math.sin(row.beta)
    zero, one, a = np.zeros(q.shape), np.ones(q.shape), np.full(q.shape, row.a)
    match row.convention:
        case Convention.STANDARD:  # Rz(theta) Tz(d) Tx(a) Rx(alpha)
            matrix = [
                [ct, -st * ca, st * sa, a * ct],
                [st, ct * ca, -ct * sa, a * st],
                [zero, one * sa, one * ca, d],
            ]
        case Convention.MODIFIED:  # Tx(a) Rx(alpha) Rz(theta) Tz(d)
            matrix = [
                [ct, -st, zero, a],
                [st * ca, ct * ca, -one * sa, -sa * d],
                [st * sa, ct * sa, one * ca, ca * d],
            ]
        case Convention.HAYATI:  # Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta)
            matrix = [
                [ct * cb - st * sa * sb, -st * ca, ct * sb + st * sa * cb, a * ct],
                [st * cb + ct * sa * sb, ct * ca, st * sb - ct * sa * cb, a * st],
                [-one * ca * sb, one * sa, one * ca * cb, d],
            ]
    return np.array([*matrix, [zero, zero, zero, one]])


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
