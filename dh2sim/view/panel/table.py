"""The table: all of it to be read, one row at a time to be edited, and files to take home."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from dh2sim.robot.spec import Convention
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.view.events import ConvertTable, EditCell, SelectRow, SetConvention, SetUnits, Show, Undo
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Bound, Send, bind, on_click
from dh2sim.view.panel.table_text import overview
from dh2sim.view.state import COLUMNS, CONVENTION, Complaint, Part, ViewState

if TYPE_CHECKING:
    import viser

LETTERS = {"a": "a", "alpha": "α", "d": "d", "theta": "θ", "beta": "β", CONVENTION: "convention"}


class TableTab:
    """An overview, and an editor of the row that is chosen."""

    def __init__(self, client: viser.ClientHandle, send: Send, state: ViewState) -> None:
        """Add the widgets to viser's current container."""
        self._gui = client.gui
        self._send = send
        self._shown: object = None
        self._row = 0
        """Of the editor; of which its widgets' events are."""
        self._overview = self._gui.add_html("")
        self._rows = _names(state)
        chooser = self._gui.add_dropdown("Edit row", self._rows)
        self._chooser = bind(chooser, send, lambda label: SelectRow(row=self._rows.index(label)))
        self._cells = {column: self._cell(column) for column in COLUMNS}
        self._convention = self._convention_of_row()
        self._complaint = self._gui.add_html("")
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
        self._row = state.selected_row
        row = state.draft.rows[self._row]
        for (column, cell), text in zip(self._cells.items(), row.cells, strict=True):
            cell.show(text)
            marked = state.draft.complaint(self._row, column) is not None
            cell.handle.visible = marked or _is_used(column, row.convention)
        self._convention.show(row.convention.value)
        self._complaint.content = markup.note(_complaints(state, self._row), wrong=True, name="complaint")
        if self._undo.disabled == bool(state.earlier):
            self._undo.disabled = not state.earlier
        self._explain.show(Part.ANNOTATIONS in state.shown)
        self._angle.show(state.draft.units.angle.value)
        self._length.show(state.draft.units.length.value)

    def _cell(self, column: str) -> Bound[str]:
        widget = self._gui.add_text(LETTERS[column], "", hint="A number, or an expression such as pi/2 or d1 + 0.1")
        return bind(widget, self._send, lambda text: EditCell(row=self._row, column=column, text=text))

    def _convention_of_row(self) -> Bound[str]:
        names = [convention.value for convention in Convention]
        hint = "Reads the same numbers another way: the robot becomes another one"
        widget = self._gui.add_dropdown("convention", names, hint=hint)
        return bind(widget, self._send, lambda name: SetConvention(row=self._row, convention=Convention(name)))

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


def _is_used(column: str, convention: Convention) -> bool:
    return column != "beta" or convention is Convention.HAYATI


def _complaints(state: ViewState, row: int) -> str:
    ours = [found for found in state.draft.complaints if found.row == row]
    return "<br>".join(_complaint(found) for found in ours)


def _complaint(found: Complaint) -> str:
    return f"<b>{LETTERS[found.column]}</b>: {markup.text(found.message)}"
