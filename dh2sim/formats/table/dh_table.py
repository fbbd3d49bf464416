"""A table of Denavit-Hartenberg parameters, wherever in a text it was found, and the tables of a text."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from dh2sim.formats.table.grid import DELIMITER, MAX_COLUMNS, MAX_ROWS, Cells, Grid
from dh2sim.formats.table.headers import UNIT, are_headings, read_heading, variable_in
from dh2sim.formats.table.notation import plain
from dh2sim.messages import shown
from dh2sim.robot.row import Convention

_UNIT_CELL: Final = re.compile(rf"[\[({{<]?\s*(?:in\s+)?({UNIT})\.?\s*[\])}}>]?", re.IGNORECASE)
_NO_UNIT: Final = re.compile(r"[\[({<]?\s*(?:[-–—/1]|units?)?\s*[\])}>]?", re.IGNORECASE)
_NUMERIC: Final = re.compile(rf"[-+(]*(?:[\d.,]|pi\b)[-+*/().,\deEpi\s]*(?:{UNIT})?\.?")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Given:
    """What is known of a table besides its cells, where a script makes it."""

    by: str
    """What gives it, for messages, such as ``SerialLink``."""
    convention: Convention | None = None
    description: str = ""
    base: Sequence[Sequence[float]] | None = None
    """Pose of DH frame 0 in base_link, 4 x 4, in the table's unit of length."""
    tool: Sequence[Sequence[float]] | None = None
    """Pose of tool0 in DH frame n, 4 x 4, in the table's unit of length."""
    configurations: Mapping[str, Sequence[float]] = field(default_factory=dict)
    """Joint vectors, in rad and the table's unit of length."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Table:
    """A table of DH parameters."""

    header: Cells
    rows: tuple[Cells, ...] = field(repr=False)
    grid: Grid = field(repr=False)
    notes: tuple[str, ...] = ()
    """What was done to its rows, one sentence each."""
    problems: tuple[tuple[int, int, str], ...] = ()
    """Line, column and what is wrong with what it was made of."""
    extent: range | None = None
    """Numbers of its lines, where these are not those from its headings to its last row."""
    given: Given | None = field(default=None, repr=False)

    @property
    def lines(self) -> range:
        """Numbers of its lines, from that of its headings to that of its last row."""
        if self.extent is not None:
            return self.extent
        return range(self.header[0].line, self.grid.lines.stop)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Located:
    """The tables of a text."""

    tables: tuple[Table, ...] = field(repr=False)
    """Those of DH parameters, in the order of the text; those in comments last. Failing that, the most alike."""
    pipes: tuple[Grid, ...] = field(repr=False)
    """All tables between pipes."""
    problems: tuple[tuple[int, int, str], ...] = ()
    """Line, column and what is wrong with scripts of which no table could be made."""

    def around(self, table: Table) -> range:
        """Return the numbers of the lines that may belong to a table: up to its neighbours."""
        others = [other.lines for other in self.tables if other is not table]
        start = max((lines.stop for lines in others if lines.stop <= table.lines.start), default=1)
        stop = min((lines.start for lines in others if lines.start >= table.lines.stop), default=0)
        return range(start, stop or 1_000_001)


def make_table(header: Cells, rows: Sequence[Cells], grid: Grid) -> Table:
    """Return the table of some rows of a grid.

    Units in a row of their own, and a second row of headings, go to the headings. In Markdown, a row that is shorter
    than the headings is filled up with empty cells, and what is behind the last column is cut off.
    """
    rows = list(rows)
    delimited = bool(rows) and all(DELIMITER.fullmatch(cell.text) for cell in rows[0])
    rows = rows[1:] if delimited else rows
    for _ in range(2):
        if rows and len(rows[0]) == len(header) and (merged := _merged(header, rows[0])):
            header, rows = merged, rows[1:]
    notes: list[str] = []
    if grid.separator in "&<" and len(header) > 2:
        notes += [
            f"line {row[0].line} is one cell across all columns, and was not read: {shown(plain(row[0].text))}"
            for row in rows
            if len(row) == 1
        ]
        rows = [row for row in rows if len(row) > 1]
    if delimited or grid.filled:
        rows = [_fitted(row, len(header), number, notes) for number, row in enumerate(rows, start=1)]
    return Table(header=header, rows=tuple(rows), grid=grid, notes=tuple(notes))


def transposed(grid: Grid) -> Table | None:
    """Return the table of a grid whose rows are the parameters and whose columns the joints; None for another."""
    rows = [row for row in grid.rows if not all(DELIMITER.fullmatch(cell.text) for cell in row)]
    width = max((len(row) for row in rows), default=0)
    rows = [row for row in rows if len(row) > 1][:MAX_COLUMNS]
    first = tuple(row[0] for row in rows)
    if width < 2 or width > MAX_ROWS + 1 or not are_headings(first):
        return None
    even = [row if len(row) == width else (*row, *[replace(row[-1], text="")] * (width - len(row))) for row in rows]
    columns = tuple(zip(*even, strict=True))
    table = make_table(columns[0], columns[1:], replace(grid, filled=False))
    note = "every row was read as a parameter, and every column as a joint"
    short = next((row[0] for row in rows if len(row) < width), None)
    lacking = (
        () if short is None else (f"{shown(short.text)} has fewer values than others: the rest was read as empty",)
    )
    return replace(table, extent=grid.lines, notes=(*table.notes, note, *lacking))


def _merged(header: Cells, row: Cells) -> Cells | None:
    """Return headings with what a second row says of them; None where the row is one of the table's own."""
    texts = [plain(cell.text) for cell in row]
    units = [found[1] if (found := _UNIT_CELL.fullmatch(text)) else None for text in texts]
    if sum(unit is not None for unit in units) > 1 and all(
        unit or _NO_UNIT.fullmatch(text) for unit, text in zip(units, texts, strict=True)
    ):
        return tuple(
            replace(cell, text=f"{cell.text} ({unit})") if unit else cell
            for cell, unit in zip(header, units, strict=True)
        )
    above, below = [read_heading(cell) for cell in header], [read_heading(cell) for cell in row]
    agree = all(
        None in (one.quantity, two.quantity) or one.quantity is two.quantity
        for one, two in zip(above, below, strict=True)
    )
    if not (are_headings(row) and agree):
        return None
    return tuple(two.cell if two.quantity else one.cell for one, two in zip(above, below, strict=True))


def _fitted(row: Cells, width: int, number: int, notes: list[str]) -> Cells:
    """Return a row of a Markdown table as long as its headings, as far as that is what the row means."""
    if width / 2 <= len(row) < width:
        behind = replace(row[-1], text="", column=row[-1].column + len(row[-1].text))
        notes.append(f"row {number} has {len(row)} cells of {width}: the others were read as empty")
        return (*row, *[behind] * (width - len(row)))
    extra = [cell.text for cell in row[width:] if cell.text]
    if len(row) > width and not any(_NUMERIC.fullmatch(plain(text)) or variable_in(text) for text in extra):
        if extra:
            notes.append(f"behind the last column of row {number}, {shown(' | '.join(extra))} was not read")
        return row[:width]
    return row
