"""The DH table as a textbook prints it, in deg and m, with the joint variables starred: as text, HTML and LaTeX."""

from __future__ import annotations

import html
import math
from collections.abc import Callable
from dataclasses import dataclass

from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec

_TITLES = {Convention.STANDARD: "standard", Convention.MODIFIED: "modified", Convention.HAYATI: "Hayati"}
_HTML = {"alpha": "α", "beta": "β", "theta": "θ"}
_LEFT = "text-align:left"

Symbol = Callable[[str, str], str]
"""Writes a parameter with its index, given as ``theta`` and ``2``, or ``a`` and ``i-1``."""


def short(value: float) -> str:
    """Return a number for reading: six digits, no trailing zeros, no -0, no rounding noise of degrees."""
    return f"{round(value, 10) + 0.0:.6g}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """A parameter of one row: a number, or the joint variable with its offset."""

    value: float | None
    """deg or m; None where the row's convention has no such parameter."""
    variable: str = ""
    """``theta`` or ``d`` where the joint coordinate adds to the value, else empty."""
    index: int = 0
    """Of the row, counted from 1."""
    flip: bool = False
    """Whether the joint coordinate subtracts."""

    def text(self, symbol: Symbol, *, minus: str = "-") -> str:
        """Return ``-90``, or the starred variable with offset and direction: ``θ2*``, ``θ2* + 90``, ``90 - θ2*``."""
        if self.value is None:
            return ""
        if not self.variable:
            return short(self.value).replace("-", minus)
        variable = f"{symbol(self.variable, str(self.index))}*"
        if self.flip:
            return f"{short(self.value)} - {variable}".replace("-", minus) if self.value else f"{minus}{variable}"
        if not self.value:
            return variable
        return f"{variable} {'+' if self.value > 0 else minus} {short(abs(self.value))}"


@dataclass(frozen=True, slots=True, kw_only=True)
class TextbookTable:
    """A robot's DH table, ready to be written in any notation."""

    title: str
    """``DH table, standard convention``."""
    columns: tuple[tuple[str, str, str], ...]
    """Parameter, index and unit of every column of cells: ``("alpha", "i-1", "deg")``."""
    mixed: bool
    """Whether rows have different conventions."""
    rows: tuple[Row, ...]
    cells: tuple[tuple[Cell, ...], ...]
    """A tuple for every row, in the order of the columns."""


def textbook_table(spec: RobotSpec) -> TextbookTable:
    """Arrange the numbers of a robot's table as its convention writes them."""
    conventions = {row.convention for row in spec.rows}
    mixed = len(conventions) > 1
    link_index = "i-1" if conventions == {Convention.MODIFIED} else "i"
    columns = [("a", link_index, "m"), ("alpha", link_index, "deg"), ("d", "i", "m"), ("theta", "i", "deg")]
    if Convention.HAYATI in conventions:
        columns.insert(2, ("beta", "i", "deg"))
    return TextbookTable(
        title="DH table, " + ("mixed conventions" if mixed else f"{_TITLES[spec.rows[0].convention]} convention"),
        columns=tuple(columns),
        mixed=mixed,
        rows=spec.rows,
        cells=tuple(tuple(_cell(row, i, name) for name, _, _ in columns) for i, row in enumerate(spec.rows, start=1)),
    )


def limits_text(row: Row) -> str:
    """Return a row's position limits for reading, empty where the robot file gives none."""
    if row.limits.position is None:
        return ""
    unit, scale = ("°", 180 / math.pi) if row.type.turns else (" m", 1.0)
    lower, upper = row.limits.position
    return f"{short(lower * scale)} … {short(upper * scale)}{unit}"


def table_text(spec: RobotSpec) -> str:
    """Return the table as plain text."""
    table = textbook_table(spec)
    extra = ("convention",) if table.mixed else ()
    lines = [
        ["i", "joint", "type", *extra, *(f"{name}_{index}" for name, index, _ in table.columns), "limits"],
        ["", "", "", *("" for _ in extra), *(unit for *_, unit in table.columns), ""],
    ]
    for i, (row, cells) in enumerate(zip(table.rows, table.cells, strict=True), start=1):
        kind = (row.convention.value,) if table.mixed else ()
        parameters = (cell.text(plain_symbol) for cell in cells)
        lines.append([str(i), row.name, row.type.value, *kind, *parameters, limits_text(row)])
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    left = 3 + len(extra)
    return f"{spec.name}: {table.title}\n" + "\n".join(
        "  ".join(f"{text:{'<' if k < left else '>'}{widths[k]}}" for k, text in enumerate(line)).rstrip()
        for line in [lines[0], lines[1], ["─" * width for width in widths], *lines[2:]]
    )


def table_html(spec: RobotSpec) -> str:
    """Return the table as an HTML element, for a notebook; it takes its colours from the page."""
    table = textbook_table(spec)
    extra = ("convention",) if table.mixed else ()
    head = ["<th>i</th>", *(f'<th style="{_LEFT}">{title}</th>' for title in ("joint", "type", *extra))]
    head += [f"<th>{_html_symbol(name, index)}<br>{unit}</th>" for name, index, unit in table.columns]
    body = []
    for i, (row, cells) in enumerate(zip(table.rows, table.cells, strict=True), start=1):
        words = (row.name, row.type.value, *((row.convention.value,) if table.mixed else ()))
        body.append(
            f"<tr><td>{i}</td>"
            + "".join(f'<td style="{_LEFT}">{html.escape(word)}</td>' for word in words)
            + "".join(f"<td>{cell.text(_html_symbol, minus='−')}</td>" for cell in cells)
            + f"<td>{limits_text(row).replace('-', '−')}</td></tr>"
        )
    caption = f"<b>{html.escape(spec.name)}</b>: {table.title}"
    return (
        f'<table><caption style="{_LEFT}">{caption}</caption>\n'
        f"<thead><tr>{''.join(head)}<th>limits</th></tr></thead>\n"
        "<tbody>\n" + "\n".join(body) + "\n</tbody></table>"
    )


def table_latex(spec: RobotSpec) -> str:
    """Return the table as LaTeX mathematics, an array between dollar signs."""
    table = textbook_table(spec)
    units = {"deg": r"^\circ", "m": r"\mathrm{m}"}
    extra = (r"\text{convention}",) if table.mixed else ()
    head = " & ".join(["i", *extra, *(_latex_symbol(name, index) for name, index, _ in table.columns)])
    unit_line = " & ".join(["", *("" for _ in extra), *(f"[{units[unit]}]" for *_, unit in table.columns)])
    body = []
    for i, (row, cells) in enumerate(zip(table.rows, table.cells, strict=True), start=1):
        kind = (rf"\text{{{row.convention}}}",) if table.mixed else ()
        body.append(" & ".join([str(i), *kind, *(cell.text(_latex_symbol).replace("*", "^{*}") for cell in cells)]))
    lines = [f"{head} \\\\", f"{unit_line} \\\\ \\hline", *(f"{line} \\\\" for line in body)]
    columns = "c" * (len(extra) + len(table.columns))
    return "\n".join([f"$\\displaystyle \\begin{{array}}{{c|{columns}}}", *lines, "\\end{array}$"])


def _cell(row: Row, index: int, name: str) -> Cell:
    hayati = row.convention is Convention.HAYATI
    if (name == "beta" and not hayati) or (name == "d" and hayati and row.type is not JointType.PRISMATIC):
        return Cell(value=None)
    value = {"a": row.a, "alpha": row.alpha, "beta": row.beta, "d": row.d, "theta": row.theta}[name]
    moved = "theta" if row.type.turns else "d" if row.type.moves else ""
    return Cell(
        value=value if name in ("a", "d") else math.degrees(value),
        variable=name if name == moved else "",
        index=index,
        flip=row.flip,
    )


def plain_symbol(name: str, index: str) -> str:
    """Return a parameter and its index as plain text, as in ``θ2``."""
    return f"{_HTML.get(name, name)}{index}"


def _html_symbol(name: str, index: str) -> str:
    return f"<i>{_HTML.get(name, name)}</i><sub>{index.replace('-', '−')}</sub>"


def _latex_symbol(name: str, index: str) -> str:
    return f"{name if len(name) == 1 else chr(92) + name}_{{{index}}}"
