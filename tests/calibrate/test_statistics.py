"""A small part of the campaign of ``scripts/calibration_statistics.py``, and the distributions it judges by."""

from __future__ import annotations

import numpy as np
import pytest

from dh2sim.calibrate.outliers import chi2_quantile
from scripts.calibration_statistics import simulate


@pytest.mark.parametrize(
    ("kind", "fits"),
    [("position", 3), *(pytest.param(kind, 12, marks=pytest.mark.slow) for kind in ("position", "distance"))],
)
def test_errors_are_distributed_as_the_covariance_says(kind: str, fits: int) -> None:
    found = simulate("scara", kind, fits=fits)
    assert abs(found.chi2_off) < 4.0
    assert abs(found.parameters_off) < 4.0
    assert 0.7 < found.held_out / found.predicted < 1.4


def test_quantiles_of_chi_squared_are_those_of_tables() -> None:
    """Abramowitz and Stegun, Handbook of Mathematical Functions, table 26.8."""
    assert np.abs(chi2_quantile(0.99, np.array([1, 3, 6])) / [6.6349, 11.3449, 16.8119] - 1.0).max() < 0.02
    assert np.abs(chi2_quantile(0.999, np.array([1, 3, 6])) / [10.8276, 16.2662, 22.4577] - 1.0).max() < 0.035
