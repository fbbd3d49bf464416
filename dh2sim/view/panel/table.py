"""The Table tab: an overview of the table as printed in textbooks, and an editor of one row."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

from dh2sim.robot.spec import AngleUnit, Convention, LengthUnit
from dh2sim.view.events import ConvertTable, EditCell, SelectRow, SetConvention, SetUnits, Show, Undo
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Bound, Send, bind, on_click
from dh2sim.view.scene.annotations import Quantity, subscript, symbol
from dh2sim.view.state import CONVENTION, CellError, Part, TableState, ViewState

if TYPE_CHECKING:
    import viser

_ERROR = "background:#fde2df;color:#b42318;border-radius:3px;padding:0 0.2em"
_SELECTED = "font-weight:700"


def overview(state: ViewState) -> str:
    """Return the table as HTML; cells with errors are marked, with the message as tooltip."""
    table = state.table
    hayati = any(row.convention is Convention.HAYATI for row in table.rows)
    angle = "°" if table.units.angle is AngleUnit.DEG else "rad"
    length = table.units.length.value
    head = ["i", "joint", f"a<br>{length}", f"α<br>{angle}", f"d<br>{length}", f"θ<br>{angle}"]
    head += [f"β<br>{angle}"] if hayati else []
    rows = [_row(state, i, hayati=hayati) for i in range(len(table.rows))]
    return markup.table(rows, head=[*head, "convention"], name="table") + markup.note(_legend(table))


def _row(state: ViewState, i: int, *, hayati: bool) -> list[str]:
    row = state.table.rows[i]
    number = f"<span style='{_SELECTED}'>{i + 1}</span>" if i == state.selected_row else str(i + 1)
    columns = ("a", "alpha", "d", "theta", *(("beta",) if hayati else ()))
    cells = [_cell(state, i, column, text) for column, text in zip(columns, row.cells, strict=False)]
    flips = [spec.flip for spec in state.spec.rows]
    variable = _variable(i, flip=flips[i])
    if row.type.moves:
        moved = 3 if row.type.turns else 2
        marked = state.table.error(i, columns[moved]) is not None
        cells[moved] = f"{variable} + {cells[moved]}" if marked else variable + _offset(row.cells[moved])
    return [number, markup.text(row.name), *cells, row.convention.value]


def _cell(state: ViewState, row: int, column: str, text: str) -> str:
    found: CellError | None = state.table.error(row, column)
    if found is None:
        return markup.text(text)
    return f'<span title="{markup.text(found.message)}" style="{_ERROR}">{markup.text(text) or "?"}</span>'


def _variable(i: int, *, flip: bool) -> str:
    return f"{'−' if flip else ''}q<sub>{i + 1}</sub>"


def _offset(text: str) -> str:
    """Return the offset after a joint's variable; empty if it is zero."""
    number = text.strip().removeprefix("+").strip()
    if not number or _is_zero(number):
        return ""
    sign, rest = ("−", number[1:].strip()) if number.startswith("-") else ("+", number)
    return f" {sign} {markup.text(rest)}"


def _is_zero(text: str) -> bool:
    try:
        return float(text) == 0.0
    except ValueError:  # an expression
        return False


def _legend(table: TableState) -> str:
    used = {row.convention for row in table.rows}
    products = {
        Convention.STANDARD: "standard: Rz(θ) Tz(d) Tx(a) Rx(α)",
        Convention.MODIFIED: "modified: Tx(a) Rx(α) Rz(θ) Tz(d), a and α of index i − 1",
        Convention.HAYATI: "hayati: Rz(θ) Tx(a) Rx(α) Ry(β)",
    }
    return "<br>".join(text for convention, text in products.items() if convention in used)


_STEP: Final = 0.01
"""Between the orders of widgets, which are placed between two of viser's, whose orders are whole numbers."""


class RowEditor:
    """Fields of one row, labelled with its indices; another row gets fields of its own.

    So typing always goes to the row that the label names, even if another row was selected a moment before.
    """

    def __init__(self, gui: viser.GuiApi, send: Send, state: ViewState, row: int, place: float) -> None:
        """Add the widgets to viser's current container.

        Args:
            gui: The page's widgets.
            send: Queues events.
            state: A state that has the row.
            row: From 0.
            place: Order of the widget that they are placed below.
        """
        self._row = row
        shown = state.table.rows[row]
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
                hint="Reads the same numbers in another way, which makes another robot",
                order=end + _STEP,
            ),
            send,
            lambda name: SetConvention(row=row, convention=Convention(name)),
        )
        self._errors = gui.add_html("", order=end + 2 * _STEP)

    def show(self, state: ViewState) -> None:
        """Show a state that has the row."""
        row = state.table.rows[self._row]
        for (quantity, cell), text in zip(self._cells.items(), row.cells, strict=True):
            cell.show(text)
            marked = state.table.error(self._row, quantity.value) is not None
            cell.handle.visible = marked or quantity is not Quantity.BETA or row.convention is Convention.HAYATI
            if row.convention is not self._convention_shown:
                cell.handle.label = symbol(quantity, row.convention, self._row)
        self._convention_shown = row.convention
        self._convention.show(row.convention.value)
        errors = [error for error in state.table.errors if error.row == self._row]
        text = "<br>".join(_error_text(error, row.convention) for error in errors)
        self._errors.content = markup.note(text, error=True, name="cell-errors")

    def remove(self) -> None:
        """Remove the widgets from the page."""
        for widget in (*(cell.handle for cell in self._cells.values()), self._convention.handle, self._errors):
            widget.remove()

    def _edit(self, column: str, text: str) -> EditCell:
        return EditCell(row=self._row, column=column, text=text)


def _error_text(error: CellError, convention: Convention) -> str:
    if error.column == CONVENTION:
        return f"<b>convention</b>: {markup.text(error.message)}"
    return f"<b>{symbol(Quantity(error.column), convention, error.row)}</b>: {markup.text(error.message)}"


class TableTab:
    """An overview, and an editor of the selected row."""

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
        self._undo = self._gui.add_button("Undo", disabled=True, hint="Undoes the last edit of the table")
        on_click(self._undo, send, Undo)
        self._explain = bind(
            self._gui.add_checkbox("Explain in scene", Part.ANNOTATIONS in state.shown),
            send,
            lambda on: Show(part=Part.ANNOTATIONS, on=on),
        )
        with self._gui.add_folder("Whole table", expand_by_default=False):
            self._add_whole(state)

    def show(self, state: ViewState) -> None:
        """Show a state, unless only the joints have moved."""
        shown = (state.table, state.model, state.selected_row, state.shown, bool(state.undo_texts))
        if shown == self._shown:
            return
        self._shown = shown
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
        if self._undo.disabled == bool(state.undo_texts):
            self._undo.disabled = not state.undo_texts
        self._explain.show(Part.ANNOTATIONS in state.shown)
        self._angle.show(state.table.units.angle.value)
        self._length.show(state.table.units.length.value)

    def _editor_of_row(self, state: ViewState) -> RowEditor:
        return RowEditor(self._gui, self._send, state, state.selected_row, self._chooser.handle.order)

    def _selected(self, label: str) -> SelectRow:
        """Return the event of a choice; one of a robot no longer shown selects no row."""
        return SelectRow(row=self._rows.index(label) if label in self._rows else -1)

    def _add_whole(self, state: ViewState) -> None:
        """Add the widgets for all rows."""
        units = state.table.units
        self._angle = self._unit("Angles in", list(AngleUnit), units.angle)
        self._length = self._unit("Lengths in", list(LengthUnit), units.length)
        hints = {
            "Read as": "The same numbers in all rows, another robot",
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
    return tuple(f"{i}: {row.name}" for i, row in enumerate(state.table.rows, start=1))


def _identity(state: ViewState) -> object:
    """Return what the fields belong to: the robot, its rows, and the selected one."""
    return state.spec.name, _names(state), state.selected_row
