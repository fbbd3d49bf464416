"""Screws of joints: the motions they allow, how these move along, and the algebra that several generate.

A screw is (w, v), shape (6,): angular velocity, and the velocity of the point of the body that is at the origin. See
Murray, Li and Sastry, *A Mathematical Introduction to Robotic Manipulation*, chapter 2.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.kinematics.rotations import hat
from dh2sim.typing import Array

DEPENDENT: Final = 1e-8
"""Singular values below this share of the largest are zero: what is closed to 1e-12 leaves 1e-12."""


def turning(point: ArrayLike, axis: ArrayLike) -> Array:
    """Return the screw of a turn about the line through ``point`` along ``axis``, shape (6,)."""
    direction = _unit(axis)
    return np.concatenate([direction, np.cross(np.asarray(point, dtype=np.float64), direction)])


def sliding(axis: ArrayLike) -> Array:
    """Return the screw of a slide along ``axis``, shape (6,)."""
    return np.concatenate([np.zeros(3), _unit(axis)])


def _unit(axis: ArrayLike) -> Array:
    direction = np.asarray(axis, dtype=np.float64)
    return np.asarray(direction / np.linalg.norm(direction))


def bracket(a: Array, b: Array) -> Array:
    """Return the Lie bracket [a, b] of two screws, shape (6,): how ``b`` changes as the body moves along ``a``."""
    turn = hat(a[:3])
    return np.concatenate([turn @ b[:3], turn @ b[3:] + hat(a[3:]) @ b[:3]])


def algebra(screws: ArrayLike) -> Array:
    """Return an orthonormal basis of the smallest Lie algebra that contains screws.

    Its dimension is the lambda of Gruebler's count: 3 for parallel axes (planar) and for axes through a point
    (spherical), 6 in general; 1, 2, 4 and 5 occur too. See Hervé, *Analyse structurelle des mécanismes par groupe des
    déplacements*, 1978.

    Args:
        screws: Lengths of the order of 1, shape (count, 6).

    Returns:
        Shape (dimension, 6).
    """
    basis = row_space(np.asarray(screws, dtype=np.float64).reshape(-1, 6))
    while True:
        brackets = [bracket(a, b) for i, a in enumerate(basis) for b in basis[:i]]
        larger = row_space(np.vstack([basis, *brackets]))
        if len(larger) == len(basis):
            return basis
        basis = larger


def row_space(rows: Array) -> Array:
    """Return an orthonormal basis of the space that rows span, shape (rank, columns)."""
    if not rows.size:
        return rows[:0]
    _, values, basis = np.linalg.svd(rows, full_matrices=False)
    return np.asarray(basis[values > DEPENDENT * max(values[0], 1e-300)])


def common_motions(a: Array, b: Array) -> Array:
    """Return an orthonormal basis of the screws that two spaces of screws share.

    Args:
        a: Screws that span the first, shape (count, 6).
        b: Screws that span the second, shape (count, 6).

    Returns:
        Shape (dimension, 6).
    """
    first, second = row_space(a), row_space(b)
    cosines, directions = np.linalg.svd(second @ first.T)[1:]
    return np.asarray(directions[: len(cosines)][cosines > 1.0 - DEPENDENT] @ first)


def exponential(screw: Array, q: Array) -> Array:
    """Return the motions along a screw, shape (count, 4, 4); the angular part of ``screw`` is a unit vector or zero.

    Args:
        screw: Shape (6,).
        q: How far, shape (count,).
    """
    w, v = screw[:3], screw[3:]
    motions = np.zeros((len(q), 4, 4))
    motions[:] = np.eye(4)
    if not w.any():
        motions[:, :3, 3] = q[:, None] * v
        return motions
    W = hat(w)
    s, c = np.sin(q)[:, None, None], (1.0 - np.cos(q))[:, None, None]
    motions[:, :3, :3] += s * W + c * (W @ W)
    motions[:, :3, 3] = (q[:, None, None] * np.eye(3) + c * W + (q[:, None, None] - s) * (W @ W)) @ v
    return motions


def moved_screw(motions: Array, screw: Array) -> Array:
    """Return where motions take a screw, Ad(T) screw, shape (count, 6)."""
    rotations, positions = motions[:, :3, :3], motions[:, :3, 3]
    seen = (positions[:, None] @ rotations)[:, 0]  # from the moved frame: p x R w = R (R' p x w)
    slides = screw[3:] - seen @ hat(screw[:3]).T
    return np.concatenate([rotations @ screw[:3], (rotations @ slides[:, :, None])[:, :, 0]], axis=1)
