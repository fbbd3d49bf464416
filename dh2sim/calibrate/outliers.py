"""Rows that are farther off than noise takes any of as many, by the chi-squared distribution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dh2sim.calibrate.fit import Fit
from dh2sim.calibrate.observations import ANGLE, LENGTH
from dh2sim.typing import Array

OUTLIER: Final = 0.01
"""Chance that any row at all is called an outlier where there is none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outlier:
    """A row that is farther off than noise takes any."""

    row: int
    place: str
    """Such as ``line 17``."""
    group: str
    times: float
    """Standard deviations of a component."""
    length: float
    """How far off, m; NaN where no length was measured."""
    angle: float
    """rad; NaN where no angle was measured."""
    left_out: bool


def find_outliers(whole: Fit, dropped: NDArray[np.intp] | Sequence[int], *, robust: bool) -> tuple[Outlier, ...]:
    """Return the rows that are farther off than any of as many is by chance, worst first."""
    equations, measured = whole.equations, whole.observations.measured
    mine = equations.row >= 0
    scaled = equations.e / whole.sigma.of(equations.scale)
    left = np.maximum(1.0 - whole.leverage, 1e-3)
    size = np.where(whole.weight > 0.0, scaled**2 / left, scaled**2)
    factor = 1.0
    if not (robust or whole.sigma.length_known):  # outliers have made the estimated noise greater than it is
        typical = float(np.median(np.sqrt(size[mine]))) / 0.6745
        factor = min(1.0, typical)
    count = np.bincount(equations.row[mine], minlength=len(measured))
    total = np.bincount(equations.row[mine], size[mine], minlength=len(measured))
    present = count > 0
    limit = np.full(len(measured), np.inf)
    limit[present] = chi2_quantile(1.0 - OUTLIER / max(int(present.sum()), 1), count[present])
    found = []
    for row in np.flatnonzero((total > limit * factor**2) | np.isin(np.arange(len(measured)), dropped)).tolist():
        own = equations.row == row
        length, angle = (
            float(np.linalg.norm(equations.e[own & (equations.scale == scale)]))
            if (own & (equations.scale == scale)).any()
            else float("nan")
            for scale in (LENGTH, ANGLE)
        )
        found.append(
            Outlier(
                row=row,
                place=measured.place(row),
                group="" if measured.groups is None else measured.groups[row],
                times=float(np.sqrt(total[row] / count[row])) / factor,
                length=length,
                angle=angle,
                left_out=row in dropped,
            )
        )
    return tuple(sorted(found, key=lambda outlier: -outlier.times))


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
