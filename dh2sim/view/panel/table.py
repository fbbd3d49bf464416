"""The table: all of it to be read, one row at a time to be edited, and files to take home."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from dh2sim.robot.spec import Convention
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.view.events import ConvertTable, SelectRow, SetConvention, SetUnits, Show, Undo
from dh2sim.view.panel.bound import Bound, Send, bind, on_click
from dh2sim.view.panel.row_editor import RowEditor
from dh2sim.view.panel.table_text import overview
from dh2sim.view.state import Part, ViewState

if TYPE_CHECKING:
    import viser


class TableTab:
    """An overview, and an editor of the row that is chosen."""

    def __init__(self, client: viser.ClientHandle, tab: viser.GuiTabHandle, send: Send, state: ViewState) -> None:
        """Add the widgets to a tab, viser's current container."""
        self._gui = client.gui
        self._tab = tab
        self._send = send
        self._shown: object = None
        self._overview = self._gui.add_html("")
        self._rows = _names(state)
        chooser = self._gui.add_dropdown("Edit row", self._rows)
        self._chooser = bind(chooser, send, self._selected)
        self._edited = _identity(state)
        self._editor = self._editor_of_row(state)
        self._undo = self._gui.add_button("Undo", disabled=True, hint="Takes the last edit of the table back")
        on_click(self._undo, send, Undo)
        self._explain = bind(
            self._gui.add_checkbox("Explain in scene", Part.ANNOTATIONS in state.shown),
            send,
            lambda on: Show(part=Part.ANNOTATIONS, on=on),
        )
        with self._gui.add_folder("Whole table", expand_by_default=False):
            self._add_whole(state)

    def show(self, state: ViewState) -> None:
        """Show a state; that is nothing new where only the joints have moved."""
        seen = (state.draft, state.model, state.selected_row, state.shown, bool(state.earlier))
        if seen == self._shown:
            return
        self._shown = seen
        self._overview.content = overview(state)
        if _names(state) != self._rows:
            self._rows = self._chooser.handle.options = _names(state)
        self._chooser.show(self._rows[state.selected_row])
        if _identity(state) != self._edited:
            self._edited = _identity(state)
            self._editor.remove()
            with self._tab:
                self._editor = self._editor_of_row(state)
        self._editor.show(state)
        if self._undo.disabled == bool(state.earlier):
            self._undo.disabled = not state.earlier
        self._explain.show(Part.ANNOTATIONS in state.shown)
        self._angle.show(state.draft.units.angle.value)
        self._length.show(state.draft.units.length.value)

    def _editor_of_row(self, state: ViewState) -> RowEditor:
        return RowEditor(self._gui, self._send, state, state.selected_row, self._chooser.handle.order)

    def _selected(self, label: str) -> SelectRow:
        """Return what a choice stands for; one of a robot that is gone meanwhile, for a row that there is not."""
        return SelectRow(row=self._rows.index(label) if label in self._rows else -1)

    def _add_whole(self, state: ViewState) -> None:
        """Add what concerns all rows."""
        units = state.draft.units
        self._angle = self._unit("Angles in", list(AngleUnit), units.angle)
        self._length = self._unit("Lengths in", list(LengthUnit), units.length)
        hints = {
            "Read as": "All rows, the same numbers: another robot",
            "Convert to": "The same robot, other numbers",
        }
        whole = [Convention.STANDARD, Convention.MODIFIED]
        for label, hint in hints.items():
            group = self._gui.add_button_group(label, [convention.value for convention in whole], hint=hint)
            on_click(group, self._send, partial(_whole, label, group))

    def _unit(self, label: str, units: list[Any], unit: Any) -> Bound[str]:
        widget = self._gui.add_dropdown(label, [known.value for known in units], initial_value=unit.value)
        return bind(widget, self._send, lambda _name: self._units_event())

    def _units_event(self) -> SetUnits:
        return SetUnits(angle=AngleUnit(self._angle.handle.value), length=LengthUnit(self._length.handle.value))


def _whole(label: str, group: Any) -> SetConvention | ConvertTable:
    convention = Convention(group.value)
    return (
        SetConvention(row=None, convention=convention) if label == "Read as" else ConvertTable(convention=convention)
    )


def _names(state: ViewState) -> tuple[str, ...]:
    return tuple(f"{i}: {row.name}" for i, row in enumerate(state.draft.rows, start=1))


def _identity(state: ViewState) -> object:
    """Return what makes fields those of a row: the robot, its rows, and which is chosen."""
    return state.spec.name, _names(state), state.selected_row
