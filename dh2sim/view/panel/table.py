"""The Table tab: the table's cells, what explains the selected row, and the robot file's parameters."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

from dh2sim.robot.edit import PARAMETERS
from dh2sim.robot.row import Convention
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.view.events import (
    ConvertTable,
    EditCell,
    PlayRow,
    SeekRow,
    SelectRow,
    SetConvention,
    SetUnits,
    Show,
    Undo,
)
from dh2sim.view.frame_readout import relative_pose
from dh2sim.view.motion.row_animation import step_count, step_text
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Bound, Send, bind, on_click
from dh2sim.view.panel.cells import CellGrid, identity_of
from dh2sim.view.panel.pose import matrix_markup
from dh2sim.view.scene.annotations import Quantity, subscript, symbol
from dh2sim.view.state import CONVENTION, CellError, Part, TableState, ViewState

if TYPE_CHECKING:
    import viser

_PARAMETERS: Final = "parameters"
_TWO_COLUMNS: Final = {
    markup.holder(_PARAMETERS): "display:grid;grid-template-columns:1fr 1fr",
    f"{markup.holder(_PARAMETERS)}>div:has(>[data-dh2sim])": "display:none",
    f"{markup.holder(_PARAMETERS)}>div>div>div:has(label)": "width:auto!important;min-width:2.5em",
}
_PLAY: Final = "Play the row's steps"
_PRODUCTS: Final = {
    Convention.STANDARD: "standard: Rz(θ) Tz(d) Tx(a) Rx(α)",
    Convention.MODIFIED: "modified: Tx(a) Rx(α) Rz(θ) Tz(d), a and α of index i − 1",
    Convention.HAYATI: "hayati: Rz(θ) Tx(a) Rx(α) Ry(β)",
}


class TableTab:
    """The table; below it the selected row, the parameters, and what concerns all rows."""

    def __init__(self, client: viser.ClientHandle, tab: viser.GuiTabHandle, send: Send, state: ViewState) -> None:
        """Add the widgets to a tab, viser's current container."""
        self._gui = client.gui
        self._tab = tab
        self._send = send
        self._shown: object = None
        self._shown_slow: object = None
        self._cells = CellGrid(self._gui, send, state)
        self._notes = self._gui.add_html("")
        self._parameters = ParameterFields(self._gui, send, state)
        self._undo = self._gui.add_button("Undo", disabled=True, hint="Undoes the last edit of the table")
        on_click(self._undo, send, Undo)
        self._rows = _names(state)
        chooser = self._gui.add_dropdown("Row", self._rows, hint="The row that is explained in the scene")
        self._chooser = bind(chooser, send, self._selected)
        self._row = RowFields(self._gui, send, state, chooser.order)
        self._explain = bind(
            self._gui.add_checkbox("Explain in scene", Part.ANNOTATIONS in state.shown),
            send,
            lambda on: Show(part=Part.ANNOTATIONS, on=on),
        )
        self._matrix = self._gui.add_html("")
        with self._gui.add_folder("Whole table", expand_by_default=False):
            self._add_whole(state)

    def show(self, state: ViewState) -> None:
        """Show a state."""
        shown = (state.table, state.model, state.selected_row, state.shown, bool(state.undo_texts))
        if shown == self._shown:
            self._row.show(state)
            return
        self._shown = shown
        with self._tab:
            if identity_of(state) != self._cells.identity:
                self._cells.remove()
                self._cells = CellGrid(self._gui, self._send, state, self._cells.order)
            if not self._row.belongs_to(state):
                self._row.remove()
                self._row = RowFields(self._gui, self._send, state, self._chooser.handle.order)
            if not self._parameters.belongs_to(state):
                self._parameters.remove()
                self._parameters = ParameterFields(self._gui, self._send, state, self._parameters.order)
        self._cells.show(state)
        self._notes.content = notes(state.table)
        if _names(state) != self._rows:
            self._rows = self._chooser.handle.options = _names(state)
        self._chooser.show(self._rows[state.selected_row])
        self._row.show(state)
        self._parameters.show(state)
        if self._undo.disabled == bool(state.undo_texts):
            self._undo.disabled = not state.undo_texts
        self._explain.show(Part.ANNOTATIONS in state.shown)
        self._angle.show(state.table.units.angle.value)
        self._length.show(state.table.units.length.value)

    def show_slow(self, state: ViewState) -> None:
        """Show the matrix of the selected row at the joint coordinates."""
        shown = (state.model, state.q, state.selected_row)
        if shown != self._shown_slow:
            self._shown_slow = shown
            self._matrix.content = row_matrix(state)

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


class RowFields:
    """The convention and the animation of a row; another row gets fields of its own, as their label names it."""

    def __init__(self, gui: viser.GuiApi, send: Send, state: ViewState, order: float) -> None:
        """Add the widgets to viser's current container.

        Args:
            gui: The page's widgets.
            send: Queues events.
            state: Its selected row is the one.
            order: Of the widget that they are placed below.
        """
        row = state.selected_row
        self._identity = _row_identity(state)
        field = gui.add_dropdown(
            f"convention{subscript(row + 1)}",
            [convention.value for convention in Convention],
            initial_value=state.table.rows[row].convention.value,
            hint="Reads the same numbers in another way, which makes another robot",
            order=order + 0.2,  # viser's own orders are whole numbers
        )
        self._convention = bind(field, send, lambda name: SetConvention(row=row, convention=Convention(name)))
        count = step_count(state)
        self._playing = state.row_playing
        self._play = gui.add_button(
            _PLAY, hint="Moves a frame through the row's product, step by step", order=order + 0.4
        )
        on_click(self._play, send, lambda: PlayRow(on=not self._playing))
        steps = gui.add_slider("Steps", min=0.0, max=float(count), step=0.01, initial_value=count, order=order + 0.6)
        self._steps = bind(steps, send, lambda value: SeekRow(steps=value))
        self._text = gui.add_html("", order=order + 0.8)

    def belongs_to(self, state: ViewState) -> bool:
        """Return whether the fields are those of the selected row."""
        return self._identity == _row_identity(state)

    def show(self, state: ViewState) -> None:
        """Show a state with the same row selected."""
        self._convention.show(state.table.rows[state.selected_row].convention.value)
        if state.row_playing != self._playing:
            self._playing = state.row_playing
            self._play.label = "Pause" if self._playing else _PLAY
        done = float(step_count(state)) if state.row_progress is None else state.row_progress
        self._steps.show(round(done, 2))
        self._text.content = markup.note(markup.text(step_text(state)), name="step")

    def remove(self) -> None:
        """Remove the widgets from the page."""
        for widget in (self._convention.handle, self._play, self._steps.handle, self._text):
            widget.remove()


def _row_identity(state: ViewState) -> object:
    return state.spec.name, state.selected_row, step_count(state)


class ParameterFields:
    """A field for each parameter of the robot file; other parameters get fields of their own."""

    def __init__(self, gui: viser.GuiApi, send: Send, state: ViewState, order: float | None = None) -> None:
        """Add the widgets to viser's current container."""
        self._names = _parameters(state)
        self._folder = gui.add_folder("Parameters", order=order, visible=bool(state.table.parameters))
        with self._folder:
            gui.add_html(markup.style(_TWO_COLUMNS, name=_PARAMETERS))
            self._fields = {
                name: bind(gui.add_text(name, text), send, partial(_edit_parameter, name))
                for name, text in state.table.parameters.items()
            }

    @property
    def order(self) -> float:
        """Place in the container."""
        return float(self._folder.order)

    def belongs_to(self, state: ViewState) -> bool:
        """Return whether the fields are those of a state's parameters."""
        return self._names == _parameters(state)

    def show(self, state: ViewState) -> None:
        """Show a state with the same parameters."""
        for name, text in state.table.parameters.items():
            self._fields[name].show(text)

    def remove(self) -> None:
        """Remove the widgets from the page."""
        self._folder.remove()


def _parameters(state: ViewState) -> object:
    return state.spec.name, tuple(state.table.parameters)


def _edit_parameter(name: str, text: str) -> EditCell:
    return EditCell(row=PARAMETERS, column=name, text=text)


def row_matrix(state: ViewState) -> str:
    """Return the matrix A of the selected row at the joint coordinates, HTML."""
    row = state.selected_row
    T = relative_pose(state.model.chain, f"dh_{row}", f"dh_{row + 1}", state.q)
    title = f"A{subscript(row + 1)}: <b>dh_{row + 1}</b> in dh_{row}, lengths in m"
    return markup.note(title) + matrix_markup(T, name="row-matrix")


def notes(table: TableState) -> str:
    """Return the errors of cells and parameters, and how rows are read, HTML."""
    errors = "<br>".join(_error_text(error, table) for error in table.errors)
    used = {row.convention for row in table.rows}
    legend = "<br>".join(text for convention, text in _PRODUCTS.items() if convention in used)
    return markup.note(errors, error=True, name="cell-errors") + markup.note(legend, name="conventions")


def _error_text(error: CellError, table: TableState) -> str:
    if not isinstance(error.row, int):
        name = markup.text(error.column)
    elif error.column == CONVENTION:
        name = f"{CONVENTION}{subscript(error.row + 1)}"
    else:
        name = symbol(Quantity(error.column), table.rows[error.row].convention, error.row)
    return f"<b>{name}</b>: {markup.text(error.message)}"


def _whole(label: str, group: Any) -> SetConvention | ConvertTable:
    convention = Convention(group.value)
    return (
        SetConvention(row=None, convention=convention) if label == "Read as" else ConvertTable(convention=convention)
    )


def _names(state: ViewState) -> tuple[str, ...]:
    return tuple(f"{i}: {row.name}" for i, row in enumerate(state.table.rows, start=1))
