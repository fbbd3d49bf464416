"""Eigenvalues and eigenvectors of a pencil, and what eigenvectors of double eigenvalues are mixtures of.

The pencil C_0 + t C_1 + t² C_2 is singular where t = tan(q / 2) is the half-angle tangent of a joint at a solution.
Where several solutions share that angle, as they often do where joints stand at right angles, they share an
eigenvalue, and the eigenvectors are any mixtures of theirs, which rounding picks.
"""

from __future__ import annotations

import numpy as np

from dh2sim.inverse.loop import Flags, Indices
from dh2sim.typing import Array

_CLOSE = 1e-5
"""Half angles that differ by less, in rad, may be one, whose eigenvector is any mixture of those of two solutions."""
_NEAR = 1e-2
"""Half angles that differ by less may be one that rounding has split: whether they are is looked at."""
_LARGE = 1e5
"""Quotient of matrices above which eigenvalues are ill-conditioned."""
_SINGULAR = 1e8
"""Condition above which they are, too, though quotients of what rounding leaves may be small."""
_WEIGHTS = (0.8, 0.6)
"""Of the shifts of two powers: where one does not tell solutions apart, both do."""


def eigenpairs(C: Array) -> tuple[Array, Array, Flags, Array]:
    """Return what solves (C_0 + t C_1 + t² C_2) v = 0.

    Args:
        C: Shape (3, N, s, s).

    Returns:
        Eigenvalues, complex, shape (N, 2s), vectors in columns, shape (N, s, 2s), which are ill-conditioned, because
        C_2 is nearly singular, bool, shape (N,), and by how much rounding may have changed the pencils that these are
        the eigenvalues of, shape (N,).
    """
    size = C.shape[-1]
    companion = np.zeros((C.shape[1], 2 * size, 2 * size))
    companion[:, :size, size:] = np.eye(size)
    unit = np.broadcast_to(np.eye(size), C[2].shape)
    solved = _solved(C[2], np.concatenate([C[0], C[1], unit], axis=2))
    companion[:, size:] = -solved[:, :, : 2 * size]
    bad = np.logical_not(np.isfinite(companion).all(axis=(1, 2)))
    companion[bad] = 0.0
    t, V = np.linalg.eig(companion)
    t = np.where(bad[:, None], np.nan, t).astype(np.complex128)
    condition = np.abs(C[2]).max(axis=(1, 2)) * np.abs(solved[:, :, 2 * size :]).max(axis=(1, 2))
    large = bad | (np.abs(companion).max(axis=(1, 2)) > _LARGE) | (condition > _SINGULAR)
    # of the companion matrix, whose eigenvalues are those of one that differs by so much, and back to the pencil
    rounding = np.finfo(np.float64).eps * np.linalg.norm(companion, axis=(1, 2)) * np.linalg.norm(C[2], axis=(1, 2))
    V = np.where((np.abs(t) <= 1.0)[:, None, :], V[:, :size], V[:, size:]).astype(np.complex128)
    return t, V, large, rounding


def are_double(half: Array) -> Flags:
    """Return for which poses two real half angles are the same, shape (N, 2s), as then eigenvectors are mixtures."""
    real = np.abs(half.imag) < _CLOSE
    angles = np.sort(np.where(real, half.real, np.inf), axis=1)
    last = np.where(real, half.real, -np.inf).max(axis=1)
    with np.errstate(invalid="ignore"):  # of infinities
        double = (np.diff(angles, axis=1) < _CLOSE).any(axis=1)
    return np.asarray(double | (angles[:, 0] + np.pi - last < _CLOSE))


def shared(C: Array, half: Array, rounding: Array) -> tuple[Indices, Array, Indices]:
    """Return real half angles that several solutions share: those that are the same, or have been split by rounding.

    Args:
        C: Coefficients of 1, t, t², shape (3, N, s, s).
        half: Half angles, complex, shape (N, 2s).
        rounding: By how much rounding may have changed the pencils, shape (N,).

    Returns:
        The pose of each, shape (M,), the half angle, rad, shape (M,), and how many solutions share it, shape (M,).
    """
    poses = np.flatnonzero(are_double(half))
    groups = [(i, group.mean(), len(group)) for i in poses for group in _equal(half[i])]
    pose, count = (np.array([group[k] for group in groups], dtype=np.intp) for k in (0, 2))
    angle = np.array([group[1] for group in groups], dtype=np.float64)
    split = _split(C, half, rounding)
    return np.append(pose, split[0]), np.append(angle, split[1]), np.append(count, split[2])


def taken_apart(C: Array, pose: Indices, angle: Array, count: Indices) -> tuple[Indices, Array, Array]:
    """Return the vectors of the solutions that share an eigenvalue, of which its eigenvectors are mixtures.

    A vector of products t_4^i t_5^j is that of one solution if shifting the powers multiplies it by a number. On the
    space that several span, shifting is a small matrix, whose eigenvectors tell how to combine them. Sources: R. Roy,
    T. Kailath, ESPRIT - estimation of signal parameters via rotational invariance techniques, IEEE Trans. Acoustics,
    Speech and Signal Processing 37(7), 1989; H. J. Stetter, Numerical Polynomial Algebra, 2004, chapter 2.

    Args:
        C: Coefficients of 1, t, t², shape (3, N, s, s).
        pose: The pose of each half angle that several share, shape (G,).
        angle: The half angles, rad, shape (G,).
        count: How many share them, shape (G,).

    Returns:
        The pose of each vector, shape (M,), its half angle, rad, shape (M,), and the vectors, shape (M, s).
    """
    size = C.shape[-1]
    few = count <= (6 if size > 4 else 3)  # numbers that a shift gives
    pose, angle, count = pose[few], angle[few], count[few]
    null = np.linalg.svd(_at(C, pose, angle))[2]
    chosen, vectors = [np.zeros(0, dtype=np.intp)], [np.zeros((0, size))]
    for m in sorted(set(count.tolist())):
        same = np.flatnonzero(count == m)
        space = np.swapaxes(null[same, -m:], 1, 2)
        powers = space.reshape(len(same), 4, size // 4, m)
        low, high = powers[:, :3], powers[:, 1:]
        if size > 4:
            low, high = low[:, :, :-1], _WEIGHTS[0] * high[:, :, :-1] + _WEIGHTS[1] * low[:, :, 1:]
        low, high = (part.reshape(len(same), -1, m) for part in (low, high))
        single = (space @ np.linalg.eig(np.linalg.pinv(low) @ high)[1]).real
        chosen.append(np.repeat(same, m))
        vectors.append(np.swapaxes(single, 1, 2).reshape(-1, size))
    which = np.concatenate(chosen)
    return pose[which], angle[which], np.concatenate(vectors)


def _split(C: Array, half: Array, rounding: Array) -> tuple[Indices, Array, Indices]:
    """Return what :func:`shared` does, of half angles that rounding has split so far that they seem to be two.

    How far it moves two that are the same depends on the pencil: the farther, the nearer others are, real or not. But
    where the two were, two singular values of the pencil are no more than rounding; between two that differ, one at
    most is. Source: F. Tisseur, Backward error and condition of polynomial eigenvalue problems, Linear Algebra and
    its Applications 309, 2000.
    """
    real = np.where(np.abs(half.imag) < _NEAR, half.real, np.inf)
    order = np.argsort(real, axis=1)
    angles, imaginary = (np.take_along_axis(part, order, 1) for part in (real, np.abs(half.imag)))
    following = np.roll(angles, -1, axis=1)
    following[np.arange(len(angles)), np.isfinite(angles).sum(axis=1) - 1] = angles[:, 0] + np.pi  # half a turn on
    with np.errstate(invalid="ignore"):  # of infinities
        gaps = np.where(np.isfinite(angles), following - angles, np.inf)
    distinct = (gaps >= _CLOSE) | (np.maximum(imaginary, np.roll(imaginary, -1, axis=1)) >= _CLOSE)
    pose, k = np.nonzero((gaps < _NEAR) & distinct)
    angle = angles[pose, k] + 0.5 * gaps[pose, k]
    count = (np.linalg.svd(_at(C, pose, angle), compute_uv=False) <= rounding[pose, None]).sum(axis=1)
    split = count > 1
    return pose[split], angle[split], count[split]


def _at(C: Array, pose: Indices, angle: Array) -> Array:
    """Return the pencils of poses at half angles, times the squares of their cosines, shape (M, s, s)."""
    c, s = np.cos(angle)[:, None, None], np.sin(angle)[:, None, None]
    return np.asarray(c * c * C[0, pose] + s * c * C[1, pose] + s * s * C[2, pose])


def _equal(half: Array) -> list[Array]:
    """Return the groups of real half angles of a pose that are the same but for rounding, half turns left out."""
    angles = np.sort(half.real[np.abs(half.imag) < _CLOSE])
    wide = np.flatnonzero(np.append(np.diff(angles), angles[:1] + np.pi - angles[-1:]) >= _CLOSE)
    if not len(wide):
        return []
    begin = int(wide[0]) + 1
    angles = np.concatenate([angles[begin:], angles[:begin] + np.pi])
    groups = np.split(angles, np.flatnonzero(np.diff(angles) >= _CLOSE) + 1)
    return [group for group in groups if len(group) > 1]


def _solved(A: Array, B: Array) -> Array:
    """Solve A X = B for each of N problems; a singular one gives NaN instead of spoiling the others."""
    try:
        return np.asarray(np.linalg.solve(A, B))
    except np.linalg.LinAlgError:
        X = np.full(np.broadcast_shapes(A.shape[:1], B.shape[:1]) + B.shape[1:], np.nan)
        for i in range(len(A)):
            try:
                X[i] = np.linalg.solve(A[i], B[i])
            except np.linalg.LinAlgError:
                continue
        return X
