"""Dynamics as the joints see it: of all degrees of freedom, or with a floating base that nothing holds."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from dh2sim.simulate.plant import Plant
from dh2sim.typing import Array

BASE = 6
"""Degrees of freedom of a floating base."""


class JointSpace:
    """Turns MuJoCo's mass matrix and forces into those of the equation tau = M a + c of the n joints.

    On a floating base no force acts, so that its acceleration a_b is whatever the joints' one makes of it:
    M_bb a_b + M_bj a + c_b = 0. Put into the joints' equation this leaves the inertia M_jj - M_jb M_bb⁻¹ M_bj and the
    force c_j - M_jb M_bb⁻¹ c_b. Source: Y. Umetani, K. Yoshida, Resolved motion rate control of space manipulators
    with generalized Jacobian matrix (1989), and R. Featherstone, Rigid Body Dynamics Algorithms (2008), section 9.3.
    """

    def __init__(self, plant: Plant) -> None:
        """Describe a plant."""
        self._floating = plant.floating
        self._index = _dense_index(plant.model)

    def inertia(self, mass: Array) -> Array:
        """Return the inertia, shape (batch, n, n), from MuJoCo's sparse ``M``, shape (batch, entries)."""
        M = np.take(mass, self._index, axis=1)
        if not self._floating:
            return M
        follows = np.linalg.solve(_of_base(M), M[:, :BASE, BASE:])
        reduced = M[:, BASE:, BASE:].copy()
        for k in range(BASE):  # one by one: the same order of additions for any batch
            reduced -= M[:, BASE:, k, None] * follows[:, None, k, :]
        return reduced

    def force(self, mass: Array, force: Array) -> Array:
        """Return the joints' forces, shape (batch, n), from those of all degrees of freedom, shape (batch, nv)."""
        if not self._floating:
            return np.array(force)
        M = np.take(mass, self._index, axis=1)
        follows = np.linalg.solve(_of_base(M), force[:, :BASE, None])[:, :, 0]
        reduced = force[:, BASE:].copy()
        for k in range(BASE):
            reduced -= M[:, BASE:, k] * follows[:, k, None]
        return reduced


def _of_base(M: Array) -> Array:
    """Return the floating base's own inertia, and the identity where a simulation failed before it had any."""
    own = M[:, :BASE, :BASE].copy()
    own[~own.any(axis=(1, 2))] = np.eye(BASE)
    return own


def _dense_index(model: mujoco.MjModel) -> NDArray[np.intp]:
    """Where MuJoCo's sparse lower triangle of the mass matrix holds each entry of the dense one; a chain has all."""
    index = np.zeros((model.nv, model.nv), dtype=np.intp)
    for row in range(model.nv):
        start = model.M_rowadr[row]
        for k in range(start, start + model.M_rownnz[row]):
            index[row, model.M_colind[k]] = index[model.M_colind[k], row] = k
    return index
