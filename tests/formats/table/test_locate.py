"""Where tables are found, and the shapes of what people call a table."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim.robot.row import Convention
from tests.formats.table.samples import (
    MODIFIED,
    STANDARD,
    complaints,
    imported,
    modified,
    numbers,
    standard,
    tool_poses,
    types,
)

H = math.pi / 2


def test_rows_of_markdown_that_are_shorter_than_the_headings_are_filled_up() -> None:
    text = """\
        Modified DH

        i   | alpha_{i-1} | a_{i-1} (m) | d_i (m) | theta_i
        --- | ---         | ---     | ---  | ---
        1   | 0           | 0       | 0.75 |
        2   | -pi/2       | 0.35    | 0    | -pi/2
        3   | 0           | 1.25    | 0
        """
    found, q = imported(text), (0.3, -0.5, 0.7)
    expected = modified(q[0], 0.75, 0, 0) @ modified(q[1] - H, 0, 0.35, -H) @ modified(q[2], 0, 1.25, 0)
    np.testing.assert_allclose(tool_poses(found.spec, [q])[0], expected, atol=1e-15)
    assert "row 3 has 4 cells of 5: the others were read as empty" in found.notes


def test_what_is_behind_the_last_column_is_cut_off_and_noted_unless_it_is_a_number() -> None:
    head = "| θ | d | a | α |\n|---|---|---|---|\n| q1 | 0 | 1 | 90° |{} |\n"
    found = imported(head.format(" the shoulder"), **STANDARD)
    assert numbers(found.spec) == [(0, 0, 1, H)]
    assert found.notes[0] == "behind the last column of row 1, 'the shoulder' was not read"
    for number in ("0.5", "-90°", "pi/2", "θ1", "30 mm"):
        assert complaints(head.format(f" {number}"), **STANDARD) == [
            "t.md:3:3: row 1: 5 cells in a table of 4 columns"
        ]


def test_rows_of_csv_are_not_filled_up() -> None:
    assert complaints("theta,d,a,alpha\nq1,0,1\n", "t.csv", **STANDARD) == [
        "t.csv:2:1: row 1: 3 cells in a table of 4 columns"
    ]


@pytest.mark.parametrize("units", ["[rad]|[mm]|[mm]|[deg]", "(rad)|(mm)|(mm)|(°)", "rad|mm|mm|deg.", "-|mm|mm|deg"])
def test_units_in_a_row_of_their_own_belong_to_the_headings(units: str) -> None:
    text = f"| i | θ | d | a | α |\n|---|---|---|---|---|\n|   |{units}|\n| 1 | θ1 | 100 | 20 | -90 |\n"
    assert numbers(imported(text, **STANDARD).spec) == [(0, 0.1, 0.02, -H)]
    csv = "\n".join(["i;θ;d;a;α", f";{units.replace('|', ';')}", "1;θ1;100;20;-90"])
    assert numbers(imported(csv, "t.csv", **STANDARD).spec) == [(0, 0.1, 0.02, -H)]


def test_symbols_in_a_second_row_of_headings_belong_to_the_words_above_them() -> None:
    text = """\
        | Joint | Joint angle (deg) | Link offset | Link length | Twist |
        |---|---|---|---|---|
        | i | θ_i | d_i (mm) | a_{i-1} (mm) | α_{i-1} (deg) |
        | 1 | θ1 + 90 | 100 | 20 | -90 |
        """
    found = imported(text)
    assert found.spec.convention is Convention.MODIFIED
    assert numbers(found.spec) == [(H, 0.1, 0.02, -H)]


CONFLICT = """\
Links | alpha(i-1) | a(i-1) | d(i-1) | theta(i)
--- | --- | --- | --- | ---
0->1 | 0 | 0 | 0.75 | q1
1->2 | -pi/2 | 0.35 | 0 | q2 - pi/2
2->3 | 0 | 1.25 | 0 | q3
"""


def test_an_option_decides_where_the_indices_of_headings_contradict_each_other() -> None:
    q = (0.3, -0.5, 0.7)
    rows = ((q[0], 0.75, 0, 0), (q[1] - H, 0, 0.35, -H), (q[2], 0, 1.25, 0))
    for said, matrix, name in ((MODIFIED, modified, "modified"), (STANDARD, standard, "standard")):
        found = imported(CONFLICT, **said)
        expected = matrix(*rows[0]) @ matrix(*rows[1]) @ matrix(*rows[2])
        np.testing.assert_allclose(tool_poses(found.spec, [q])[0], expected, atol=1e-15)
        assert (
            f"the headings' indices contradict each other: the table was read as {name}, as asked for" in found.notes
        )
    [complaint] = complaints(CONFLICT)
    assert complaint.startswith("t.md:1:22: the headings' indices contradict each other: ")


@pytest.mark.parametrize("heads", ["θ(i-1)|d|a|α", "θ_i|d_{i-1}|a_i|α_i", "θ_i|d_i|a_i|α_{i-1}"])
def test_any_contradiction_of_indices_is_found(heads: str) -> None:
    text = f"|{heads}|\n|---|---|---|---|\n| q1 | 0 | 1 | 90° |\n"
    assert "the headings' indices contradict each other" in complaints(text)[0]
    assert types(imported(text, **MODIFIED).spec) == "r"
