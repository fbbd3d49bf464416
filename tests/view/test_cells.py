"""The grid of the table's cells: its columns, its rows, and what its style sheet marks."""

from __future__ import annotations

import re

import pytest

from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.view.events import EditCell, SelectRow, SetConvention
from dh2sim.view.initial_state import open_state
from dh2sim.view.panel.cells import (
    ROWS_SHOWN,
    columns_of,
    heads_of,
    identity_of,
    rows_shown,
    style_of,
    variable_of,
)
from dh2sim.view.scene.annotations import Quantity
from dh2sim.view.state import ViewState
from tests.sample_robots import STANDARD
from tests.view.states import STANFORD, after


def opened(rows: str, convention: str = "standard") -> ViewState:
    return open_state(parse_robot(f"name: x\nconvention: {convention}\njoints: [{rows}]\n"))


def styled(state: ViewState, rule: str) -> set[tuple[int, str]]:
    """The cells that a rule is for, by row, from 0, and column; the button of a row is ``i``."""
    columns = ["i", *(quantity.value for quantity in columns_of(state))]
    found = set()
    for place in re.findall(rf">:nth-child\((\d+)\)[^{{}}]*{{[^{{}}]*{re.escape(rule)}", style_of(state)):
        row, column = divmod(int(place) - 2, len(columns))  # the style sheet is the first child, from 1
        found.add((rows_shown(state)[row - 1], columns[column]))  # the heads are the first row
    return found


@pytest.mark.parametrize(
    ("row", "cell", "variable"),
    [
        ("{type: revolute, theta: 0}", "theta", "q₁"),
        ("{type: continuous, theta: pi / 2, flip: true}", "theta", "−q₁"),
        ("{type: prismatic, theta: 1}", "d", "q₁"),
        ("{type: prismatic, flip: true}", "d", "−q₁"),
        ("{type: fixed, theta: 1}", None, ""),
    ],
)
def test_a_joint_variable_stands_before_the_offset_that_it_is_added_to(
    row: str, cell: str | None, variable: str
) -> None:
    state = opened(f"{row}, {{type: revolute}}")
    found = {quantity.value: variable_of(state, 0, quantity) for quantity in columns_of(state)}
    assert found == {"a": "", "alpha": "", "d": "", "theta": "", **({} if cell is None else {cell: variable})}
    assert styled(state, f'content:"{variable}+"') == (set() if cell is None else {(0, cell)})
    assert styled(state, 'content:"q₂+"') == {(1, "theta")}


def test_wrong_cells_and_the_selected_row_are_marked() -> None:
    state = after(STANFORD, EditCell(row=3, column="theta", text="90 +"), EditCell(row=1, column="a", text="oh"))
    assert styled(state, "background:#fde2df") == {(3, "theta"), (1, "a")}
    assert styled(state, "background:#235394") == {(1, "i")}, "the row that was typed into"
    mended = after(state, EditCell(row=3, column="theta", text="9"), EditCell(row=1, column="a", text="0"))
    assert styled(mended, "background:#fde2df") == set()


@pytest.mark.parametrize(
    ("convention", "heads"),
    [
        ("standard", ["i", "aᵢ [m]", "αᵢ [rad]", "dᵢ [m]", "θᵢ [rad]"]),
        ("modified", ["i", "aᵢ₋₁ [m]", "αᵢ₋₁ [rad]", "dᵢ [m]", "θᵢ [rad]"]),
        ("hayati", ["i", "aᵢ [m]", "αᵢ [rad]", "dᵢ [m]", "θᵢ [rad]", "βᵢ [rad]"]),
    ],
)
def test_heads_carry_letter_index_and_unit(convention: str, heads: list[str]) -> None:
    state = opened("{type: revolute}", convention)
    assert [re.sub("<[^>]*>", "", head) for head in heads_of(state)] == heads


def test_columns_of_rows_in_several_conventions_have_no_common_index() -> None:
    state = opened("{type: revolute}, {type: revolute, convention: modified}")
    assert [re.sub("<[^>]*>", "", head) for head in heads_of(state)][:3] == ["i", "a [m]", "α [rad]"]


def test_beta_is_a_column_while_a_row_is_hayati_or_wrong_for_its_beta() -> None:
    state = opened("{type: revolute, beta: 0.1, convention: hayati}, {type: revolute}")
    assert Quantity.BETA in columns_of(state)
    assert columns_of(STANFORD) == (Quantity.A, Quantity.ALPHA, Quantity.D, Quantity.THETA)
    refused = after(state, SetConvention(row=0, convention=STANDARD))
    assert refused.table.errors, "a standard row has no beta"
    assert Quantity.BETA in columns_of(refused)


def test_a_long_table_is_shown_in_parts_each_with_the_selected_row() -> None:
    state = opened(", ".join(["{type: revolute, a: 0.1}"] * (ROWS_SHOWN + 3)))
    assert rows_shown(state) == range(ROWS_SHOWN)
    last = after(state, SelectRow(row=ROWS_SHOWN))
    assert rows_shown(last) == range(ROWS_SHOWN, ROWS_SHOWN + 3)
    assert styled(last, "background:#235394") == {(ROWS_SHOWN, "i")}
    assert identity_of(last) != identity_of(state)


def test_another_robot_gets_other_fields_and_an_edited_one_does_not() -> None:
    assert identity_of(after(STANFORD, EditCell(row=1, column="a", text="0.3"))) == identity_of(STANFORD)
    assert identity_of(open_state(load_robot("puma560"))) != identity_of(STANFORD)
