"""The cells of one row of the table, to be typed into."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

from dh2sim.robot.spec import Convention
from dh2sim.view.events import EditCell, SetConvention
from dh2sim.view.notation import Quantity, subscript, symbol
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Bound, Send, bind
from dh2sim.view.state import CONVENTION, Complaint, ViewState

if TYPE_CHECKING:
    import viser

_STEP: Final = 0.01
"""Between the places of widgets: they stand between two that were placed by viser, whose places are whole numbers."""


class RowEditor:
    """Fields of one row, named as it is; another row is given fields of its own.

    What is typed goes to the row whose name stands beside the field, also where another row was chosen a moment ago
    and the page has not followed yet.
    """

    def __init__(self, gui: viser.GuiApi, send: Send, state: ViewState, row: int, place: float) -> None:
        """Add the widgets to viser's current container.

        Args:
            gui: The page's widgets.
            send: Where events go.
            state: That has the row.
            row: From 0.
            place: Of the widget that they stand below.
        """
        self._row = row
        shown = state.draft.rows[row]
        self._convention_shown = shown.convention
        self._cells: dict[Quantity, Bound[str]] = {}
        for k, quantity in enumerate(Quantity, start=1):
            widget = gui.add_text(
                symbol(quantity, shown.convention, row),
                shown.cells[k - 1],
                hint="A number, or an expression such as pi/2 or d1 + 0.1",
                order=place + k * _STEP,
            )
            self._cells[quantity] = bind(widget, send, partial(self._edit, quantity.value))
        end = place + len(Quantity) * _STEP
        self._convention = bind(
            gui.add_dropdown(
                f"convention{subscript(row + 1)}",
                [convention.value for convention in Convention],
                initial_value=shown.convention.value,
                hint="Reads the same numbers another way: the robot becomes another one",
                order=end + _STEP,
            ),
            send,
            lambda name: SetConvention(row=row, convention=Convention(name)),
        )
        self._complaint = gui.add_html("", order=end + 2 * _STEP)

    def show(self, state: ViewState) -> None:
        """Show a state, which has the row."""
        row = state.draft.rows[self._row]
        for (quantity, cell), text in zip(self._cells.items(), row.cells, strict=True):
            cell.show(text)
            marked = state.draft.complaint(self._row, quantity.value) is not None
            cell.handle.visible = marked or quantity is not Quantity.BETA or row.convention is Convention.HAYATI
            if row.convention is not self._convention_shown:
                cell.handle.label = symbol(quantity, row.convention, self._row)
        self._convention_shown = row.convention
        self._convention.show(row.convention.value)
        ours = [found for found in state.draft.complaints if found.row == self._row]
        told = "<br>".join(_told(found, row.convention) for found in ours)
        self._complaint.content = markup.note(told, wrong=True, name="complaint")

    def remove(self) -> None:
        """Take the widgets off the page."""
        for widget in (*(cell.handle for cell in self._cells.values()), self._convention.handle, self._complaint):
            widget.remove()

    def _edit(self, column: str, text: str) -> EditCell:
        return EditCell(row=self._row, column=column, text=text)


def _told(found: Complaint, convention: Convention) -> str:
    if found.column == CONVENTION:
        return f"<b>convention</b>: {markup.text(found.message)}"
    return f"<b>{symbol(Quantity(found.column), convention, found.row)}</b>: {markup.text(found.message)}"
