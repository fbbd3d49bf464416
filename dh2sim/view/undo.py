"""Edits of the table can be taken back, one after the other."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from dh2sim.view.events import EditCell, Event, OpenText, Undo
from dh2sim.view.state import ViewState
from dh2sim.view.table_edits import replaced

MOST: Final = 100
"""Edits that can be taken back."""
MOST_LETTERS: Final = 4_000_000
"""Of all the robot files that are kept for that."""


def remembered(before: ViewState, event: Event, after: ViewState) -> ViewState:
    """Return the state ``after`` an event, from which one can return to the robot file of ``before``.

    What is typed into one cell, letter by letter, is one edit. Another file begins anew.
    """
    if isinstance(event, Undo | OpenText) or after.text == before.text:
        return after
    cell = (event.row, event.column) if isinstance(event, EditCell) else None
    if cell is not None and cell == before.typed:
        return after
    return replace(after, earlier=_bounded((*before.earlier, before.text)), typed=cell)


def undone(state: ViewState) -> ViewState:
    """Return the state with the robot file of before the last edit, if there is one."""
    if not state.earlier:
        return replace(state, notice="There is no edit to take back.")
    after = replaced(state, state.earlier[-1])
    return after if after.text == state.text else replace(after, earlier=state.earlier[:-1], typed=None)


def _bounded(texts: tuple[str, ...]) -> tuple[str, ...]:
    """Return the last of the texts, as many as are kept."""
    kept = texts[-MOST:]
    while len(kept) > 1 and sum(map(len, kept)) > MOST_LETTERS:
        kept = kept[1:]
    return kept
