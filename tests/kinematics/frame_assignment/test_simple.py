"""Numbers that are meant to be simple."""

from __future__ import annotations

import math

import pytest

from dh2sim.kinematics.frame_assignment.result import Tolerances
from dh2sim.kinematics.frame_assignment.rounding import simple_angle, simple_length, simple_turn

NANO = Tolerances(angle=1e-9, length=1e-9, reach=1.0)
TIGHT = Tolerances(angle=1e-13, length=1e-13, reach=1.0)
WIDE = Tolerances(angle=1e-4, length=1e-4, reach=1.0)


@pytest.mark.parametrize("degrees", [0, 15, 30, 45, 60, 90, 120, 180, -15, -90, -165])
@pytest.mark.parametrize("off", [5e-10, -5e-10, 0.0])
def test_an_angle_near_a_multiple_of_15_degrees_becomes_that(degrees: float, off: float) -> None:
    assert simple_angle(math.radians(degrees) + off, NANO) == math.radians(degrees)


def test_minus_half_a_turn_is_plus_half_a_turn() -> None:
    assert simple_angle(-math.pi + 1e-12, NANO) == math.pi
    assert simple_angle(3 * math.pi, NANO) == math.pi


def test_a_coordinate_keeps_its_turns() -> None:
    assert simple_turn(math.radians(400) + 1e-13, NANO) == math.radians(400)


def test_other_angles_lose_only_rounding_errors() -> None:
    odd = math.radians(37.3)
    assert simple_angle(math.nextafter(odd, 1.0), TIGHT) == odd
    assert simple_angle(0.123456789012345, TIGHT) == pytest.approx(0.123456789012345, abs=2e-16)


@pytest.mark.parametrize("angle", [1e-8, math.pi / 2 + 2e-9, 1.5708])
def test_an_angle_that_is_farther_off_stays(angle: float) -> None:
    assert simple_angle(angle, NANO) == pytest.approx(angle, abs=1e-15)


def test_a_wide_tolerance_takes_1_5708_for_a_right_angle() -> None:
    assert simple_angle(1.5708, WIDE) == math.pi / 2


def test_a_length_within_the_tolerance_is_zero_without_a_sign() -> None:
    assert math.copysign(1.0, simple_length(-1e-10, NANO)) == 1.0
    assert simple_length(-1e-10, NANO) == 0.0
    assert simple_length(2e-9, NANO) == 2e-9


def test_a_length_loses_the_noise_behind_its_few_decimals() -> None:
    assert simple_length(0.333 + 1e-10, NANO) == 0.333
    assert simple_length(0.089159 + 5e-13, NANO) == 0.089159
    assert simple_length(0.1 + 0.2, TIGHT) == 0.3


def test_a_calibrated_length_is_not_taken_for_a_round_one() -> None:
    """Six decimals and a nanometre are close by chance too often."""
    assert simple_length(0.089159 + 5e-11, NANO) == pytest.approx(0.089159 + 5e-11, abs=1e-16)
