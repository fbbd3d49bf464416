"""Whole turns of solutions: all of them that limits allow, the nearest to a given configuration first."""

from __future__ import annotations

from itertools import islice, product

import numpy as np
from numpy.typing import NDArray

from dh2sim.typing import Array

_SLACK = 1e-9
"""Outside a limit by less than this, rad or m, is rounding."""
_MOST = 4096
"""Combinations of whole turns that are looked at, the fewest turns first."""


class Turns:
    """Joints' limits, and the whole turns that fit into them."""

    def __init__(self, lower: Array, upper: Array, turns: NDArray[np.bool_], units: Array) -> None:
        """Prepare an arm.

        Args:
            lower: Lowest coordinates, rad and m, shape (n,); -inf where there is no limit.
            upper: Highest ones.
            turns: Which joints turn, shape (n,).
            units: What 1 in distances between configurations stands for: 1 rad, and a length, shape (n,).
        """
        self._lower, self._upper, self._turns, self._units = lower - _SLACK, upper + _SLACK, turns, units
        self._bounded = turns & np.isfinite(lower) & np.isfinite(upper)
        span = np.where(self._bounded, self._upper - self._lower, 0.0)
        most = np.floor(np.nan_to_num(span) / (2.0 * np.pi)).astype(int)
        choices = islice(product(*(range(count + 1) for count in most)), _MOST)
        self._choices = np.array(list(choices)).reshape(-1, len(lower))

    def nearest(self, q: Array, q0: Array) -> Array:
        """Return configurations with each turning joint within half a turn of ``q0``, shape (M, n)."""
        whole = np.round((q - q0) / (2.0 * np.pi)) * 2.0 * np.pi
        return np.where(self._turns, q - whole, q)

    def inside(self, q: Array) -> NDArray[np.bool_]:
        """Return whether configurations keep the limits, shape (M,)."""
        return np.asarray(((q >= self._lower) & (q <= self._upper)).all(axis=-1))

    def allowed(self, q: Array, q0: Array) -> tuple[NDArray[np.intp], Array]:
        """Return all whole turns of configurations that keep the limits.

        A joint without limits stays within half a turn of ``q0``.

        Returns:
            Which configuration each belongs to, shape (S,), and joint vectors, shape (S, n).
        """
        with np.errstate(invalid="ignore"):
            lowest = self._lower + np.mod(q - self._lower, 2.0 * np.pi)
        first = np.where(self._bounded, lowest, self.nearest(q, q0))
        fits = np.ones((len(q), len(self._choices)), dtype=np.bool_)
        for joint, choice in enumerate(self._choices.T):
            turned = first[:, joint, None] + 2.0 * np.pi * np.arange(choice.max() + 1)
            fits &= ((turned >= self._lower[joint]) & (turned <= self._upper[joint]))[:, choice]
        which, combination = np.nonzero(fits)
        return which, first[which] + 2.0 * np.pi * self._choices[combination]

    def placed(self, q: Array, q0: Array) -> Array:
        """Return configurations with joints near ``q0``, or inside their limits if that is not there, (M, n)."""
        near = self.nearest(q, q0)
        with np.errstate(invalid="ignore"):
            middle = np.where(self._bounded, 0.5 * (self._lower + self._upper), q0)
        fits = (near >= self._lower) & (near <= self._upper)
        return np.where(fits, near, self.nearest(q, middle))

    def distance(self, q: Array, q0: Array) -> Array:
        """Return the norm of q - q0, slides in units of the arm's length, shape (M,)."""
        return np.asarray(np.linalg.norm((q - q0) / self._units, axis=-1))
