"""Smooth curves for many rollouts at once, the same bits however the rollouts and the time steps are cut up."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Final

import numpy as np

from dh2sim.typing import Array

MINIMUM_JERK_PEAK: Final = 1.875
"""Greatest speed of a minimum-jerk motion, at its middle, over distance/duration: 30 · 1/4 · 1/4."""
_CACHED: Final = 16384
"""Numbers worked on at a time, of which three arrays stay in the cache."""


def weighted_sum(weights: Array, values: Sequence[Array], out: Array | None = None) -> Array:
    """Return the sum over terms h of ``weights[h, k] * values[h][i, j]``.

    Terms are added in their order, one multiplication and one addition each, and never by a library's product of
    matrices, whose order of additions depends on sizes.

    Args:
        weights: what varies with time, shape (terms, count).
        values: what varies with rollout and joint, each of shape (batch, m); at least one.
        out: where to put the result.

    Returns:
        Array of shape (batch, count, m).
    """
    batch, m = values[0].shape
    count = weights.shape[1]
    out = np.empty((batch, count, m)) if out is None else out
    if out.size == 0:
        return out
    group = min(batch, max(1, _CACHED // (m * count)))
    total, term = np.empty((2, group, m, count))  # time last: long inner loops
    for first in range(0, batch, group):
        last = min(first + group, batch)
        here, product = total[: last - first], term[: last - first]
        np.multiply(values[0][first:last, :, None], weights[0], out=here)
        for weight, value in zip(weights[1:], values[1:], strict=True):
            np.multiply(value[first:last, :, None], weight, out=product)
            np.add(here, product, out=here)
        out[first:last] = here.transpose(0, 2, 1)
    return out


def minimum_jerk(s: Array) -> tuple[Array, Array, Array]:
    """Return the minimum-jerk motion from 0 to 1 and its first two derivatives.

    10 s³ - 15 s⁴ + 6 s⁵, which starts and ends at rest without acceleration. Source: T. Flash and N. Hogan, The
    coordination of arm movements, Journal of Neuroscience 5 (1985).

    Args:
        s: time over duration, from 0 to 1.
    """
    rest = 1.0 - s
    position = s * s * s * (10.0 + s * (6.0 * s - 15.0))
    return position, 30.0 * s * s * rest * rest, 60.0 * s * rest * (1.0 - 2.0 * s)


def cubic_spline_weights(u: Array) -> Array:
    """Return the weights of four neighbouring points of a uniform cubic B-spline, shape (4, count).

    They are not negative and add up to one, so the curve stays between the least and the greatest point. Source:
    C. de Boor, A Practical Guide to Splines (1978).

    Args:
        u: place between the two middle points, from 0 to 1, shape (count,).
    """
    rest = 1.0 - u
    return np.stack(
        (
            rest * rest * rest / 6.0,
            (4.0 + u * u * (3.0 * u - 6.0)) / 6.0,
            (1.0 + 3.0 * u * (1.0 + u * rest)) / 6.0,
            u * u * u / 6.0,
        )
    )


def pieces(first: int, count: int, timestep: float, duration: float, number: int) -> tuple[Array, Array]:
    """Return in which of ``number`` pieces of equal duration time steps lie, and where in it.

    Args:
        first: first time step.
        count: how many.
        timestep: s.
        duration: of a piece, s.
        number: pieces; what comes later is at the end of the last.

    Returns:
        The pieces, whole numbers from 0, shape (count,); and the time since a piece's beginning as a share of its
        duration, from 0 to 1.
    """
    place = np.arange(first, first + count) * timestep / duration
    piece = np.minimum(np.floor(place), number - 1.0)
    return piece, np.clip(place - piece, 0.0, 1.0)


def runs_of(piece: Array) -> list[tuple[int, slice]]:
    """Return each piece that occurs in an array that does not decrease, with the part of the array where it does."""
    bounds = [*np.flatnonzero(np.diff(piece, prepend=-1.0)).tolist(), piece.size]
    return [(int(piece[first]), slice(first, end)) for first, end in itertools.pairwise(bounds)]
