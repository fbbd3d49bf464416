from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.simulate.controllers.trajectories import (
    MINIMUM_JERK_PEAK,
    cubic_spline_weights,
    minimum_jerk,
    pieces,
    runs_of,
    weighted_sum,
)
from dh2sim.typing import Array, read_only


@pytest.mark.parametrize(
    ("batch", "count", "m"), [(5, 7, 3), (1, 1, 1), (3, 20000, 2), (4, 0, 2), (4, 5, 0), (0, 5, 2)]
)
def test_a_weighted_sum_is_added_term_by_term(batch: int, count: int, m: int) -> None:
    source = np.random.default_rng(3)
    weights, values = source.normal(size=(4, count)), source.normal(size=(4, batch, m))
    expected = np.zeros((batch, count, m))
    for h in range(4):
        expected = expected + weights[h][None, :, None] * values[h][:, None, :]
    found = weighted_sum(weights, list(values))
    assert found.shape == (batch, count, m)
    assert np.array_equal(found, expected)


def test_a_weighted_sum_is_written_to_the_given_array() -> None:
    out = np.full((2, 9, 3), -1.0)
    weighted_sum(np.ones((1, 4)), [np.ones((2, 3))], out[:, 2:6])
    assert np.array_equal(out[0, :, 0], [-1, -1, 1, 1, 1, 1, -1, -1, -1])


def test_minimum_jerk_is_the_quintic_that_rests_at_both_ends() -> None:
    powers = np.arange(6)
    conditions = np.zeros((6, 6))
    for row, (end, order) in enumerate((end, order) for end in (0.0, 1.0) for order in range(3)):
        for power in powers[order:]:
            conditions[row, power] = math.perm(power, order) * end ** (power - order)
    quintic = np.polynomial.Polynomial(np.linalg.solve(conditions, [0, 0, 0, 1, 0, 0]))
    s = np.linspace(0.0, 1.0, 101)
    for order, found in enumerate(minimum_jerk(s)):
        expected = quintic.deriv(order)(s) if order else quintic(s)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_minimum_jerk_is_exact_at_its_ends() -> None:
    assert [array.tolist() for array in minimum_jerk(np.array([0.0, 1.0]))] == [[0.0, 1.0], [0.0, 0.0], [0.0, 0.0]]


def test_minimum_jerk_is_fastest_in_the_middle() -> None:
    s = np.linspace(0.0, 1.0, 10001)
    speed = minimum_jerk(s)[1]
    assert speed.max() == speed[5000] == MINIMUM_JERK_PEAK


@given(st.floats(0.0, 1.0))
def test_spline_weights_are_shares_of_one_whole(u: float) -> None:
    weights = cubic_spline_weights(np.array([u]))
    assert (weights >= 0.0).all()
    assert weights.sum() == pytest.approx(1.0, abs=1e-15)


def test_spline_weights_are_those_of_the_truncated_powers() -> None:
    def basis(t: float) -> float:  # the cardinal B-spline on 0 to 4, by de Boor's truncated powers
        return sum((-1.0) ** i * math.comb(4, i) * max(0.0, t - i) ** 3 for i in range(5)) / 6.0

    u = np.linspace(0.0, 1.0, 11)
    expected = [[basis(x + 3.0 - i) for x in u] for i in range(4)]
    np.testing.assert_allclose(cubic_spline_weights(u), expected, rtol=0, atol=1e-14)


def test_splines_are_twice_continuously_differentiable() -> None:
    points = np.random.default_rng(5).normal(size=6)

    def curve(t: Array) -> Array:
        i = np.minimum(np.floor(t), 2.0).astype(int)
        weights = cubic_spline_weights(t - i)
        return np.array([sum(weights[k, j] * points[i[j] + k] for k in range(4)) for j in range(len(t))])

    for knot in (1.0, 2.0):
        step = 1e-3
        for order, pattern in ((0, [1]), (1, [-1, 1]), (2, [1, -2, 1])):
            away = read_only(step * np.arange(len(pattern)))
            left, right = knot - away[::-1], knot + away
            difference = (curve(right) - curve(left)) @ np.array(pattern, dtype=float) / step**order
            assert abs(difference) < 100 * step


def test_time_steps_are_placed_in_their_pieces() -> None:
    piece, s = pieces(4, 8, timestep=0.1, duration=0.5, number=2)
    assert piece.tolist() == [0, 1, 1, 1, 1, 1, 1, 1]
    np.testing.assert_allclose(s, [0.8, 0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.0], atol=1e-12)
    assert runs_of(piece) == [(0, slice(0, 1)), (1, slice(1, 8))]


def test_no_time_steps_lie_in_no_piece() -> None:
    piece, s = pieces(4, 0, timestep=0.1, duration=0.5, number=2)
    assert s.shape == (0,)
    assert runs_of(piece) == []
