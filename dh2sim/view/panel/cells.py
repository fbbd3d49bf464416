"""The table's cells as a grid of fields, each edited where it is shown.

viser has fields, but no grid. So the fields are in a folder of their own, whose children a style sheet arranges in
rows and columns. A browser that cannot do that shows the same fields one below the other, each with its label.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

from dh2sim.robot.row import Convention
from dh2sim.robot.units import AngleUnit
from dh2sim.view.events import EditCell, SelectRow
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Bound, Send, bind, on_click
from dh2sim.view.scene.annotations import LETTERS, Quantity, is_indexed_before, subscript, symbol
from dh2sim.view.state import TableRow, ViewState

if TYPE_CHECKING:
    import viser

ROWS_SHOWN: Final = 12
"""At a time; longer tables are shown in parts."""
_NAME: Final = "cells"
_GRID: Final = markup.holder(_NAME)
_HIDDEN: Final = (
    "position:absolute!important;width:1px!important;height:1px;padding:0!important;overflow:hidden;"
    "clip-path:inset(50%)"
)
_MONO: Final = "font-family:ui-monospace,Menlo,Consolas,monospace"
_SIDES: Final = "padding:0 0.4em"
_BUTTON: Final = "height:1.625rem!important;padding:0;background:none;color:inherit;border:1px solid #d5dae1"
_SELECTED: Final = "background:#235394;color:#fff;border-color:#235394"
_ERROR: Final = "background:#fde2df!important;color:#b42318!important;border-color:#b42318!important"
_VARIABLE: Final = f"{_MONO};font-size:0.72em;white-space:nowrap;padding-right:0.2em"


class CellGrid:
    """The fields of up to ``ROWS_SHOWN`` rows; other rows, and another robot, get a grid of their own.

    So typing always goes to the cell that the label names.
    """

    def __init__(self, gui: viser.GuiApi, send: Send, state: ViewState, order: float | None = None) -> None:
        """Add the widgets to viser's current container.

        Args:
            gui: The page's widgets.
            send: Queues events.
            state: A state with the rows.
            order: Of the grid in the container.
        """
        self.identity = identity_of(state)
        self._folder = gui.add_folder("Table", order=order)
        self._cells: dict[tuple[int, Quantity], Bound[str]] = {}
        self._conventions: dict[int, Convention] = {}
        with self._folder:
            self._style = gui.add_html(style_of(state))
            self._heads = [gui.add_html(head) for head in heads_of(state)]
            for row in rows_shown(state):
                on_click(gui.add_button(str(row + 1)), send, partial(SelectRow, row=row))
                self._add_row(gui, send, state.table.rows[row], row, columns_of(state))

    @property
    def order(self) -> float:
        """Place in the container."""
        return float(self._folder.order)

    def show(self, state: ViewState) -> None:
        """Show a state with the same identity."""
        self._style.content = style_of(state)
        for head, content in zip(self._heads, heads_of(state), strict=True):
            head.content = content
        for (row, quantity), cell in self._cells.items():
            shown = state.table.rows[row]
            cell.show(_text(shown, quantity))
            if shown.convention is not self._conventions[row]:
                cell.handle.label = symbol(quantity, shown.convention, row)
        self._conventions = {row: state.table.rows[row].convention for row in self._conventions}

    def remove(self) -> None:
        """Remove the widgets from the page."""
        self._folder.remove()

    def _add_row(
        self, gui: viser.GuiApi, send: Send, shown: TableRow, row: int, columns: tuple[Quantity, ...]
    ) -> None:
        self._conventions[row] = shown.convention
        for quantity in columns:
            widget = gui.add_text(symbol(quantity, shown.convention, row), _text(shown, quantity))
            self._cells[row, quantity] = bind(widget, send, partial(_edit, row, quantity))


def _edit(row: int, quantity: Quantity, text: str) -> EditCell:
    return EditCell(row=row, column=quantity.value, text=text)


def _text(row: TableRow, quantity: Quantity) -> str:
    return row.cells[tuple(Quantity).index(quantity)]


def identity_of(state: ViewState) -> object:
    """Return what the fields of a grid belong to: the robot, the rows that are shown, and the columns."""
    return state.spec.name, tuple(row.name for row in state.table.rows), rows_shown(state), columns_of(state)


def rows_shown(state: ViewState) -> range:
    """Return the rows that are shown: the part of the table that holds the selected one."""
    first = state.selected_row // ROWS_SHOWN * ROWS_SHOWN
    return range(first, min(first + ROWS_SHOWN, len(state.table.rows)))


def columns_of(state: ViewState) -> tuple[Quantity, ...]:
    """Return the columns of a table; beta is one of Hayati rows, and of rows in which it is an error."""
    table = state.table
    hayati = any(row.convention is Convention.HAYATI for row in table.rows)
    wrong = any(error.column == Quantity.BETA for error in table.errors)
    return tuple(quantity for quantity in Quantity if quantity is not Quantity.BETA or hayati or wrong)


def heads_of(state: ViewState) -> list[str]:
    """Return the heads of the columns, HTML: letter, index and unit."""
    units, conventions = state.table.units, {row.convention for row in state.table.rows}
    angle = "°" if units.angle is AngleUnit.DEG else "rad"
    heads = ["i"]
    for quantity in columns_of(state):
        indices = {"ᵢ₋₁" if is_indexed_before(quantity, convention) else "ᵢ" for convention in conventions}
        letter = f"{LETTERS.get(quantity, quantity.value)}{indices.pop() if len(indices) == 1 else ''}"
        unit = angle if quantity.turns else units.length.value
        heads.append(f"{letter} <span style='opacity:0.65'>[{unit}]</span>")
    style = "text-align:center;font-size:0.82em;line-height:1.5"
    return [f'<div style="{style}">{head}</div>' for head in heads]


def style_of(state: ViewState) -> str:
    """Return the style sheet of the grid, HTML.

    It arranges the fields, hides their labels, which screen readers read, puts each joint variable before its offset,
    and marks the selected row and cells with errors.
    """
    columns = columns_of(state)
    rules = {
        _GRID: f"display:grid;grid-template-columns:1.9em repeat({len(columns)},minmax(0,1fr));gap:3px;{_SIDES}",
        f"{_GRID}>div": "padding:0!important;margin:0!important",
        f'{_GRID}>div:has(>[data-dh2sim="{_NAME}"])': "display:none",
        f"{_GRID}>div>div>div:has(label)": _HIDDEN,
        f"{_GRID}>div>div>div:last-child": "min-width:0",
        f"{_GRID} input": f"{_MONO};font-size:0.78em;padding:0 0.35em!important",
        f"{_GRID} button": _BUTTON,
    }
    for place, row in enumerate(rows_shown(state)):
        first = 1 + (1 + len(columns)) * (place + 1)  # after the style sheet and the heads
        if row == state.selected_row:
            rules[f"{_GRID}>:nth-child({first + 1}) button"] = _SELECTED
        for k, quantity in enumerate(columns, start=2):
            cell = f"{_GRID}>:nth-child({first + k})"
            if variable := variable_of(state, row, quantity):
                rules[f"{cell}>div::before"] = f'content:"{variable}+";{_VARIABLE}'
            if state.table.error(row, quantity.value):
                rules[f"{cell} input"] = _ERROR
    return markup.style(rules, name=_NAME)


def variable_of(state: ViewState, row: int, quantity: Quantity) -> str:
    """Return the joint variable that is added to a cell, such as ``q₂``; empty where none is."""
    kind = state.table.rows[row].type
    moved = Quantity.THETA if kind.turns else Quantity.D
    if not kind.moves or quantity is not moved:
        return ""
    return f"{'−' if state.spec.rows[row].flip else ''}q{subscript(row + 1)}"
