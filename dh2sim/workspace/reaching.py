"""Joint coordinates inside their limits that bring coordinates of a point where they are wanted, for many at once."""

from __future__ import annotations

from typing import Final

import numpy as np

from dh2sim.typing import Array
from dh2sim.workspace.point import Coordinates, Flags

_FLOOR: Final = 1e-14
"""Damping that is always there, as a share of the squared Jacobian: singular systems stay solvable."""
_SLOW: Final = 4
"""Steps in a row that gain little, after which a search is given up."""
_GAIN: Final = 0.8
"""Share of the distance that is left by a step that gains little."""


def reach(
    coordinates: Coordinates, q: Array, targets: Array, *, within: float, slack: float = 0.0, most: int = 24
) -> tuple[Array, Flags]:
    """Search from each configuration for one that brings the point to a target, inside the limits.

    Steps are those of Levenberg and Marquardt with a damping that vanishes with the squared distance, which keeps
    convergence quadratic (Yamashita and Fukushima, On the rate of convergence of the Levenberg-Marquardt method,
    2001); joints at a limit that a step would cross are left out of it. Each search is by itself: results do not
    depend on which others run beside it.

    Args:
        coordinates: What is to reach the targets.
        q: Where searches start, shape (N, m).
        targets: Where to, shape (N, k).
        within: Greatest distance from the target along each coordinate, m.
        slack: Distance along each coordinate up to which a target is not approached any further, m; less than
            ``within``.
        most: Steps.

    Returns:
        Where searches ended, shape (N, m), and which of them reached their target, shape (N,).
    """
    found, reached = q.copy(), np.zeros(len(q), dtype=np.bool_)
    open_ = np.arange(len(q))
    at = found.copy()
    last = np.full(len(q), np.inf)
    slow = np.zeros(len(q), dtype=np.int64)
    for step in range(most + 1):
        x, J = coordinates.values(at)
        error = targets[open_] - x
        arrived = (np.abs(error) <= within).all(axis=-1)
        reached[open_] |= arrived
        found[open_] = at
        if slack:
            error = error - np.clip(error, -slack, slack)
        distance = np.sqrt((error * error).sum(axis=-1))
        slow = np.where(distance > _GAIN * last, slow + 1, 0)
        going = ~arrived & (slow < _SLOW)
        if step == most or not q.shape[1] or not going.any():
            break
        open_, slow = open_[going], slow[going]
        at, J, error, last = at[going], J[going], error[going], distance[going]
        at = np.clip(at + _step(coordinates, at, J, error), coordinates.lower, coordinates.upper)
    return found, reached


def _step(coordinates: Coordinates, q: Array, J: Array, error: Array) -> Array:
    """Return damped steps towards the targets, shape (N, m), of joints that are free to make them."""
    steps = coordinates.steps
    free = np.ones(q.shape)
    scaled = J * steps
    size = (scaled * scaled).sum(axis=(1, 2))
    damping = _FLOOR * size + np.minimum(1e-3 * (error * error).sum(axis=-1), 1e-2 * size) + 1e-300
    for _ in range(3):
        Jf = scaled * free[:, None, :]
        dq = steps * _pulled_back(Jf, _solved(Jf, damping, error))
        blocked = ((q <= coordinates.lower) & (dq < 0.0)) | ((q >= coordinates.upper) & (dq > 0.0))
        if not blocked.any():
            break
        free[blocked] = 0.0
    else:
        dq = np.where(free > 0.0, dq, 0.0)
    excess = (np.abs(dq) / steps).max(axis=-1)
    return np.asarray(dq / np.maximum(1.0, excess)[:, None])


def _pulled_back(J: Array, y: Array) -> Array:
    """Return Jᵀ y, shape (N, m)."""
    total = J[:, 0] * y[:, 0, None]
    for k in range(1, J.shape[1]):
        total = total + J[:, k] * y[:, k, None]
    return np.asarray(total)


def _solved(J: Array, damping: Array, error: Array) -> Array:
    """Solve (J Jᵀ + damping) y = error for up to three rows, in plain arithmetic."""
    rows = J.shape[1]
    G = [[(J[:, i] * J[:, j]).sum(axis=-1) if i <= j else 0.0 for j in range(rows)] for i in range(rows)]
    a = G[0][0] + damping
    if rows == 1:
        return np.asarray(error / a[:, None])
    b, d = G[0][1], G[1][1] + damping
    if rows == 2:
        determinant = np.maximum(a * d - b * b, 1e-300)
        e, f = error.T
        return np.stack([(d * e - b * f) / determinant, (a * f - b * e) / determinant], axis=-1)
    c, g, h = G[0][2], G[1][2], G[2][2] + damping
    # Cholesky factors: the damped matrix is positive definite
    l00 = np.sqrt(a)
    l10, l20 = b / l00, c / l00
    l11 = np.sqrt(np.maximum(d - l10 * l10, 1e-300))
    l21 = (g - l20 * l10) / l11
    l22 = np.sqrt(np.maximum(h - l20 * l20 - l21 * l21, 1e-300))
    e, f, k = error.T
    u = e / l00
    v = (f - l10 * u) / l11
    w = (k - l20 * u - l21 * v) / l22
    z = w / l22
    y = (v - l21 * z) / l11
    x = (u - l10 * y - l20 * z) / l00
    return np.stack([x, y, z], axis=-1)
