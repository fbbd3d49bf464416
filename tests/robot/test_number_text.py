"""Numbers are written as the shortest text that reads back as the same double, in every unit."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dh2sim.errors import ModelError, NotFiniteError
from dh2sim.robot.fields import Dimension
from dh2sim.robot.number_text import UnitWriter, number
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.units import AngleUnit, LengthUnit, Units
from dh2sim.robot.write import PartWriter
from dh2sim.robot.yaml_tree import resolve_plain

DEGREES = UnitWriter(units=Units(angle=AngleUnit.DEG))


def _length_writer(unit: LengthUnit) -> UnitWriter:
    return UnitWriter(units=Units(length=unit))


def _read(text: str) -> float:
    """Return what the reader of robot files makes of a number."""
    value = resolve_plain(text)
    assert isinstance(value, int | float), text
    assert not isinstance(value, bool)
    return float(value)


def _digits(text: str) -> int:
    """Return the number of significant digits."""
    return len(text.partition("e")[0].replace("-", "").replace(".", "").strip("0"))


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (1, "1"),
        (-90.0, "-90"),
        (0.4318, "0.4318"),
        (0.1 + 0.2, "0.30000000000000004"),
        (1e-9, "1e-9"),
        (-2.5e-7, "-2.5e-7"),
        (1e22, "1e22"),
        (1e15, "1000000000000000"),
        (5e-324, "5e-324"),
        (np.float64(0.5), "0.5"),
    ],
)
def test_numbers_have_no_needless_characters(value: float, text: str) -> None:
    assert number(value) == text


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_read_back_as_the_same_double(value: float) -> None:
    assert _read(number(value)) == value


@pytest.mark.parametrize("degrees", ["0", "-90", "90", "180", "37.3", "-0.001", "359.999", "1e-9", "123456.789"])
def test_angles_that_were_given_in_degrees_are_written_as_they_were_given(degrees: str) -> None:
    assert DEGREES.angle(math.radians(float(degrees))) == degrees


@given(st.decimals(-1000, 1000, places=4))
def test_four_decimals_of_a_degree_come_back_with_no_more_digits(degrees: object) -> None:
    given_text = number(float(str(degrees)))
    text = DEGREES.angle(math.radians(float(given_text)))
    assert math.radians(float(text)) == math.radians(float(given_text))
    assert _digits(text) <= _digits(given_text)


def _reachable(value: float, to_si: Callable[[float], float], guess: float) -> list[float]:
    """Return the doubles near ``guess`` that become ``value``; looks at many more than the writer does."""
    steps = np.arange(-60, 61) * math.ulp(guess)
    return [double for double in (guess + steps).tolist() if to_si(double) == value]


@given(st.floats(-10, 10, allow_subnormal=False))
@example(1.0)
@example(math.pi)
@example(math.nextafter(math.pi / 2, 2))
def test_angles_in_degrees_are_exact_where_a_double_is_and_an_ulp_off_elsewhere(value: float) -> None:
    text = DEGREES.angle(value)
    back = math.radians(_read(text))
    if _reachable(value, math.radians, math.degrees(value)):
        assert back == value
    else:
        assert back in (math.nextafter(value, -math.inf), math.nextafter(value, math.inf))
    assert DEGREES.angle(back) == text


def test_there_are_angles_that_no_double_in_degrees_gives() -> None:
    values = np.random.default_rng(0).uniform(-math.pi, math.pi, 2000).tolist()
    exact = [math.radians(float(DEGREES.angle(value))) == value for value in values]
    assert 0.8 < sum(exact) / len(exact) < 1


@given(st.floats(-math.pi, math.pi, allow_subnormal=False))
def test_no_text_of_an_angle_is_shorter(value: float) -> None:
    text = DEGREES.angle(value)
    back, degrees = math.radians(float(text)), math.degrees(value)
    for count in range(1, _digits(text)):
        step = 10.0 ** (math.floor(math.log10(abs(degrees))) + 1 - count) if degrees else 0.0
        for neighbour in (degrees - step, degrees, degrees + step):
            assert math.radians(float(f"{neighbour:.{count}g}")) != back


@pytest.mark.parametrize("unit", LengthUnit)
@given(value=st.floats(-10, 10, allow_subnormal=False))
def test_lengths_are_exact_or_an_ulp_off_in_every_unit(unit: LengthUnit, value: float) -> None:
    writer = _length_writer(unit)
    text = writer.length(value)
    back = writer.units.metres(_read(text))
    per_metre = {LengthUnit.M: 1, LengthUnit.MM: 1000, LengthUnit.CM: 100, LengthUnit.IN: 1 / 0.0254}[unit]
    if unit is LengthUnit.M or _reachable(value, writer.units.metres, value * per_metre):
        assert back == value
    else:
        assert back in (math.nextafter(value, -math.inf), math.nextafter(value, math.inf))
    assert writer.length(back) == text


@pytest.mark.parametrize(("unit", "text"), [("m", "0.4318"), ("mm", "431.8"), ("cm", "43.18"), ("in", "17")])
def test_lengths_are_written_in_the_unit_of_the_file(unit: str, text: str) -> None:
    assert _length_writer(LengthUnit(unit)).length(0.4318) == text


def test_coordinates_have_the_unit_of_their_joint() -> None:
    writer = UnitWriter(units=Units(angle=AngleUnit.DEG, length=LengthUnit.MM))
    assert writer.text(math.pi / 2, Dimension.COORDINATE, turns=True) == "90"
    assert writer.text(0.5, Dimension.COORDINATE, turns=False) == "500"


@pytest.mark.parametrize("value", [5e-324, -5e-324, 1e-310, 2.2250738585072014e-308])
def test_the_smallest_numbers_stay_the_same_once_they_were_read(value: float) -> None:
    text = DEGREES.angle(value)
    assert DEGREES.angle(math.radians(float(text))) == text
    assert math.radians(float(text)) == value


def test_numbers_too_large_for_the_unit_are_refused() -> None:
    with pytest.raises(ModelError) as angle:
        DEGREES.angle(1e307)
    assert str(angle.value) == "1e+307 rad is too large to be written in deg"
    with pytest.raises(ModelError) as length:
        _length_writer(LengthUnit.MM).length(-1e306)
    assert str(length.value) == "-1e+306 m is too large to be written in mm"


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_is_never_written(value: float) -> None:
    with pytest.raises(NotFiniteError, match=rf"^d: {value} is not a finite number"):
        PartWriter(UnitWriter(), None).part(
            Row(name="a", type=JointType.FIXED, convention=Convention.STANDARD, d=value)
        )
