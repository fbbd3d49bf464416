"""Ranges that setpoints and references are drawn from, inside the limits and near to where a rollout starts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from dh2sim.simulate.controllers.protocol import Lanes
from dh2sim.simulate.plant import Plant
from dh2sim.typing import Array

INSIDE: Final = 1.0 - 1e-9
"""Share of what limits allow that is used, so that rounding never leads out of them."""
FREE_TURN: Final = math.pi
"""rad: half the range of a joint that turns without limits."""
FREE_SLIDE: Final = 1.0
"""m: half the range of a joint that slides without limits."""


def half_ranges(lower: Array, upper: Array, free: Array) -> Array:
    """Return half of each range, or ``free`` where a range is not limited; all of shape (m,)."""
    limited = np.isfinite(lower) & np.isfinite(upper)
    return np.where(limited, 0.5 * np.where(limited, upper, 0.0) - 0.5 * np.where(limited, lower, 0.0), free)


def free_ranges(plant: Plant) -> Array:
    """Return half of the range that joints without limits move in, rad or m, shape (n,)."""
    return np.where(np.array(plant.turns, dtype=bool), FREE_TURN, FREE_SLIDE)


def centers(start: Array, reach: Array, lower: Array, upper: Array) -> Array:
    """Return the points nearest to ``start`` from which ``reach`` on either side is inside the limits.

    Args:
        start: shape (batch, m).
        reach: at most half of the ranges, shape (m,) or (batch, m).
        lower: shape (m,); -inf where unlimited.
        upper: shape (m,); inf where unlimited.

    Returns:
        Array of shape (batch, m).
    """
    return np.minimum(np.maximum(start, lower + reach), upper - reach)


def follow(start: Array, targets: Iterable[Array], most: Array) -> Array:
    """Return points that go from ``start`` towards each target in turn, by ``most`` at the most.

    Args:
        start: shape (batch, m).
        targets: each of shape (batch, m).
        most: greatest distance between neighbouring points, shape (m,).

    Returns:
        The start and the points, shape (1 + targets, batch, m).
    """
    points = [start]
    for target in targets:
        points.append(points[-1] + np.clip(target - points[-1], -most, most))
    return np.stack(points)


def uniform(generators: Sequence[np.random.Generator], a: int, m: int) -> Array:
    """Draw numbers from -1 to 1, an array of (a, m) for every rollout; returned as shape (a, batch, m)."""
    drawn = [generator.uniform(-1.0, 1.0, size=(a, m)) for generator in generators]
    return np.ascontiguousarray(np.moveaxis(np.stack(drawn), 0, -2))


def widened(lanes: Lanes) -> tuple[Array, Array]:
    """Return the joints' limits, and where a rollout starts outside of them its start, each of shape (batch, n)."""
    return np.minimum(lanes.plant.lower, lanes.q0), np.maximum(lanes.plant.upper, lanes.q0)
