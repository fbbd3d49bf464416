"""Cells as people write them."""

from __future__ import annotations

import math
import re

import pytest

from dh2sim.formats.table.cells import CellError, Constant, Reading, no_value, read_cell
from dh2sim.formats.table.grid import Cell
from dh2sim.formats.table.headers import Quantity
from dh2sim.formats.table.motion import COORDINATES
from dh2sim.robot.units import AngleUnit, LengthUnit

DEG, RAD, M, MM = AngleUnit.DEG, AngleUnit.RAD, LengthUnit.M, LengthUnit.MM
THETA = COORDINATES[Quantity.THETA]
CONSTANTS = {
    "L1": Constant(value=0.4, unit=M, line=1),
    "a2": Constant(value=3.0, unit=None, line=2),
    "b": Constant(value=1.0, unit=None, line=3, problem="the symbol 'b' has two values"),
}


def _read(text: str, coordinates: re.Pattern[str] | None = None, *, comma: bool = False) -> Reading:
    return read_cell(Cell(text=text, line=1, column=1), coordinates, CONSTANTS, comma=comma)


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("0", 0, None), ("-90", -90, None), ("−90", -90, None), ("–90", -90, None), ("+.5", 0.5, None),
        ("1e-3", 0.001, None), ("425 mm", 425, MM), ("425mm", 425, MM), ("0.4 m", 0.4, M), ("90°", 90, DEG),
        ("90 deg", 90, DEG), ("90º", 90, DEG), ("-90˚", -90, DEG), ("$90^\\circ$", 90, DEG),
        ("$90^{\\circ}$", 90, DEG),
        ("90<sup>o</sup>", 90, DEG), ("1.2 rad", 1.2, RAD), ("90&deg;", 90, DEG), ("(90+45)°", 135, DEG),
        ("pi/2", math.pi / 2, RAD), ("π/2", math.pi / 2, RAD), ("-π/2", -math.pi / 2, RAD), ("PI", math.pi, RAD),
        ("1/2 pi", math.pi / 2, RAD), ("0.5π", math.pi / 2, RAD), ("2pi/3", 2 * math.pi / 3, RAD),
        ("½π", math.pi / 2, RAD), ("$\\frac{\\pi}{2}$", math.pi / 2, RAD),
        ("$-\\frac{3\\pi}{4}$", -0.75 * math.pi, RAD),
        ("\\(-\\dfrac{\\pi}{2}\\)", -math.pi / 2, RAD), ("$\\frac\\pi2$", math.pi / 2, RAD), ("pi rad", math.pi, RAD),
        ("**0.4**", 0.4, None), ("`0.4`", 0.4, None), ("__0.4__", 0.4, None), ("*0.4*", 0.4, None),
        ("2*0.2", 0.4, None), ("2·0.2", 0.4, None), ("2 \\cdot 0.2", 0.4, None), ("0.2(1+1)", 0.4, None),
        ("2**3", 8, None), ("10²", 100, None), ("sqrt(2)", math.sqrt(2), None), ("$\\sqrt{2}$", math.sqrt(2), None),
        ("a2", 3, None), ("a_2", 3, None), ("$a_{2}$", 3, None), ("a₂", 3, None), ("-a2/2", -1.5, None),
        ("L1", 0.4, M), ("2 L1", 0.8, M), ("L_1/2", 0.2, M), ("\u200b0.4\u00a0", 0.4, None),
    ],
)  # fmt: skip
def test_a_number_is_read(text: str, value: float, unit: AngleUnit | LengthUnit | None) -> None:
    found = _read(text)
    assert found.value == pytest.approx(value, rel=1e-15)
    assert (found.unit, found.symbol, found.empty) == (unit, None, False)


@pytest.mark.parametrize("text", ["", " ", "-", "—", "–", "--", "$-$"])
def test_an_empty_cell_or_a_dash_is_zero(text: str) -> None:
    found = _read(text, THETA)
    assert (found.value, found.empty, found.starred, found.symbol) == (0, True, False, None)


@pytest.mark.parametrize(
    ("text", "symbol", "sign", "value", "starred"),
    [
        ("θ1*", "theta1", 1, 0, True), ("θ1", "theta1", 1, 0, False), ("θ₁", "theta1", 1, 0, False),
        ("θ_1", "theta1", 1, 0, False), ("$\\theta_1$", "theta1", 1, 0, False),
        ("$\\theta_{12}^*$", "theta12", 1, 0, True),
        ("$\\theta_1^{*}$", "theta1", 1, 0, True), ("\\theta_1", "theta1", 1, 0, False),
        ("θ<sub>1</sub>", "theta1", 1, 0, False),
        ("q1", "q1", 1, 0, False), ("q_1", "q1", 1, 0, False), ("theta1", "theta1", 1, 0, False),
        ("th1*", "th1", 1, 0, True),
        ("Theta_1", "Theta1", 1, 0, False), ("θᵢ", "thetai", 1, 0, False), ("θ", "theta", 1, 0, False),
        ("*", None, 1, 0, True), ("variable", None, 1, 0, True), ("θ1 (variable)", "theta1", 1, 0, True),
        ("**θ₁***", "theta1", 1, 0, True), ("θ1\\*", "theta1", 1, 0, True), ("θ1 *", "theta1", 1, 0, True),
        ("*q1", "q1", 1, 0, True), ("q2 - 90°", "q2", 1, -90, False), ("θ2+pi/2", "theta2", 1, math.pi / 2, False),
        ("90 + q2", "q2", 1, 90, False), ("-q3", "q3", -1, 0, False), ("-q1 + 22.9°", "q1", -1, 22.9, False),
        ("90° - q1", "q1", -1, 90, False), ("$\\theta_3^* + \\pi/2$", "theta3", 1, math.pi / 2, True),
        ("π + θ1", "theta1", 1, math.pi, False), ("0*", None, 1, 0, True), ("1e20 + q1", "q1", 1, 1e20, False),
    ],
)  # fmt: skip
def test_a_coordinate_is_found_with_its_sign_and_what_is_added(
    text: str, symbol: str | None, sign: int, value: float, starred: bool
) -> None:
    found = _read(text, THETA)
    assert found.value == pytest.approx(value, rel=1e-15)
    assert (found.symbol, found.sign, found.starred) == (symbol, sign, starred)


def test_a_comma_is_a_decimal_point_only_where_the_table_says_so() -> None:
    assert _read("-0,45", comma=True).value == -0.45
    with pytest.raises(CellError) as raised:
        _read("-0,45")
    assert str(raised.value) == (
        "'-0,45' cannot be read: in '- 0 , 45': unexpected ',' after '0'; write a decimal point as ."
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("d7", "the symbol 'd7' has no value; write the number, or give its value in the text around the table, such "
               "as 'd7 = 0.4 m'"),
        ("q1 + q2", "two joint coordinates, 'q1' and 'q2', in one cell; a row takes one, and joints that move "
                    "together have no DH table"),
        ("2*q1", "the coordinate 'q1' may only be added or subtracted, as in 'q1 + 1' or '1 - q1'; found '2*q1'"),
        ("sin(q1)", "the coordinate 'q1' may only be added or subtracted, as in 'q1 + 1' or '1 - q1'; "
                    "found 'sin(q1)'"),
        ("q1*-1", "'q1*-1' may mean '-q1' or, with a star that marks the variable, 'q1 - 1'; write that"),
        ("O.5", f"{no_value('O')}. Did you mean 0.5? It has the letter O in place of a digit"),
        ("1.O°", f"{no_value('O')}. Did you mean 1.0? It has the letter O in place of a digit"),
        ("l0", f"{no_value('l0')}. Did you mean 10? It has the letter l in place of a digit"),
        ("l2", no_value("l2")),
        ("90° + 1 rad", "two units in one cell: deg and rad; write one"),
        ("0.4 m + 20 mm", "two units in one cell: m and mm; write one"),
        ("pi/2 °", "'pi/2 °' is written with pi and in degrees; write one of them"),
        ("L1 + 0.1", "a number without a unit beside a symbol that has one; write the unit behind the number too"),
        ("L1 + 5 mm", "two units in one cell: m and mm; write one"),
        ("b", "the symbol 'b' has two values"),
        ("1/0", "'1/0' cannot be read: in '1 / 0': division by zero"),
        ("1.2.3", "'1.2.3' cannot be read: in '1.2 .3': unexpected '.3' after '1.2'"),
        ("9**9**9**9", "'9**9**9**9' cannot be read: in '9 ** 9 ** 9 ** 9': the result is too large"),
        ("1" * 500, "the cell has 500 characters; at most 400 are allowed"),
    ],
)  # fmt: skip
def test_a_wrong_cell_says_what_is_wrong(text: str, message: str) -> None:
    with pytest.raises(CellError) as raised:
        _read(text, THETA)
    assert str(raised.value) == message


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("$\\sqrt{L_3^2+L_2^2}$", 0.5), ("$\\sqrt{L_3^{2}+L_{2}^{2}}$", 0.5), ("√(L2² + L3²)", 0.5), ("2^3", 8.0),
        ("$L_2^{\\,2}$", 0.09), ("$\\frac{\\sqrt{L_2^2 + L_3^2}}{2}$", 0.25), ("√2 / 2", math.sqrt(2) / 2),
        ("$\\dfrac{1}{\\sqrt{2}}$", 1 / math.sqrt(2)), ("L2*cos(60°)", 0.15), ("L_2 \\cos(\\frac{\\pi}{3})", 0.15),
        ("(L2 + L3)/2", 0.35),
    ],
)  # fmt: skip
def test_powers_roots_and_functions_are_read_in_lengths(text: str, value: float) -> None:
    cell = Cell(text=text, line=1, column=1)
    constants = {name: Constant(value=v, unit=None, line=1) for name, v in (("L2", 0.3), ("L3", 0.4))}
    assert read_cell(cell, None, constants, comma=False).value == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    "text",
    [
        "$\\theta_2 + \\arctan{\\frac{L_3}{L_2}}$", "θ2 + atan(L3/L2)", "θ2 + tan⁻¹(L3/L2)",
        "$\\theta_2 + \\tan^{-1}(L_3/L_2)$", "q2 + atan2(L3, L2)", "q2 + arctan2(L3,L2)", "θ_2 + arctg(L3/L2)",
        "$\\operatorname{atan2}(L_3, L_2) + \\theta_2^*$",
    ],
)  # fmt: skip
@pytest.mark.parametrize("unit", [None, LengthUnit.M])
def test_an_arc_tangent_of_lengths_is_an_angle_in_radians(text: str, unit: LengthUnit | None) -> None:
    constants = {name: Constant(value=v, unit=unit, line=1) for name, v in (("L2", 0.3), ("L3", 0.4))}
    found = read_cell(Cell(text=text, line=1, column=1), THETA, constants, comma=False)
    assert found.value == pytest.approx(math.atan2(0.4, 0.3), rel=1e-15)
    assert found.unit is AngleUnit.RAD


@pytest.mark.parametrize("text", ["L1*cos(30)", "sin(90)", "tan(-45)"])
def test_a_function_of_a_number_that_looks_like_degrees_is_refused(text: str) -> None:
    with pytest.raises(CellError, match=r"is of radians; write .*°\) if degrees are meant"):
        _read(text, None)


@pytest.mark.parametrize("text", ["N/A", "n/a", "none", "nil", "—", "", "N.A."])
def test_a_cell_that_says_not_applicable_is_empty(text: str) -> None:
    assert _read(text, None).empty
