"""From configurations near a solution to the solution: Levenberg-Marquardt on the true arm, many at a time."""

from __future__ import annotations

import math

import numpy as np

from dh2sim.inverse.loop import Arm, Flags, pose_and_jacobian, pose_error
from dh2sim.typing import Array

_DONE = 1e-14
"""What is left of a pose, in lengths of the arm and rad, that no step makes less."""
_STEPS = 24
_PATIENT_STEPS = 60
"""Where configurations may be far from solutions."""
_SOON = 3
_NEAR = 1e-3
"""What is not as near as that to its pose after a few steps is not on its way to a solution nearby."""
_LONGEST = 1.0
"""Longest step of a coordinate, rad or lengths of the arm."""
_CAREFUL_STEPS = 30
_EXACT = 2e-15
"""What is left of a pose where careful steps end."""
_PROBE = 1e-3
"""How far along a step its curvature is measured, rad or lengths of the arm."""
_BENT = 0.75
"""Acceleration, as a share of the step, above which the step is too long for it."""


def polish(arm: Arm, q: Array, T: Array, moving: Flags, gate: float = math.inf) -> tuple[Array, Array, Array]:
    """Return configurations moved to where they reach their poses, and how far from that they still are.

    The damping is proportional to the square of what is left, so that convergence is quadratic at regular solutions.
    Source: N. Yamashita, M. Fukushima, On the rate of convergence of the Levenberg-Marquardt method, Computing
    Supplement 15, 2001.

    Args:
        arm: The arm.
        q: Coordinates of all its joints, in its own units, shape (M, n).
        T: Poses to reach, positions in units of the arm's length, shape (M, 4, 4).
        moving: Which joints may move, bool, shape (n,).
        gate: Configurations farther than that from their poses, in lengths of the arm and rad, stay as they are; so
            do those that are not near their poses soon. Without it, all are moved, and longer.

    Returns:
        Coordinates, shape (M, n), norms of the errors, shape (M,), and Jacobians there, shape (M, 6, n).
    """
    q = np.array(q)
    frame, J = pose_and_jacobian(arm, q)
    error = pose_error(frame, T)
    norm = np.linalg.norm(error, axis=1)
    damping = np.full(len(q), 1e-6)
    active = np.flatnonzero((norm > _DONE) & (norm < gate))
    all_J, J, error = J, J[active][:, :, moving], error[active]
    diagonal = np.arange(int(moving.sum()))
    patient = gate == math.inf
    for attempt in range(_PATIENT_STEPS if patient else _STEPS):
        if not len(active):
            break
        Jt = np.swapaxes(J, 1, 2)
        A = Jt @ J
        A[:, diagonal, diagonal] += (damping[active] * np.minimum(norm[active] ** 2, 1.0) + 1e-15)[:, None]
        step = solved(A, Jt @ error[:, :, None])[:, :, 0]
        step *= np.minimum(1.0, _LONGEST / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
        trial = q[active]
        trial[:, moving] += step
        frame, J_trial = pose_and_jacobian(arm, trial)
        error_trial = pose_error(frame, T[active])
        norm_trial = np.linalg.norm(error_trial, axis=1)
        better = norm_trial < norm[active]
        took = active[better]
        q[took], norm[took], all_J[took] = trial[better], norm_trial[better], J_trial[better]
        J[better], error[better] = J_trial[better][:, :, moving], error_trial[better]
        damping[active] = np.where(better, 0.1 * damping[active], 10.0 * np.maximum(damping[active], 1e-8))
        # near the end an attempt that does not help is the end
        keep = (norm[active] > _DONE) & (better | (norm[active] > 1e-13)) & (damping[active] < 1e6)
        if attempt >= _SOON and not patient:
            keep &= norm[active] < _NEAR
        active, J, error = active[keep], J[keep], error[keep]
    return q, norm, all_J


def solved(A: Array, b: Array) -> Array:
    """Return x of A x = b, the shortest where a damped matrix is singular in double precision nevertheless."""
    try:
        return np.asarray(np.linalg.solve(A, b))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.pinv(A, rcond=1e-15, hermitian=True) @ b)


def refine(arm: Arm, q: Array, T: Array, moving: Flags) -> tuple[Array, Array, Array]:
    """Return what :func:`polish` returns of configurations near nearly singular solutions, which it does not reach.

    The way there leads along a valley of the error that is bent: a straight step as long as needed leaves it. So
    steps are parabolas, with the acceleration that keeps them in the valley, and their damping is found by trial; and
    as the squares of the least singular values are lost in J^T J, J itself is decomposed. Source: M. K. Transtrum, J.
    P. Sethna, Improvements to the Levenberg-Marquardt algorithm for nonlinear least-squares minimization, 2012.

    Args:
        arm: The arm.
        q: Coordinates of all its joints, in its own units, shape (M, n).
        T: Poses to reach, positions in units of the arm's length, shape (M, 4, 4).
        moving: Which joints may move, bool, shape (n,).
    """
    q = np.array(q)
    frame, J = pose_and_jacobian(arm, q)
    error = pose_error(frame, T)
    norm = np.linalg.norm(error, axis=1)
    damping = np.full(len(q), 1e-16)
    for _ in range(_CAREFUL_STEPS):
        active = np.flatnonzero((norm > _EXACT) & (damping < 1.0))
        if not len(active):
            break
        moved = J[active][:, :, moving]
        U, S, Vt = np.linalg.svd(moved, full_matrices=False)
        inverse = np.swapaxes(Vt * (S / (S * S + damping[active, None]))[:, :, None], 1, 2) @ np.swapaxes(U, 1, 2)
        velocity = inverse @ error[active][:, :, None]
        probe = _PROBE / np.maximum(np.abs(velocity).max(axis=1, keepdims=True), 1e-300)
        ahead = q[active]
        ahead[:, moving] += (probe * velocity)[:, :, 0]
        bending = (pose_and_jacobian(arm, ahead)[1][:, :, moving] - moved) @ velocity / probe
        acceleration = -0.5 * inverse @ bending
        lengths = [np.linalg.norm(x, axis=(1, 2)) for x in (velocity, acceleration)]
        trial = q[active]
        trial[:, moving] += (velocity + acceleration)[:, :, 0]
        frame, J_trial = pose_and_jacobian(arm, trial)
        error_trial = pose_error(frame, T[active])
        norm_trial = np.linalg.norm(error_trial, axis=1)
        better = (norm_trial < norm[active]) & (lengths[1] <= _BENT * lengths[0])
        took = active[better]
        q[took], norm[took], J[took], error[took] = (x[better] for x in (trial, norm_trial, J_trial, error_trial))
        damping[active] = np.where(better, 0.1 * damping[active], 5.0 * np.maximum(damping[active], 1e-22))
    return q, norm, J
