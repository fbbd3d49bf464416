"""How far poses are from the poses that they should be."""

from __future__ import annotations

import numpy as np

from dh2sim.typing import Array

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
