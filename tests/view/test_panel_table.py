"""The table as it is printed."""

from __future__ import annotations

import re

import pytest

from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.view.events import EditCell
from dh2sim.view.initial_state import open_state
from dh2sim.view.panel.table import overview
from dh2sim.view.reduce import reduce


def cells(html: str) -> list[list[str]]:
    """The rows of the table, as they are read."""
    rows = re.findall(r"<tr>(.*?)</tr>", html)[1:]
    return [[re.sub("<[^>]*>", "", cell) for cell in re.findall(r"<td[^>]*>(.*?)</td>", row)] for row in rows]


@pytest.mark.parametrize(
    ("offset", "flip", "printed"),
    [
        ("0", "false", "q1"),
        ("0.0", "false", "q1"),
        ("-0", "true", "−q1"),
        ("90", "false", "q1 + 90"),
        ("+90", "false", "q1 + 90"),
        ("-90", "false", "q1 − 90"),
        ("pi / 2", "true", "−q1 + pi / 2"),
        ("-2 * pi", "false", "q1 − 2 * pi"),
    ],
)
@pytest.mark.parametrize(("kind", "column"), [("revolute", "theta"), ("prismatic", "d")])
def test_a_joint_variable_is_followed_by_its_offset_unless_that_is_zero(
    kind: str, column: str, offset: str, flip: str, printed: str
) -> None:
    text = f"name: x\nconvention: standard\njoints: [{{type: {kind}, {column}: {offset}, flip: {flip}, a: 0.5}}]\n"
    (row,) = cells(overview(open_state(parse_robot(text))))
    moving, other = (5, 4) if column == "theta" else (4, 5)
    assert row[moving] == printed
    assert row[other] == "0"


def test_a_wrong_offset_is_marked_beside_the_variable() -> None:
    state = reduce(open_state(load_robot("stanford")), EditCell(row=3, column="theta", text="90 +"))
    html = overview(state)
    assert cells(html)[3][5] == "q4 + 90 +"
    assert "it ends too early" in html


def test_a_fixed_row_has_no_variable() -> None:
    text = "name: x\nconvention: standard\njoints: [{type: revolute, a: 0.5}, {type: fixed, theta: 90, d: 0.1}]\n"
    assert cells(overview(open_state(parse_robot(text))))[1][4:6] == ["0.1", "90"]
