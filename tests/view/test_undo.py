"""Edits of the table are taken back, one after the other."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dh2sim.robot.row import Convention
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.view.events import ConvertTable, EditCell, OpenText, SelectRow, SetConvention, SetUnits, Undo
from dh2sim.view.reduce import MAX_UNDO, MAX_UNDO_LENGTH
from dh2sim.view.state import Mode
from tests.view.states import STANFORD, after


def cell(text: str, row: int = 0, column: str = "a") -> EditCell:
    return EditCell(row=row, column=column, text=text)


def test_edits_are_undone_one_by_one_to_the_letter() -> None:
    edits = (
        cell("0.1"),
        cell("0.2", row=1),
        SetConvention(row=None, convention=Convention.MODIFIED),
        SetUnits(angle=AngleUnit.RAD, length=LengthUnit.MM),
        ConvertTable(convention=Convention.STANDARD),
    )
    states = [STANFORD]
    for edit in edits:
        states.append(after(states[-1], edit))
    assert len({state.text for state in states}) == len(edits) + 1
    state = states[-1]
    for earlier in reversed(states[:-1]):
        state = after(state, Undo())
        assert state.text == earlier.text
        assert state.table == earlier.table
    assert state.undo_texts == ()


def test_what_is_typed_into_a_cell_letter_by_letter_is_one_edit() -> None:
    typed = after(STANFORD, *(cell(text) for text in ("0", "0.", "0.1", "0.12", "0.12 +", "0.12 + 1")))
    assert typed.spec.rows[0].a == 1.12
    assert typed.undo_texts == (STANFORD.text,)
    assert after(typed, Undo()).text == STANFORD.text
    other = after(typed, cell("0.3", row=2), cell("0.5"))
    assert len(other.undo_texts) == 3, "into another cell and back are further edits"


def test_an_invalid_value_is_no_edit_and_its_mark_goes_with_the_edit_before() -> None:
    wrong = after(STANFORD, cell("0.1"), cell("pi /", row=1, column="alpha"))
    assert wrong.table.errors
    assert wrong.undo_texts == (STANFORD.text,)
    back = after(wrong, Undo())
    assert (back.text, back.table.errors) == (STANFORD.text, ())


def test_what_is_typed_into_a_cell_after_something_wrong_is_an_edit_of_its_own() -> None:
    first = after(STANFORD, cell("0.1"))
    second = after(first, cell("90 +", row=1, column="alpha"), cell("45", row=1, column="alpha"))
    assert second.undo_texts == (STANFORD.text, first.text)
    assert after(second, Undo()).text == first.text


def test_joints_and_the_chosen_row_stay_where_they_are() -> None:
    state = after(STANFORD, cell("0.1", row=3), SelectRow(row=3))
    moved = replace(state, q=(0.1, *state.q[1:]))
    back = after(moved, Undo())
    assert (back.q, back.selected_row) == (moved.q, 3)


def test_without_an_edit_there_is_nothing_to_undo() -> None:
    assert after(STANFORD, Undo()) == replace(STANFORD, notice="Nothing to undo.")


@pytest.mark.parametrize("mode", [Mode.PHYSICS, Mode.REPLAY])
def test_nothing_can_be_undone_while_something_moves_the_joints(mode: Mode) -> None:
    edited = after(STANFORD, cell("0.1"))
    state = after(replace(edited, mode=mode), Undo())
    assert (state.text, state.undo_texts) == (edited.text, edited.undo_texts)
    assert state.notice == "The table can be edited in manual mode only."


def test_another_file_cannot_be_undone() -> None:
    edited = after(STANFORD, cell("0.1"))
    opened = after(edited, OpenText(text=b"name: x\nconvention: standard\njoints:\n  - {type: revolute}\n", file="x"))
    assert opened.spec.name == "x", opened.notice
    assert opened.undo_texts == ()


@pytest.mark.slow
def test_what_is_kept_is_bounded() -> None:
    state = STANFORD
    for k in range(MAX_UNDO + 5):
        state = after(state, cell(f"0.{k + 1}", row=k % 2))
    assert len(state.undo_texts) == MAX_UNDO
    letters = "#" * (MAX_UNDO_LENGTH // 2)
    long = after(replace(STANFORD, undo_texts=(letters, letters)), cell("0.1"))
    assert long.undo_texts == (letters, STANFORD.text)
