"""Symbols in a table take their values from the text around it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.formats.table.samples import STANDARD, complaints, imported, numbers, standard, tool_poses

LETTERS = """\
Standard DH

| i | theta_i / rad | d_i / mm | a_i / mm | alpha_i / rad |
|---|---|---|---|---|
| 1 | q_1 | d_BS | 0 | pi/2 |
| 2 | q_2 - pi/2 | 0 | l_arm | 0 |
| 3 | q_3 | -l_ball | 0 | -pi/2 |

d_BS = 340 mm
l_arm = 217.50 mm
l_ball = 8.70 mm
"""
TABLE = "| θ | d | a | α |\n|---|---|---|---|\n| q1 | {symbol} | 0 | 90° |\n"


def _d(line: str, symbol: str = "d_1") -> float:
    return imported(f"{TABLE.format(symbol=symbol)}\n{line}\n", **STANDARD).spec.rows[0].d


def test_constants_of_several_letters_are_read() -> None:
    q, h = (0.3, -0.5, 0.7), math.pi / 2
    expected = standard(q[0], 0.34, 0, h) @ standard(q[1] - h, 0, 0.2175, 0) @ standard(q[2], -0.0087, 0, -h)
    np.testing.assert_allclose(tool_poses(imported(LETTERS).spec, [q])[0], expected, atol=1e-15)


@pytest.mark.parametrize("symbol", ["l_arm", "d_BS", "LA", "L_{arm}", "$l_{1}$", "lBase", "L", "upper_arm", "D1"])
@pytest.mark.parametrize("sign", [" = ", "=", " := ", ": ", " ≈ "])
def test_a_symbol_of_any_name_is_given_its_value(symbol: str, sign: str) -> None:
    assert _d(f"- {symbol}{sign}340 mm", symbol) == pytest.approx(0.34, rel=1e-15)


@pytest.mark.parametrize(
    ("line", "value"),
    [
        ("d_1 = 0.33 + 0.42 = 0.75", 0.75), ("d_1 = 0.33 + 0.42 m", 0.75), ("d1 = 0.33 m + 0.42 m = 0.75 m", 0.75),
        ("d_1 = 330 + 420 = 750 mm", 0.75), ("$d_1 = 0.33\\,\\mathrm{m}$", 0.33), ("d1 = 2*0.2", 0.4),
        ("d1 = L1 + L2, L1 = 0.1, L2 = 0.2", 0.1 + 0.2), ("L1 = 100 mm; L2 = 20 cm; d1 = L1 + L2", 0.1 + 0.2),
        ("d1 = (0.1 + 0.2)/2", 0.15), ("d1 = 0,4 m", 0.4), ("d_1 = 0.4 (height of the base)", 0.4),
        ("d1: 0.1 m", 0.1), ("d1 = 0.4 and a2 = 0.3", 0.4), ("where d1 = 0.4 is the height", 0.4), ("d1=40cm", 0.4),
        ("d1 = 4e-1 m.", 0.4), ("| Symbol | Value |\n|---|---|\n| d_1 | 340 mm |", 0.34),
        ("| Symbol | Meaning | Value (mm) |\n|---|---|---|\n| $d_1$ | height | 340 |", 0.34),
        ("| Symbol | Value | Unit |\n|---|---|---|\n| d1 | 34 | cm |", 0.34),
    ],
)  # fmt: skip
def test_values_are_read_as_people_write_them(line: str, value: float) -> None:
    assert _d(line) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    "line", ["d1 = tall", "d1 = 1,200 mm", "xd1 = 0.4", "d1 = 0.4 furlongs", "d1 = d1 + 1", "d1 ="]
)
def test_what_is_no_value_gives_none(line: str) -> None:
    [complaint] = complaints(f"{TABLE.format(symbol='d_1')}\n{line}\n", **STANDARD)
    assert complaint.startswith("t.md:3:8: row 1, d: the symbol 'd1' has no value; write the number")


def test_the_hint_leads_to_a_text_that_is_read() -> None:
    text = TABLE.format(symbol="l_arm")
    [complaint] = complaints(text, **STANDARD)
    hint = complaint.rpartition("such as '")[2].rstrip("'")
    assert hint == "larm = 0.4 m"
    assert numbers(imported(f"{text}\n{hint}\n", **STANDARD).spec)[0][1] == 0.4


def test_two_sides_that_differ_and_two_values_are_refused() -> None:
    text = TABLE.format(symbol="d1")
    assert complaints(f"{text}\nd1 = 0.33 + 0.42 = 0.57\n", **STANDARD) == [
        "t.md:3:8: row 1, d: the two sides of '0.33 + 0.42 = 0.57' on line 5 differ; write the number"
    ]
    assert complaints(f"{text}\nd1 = 0.33\n\nd1: 0.4\n", **STANDARD) == [
        "t.md:3:8: row 1, d: the symbol 'd1' has two values, on lines 5 and 7; write the number"
    ]


def test_symbols_defined_by_each_other_end() -> None:
    text = TABLE.format(symbol="d1")
    [complaint] = complaints(f"{text}\nd1 = L1 + 1\nL1 = L2 + 1\nL2 = d1 + 1\n", **STANDARD)
    assert "the symbol 'd1' has no value" in complaint
