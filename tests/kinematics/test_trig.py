from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.kinematics.trig import atan2, sin_cos

SMALL = 1e-15  # below this a sine is taken for that of a multiple of pi/2

# Rounded from 120 digits. At the first four a common C library misses the last bit.
SINES_AND_COSINES = [
    (-2.2153, -0.7993980593995537, -0.6008017498544989),
    (2.0645, 0.8805837665443049, -0.4738905254366721),
    (3.7944, -0.6074189010004017, -0.7943816958537401),
    (-3.3809, 0.23702976872457612, -0.9715023874074494),
    (1.0, 0.8414709848078965, 0.5403023058681398),
    (math.radians(37.3), 0.605988400265711, 0.7954734808548959),
    (100.0, -0.5063656411097588, 0.8623188722876839),
    (1e22, -0.8522008497671888, 0.523214785395139),
    (1e300, -0.8178819121159085, -0.5753861119575491),
]
ARCTANGENTS = [
    (-2.7508, 3.5918, -0.6535716802915357),
    (2.3029, -0.7161, 1.8722737174155226),
    (0.6421, 2.96, 0.21361602406626243),
    (1.0, 2.0, 0.4636476090008061),
    (-3.0, -4.0, -2.498091544796509),
    (1e-300, 1.0, 1e-300),
    (1.0, -1e-17, math.pi / 2),
]

finite = st.floats(allow_nan=False, allow_infinity=False)


@pytest.mark.parametrize(("angle", "sine", "cosine"), SINES_AND_COSINES)
def test_sine_and_cosine_are_correctly_rounded(angle: float, sine: float, cosine: float) -> None:
    assert sin_cos(angle) == (sine, cosine)
    assert sin_cos(-angle) == (-sine, cosine)


@given(finite | st.floats(-20.0, 20.0))
def test_sine_and_cosine_are_within_one_ulp_of_the_c_library(angle: float) -> None:
    for ours, theirs in zip(sin_cos(angle), (math.sin(angle), math.cos(angle)), strict=True):
        assert abs(ours - theirs) <= math.ulp(theirs) or (abs(theirs) < 16 * SMALL and ours == 0.0)


@pytest.mark.parametrize("k", list(range(-16, 17)))
def test_multiples_of_a_right_angle_are_exact(k: int) -> None:
    expected = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][k % 4]
    assert sin_cos(k * (math.pi / 2)) == expected
    assert sin_cos(math.radians(90.0 * k)) == expected
    assert sin_cos(k * (math.pi / 2) + 2e-16) == expected


@pytest.mark.parametrize("angle", [0.0, -0.0, math.pi, -math.pi])
def test_zero_has_no_minus_sign(angle: float) -> None:
    assert str(sin_cos(angle)[0]) == "0.0"


def test_an_angle_near_a_right_angle_is_not_taken_for_one() -> None:
    assert sin_cos(math.pi / 2 + 1e-15)[1] == pytest.approx(-1e-15, rel=0.1)
    assert sin_cos(1e-15)[0] == 1e-15
    assert sin_cos(1e3 * math.pi)[0] != 0.0


@pytest.mark.parametrize("angle", [math.nan, math.inf, -math.inf])
def test_sine_of_what_is_not_finite_is_refused(angle: float) -> None:
    with pytest.raises(ValueError, match=f"^the angle must be finite, got {angle!r}$"):
        sin_cos(angle)


@pytest.mark.parametrize(("y", "x", "angle"), ARCTANGENTS)
def test_arctangent_is_correctly_rounded(y: float, x: float, angle: float) -> None:
    assert atan2(y, x) == angle
    assert atan2(-y, x) == -angle


@given(finite, finite)
def test_arctangent_is_within_one_ulp_of_the_c_library(y: float, x: float) -> None:
    expected = math.atan2(y + 0.0, x + 0.0)
    assert abs(atan2(y, x) - expected) <= math.ulp(expected)


@given(st.floats(-1.0, 1.0, allow_subnormal=False), st.floats(-1.0, 1.0, allow_subnormal=False))
def test_arctangent_does_not_depend_on_the_scale(y: float, x: float) -> None:
    assert atan2(y * 2.0**40, x * 2.0**40) == atan2(y, x)


@pytest.mark.parametrize(
    ("y", "x", "angle"),
    [
        (0.0, 0.0, 0.0),
        (0.0, 2.0, 0.0),
        (0.0, -2.0, math.pi),
        (-0.0, -2.0, math.pi),
        (2.0, 0.0, math.pi / 2),
        (-2.0, -0.0, -math.pi / 2),
        (5e-324, 1e300, 0.0),
    ],
)
def test_arctangent_on_the_axes_ignores_the_sign_of_zero(y: float, x: float, angle: float) -> None:
    assert str(atan2(y, x)) == str(angle)


def test_arctangent_of_what_is_not_finite_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^the coordinates must be finite, got y = nan, x = 1\.0$"):
        atan2(math.nan, 1.0)


@given(st.floats(-3.14, 3.14))
def test_arctangent_undoes_sine_and_cosine(angle: float) -> None:
    assert atan2(*sin_cos(angle)) == pytest.approx(angle, rel=0.0, abs=6e-16)
