"""Solutions of nearly singular poses, which lie far from each other in one valley of the error.

Near a singularity the equations of a pose hold almost, but not quite, along a whole curve, and rounding leaves an
elimination with points of that curve that are no solutions. The direction in which the tool hardly moves is that of
one equation. The other five make a curve that is followed; where the sixth changes its sign on it is a solution.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from dh2sim.inverse.loop import Arm, Flags, pose_and_jacobian, pose_error
from dh2sim.inverse.self_motion import PoseCurve
from dh2sim.typing import Array

_VALLEY: Final = 1e-5
"""What the sixth equation may be wrong by, in lengths of the arm and rad, as long as the curve is followed."""
_MOST: Final = 8
"""Curves that are followed for one pose."""
_FALSE_POSITIONS: Final = 12
"""Steps towards a solution between two points (the Illinois algorithm: M. Dowell, P. Jarratt, 1971)."""
_WITHIN: Final = 5e-4
"""A configuration as near to a curve as that is on it, rad or lengths of the arm."""


def near_solutions(arm: Arm, q: Array, T: Array, moving: Flags) -> Array:
    """Return configurations near the solutions of a pose in the valleys that lead through others.

    Args:
        arm: The arm.
        q: Configurations that almost reach the pose, the best first, in the arm's units, shape (M, n).
        T: The pose, its position in units of the arm's length, shape (4, 4).
        moving: Which joints may move, bool, shape (n,): six.

    Returns:
        Shape (K, n).
    """
    valleys: list[_Valley] = []
    near = [np.zeros((0, arm.n))]
    for start in q:
        if len(valleys) == _MOST:
            break
        if not any(valley.leads_through(start) for valley in valleys):
            valleys.append(_Valley(arm, start, T, moving))
            near.append(valleys[-1].sign_changes())
    return np.concatenate(near)


class _Valley(PoseCurve):
    """The configurations at which all equations of a pose hold but one."""

    longest = 0.1

    def __init__(self, arm: Arm, start: Array, T: Array, moving: Flags) -> None:
        super().__init__(arm, T, moving)
        U = np.linalg.svd(pose_and_jacobian(arm, start[None])[1][0][:, moving])[0]
        self._kept, self._left_out = U[:, :-1].T, U[:, -1]
        begin = self.onto(start)
        points, closed = (start[None], False) if begin is None else self.both_ways(begin[0])
        if closed:
            points = np.concatenate([points, points[-1:] + self.wrapped(points[0] - points[-1])])
        self._points = points
        """In order, shape (m, n)."""

    def leads_through(self, q: Array) -> bool:
        """Return whether a configuration is in the valley."""
        gaps = self.wrapped(q - self._points)
        nearest = int(np.einsum("mi,mi->m", gaps, gaps).argmin())
        for neighbour in (nearest - 1, nearest + 1):
            if not 0 <= neighbour < len(self._points):
                continue
            chord = self._points[neighbour] - self._points[nearest]
            share = float(gaps[nearest] @ chord) / float(chord @ chord)
            foot = self.onto(self._points[nearest] + share * chord) if 0.0 <= share <= 1.0 else None
            if foot is not None:
                gap = self.wrapped(q - foot[0])
                gap -= float(gap @ chord) / float(chord @ chord) * chord
                if float(np.linalg.norm(gap)) < _WITHIN:
                    return True
        return False

    def sign_changes(self) -> Array:
        """Return where in the valley the equation left out holds, shape (K, n)."""
        points = self._points
        frame, _ = pose_and_jacobian(self.arm, points)
        left = pose_error(frame, np.broadcast_to(self.T, (len(points), 4, 4))) @ self._left_out
        (changes,) = np.nonzero(np.signbit(left[1:]) != np.signbit(left[:-1]))
        between = [self._zero(points[k], points[k + 1], left[k], left[k + 1]) for k in changes]
        return np.array(between).reshape(-1, points.shape[1])

    def _zero(self, a: Array, b: Array, at_a: float, at_b: float) -> Array:
        """Return a point of the curve between two, at which the equation left out is wrong one way and the other."""
        for _ in range(_FALSE_POSITIONS):
            middle = a + at_a / (at_a - at_b) * (b - a)
            reached = self.onto(middle)
            if reached is None:
                return np.asarray(middle)
            middle = reached[0]
            at_middle = float(super().error(middle)[0] @ self._left_out)
            if (at_middle < 0.0) == (at_a < 0.0):
                a, at_a, at_b = middle, at_middle, 0.5 * at_b
            else:
                b, at_b, at_a = middle, at_middle, 0.5 * at_a
            if at_middle == 0.0:
                break
        return middle

    def error(self, q: Array) -> tuple[Array, Array]:
        """Return what is left of the five equations, and the Jacobian of the joints that move."""
        error, J = super().error(q)
        return self._kept @ error, self._kept @ J

    def ends(self, q: Array) -> bool:
        """Return whether a point is out of the valley."""
        return abs(float(super().error(q)[0] @ self._left_out)) > _VALLEY
