from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.sampling import random_configurations


def test_random_configurations_fill_the_bounds_and_keep_within() -> None:
    q = random_configurations([-1.0, 0.2, 3.0], [2.0, 0.3, 3.0], 5000, 7)
    assert q.shape == (5000, 3)
    np.testing.assert_allclose(q.min(axis=0), [-1.0, 0.2, 3.0], rtol=0, atol=0.003)
    np.testing.assert_allclose(q.max(axis=0), [2.0, 0.3, 3.0], rtol=0, atol=0.003)
    assert (q >= [-1.0, 0.2, 3.0]).all()
    assert (q <= [2.0, 0.3, 3.0]).all()


def test_a_seed_says_which_configurations_are_drawn() -> None:
    first, again, other = (random_configurations([-1, -1], [1, 1], 10, seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_none_may_be_drawn() -> None:
    assert random_configurations([-1, -1], [1, 1], 0, 0).shape == (0, 2)
    assert random_configurations([], [], 4, 0).shape == (4, 0)


@pytest.mark.parametrize(
    ("lower", "upper", "message"),
    [
        ([0.0, 2.0], [1.0, 1.0], "no coordinate 1 can lie between 2.0 and 1.0"),
        ([math.nan], [1.0], "no coordinate 0 can lie between nan and 1.0"),
        ([0.0], [math.inf], "no coordinate 0 can lie between 0.0 and inf"),
        ([0.0], [1.0, 2.0], "expected bounds of shape (n,), got shapes (1,) and (2,)"),
        (0.0, 1.0, "expected bounds of shape (n,), got shapes () and ()"),
    ],
)
def test_impossible_bounds_are_refused(lower: ArrayLike, upper: ArrayLike, message: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        random_configurations(lower, upper, 3, 0)
    assert str(caught.value) == message
