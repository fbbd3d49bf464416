from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.sampling import random_configurations, scattered_configurations


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


def test_scattered_configurations_are_those_of_splitmix64() -> None:
    # the first numbers of SplitMix64 with seed 0, as its authors publish them
    numbers = [0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F, 0xF88BB8A8724C81EC]
    found = scattered_configurations([0.0, 0.0], [1.0, 1.0], 2)
    np.testing.assert_array_equal(found.ravel(), [(number >> 11) / 2**53 for number in numbers])


def test_scattered_configurations_fill_their_box() -> None:
    low, high = np.array([-1.0, 2.0, 0.0]), np.array([1.0, 2.5, 30.0])
    q = scattered_configurations(low, high, 1000)
    assert q.shape == (1000, 3)
    assert (q >= low).all()
    assert (q < high).all()
    np.testing.assert_allclose(q.mean(axis=0), (low + high) / 2, atol=0.03 * (high - low).max())
    assert np.abs(np.asarray(np.corrcoef(q.T)) - np.eye(3)).max() < 0.1


def test_no_joints_are_scattered_as_nothing() -> None:
    assert scattered_configurations([], [], 5).shape == (5, 0)
