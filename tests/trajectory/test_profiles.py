from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.errors import TrajectoryError
from dh2sim.trajectory.curves import PiecewisePolynomial, cubic_spline, quintic_hermite
from dh2sim.trajectory.profiles import quintic, state_to_state, trapezoid
from dh2sim.typing import Array
from tests.trajectory.oracles import assert_derivatives_agree

sizes = st.floats(1e-3, 1e3)
numbers = st.floats(-3.0, 3.0, allow_subnormal=False)


def dense(curve: PiecewisePolynomial, count: int = 4001) -> Array:
    return curve.derivatives(np.linspace(0.0, curve.end, count))


@given(length=sizes, duration=sizes)
def test_a_quintic_goes_from_rest_to_rest_without_acceleration(length: float, duration: float) -> None:
    found = dense(quintic(length, duration))
    np.testing.assert_allclose(found[0, [0, -1], 0], [0.0, length], rtol=1e-13)
    np.testing.assert_allclose(found[1:3, [0, -1], 0], 0.0, atol=1e-11 * length / min(duration, duration**2))
    # the textbook's greatest speed and acceleration
    np.testing.assert_allclose(found[1].max(), 1.875 * length / duration, rtol=1e-6)
    np.testing.assert_allclose(np.abs(found[2]).max(), 10.0 / np.sqrt(3.0) * length / duration**2, rtol=1e-6)


@given(length=sizes, velocity=sizes, acceleration=sizes)
def test_a_trapezoid_reaches_one_of_its_limits_and_no_more(
    length: float, velocity: float, acceleration: float
) -> None:
    curve = trapezoid(length, velocity, acceleration)
    found = dense(curve)
    np.testing.assert_allclose(found[0, [0, -1], 0], [0.0, length], rtol=1e-12, atol=1e-12 * length)
    assert np.abs(found[1]).max() <= velocity * (1 + 1e-12)
    assert np.abs(found[2]).max() <= acceleration * (1 + 1e-12)
    # the least time: bang, coast, bang
    ramp = velocity / acceleration
    least = length / velocity + ramp if length > velocity * ramp else 2.0 * np.sqrt(length / acceleration)
    assert curve.end == pytest.approx(least, rel=1e-12)


@given(
    q1=st.lists(numbers, min_size=3, max_size=3),
    v0=st.lists(st.floats(-0.9, 0.9), min_size=3, max_size=3),
    a0=st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3),
)
def test_a_motion_between_states_meets_both_and_keeps_limits(
    q1: list[float], v0: list[float], a0: list[float]
) -> None:
    v, a, j = np.array([2.0, 3.0, 1.5]), np.array([4.0, 3.0, 9.0]), np.array([20.0, 50.0, 10.0])
    start = np.array([0.3, -0.2, 0.1])
    curve = state_to_state(start, q1, velocity=v, acceleration=a, jerk=j, v0=v0, a0=a0)
    ends = curve.derivatives(np.array([0.0, curve.end]))
    np.testing.assert_allclose(ends[:3, 0], np.stack([start, v0, a0]), atol=1e-9)
    np.testing.assert_allclose(ends[:3, 1], np.stack([q1, np.zeros(3), np.zeros(3)]), atol=1e-7)
    found = dense(curve)
    for rates, limit in zip(found[1:], (v, a, j), strict=True):
        assert (np.abs(rates) <= limit * (1 + 1e-7) + 1e-7).all()
    assert_derivatives_agree(lambda t: curve.derivatives(t)[0], lambda t: curve.derivatives(t)[1], curve.end, v, a)


def test_a_jerk_limited_motion_of_one_joint_takes_the_time_of_the_textbook() -> None:
    # far enough for all limits: t = d / v + v / a + a / j
    curve = state_to_state([0.0], [10.0], velocity=[2.0], acceleration=[4.0], jerk=[16.0])
    assert curve.end == pytest.approx(10.0 / 2.0 + 2.0 / 4.0 + 4.0 / 16.0, rel=1e-12)


def test_joints_move_in_step_from_rest_to_rest() -> None:
    q0, q1 = np.array([0.1, -0.5, 2.0]), np.array([0.9, 0.2, -1.0])
    curve = state_to_state(q0, q1, velocity=[1, 2, 3], acceleration=[4, 5, 6], jerk=[70, 80, 90])
    shares = (dense(curve)[0] - q0) / (q1 - q0)
    np.testing.assert_allclose(shares[:, 1:], shares[:, :1].repeat(2, axis=1), atol=1e-12)


def test_a_state_beyond_the_limits_is_refused() -> None:
    with pytest.raises(TrajectoryError, match="no jerk-limited motion"):
        state_to_state([0.0], [1.0], velocity=[1.0], acceleration=[1.0], jerk=[1.0], v1=[2.0])


def test_a_spline_passes_its_points_twice_continuously_differentiable() -> None:
    knots, points = np.array([0.0, 0.7, 1.0, 2.5]), np.random.default_rng(3).normal(size=(4, 5))
    spline = cubic_spline(knots, points)
    before, after = (spline.derivatives(knots[1:-1] + shift) for shift in (-1e-9, 1e-9))
    np.testing.assert_allclose(spline.derivatives(knots)[0], points, atol=1e-13)
    np.testing.assert_allclose(before[:3], after[:3], atol=1e-6)
    np.testing.assert_allclose(spline.derivatives(knots[[0, -1]])[1], 0.0, atol=1e-13)


def test_a_quintic_through_samples_of_a_polynomial_of_fifth_degree_is_that_polynomial() -> None:
    coefficients = np.random.default_rng(1).normal(size=(6, 2))
    value = np.polynomial.polynomial.polyval
    derivatives = [np.polynomial.polynomial.polyder(coefficients, k) for k in range(3)]
    knots, x = np.array([0.0, 0.2, 1.0, 1.1]), np.linspace(0.0, 1.1, 57)
    curve = quintic_hermite(knots, *(value(knots, each).T for each in derivatives))
    np.testing.assert_allclose(curve.derivatives(x)[0], value(x, coefficients).T, atol=1e-11)
