"""Random configurations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.typing import Array


def random_configurations(lower: ArrayLike, upper: ArrayLike, count: int, seed: int | Sequence[int]) -> Array:
    """Draw joint vectors uniformly; the same seed gives the same vectors.

    Args:
        lower: Least coordinates, rad and m, shape (n,).
        upper: Greatest coordinates, rad and m, shape (n,).
        count: How many to draw.
        seed: Seed of NumPy's default generator, or several numbers that are one together.

    Returns:
        Shape (count, n).

    Raises:
        ConfigurationError: The bounds have different shapes, are not finite, or are the wrong way round; ``count`` is
            not a whole number of at least 0.
    """
    if not isinstance(count, int | np.integer) or count < 0:
        raise ConfigurationError(f"the count must be a whole number of at least 0, got {count!r}")
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    if low.ndim != 1 or low.shape != high.shape:
        raise ConfigurationError(f"expected bounds of shape (n,), got shapes {low.shape} and {high.shape}")
    for i, (least, greatest) in enumerate(zip(low.tolist(), high.tolist(), strict=True)):
        if not (np.isfinite(least) and np.isfinite(greatest) and least <= greatest):
            raise ConfigurationError(f"no coordinate {i} can lie between {least!r} and {greatest!r}")
    try:
        generator = np.random.default_rng(seed)
    except (TypeError, ValueError):
        raise ConfigurationError(f"seed must be a whole number of at least 0, or several, got {seed!r}") from None
    return generator.uniform(low, high, (int(count), len(low)))


def scattered_configurations(lower: ArrayLike, upper: ArrayLike, count: int) -> Array:
    """Return joint vectors scattered over a box, always the same ones.

    They stand in for random ones where a command should be quick: importing NumPy's random numbers takes longer than
    all that is done with them. Numbers are those of SplitMix64 (Steele, Lea, Flood: Fast splittable pseudorandom
    number generators, OOPSLA 2014), seeded with 0.

    Args:
        lower: Lowest coordinates, rad and m, shape (n,).
        upper: Highest coordinates, shape (n,).
        count: How many joint vectors.

    Returns:
        Shape (count, n).
    """
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    state = np.arange(1, count * low.size + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    state ^= state >> np.uint64(31)
    share = (state >> np.uint64(11)).astype(np.float64) * 2.0**-53
    return np.asarray(low + (high - low) * share.reshape(count, low.size))
