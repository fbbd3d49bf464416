"""Units come from headings, cells, the text or the user; where it matters, none is guessed."""

from __future__ import annotations

import math

import pytest

from dh2sim.robot.units import AngleUnit, LengthUnit
from tests.formats.table.samples import STANDARD, complaints, imported, numbers

H = math.pi / 2
DEG, RAD, M, MM = AngleUnit.DEG, AngleUnit.RAD, LengthUnit.M, LengthUnit.MM
IN_M = "no unit of lengths is given: they were read in m"
ZERO = "all angles are 0, in any unit: the robot file is in rad, unless you pass angle='deg' or angle='rad'"


def _table(alpha: str, a: str = "0", *, alpha_heading: str = "α", a_heading: str = "a", theta: str = "θ1") -> str:
    return f"| θ | d | {a_heading} | {alpha_heading} |\n|---|---|---|---|\n| {theta} | 0 | {a} | {alpha} |\n"


@pytest.mark.parametrize(
    ("alpha", "a", "expected", "notes"),
    [
        ("90°", "0", (0, H), ()),
        ("π/2", "0", (0, H), ()),
        ("0", "0", (0, 0), (ZERO,)),
        ("0", "0.4", (0.4, 0), (ZERO, IN_M)),
        ("0", "-9.9", (-9.9, 0), (ZERO, IN_M)),
        ("0", "400 mm", (0.4, 0), (ZERO,)),
        ("0", "40 cm", (0.4, 0), (ZERO,)),
        ("0", "400 mm - 100", (0.3, 0), (ZERO,)),
    ],
)
def test_cells_say_their_unit(alpha: str, a: str, expected: tuple[float, float], notes: tuple[str, ...]) -> None:
    found = imported(_table(alpha, a), **STANDARD)
    assert (found.spec.rows[0].a, found.spec.rows[0].alpha) == pytest.approx(expected, abs=1e-15)
    assert found.notes == notes


@pytest.mark.parametrize("alpha", ["90", "15", "1.57", "3", "1", "-90", "1.6"])
def test_an_angle_without_a_unit_asks_for_it(alpha: str) -> None:
    assert complaints(_table(alpha), **STANDARD) == [
        f"t.md:3:16: row 1, alpha: '{alpha}' is an angle, and nothing says in which unit; write the unit in "
        "the heading, "
        "or pass angle='deg' or angle='rad'"
    ]


@pytest.mark.parametrize("a", ["10", "-425", "0.4 + 10"])
def test_a_length_of_ten_and_more_without_a_unit_asks_for_it(a: str) -> None:
    assert complaints(_table("0", a), **STANDARD) == [
        f"t.md:3:12: row 1, a: '{a}' is a length, and nothing says in which unit; write the unit in the "
        "heading, or pass "
        "length='m' or length='mm'"
    ]


@pytest.mark.parametrize("alpha", ["1.5708", "-1.571", "3.14159", "0.785398", "1.570796326794897"])
def test_pi_in_decimals_can_only_be_radians(alpha: str) -> None:
    found = imported(_table(alpha), **STANDARD)
    assert found.spec.rows[0].alpha == float(alpha)
    assert found.notes == ("angles without a unit were read in rad: they are multiples of pi/4 to the last digit",)


def test_where_all_angles_are_zero_the_unit_of_the_robot_file_is_noted_unless_something_gives_it() -> None:
    assert imported(_table("0", "1 m"), **STANDARD).notes == (ZERO,)
    for text, options in (
        (_table("0", "1 m"), {"angle": DEG}),
        (_table("0", "1 m", alpha_heading="α (deg)"), {}),
        (_table("0°", "1 m"), {}),
    ):
        found = imported(text, **STANDARD, **options)
        assert (found.units.angle, found.notes) == (DEG, ())


def test_options_say_the_unit() -> None:
    found = imported(_table("90", "400"), **STANDARD, angle=DEG, length=MM)
    assert numbers(found.spec) == [(0, 0, 0.4, H)]
    assert (found.units.angle, found.units.length, found.notes) == (DEG, MM, ())


def test_headings_say_the_unit_and_an_option_goes_before_them_and_is_noted() -> None:
    text = _table("90", "400", alpha_heading="α (deg)", a_heading="a [mm]")
    assert numbers(imported(text, **STANDARD).spec) == [(0, 0, 0.4, H)]
    found = imported(text, **STANDARD, angle=RAD, length=M)
    assert numbers(found.spec) == [(0, 0, 400, 90)]
    assert found.notes == (
        "the heading 'α (deg)' says deg; rad was asked for, and used",
        "the heading 'a [mm]' says mm; m was asked for, and used",
    )


def test_one_heading_counts_for_the_others_and_is_noted() -> None:
    found = imported(_table("90", "400", alpha_heading="α (deg)", a_heading="a [mm]", theta="θ1 + 45"), **STANDARD)
    assert numbers(found.spec) == [(math.pi / 4, 0, 0.4, H)]
    assert found.notes == ("an angle without a unit was read in deg, the unit of other columns",)


def test_marked_cells_speak_for_the_others_where_these_fit() -> None:
    assert imported(_table("90", theta="θ1 + 45°"), **STANDARD).spec.rows[0].alpha == H
    assert imported(_table("1.2", theta="θ1 + pi"), **STANDARD).spec.rows[0].alpha == 1.2
    for alpha, theta in (("1.2", "θ1 + 45°"), ("90", "θ1 + pi")):
        assert complaints(_table(alpha, theta=theta), **STANDARD) == [
            f"t.md:3:{len(theta) + 14}: row 1, alpha: '{alpha}' is an angle, and nothing says in which unit; "
            "write the unit "
            "in the heading, or pass angle='deg' or angle='rad'"
        ]


@pytest.mark.parametrize(
    "sentence",
    [
        "Angles in degrees, lengths in mm.",
        "Lengths are in millimetres, angles: deg",
        "All angles are given in deg and all distances in (mm).",
    ],
)
def test_a_sentence_beside_the_table_says_the_units(sentence: str) -> None:
    assert numbers(imported(f"{sentence}\n\n{_table('90', '400')}", **STANDARD).spec) == [(0, 0, 0.4, H)]


def test_a_cell_against_its_heading_is_refused() -> None:
    text = _table("pi/2", "0.4 m", alpha_heading="α (deg)", a_heading="a [mm]")
    assert complaints(text, **STANDARD) == [
        "t.md:3:12: row 1, a: '0.4 m' is in m, but the heading 'a [mm]' says mm",
        "t.md:3:20: row 1, alpha: 'pi/2' is in rad, but the heading 'α (deg)' says deg",
    ]


def test_a_unit_of_the_wrong_kind_is_refused() -> None:
    assert complaints(_table("5 mm", "90°"), **STANDARD) == [
        "t.md:3:12: row 1, a: '90°' is in deg, and a length belongs here",
        "t.md:3:18: row 1, alpha: '5 mm' is in mm, and an angle belongs here",
    ]


def test_a_decimal_comma_and_grouped_thousands_are_distinguished_or_refused() -> None:
    head = "theta;d;a;alpha\n"
    spec = imported(head + "q1;0,089;-0,425;0\n", "t.csv", **STANDARD).spec
    assert numbers(spec) == [(0, 0.089, -0.425, 0)]
    assert complaints(head + "q1;1,250;0;0\n", "t.csv", **STANDARD, length=MM) == [
        "t.csv:2:4: the comma in '1,250' may group thousands or be a decimal comma; write a point, or none"
    ]
    assert complaints(head + "q1;0,25;1.5;0\n", "t.csv", **STANDARD) == [
        "t.csv:2:4: row 1, d: '0,25' cannot be read: in '0 , 25': unexpected ',' after '0'; write a decimal "
        "point as ."
    ]
