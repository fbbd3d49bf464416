"""Distributions that residuals are judged by."""

from __future__ import annotations

from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.typing import Array


def chi2_quantile(share: float, dof: ArrayLike) -> Array:
    """Return quantiles of the chi-squared distribution (E. B. Wilson, M. M. Hilferty, 1931), within a few percent.

    Args:
        share: Of the distribution that lies below, in (0, 1).
        dof: Degrees of freedom.
    """
    z = NormalDist().inv_cdf(share)
    spread = 2.0 / (9.0 * np.asarray(dof, dtype=np.float64))
    return np.asarray(np.asarray(dof) * np.maximum(1.0 - spread + z * np.sqrt(spread), 0.0) ** 3)


def chi2_spread(dof: int) -> float:
    """Return the standard deviation of chi-squared per degree of freedom."""
    return float(np.sqrt(2.0 / dof)) if dof > 0 else float("nan")
