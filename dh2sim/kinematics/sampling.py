"""Random configurations."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.typing import Array


def random_configurations(lower: ArrayLike, upper: ArrayLike, count: int, seed: int) -> Array:
    """Draw joint vectors uniformly; the same seed gives the same vectors.

    Args:
        lower: Least coordinates, rad and m, shape (n,).
        upper: Greatest coordinates, rad and m, shape (n,).
        count: How many to draw.
        seed: Seed of NumPy's default generator.

    Returns:
        Shape (count, n).

    Raises:
        ConfigurationError: The bounds have different shapes, are not finite, or are the wrong way round.
    """
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    if low.ndim != 1 or low.shape != high.shape:
        raise ConfigurationError(f"expected bounds of shape (n,), got shapes {low.shape} and {high.shape}")
    for i, (least, greatest) in enumerate(zip(low.tolist(), high.tolist(), strict=True)):
        if not (np.isfinite(least) and np.isfinite(greatest) and least <= greatest):
            raise ConfigurationError(f"no coordinate {i} can lie between {least!r} and {greatest!r}")
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))
