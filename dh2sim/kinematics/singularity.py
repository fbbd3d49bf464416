"""How well a robot moves at a configuration: singular values of its Jacobian, and motions that are lost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.typing import Array, read_only

SINGULAR = 1e-9
"""A singular value below this share of the largest counts as zero: what is left of it is rounding."""


def singular_values(J: ArrayLike) -> Array:
    """Return the singular values of Jacobians, largest first.

    Rows in m and rows in rad are not weighted, so the values depend on the unit of length, but not which are zero.

    Args:
        J: Jacobians, shape (..., 6, n).

    Returns:
        Shape (..., min(6, n)).
    """
    return np.asarray(np.linalg.svd(np.asarray(J, dtype=np.float64), compute_uv=False))


def manipulability(J: ArrayLike) -> Array:
    """Return Yoshikawa's measure, the product of the singular values; it is zero at a singular configuration.

    It is sqrt(det(J Jᵀ)), and sqrt(det(Jᵀ J)) where a robot has fewer than six joint coordinates. Source:
    T. Yoshikawa, Manipulability of Robotic Mechanisms, International Journal of Robotics Research 4(2), 1985.

    Args:
        J: Jacobians, shape (..., 6, n).

    Returns:
        Shape (...).
    """
    return np.asarray(singular_values(J).prod(axis=-1))


def rank(J: ArrayLike) -> int:
    """Return the rank of a Jacobian of shape (6, n): the dimension of the frame's possible velocities."""
    values = singular_values(J)
    return int((values > SINGULAR * values.max(initial=0.0)).sum())


def still_motions(J: ArrayLike) -> Array:
    """Return the joint motions that leave the frame still: a basis of the null space of a Jacobian.

    It has n - rank vectors: n - 6 self-motions of a redundant robot, and one more for each direction in which a
    singular configuration cannot move the frame.

    Args:
        J: The Jacobian at one configuration, shape (6, n).

    Returns:
        Rates of the joint coordinates, shape (n - rank, n), in reduced form: each vector has a 1 where all others
        have a 0.
    """
    return _basis(np.asarray(J, dtype=np.float64))


def lost_directions(J: ArrayLike) -> Array:
    """Return the velocities that the frame cannot have: a basis of the orthogonal complement of the column space.

    Args:
        J: The Jacobian at one configuration, shape (6, n).

    Returns:
        Linear and angular velocities, shape (6 - rank, 6), in reduced form.
    """
    return _basis(np.asarray(J, dtype=np.float64).T)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VelocityEllipsoid:
    """The velocities that a frame's origin has while the joint rates have the norm 1."""

    axes: Array
    """Its principal axes in base_link, the longest first: the columns of a rotation, shape (3, 3)."""
    semi_axes: Array
    """Their half lengths, m/s, shape (3,); zero in a direction in which the origin cannot move."""


def velocity_ellipsoid(J: ArrayLike) -> VelocityEllipsoid:
    """Return the ellipsoid of manipulability of a Jacobian's linear part J_v: v with vᵀ (J_v J_vᵀ)⁻¹ v = 1.

    Its half axes are the left singular vectors of J_v times the singular values. Source: B. Siciliano, L. Sciavicco,
    L. Villani, G. Oriolo, Robotics: Modelling, Planning and Control, 2009, section 3.9.

    Args:
        J: The Jacobian at one configuration, shape (6, n).
    """
    linear = np.asarray(J, dtype=np.float64)[:3]
    axes, values, _ = np.linalg.svd(linear)
    semi_axes = np.zeros(3)
    semi_axes[: len(values)] = values
    if np.linalg.det(axes) < 0.0:
        axes[:, 2] *= -1.0
    return VelocityEllipsoid(axes=read_only(axes), semi_axes=read_only(semi_axes))


def _basis(A: Array) -> Array:
    """Return a basis of the null space of A in reduced form, shape (columns - rank, columns)."""
    basis = np.linalg.svd(A)[2][rank(A) :].copy()
    for i in range(len(basis)):
        size = np.abs(basis[i:])
        # the first of the largest elements: rounding does not choose between equal ones
        row, column = np.unravel_index(np.argmax(size > (1.0 - SINGULAR) * size.max()), size.shape)
        basis[[i, i + int(row)]] = basis[[i + int(row), i]]
        basis[i] /= basis[i, column]
        others = np.arange(len(basis)) != i
        basis[others] -= np.outer(basis[others, column], basis[i])
    basis[np.abs(basis) < SINGULAR] = 0.0
    return basis
