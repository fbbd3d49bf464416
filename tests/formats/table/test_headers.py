"""Headings as people write them."""

from __future__ import annotations

import math

import pytest

from dh2sim.formats.table.grid import Cell
from dh2sim.formats.table.headers import Quantity, read_heading
from dh2sim.robot.units import AngleUnit, LengthUnit
from tests.formats.table.samples import MODIFIED, STANDARD, complaints, imported

Q = Quantity


@pytest.mark.parametrize(
    ("text", "quantity", "index"),
    [
        ("theta", Q.THETA, None), ("θ", Q.THETA, None), ("th", Q.THETA, None), ("θ_i", Q.THETA, 0),
        ("theta_i", Q.THETA, 0),
        ("$\\theta_i$", Q.THETA, 0), ("$\\theta_{i}$", Q.THETA, 0), ("Joint angle", Q.THETA, None),
        ("θⱼ", Q.THETA, 0),
        ("joint angle θ", Q.THETA, None), ("θi", Q.THETA, 0), ("thetai", Q.THETA, 0), ("Theta", Q.THETA, None),
        ("alpha", Q.ALPHA, None), ("α", Q.ALPHA, None), ("twist", Q.ALPHA, None), ("Link Twist", Q.ALPHA, None),
        ("α_{i-1}", Q.ALPHA, -1), ("$\\alpha_{i-1}$", Q.ALPHA, -1), ("⍺ⱼ₋₁", Q.ALPHA, -1),
        ("alpha(i-1)", Q.ALPHA, -1),
        ("\\alpha_{i−1}", Q.ALPHA, -1), ("alpha_i-1", Q.ALPHA, -1), ("&alpha;<sub>i-1</sub>", Q.ALPHA, -1),
        ("a", Q.A, None), ("link length", Q.A, None), ("link_length", Q.A, None), ("a_i", Q.A, 0),
        ("a_{i-1}", Q.A, -1),
        ("ai-1", Q.A, -1), ("aⱼ₋₁", Q.A, -1), ("ai", Q.A, 0), ("a (link length)", Q.A, None),
        ("Link length a_i", Q.A, 0),
        ("r", Q.R, None), ("r_i", Q.R, 0), ("d", Q.D, None), ("d_i", Q.D, 0), ("link offset", Q.D, None),
        ("s", Q.D, None),
        ("d(i)", Q.D, 0), ("joint offset d", Q.D, None), ("offset", Q.OFFSET, None), ("θ offset", Q.OFFSET, None),
        ("β", Q.BETA, None), ("beta_i", Q.BETA, 0), ("i", Q.JOINT, None), ("#", Q.JOINT, None),
        ("Joint", Q.JOINT, None),
        ("link", Q.JOINT, None), ("", Q.JOINT, None), ("Joint no.", Q.JOINT, None), ("name", Q.NAME, None),
        ("type", Q.TYPE, None), ("σ", Q.TYPE, None), ("σ_j", Q.TYPE, 0), ("R/P", Q.TYPE, None),
        ("qmin", Q.LOWER, None),
        ("q⁻", Q.LOWER, None), ("q⁺", Q.UPPER, None), ("q_max", Q.UPPER, None), ("Lower limit", Q.LOWER, None),
        ("min", Q.LOWER, None), ("limits", Q.LIMITS, None), ("Joint limits", Q.LIMITS, None),
        ("**θ**", Q.THETA, None),
        ("mass", None, None), ("alhpa", None, None), ("Rated torque", None, None), ("angle", Q.ANGLE, None),
        ("φ_i", Q.ANGLE, 0), ("ϕ", Q.ANGLE, None), ("$\\varphi_i$", Q.ANGLE, 0), ("Ɵ", Q.THETA, None),
        ("Ө_i", Q.THETA, 0), ("Ѳ", Q.THETA, None), ("teta", Q.THETA, None), ("Joint angle q", Q.THETA, None),
        ("Joint angle $q_i$", Q.THETA, 0), ("rotation angle", Q.ANGLE, None), ("Angle θ", Q.THETA, None),
        ("twist angle α", Q.ALPHA, None), ("Joint variable", Q.VARIABLE, None), ("phi (joint angle)", Q.THETA, None),
    ],
)  # fmt: skip
def test_a_heading_is_known(text: str, quantity: Quantity | None, index: int | None) -> None:
    found = read_heading(Cell(text=text, line=1, column=1))
    assert (found.quantity, found.index, found.angle, found.length) == (quantity, index, None, None)


@pytest.mark.parametrize(
    ("text", "quantity", "index", "unit"),
    [
        ("alpha (deg)", Q.ALPHA, None, AngleUnit.DEG), ("a [mm]", Q.A, None, LengthUnit.MM),
        ("d / m", Q.D, None, LengthUnit.M), ("θ (°)", Q.THETA, None, AngleUnit.DEG),
        ("a_i, mm", Q.A, 0, LengthUnit.MM),
        ("$\\alpha_{i-1}$ [rad]", Q.ALPHA, -1, AngleUnit.RAD), ("d_mm", Q.D, None, LengthUnit.MM),
        ("Theta_i (Grad)", Q.THETA, 0, AngleUnit.DEG), ("alpha [grados]", Q.ALPHA, None, AngleUnit.DEG),
        ("theta in degrees", Q.THETA, None, AngleUnit.DEG), ("a (in mm)", Q.A, None, LengthUnit.MM),
        ("a [in]", Q.A, None, LengthUnit.IN), ("Link length (mm)", Q.A, None, LengthUnit.MM),
        ("α°", Q.ALPHA, None, AngleUnit.DEG),
        ("d (m) - link offset", Q.D, None, LengthUnit.M), ("qmin (deg)", Q.LOWER, None, AngleUnit.DEG),
        ("$d\\;(\\mathrm{m})$", Q.D, None, LengthUnit.M), ("a(i-1) [m]", Q.A, -1, LengthUnit.M),
    ],
)  # fmt: skip
def test_a_heading_says_its_unit(
    text: str, quantity: Quantity, index: int | None, unit: AngleUnit | LengthUnit
) -> None:
    found = read_heading(Cell(text=text, line=1, column=1))
    assert (found.quantity, found.index, found.angle or found.length) == (quantity, index, unit)


def test_a_misspelt_heading_is_named_beside_what_is_missing() -> None:
    assert complaints("theta,d,a,alhpa\n0,1,2,3\n", "t.csv", **STANDARD) == [
        "t.csv:1:1: no column for alpha; a DH table has columns for theta, d, a, alpha. Found headings: 'theta', "
        "'d', 'a', 'alhpa'",
        "t.csv:1:11: unknown heading 'alhpa'. Did you mean 'alpha'?",
    ]


def test_a_table_with_too_few_columns_says_which_are_missing() -> None:
    assert complaints("| joint | theta |\n|---|---|\n| 1 | 0 |\n") == [
        "t.md:1:3: no column for d and a and alpha; a DH table has columns for theta, d, a, alpha. Found headings: "
        "'joint', 'theta'"
    ]


def test_two_columns_for_one_thing_are_refused() -> None:
    assert complaints("theta,d,a,alpha,d_i\n0,0,0,0,0\n", "t.csv", **STANDARD) == [
        "t.csv:1:17: two columns hold d: this one, and the one headed 'd'"
    ]


def test_a_text_without_a_table_says_what_is_looked_for() -> None:
    assert complaints("# A robot\n\n| a | b |\n|---|---|\n".replace("a |", "x |")) == [
        "t.md:1:1: no table of Denavit-Hartenberg parameters found: none has headings such as theta, d, a "
        "and alpha. Allowed: a table in Markdown, LaTeX, HTML, MediaWiki, CSV, TSV, YAML or JSON, or a printout or a "
        "script of the Robotics Toolbox for Python or MATLAB"
    ]


def test_r_beside_alpha_is_a_and_beside_theta_may_be_khalils() -> None:
    spec = imported("| θ | d | r | α |\n|-|-|-|-|\n| θ1 | 1 | 2 | 0 |\n", **STANDARD).spec
    assert (spec.rows[0].d, spec.rows[0].a) == (1, 2)
    assert complaints("| α | d | θ | r |\n|-|-|-|-|\n| 0 | 1 | θ1 | 2 |\n", **MODIFIED) == [
        "t.md:1:15: r is a in some books and, after Khalil, d in others (whose d is a): name the columns a and d"
    ]


def test_offset_is_d_where_nothing_else_is() -> None:
    found = imported("theta,offset,length,twist\nq1,1,2,0\n", "t.csv", **STANDARD)
    assert (found.spec.rows[0].d, found.spec.rows[0].a, found.spec.rows[0].theta) == (1, 2, 0)
    assert "column 'offset' was read as d, since no other column is d" in found.notes


def test_columns_that_are_not_used_are_named() -> None:
    notes = imported("i,theta,d,a,alpha,mass,q\n1,q1,1,2,0,7,home\n", "t.csv", **STANDARD).notes
    assert notes[:2] == ("column 'mass' was not used", "column 'q' was not used")


@pytest.mark.parametrize("heading", ["φ (deg)", "ϕ [deg]", "Ɵ (deg)", "Ө, deg", "angle (deg)", "Joint angle q (°)"])
def test_a_column_of_joint_angles_is_theta_whatever_it_is_called(heading: str) -> None:
    text = f"| i | {heading} | d | a | α (deg) |\n|---|---|---|---|---|\n| 1 | q1 + 180 | 1 | 2 | 90 |\n"
    spec = imported(text, **STANDARD).spec
    assert (spec.rows[0].theta, spec.rows[0].d, spec.rows[0].a) == (math.pi, 1, 2)


@pytest.mark.parametrize("cells", [("q1", "q2 + 90"), ("0", "-90"), ("θ1*", "θ2*"), ("pi/2", "0"), ("*", "*")])
def test_a_column_of_angles_that_nobody_knows_is_refused(cells: tuple[str, str]) -> None:
    text = (
        f"| d | a | α (deg) | Ugol |\n|---|---|---|---|\n| 1 | 2 | 90 | {cells[0]} |\n| 1 | 2 | 90 | {cells[1]} |\n"
    )
    assert complaints(text, **STANDARD) == [
        "t.md:1:21: the column 'Ugol' holds angles or coordinates, and no column is known as theta: call it theta, "
        "or leave it out"
    ]


@pytest.mark.parametrize(
    ("heading", "cells"),
    [("Mass [kg]", ("3.7", "8.4")), ("Gelenk", ("A1", "A2")), ("Nr", ("1", "2")), ("Von", ("0", "1"))],
)
def test_columns_of_something_else_are_not_taken_for_theta(heading: str, cells: tuple[str, str]) -> None:
    text = (
        f"| {heading} | d | a | α |\n|---|---|---|---|\n| {cells[0]} | 1 | 2 | 90° |\n| {cells[1]} | 1 | 2 | 90° |\n"
    )
    found = imported(text, **STANDARD)
    assert len(found.spec.rows) == 2
    assert any(note.startswith("no column is theta: ") for note in found.notes)


def test_a_unit_may_end_with_a_point_or_be_in_braces() -> None:
    text = "| i | theta | d (mm.) | a {mm} | alpha (deg.) |\n|---|---|---|---|---|\n| 1 | q1 | 100 | N/A | 90 |\n"
    spec = imported(text, **STANDARD).spec
    assert (spec.rows[0].d, spec.rows[0].a, spec.rows[0].alpha) == (0.1, 0, math.pi / 2)
