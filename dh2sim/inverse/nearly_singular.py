"""Solutions of nearly singular poses, which lie far from each other in one valley of the error.

Near a singularity the equations of a pose hold almost, but not quite, along a whole curve, and rounding leaves an
elimination with points of that curve that are no solutions. The direction in which the tool hardly moves is that of
one equation. The other five make a curve that is followed; where the sixth changes its sign on it is a solution.

All curves are followed at once, each both ways, by a parabola and one of Newton's steps at a time; the direction
comes from the same linear equations as the step. Source: E. L. Allgower, K. Georg, Introduction to Numerical
Continuation Methods, 2003, chapters 2 and 6.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from dh2sim.inverse.loop import Arm, Flags, Indices, pose_and_jacobian, pose_error
from dh2sim.inverse.self_motion import FAR, FIRST, STRAIGHT, WOUND
from dh2sim.typing import Array

_VALLEY: Final = 1e-5
"""What the sixth equation may be wrong by, in lengths of the arm and rad, as long as the curve is followed."""
_LONGEST: Final = 0.15
"""Step, in rad and lengths of the arm: of two changes of sign within one neither is seen."""
_SHORTEST: Final = 1e-4
_CORRECTION: Final = 2e-3
"""Farthest that a parabola may be from the curve: Newton's step leaves the square of it."""
_MOST: Final = 1000
"""Steps along a curve."""
_NEWTON: Final = 2
"""Steps onto a curve from near it."""
_FALSE_POSITIONS: Final = 8
"""Steps towards a solution between two points (the Illinois algorithm: M. Dowell, P. Jarratt, 1971)."""


def near_solutions(arm: Arm, q: Array, T: Array, moving: Flags) -> tuple[Indices, Array]:
    """Return configurations near the solutions of poses in the valleys that lead through others.

    Args:
        arm: The arm.
        q: Configurations that almost reach their poses, in the arm's units, shape (M, n).
        T: The pose of each, its position in units of the arm's length, shape (M, 4, 4).
        moving: Which joints may move, bool, shape (n,): six.

    Returns:
        From which of the given ones each was found, shape (K,), and the configurations, shape (K, n). One solution
        may be found from several.
    """
    if not len(q):
        return np.zeros(0, dtype=np.intp), q
    U, _, Vt = np.linalg.svd(pose_and_jacobian(arm, q)[1][:, :, moving])
    valleys = _Valleys(arm=arm, T=T, moving=moving, kept=np.swapaxes(U[:, :, :-1], 1, 2), left_out=U[:, :, -1])
    every = np.arange(len(q))
    begin = valleys.onto(every, q, Vt[:, -1])
    which, points, directions = valleys.followed(begin, Vt[:, -1])
    points = valleys.onto(which, points, directions)
    return valleys.zeros(which, points, directions)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Valleys:
    """Curves on which all equations of poses hold but one."""

    arm: Arm
    T: Array
    """The pose of each, shape (M, 4, 4)."""
    moving: Flags
    kept: Array = field(repr=False)
    """The five equations, as combinations of the pose's six, shape (M, 5, 6)."""
    left_out: Array = field(repr=False)
    """The sixth, shape (M, 6)."""

    def followed(self, start: Array, direction: Array) -> tuple[Indices, Array, Array]:
        """Follow each curve both ways, until the ways meet, or the sixth equation holds no more.

        Args:
            start: A point of each, shape (M, n).
            direction: The unit vector along each there, shape (M, 6).

        Returns:
            Of the points of all curves, in order for each curve and way: which curve's (the second way is counted on
            from the first: M, ..., 2 M - 1, modulo M), shape (m,), the point, (m, n), and the direction, (m, 6).
        """
        turns = np.array(self.arm.turns)
        count = len(start)
        curve = np.tile(np.arange(count), 2)
        begin = q = np.concatenate([start, start])
        t = np.concatenate([direction, -direction])
        bend, step = np.zeros_like(t), np.full(2 * count, FIRST)
        lanes = active = np.arange(2 * count)
        passed = [(lanes, q, t)]
        q, t = q.copy(), t.copy()
        for _ in range(_MOST):
            h = step[active][:, None]
            before = q[active]
            there = before.copy()
            there[:, self.moving] += h * t[active] + 0.5 * h * h * bend[active]
            correction, ahead, left = self._newton(curve[active], there, t[active])
            there[:, self.moving] += correction
            far = np.abs(correction).max(axis=1)
            straight = np.einsum("li,li->l", ahead, t[active])
            took = (far <= _CORRECTION) & (straight >= STRAIGHT)
            lost = ~took & (0.5 * step[active] < _SHORTEST)
            lane = active[took]
            bend[lane] = (ahead[took] - t[lane]) / h[took]
            q[lane], t[lane] = there[took], ahead[took]
            passed.append((lane, there[took], ahead[took]))
            step[active] = np.where(took, np.minimum(1.5 * step[active], _LONGEST), 0.5 * step[active])
            out = (np.abs(left) > _VALLEY) | (np.abs(there - begin[active]) > np.where(turns, WOUND, FAR)).any(axis=1)
            # it meets the other way along the same curve, wherever that is by now, or has ended
            other = (active + count) % (2 * count)
            move, gap = there - before, _wrapped(q[other] - before, turns)
            length = np.einsum("li,li->l", move, move)
            along = np.einsum("li,li->l", gap, move) / np.maximum(length, 1e-300)
            across = np.linalg.norm(gap - along[:, None] * move, axis=1)
            facing = np.einsum("li,li->l", ahead, t[other]) < -0.5
            met = (along > 1e-3) & (along <= 1.001) & (across < 0.1 * np.sqrt(length)) & facing
            ended = lost | (took & (out | met))
            # the other one has been overtaken
            active = np.setdiff1d(active[~ended], other[took & met], assume_unique=True)
            if not len(active):
                break
        lane, points, directions = (np.concatenate(each) for each in zip(*passed, strict=True))
        order = np.argsort(lane, kind="stable")
        return lane[order], points[order], directions[order]

    def onto(self, which: Indices, q: Array, t: Array) -> Array:
        """Return the points of curves near configurations, straight across the directions ``t``."""
        q = q.copy()
        for _ in range(_NEWTON):
            correction, _, _ = self._newton(which % len(self.T), q, t)
            q[:, self.moving] += np.clip(correction, -_LONGEST, _LONGEST)
        return q

    def zeros(self, which: Indices, points: Array, t: Array) -> tuple[Indices, Array]:
        """Return where between points of curves the equation left out holds.

        Returns:
            On which curves, shape (K,), and the points, shape (K, n).
        """
        left = self._left(which % len(self.T), points)
        changes = np.flatnonzero((np.signbit(left[1:]) != np.signbit(left[:-1])) & (which[1:] == which[:-1]))
        curve, t = which[changes] % len(self.T), t[changes]
        a, b, at_a, at_b = points[changes], points[changes + 1], left[changes], left[changes + 1]
        middle = a
        for _ in range(_FALSE_POSITIONS):
            gap = np.where(at_a == at_b, 1.0, at_a - at_b)
            middle = self.onto(curve, a + (at_a / gap)[:, None] * (b - a), t)
            at_middle = self._left(curve, middle)
            same = np.signbit(at_middle) == np.signbit(at_a)
            a, b = np.where(same[:, None], middle, a), np.where(same[:, None], b, middle)
            at_a, at_b = np.where(same, at_middle, 0.5 * at_a), np.where(same, 0.5 * at_b, at_middle)
        return curve, middle

    def _newton(self, curve: Indices, q: Array, t: Array) -> tuple[Array, Array, Array]:
        """Return a step of Newton's onto curves.

        Args:
            curve: Which curves, shape (m,).
            q: Near them, shape (m, n).
            t: Unit vectors that the steps are across, shape (m, 6).

        Returns:
            The steps, shape (m, 6), directions of the curves, shape (m, 6), and what the sixth equations are wrong by
            there, shape (m,).
        """
        frame, J = pose_and_jacobian(self.arm, q)
        error, J = pose_error(frame, self.T[curve]), J[:, :, self.moving]
        A = np.concatenate([self.kept[curve] @ J, t[:, None]], axis=1)
        A[:, range(6), range(6)] += 1e-15  # never quite singular
        right = np.zeros((len(q), 6, 2))
        right[:, :5, 0] = (self.kept[curve] @ error[:, :, None])[:, :, 0]
        right[:, 5, 1] = 1.0
        step, ahead = np.moveaxis(np.linalg.solve(A, right), 2, 0)
        left = np.einsum("li,li->l", self.left_out[curve], error - (J @ step[:, :, None])[:, :, 0])
        return step, ahead / np.linalg.norm(ahead, axis=1, keepdims=True), left

    def _left(self, curve: Indices, q: Array) -> Array:
        """Return what the equation left out is wrong by, shape (m,)."""
        error = pose_error(pose_and_jacobian(self.arm, q)[0], self.T[curve])
        return np.asarray(np.einsum("li,li->l", self.left_out[curve], error))


def _wrapped(difference: Array, turns: Flags) -> Array:
    """Return differences of configurations, whole turns left out."""
    return np.asarray(difference - np.where(turns, 2.0 * np.pi * np.round(difference / (2.0 * np.pi)), 0.0))
