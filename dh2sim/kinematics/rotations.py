"""Rotations as matrices, made of axes and angles, rotation vectors and quaternions; arrays of any number of them.

For what stays in memory: products of matrices may differ in the last bit from machine to machine, so what reaches an
export is computed by ``transforms``. Source of the formulas: K. M. Lynch, F. C. Park, Modern Robotics, 2017, section
3.2.3 (Rodrigues' formula and its inverse) and appendix B.3 (quaternions).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.typing import Array


def hat(vectors: Array) -> Array:
    """Return the matrices of cross products with vectors, shape (..., 3) to (..., 3, 3)."""
    K = np.zeros((*vectors.shape, 3))
    K[..., 2, 1], K[..., 0, 2], K[..., 1, 0] = np.moveaxis(vectors, -1, 0)
    return K - np.swapaxes(K, -1, -2)


def rotations_about(axis: Array, angles: float | Array) -> Array:
    """Return the rotations by angles, rad, shape (...), about one unit vector, shape (..., 3, 3)."""
    K = hat(np.asarray(axis, dtype=np.float64))
    turned = np.asarray(angles, dtype=np.float64)[..., None, None]
    half = np.sin(0.5 * turned)
    return np.asarray(np.eye(3) + np.sin(turned) * K + 2.0 * half * half * (K @ K))


def rotations_of_vectors(vectors: Array) -> Array:
    """Return the rotations of rotation vectors, rad, shape (..., 3) to (..., 3, 3)."""
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    safe = np.where(angle > 0.0, angle, 1.0)
    # sin(a) / a and (1 - cos a) / a², without cancellation
    first = np.where(angle > 0.0, np.sin(angle) / safe, 1.0)
    second = np.where(angle > 0.0, 2.0 * (np.sin(0.5 * angle) / safe) ** 2, 0.5)
    K = hat(vectors)
    return np.asarray(np.eye(3) + first * K + second * (K @ K))


def rotation_vectors(R: Array) -> Array:
    """Return the rotation vectors, rad, of rotations, shape (..., 3, 3) to (..., 3); their lengths are 0 to pi."""
    axial = 0.5 * np.stack(
        [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1
    )
    sine = np.linalg.norm(axial, axis=-1)
    cosine = 0.5 * (np.trace(R, axis1=-2, axis2=-1) - 1.0)
    angle = np.arctan2(sine, cosine)
    vectors = np.asarray(np.where(sine > 0.0, angle / np.where(sine > 0.0, sine, 1.0), 1.0)[..., None] * axial)
    for i in map(tuple, np.argwhere((cosine < 0.0) & (sine < 1e-4))):
        # near half a turn the axis is in the symmetric part
        symmetric = 0.5 * (R[i] + R[i].T) - np.cos(angle[i]) * np.eye(3)
        column = symmetric[:, int(np.argmax(np.diag(symmetric)))]
        axis = column / np.linalg.norm(column)
        vectors[i] = angle[i] * (axis if axis @ axial[i] >= 0.0 else -axis)
    return vectors


def rotations_of_quaternions(quaternions: ArrayLike) -> Array:
    """Return the rotations of unit quaternions (w, x, y, z), shape (..., 4) to (..., 3, 3)."""
    w, x, y, z = np.moveaxis(np.asarray(quaternions, dtype=np.float64), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))
