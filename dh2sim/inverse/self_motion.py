"""Self-motions: the curves in joint space along which an arm with a joint to spare holds its pose.

A curve is followed by continuation: a step along the null vector of the Jacobian, then back onto the pose by Newton's
steps of least norm. It is closed where it comes back to where it began, angles modulo whole turns; those of an arm
whose joints all turn are closed, but for those through singularities. Sources: J. W. Burdick, On the inverse
kinematics of redundant manipulators: characterization of the self-motion manifolds, ICRA 1989; E. L. Allgower,
K. Georg, Introduction to Numerical Continuation Methods, 2003, chapter 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.inverse.loop import Arm, pose_and_jacobian, pose_error
from dh2sim.typing import Array

SELF_MOTION: Final = "self-motion"
ON_POSE: Final = 1e-13
"""Error up to which a point is on the curve, in lengths of the arm and rad."""
LONGEST: Final = 0.05
"""Step, in rad and lengths of the arm; the first is shorter, and where the curve bends or is lost they are, too."""
FIRST: Final = 0.02
SHORTEST: Final = 1e-6
STRAIGHT: Final = 0.985
"""Least cosine of the angle between the directions at both ends of a step."""
MOST: Final = 4000
"""Points of a curve."""
FAR: Final = 10.0
"""A slide this many lengths of the arm from where it began ends the curve."""
WOUND: Final = 5.0 * np.pi
"""A turn this far from where it began ends it, too: such a curve winds over a surface, and may never close."""
FLAT: Final = 1e-7
"""Singular values below count as zero."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Path:
    """Points of a curve in order."""

    q: Array
    """In the arm's units, angles without jumps, shape (m, n)."""
    closed: bool
    """Whether it goes on from the last point to the first."""


def follow(arm: Arm, q: Array, T: Array, moving: NDArray[np.bool_]) -> Path:
    """Follow the curve through a configuration on which the arm holds its pose.

    Args:
        arm: The arm; the goal's joints count as its own.
        q: A configuration that reaches the pose, in the arm's units, shape (n,).
        T: The pose, its position in units of the arm's length, shape (4, 4).
        moving: Which joints may move, bool, shape (n,); one more than the pose needs.

    Returns:
        The curve, both ways from ``q`` until it closes or cannot be followed any farther.
    """
    curve = _Curve(arm, T, moving)
    ahead, closed = curve.followed(q, 1.0)
    if closed:
        return Path(q=ahead, closed=True)
    back, _ = curve.followed(q, -1.0)
    return Path(q=np.concatenate([back[:0:-1], ahead]), closed=False)


class _Curve:
    """The configurations that reach one pose."""

    def __init__(self, arm: Arm, T: Array, moving: NDArray[np.bool_]) -> None:
        self._arm, self._T, self._moving = arm, T[None], moving
        self._turns = np.array(arm.turns)

    def followed(self, start: Array, sign: float) -> tuple[Array, bool]:
        """Return points from ``start`` on in one direction, and whether they lead back to it."""
        first = sign * self._first_direction(start)
        q, direction, step = start, first, FIRST
        points = [start]
        while len(points) < MOST:
            reached = self._onto(q + step * direction)
            ahead = None if reached is None else self._direction(reached[1], direction)
            if reached is None or ahead is None or float(ahead @ direction) < STRAIGHT:
                step *= 0.5
                if step < SHORTEST:
                    return np.array(points), False
                continue
            there = reached[0]
            if len(points) > 3 and self._passes(start, q, there) and float(ahead @ first) > 0.5:
                return np.array(points), True
            if (np.abs(there - start) > np.where(self._turns, WOUND, FAR)).any():
                return np.array(points), False
            points.append(there)
            q, direction, step = there, ahead, min(1.5 * step, LONGEST)
        return np.array(points), False

    def _first_direction(self, q: Array) -> Array:
        """Return a unit vector along a curve through ``q``: of several, one that goes on."""
        directions = null_directions(self._arm, q, self._moving)
        for direction in directions if len(directions) > 1 else ():
            reached = self._onto(q + FIRST * direction)
            if reached is not None and float(np.linalg.norm(reached[0] - q - FIRST * direction)) < 0.1 * FIRST:
                return np.asarray(direction)
        return np.asarray(directions[-1])

    def _direction(self, J: Array, before: Array) -> Array:
        """Return the unit vector along the curve that goes on, given the Jacobian of the joints that move."""
        null = _null_space(J)
        direction = np.zeros(len(before))
        direction[self._moving] = null.T @ (null @ before[self._moving])
        length = float(np.linalg.norm(direction))
        return direction / length if length > 0.0 else direction

    def _onto(self, q: Array) -> tuple[Array, Array] | None:
        """Return the point of the curve near ``q``, and the Jacobian of the joints that move; None if it is far."""
        q = q.copy()
        for _ in range(6):
            error, J = self._error(q)
            if float(np.abs(error).max()) <= ON_POSE:
                return q, J
            move = np.linalg.lstsq(J, error, rcond=FLAT)[0]
            if float(np.abs(move).max(initial=0.0)) > 4.0 * LONGEST:
                return None
            q[self._moving] += move
        error, J = self._error(q)
        return (q, J) if float(np.abs(error).max()) <= 100.0 * ON_POSE else None

    def _error(self, q: Array) -> tuple[Array, Array]:
        """Return what is left to the pose, shape (6,), and the Jacobian of the joints that move."""
        frame, J = pose_and_jacobian(self._arm, q[None])
        return pose_error(frame, self._T)[0], J[0][:, self._moving]

    def _passes(self, start: Array, q: Array, there: Array) -> bool:
        """Return whether a step leads past the start, angles modulo whole turns."""
        step, gap = there - q, self.wrapped(start - q)
        length = float(np.linalg.norm(step))
        along = float(gap @ step) / length
        across = float(np.linalg.norm(gap - along / length * step))
        return 0.0 < along <= length and across < 0.1 * length

    def wrapped(self, difference: Array) -> Array:
        """Return a difference of configurations, whole turns left out."""
        return np.where(self._turns, (difference + np.pi) % (2.0 * np.pi) - np.pi, difference)


def null_directions(arm: Arm, q: Array, moving: NDArray[np.bool_]) -> Array:
    """Return unit vectors that span the velocities at which the tool stands still, shape (k, n), k at least 1.

    Where there are several, each moves as few joints as possible: curves along them close, as those along mixtures of
    turns in line with each other need not.
    """
    rows = np.array(_null_space(pose_and_jacobian(arm, q[None])[1][0][:, moving]))
    for i in range(len(rows) if len(rows) > 1 else 0):
        row, column = divmod(int(np.abs(rows[i:]).argmax()), rows.shape[1])
        rows[[i, i + row]] = rows[[i + row, i]]
        rows[i] /= rows[i, column]
        others = np.arange(len(rows)) != i
        rows[others] -= rows[others, column, None] * rows[i]
    directions = np.zeros((len(rows), len(q)))
    directions[:, moving] = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    return directions


def _null_space(J: Array) -> Array:
    """Return an orthonormal basis of a Jacobian's null space, or the least vector where there is none."""
    _, values, vectors = np.linalg.svd(J)
    rank = int((values > FLAT).sum())
    return np.asarray(vectors[min(rank, len(vectors) - 1) :])


def lies_on(points: Array, q: Array, turns: NDArray[np.bool_], *, closed: bool) -> bool:
    """Return whether a configuration lies on a curve, angles modulo whole turns.

    Args:
        points: Of the curve in order, in the arm's units, shape (m, n).
        q: The configuration, in the arm's units, shape (n,).
        turns: Which joints turn, bool, shape (n,).
        closed: Whether the curve goes on from the last point to the first.
    """
    gaps = np.where(turns, (q - points + np.pi) % (2.0 * np.pi) - np.pi, q - points)
    nearest = int(np.einsum("mi,mi->m", gaps, gaps).argmin())
    neighbours = np.array([nearest - 1, nearest + 1])
    neighbours = neighbours % len(points) if closed else np.clip(neighbours, 0, len(points) - 1)
    ends = points[neighbours] - points[nearest]
    ends = np.where(turns, (ends + np.pi) % (2.0 * np.pi) - np.pi, ends)
    for end in ends:
        length = float(end @ end)
        share = min(max(float(gaps[nearest] @ end) / length, 0.0), 1.0) if length > 0.0 else 0.0
        if float(np.linalg.norm(gaps[nearest] - share * end)) < 0.1 * LONGEST:
            return True
    return False


def inside(path: Path, lower: Array, upper: Array, turns: NDArray[np.bool_], q0: Array) -> list[Path]:
    """Return the parts of a curve that keep limits, each moved by whole turns to where it does, near ``q0``.

    Args:
        path: The curve, of n joints.
        lower: Lowest coordinates, shape (n,); -inf where there is no limit.
        upper: Highest ones.
        turns: Which joints turn, bool, shape (n,).
        q0: Of several ways to keep the limits by whole turns, the nearest to this configuration is taken.
    """
    points = path.q
    kept = [_turned_inside(q, lower, upper, turns, q0) for q in points]
    if path.closed and any(one is None for one in kept):  # begin behind a gap, so that no part is cut in two
        gap = next(i for i, one in enumerate(kept) if one is None)
        points, kept = np.roll(points, -gap, axis=0), kept[gap:] + kept[:gap]
    parts: list[list[Array]] = []
    shift: Array | None = None
    for q, one in zip(points, kept, strict=True):
        before = parts[-1][-1] if shift is not None else None
        if before is not None:
            near = np.where(turns, q - 2.0 * np.pi * np.round((q - before) / (2.0 * np.pi)), q)
            if ((near >= lower) & (near <= upper)).all():
                parts[-1].append(near)
                continue
        shift = one
        if one is not None:
            parts.append([one])
    whole = path.closed and len(parts) == 1 and len(parts[0]) == len(points)
    if path.closed and len(parts) > 1 and np.abs(parts[-1][-1] - parts[0][0]).max() < 2.0 * LONGEST:
        parts[0] = [*parts.pop(), *parts[0]]  # cut in two where the curve was begun
    return [Path(q=np.array(part), closed=whole) for part in parts]


def _turned_inside(q: Array, lower: Array, upper: Array, turns: NDArray[np.bool_], q0: Array) -> Array | None:
    """Return a configuration moved inside the limits by whole turns, as near to ``q0`` as they allow, or None."""
    turn = 2.0 * np.pi
    near = np.where(turns, q - turn * np.round((q - q0) / turn), q)
    low, high = np.ceil((lower - near) / turn), np.floor((upper - near) / turn)
    near = np.where(turns, near + turn * np.clip(0.0, np.minimum(low, high), high), near)
    return near if ((near >= lower) & (near <= upper)).all() else None
