"""Where in a text its tables of Denavit-Hartenberg parameters are."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import PurePath
from typing import Final

from dh2sim.formats.table.grid import (
    DELIMITER,
    MAX_COLUMNS,
    Cells,
    Grid,
    is_comment,
    pipe_grids,
    separated_grid,
    split,
)
from dh2sim.formats.table.headers import UNIT, are_headings, parameters_in, read_heading, variable_in
from dh2sim.formats.table.notation import plain
from dh2sim.messages import shown

_SEPARATED: Final = (".csv", ".tsv", ".tab")
_MAX_HEADING_LINES: Final = 2000
"""Lines that are searched for the headings of a table between separators."""
_MAX_CANDIDATES: Final = 20
"""Lines that may be headings of a table between separators, and are looked at."""
_UNIT_CELL: Final = re.compile(rf"[\[({{<]?\s*(?:in\s+)?({UNIT})\.?\s*[\])}}>]?", re.IGNORECASE)
_NO_UNIT: Final = re.compile(r"[\[({<]?\s*[-–—/1]?\s*[\])}>]?")
_NUMERIC: Final = re.compile(rf"[-+(]*(?:[\d.,]|pi\b)[-+*/().,\deEpi\s]*(?:{UNIT})?\.?")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Table:
    """A table of DH parameters."""

    header: Cells
    rows: tuple[Cells, ...] = field(repr=False)
    grid: Grid = field(repr=False)
    notes: tuple[str, ...] = ()
    """What was done to its rows, a sentence each."""

    @property
    def lines(self) -> range:
        """Numbers of its lines, from that of its headings to that of its last row."""
        return range(self.header[0].line, self.grid.lines.stop)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Located:
    """The tables of a text."""

    tables: tuple[Table, ...] = field(repr=False)
    """Those of DH parameters, in the order of the text; those in comments last. Failing that, the most alike."""
    pipes: tuple[Grid, ...] = field(repr=False)
    """All tables between pipes."""

    def around(self, table: Table) -> range:
        """Return the numbers of the lines that may belong to a table: up to its neighbours."""
        others = [other.lines for other in self.tables if other is not table]
        start = max((lines.stop for lines in others if lines.stop <= table.lines.start), default=1)
        stop = min((lines.start for lines in others if lines.start >= table.lines.stop), default=0)
        return range(start, stop or 1_000_001)


def locate(lines: Sequence[str], file: str) -> Located:
    """Return the tables of DH parameters in a text; failing that, the table that is most like one.

    Args:
        lines: The file's lines.
        file: Its name, whose ending decides where to look first.
    """
    pipes = tuple(pipe_grids(lines))
    marked = list(_between_pipes(pipes))
    taken = {number for table in marked for number in table.lines}
    separated = list(_between_separators(lines, taken))
    even = [table for table in separated if _is_even(table)]
    if PurePath(file).suffix.casefold() in _SEPARATED:
        found = even or separated[:1] or marked
    else:
        found = sorted([*marked, *even], key=lambda table: table.lines.start) or separated[:1]
    found = sorted(found, key=lambda table: is_comment(lines[table.lines.start - 1]))
    return Located(tables=tuple(found or _most_alike(lines, pipes)), pipes=pipes)


def _between_pipes(pipes: Sequence[Grid]) -> Iterator[Table]:
    for grid in pipes:
        for index, row in enumerate(grid.rows[:5]):
            if are_headings(row[:MAX_COLUMNS]):
                yield make_table(row, grid.rows[index + 1 :], grid)
                break


def make_table(header: Cells, rows: Sequence[Cells], grid: Grid) -> Table:
    """Return the table of some rows of a grid.

    Units in a row of their own, and a second row of headings, go to the headings. In Markdown, a row that is shorter
    than the headings is filled up with empty cells, and what is behind the last column is cut off.
    """
    rows = list(rows)
    delimited = bool(rows) and all(DELIMITER.fullmatch(cell.text) for cell in rows[0])
    rows = rows[1:] if delimited else rows
    while rows and len(rows[0]) == len(header) and (merged := _merged(header, rows[0])):
        header, rows = merged, rows[1:]
    notes: list[str] = []
    if delimited or grid.markdown:
        rows = [_fitted(row, len(header), number, notes) for number, row in enumerate(rows, start=1)]
    return Table(header=header, rows=tuple(rows), grid=grid, notes=tuple(notes))


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


def _between_separators(lines: Sequence[str], taken: set[int]) -> Iterator[Table]:
    """Yield the tables under lines that have headings, those in comments last."""
    for comments in (False, True):
        stop, candidates = 0, 0
        for index, line in enumerate(lines[:_MAX_HEADING_LINES]):
            if index < stop or index + 1 in taken or is_comment(line) is not comments or not line.strip():
                continue
            grids = [
                separated_grid(lines, index, separator)
                for separator in "\t;, "
                if separator in line and _has_headings(line, separator)
            ]
            if not grids:
                continue
            grid = next((grid for grid in grids if len({len(row) for row in grid.rows[:2]}) == 1), grids[0])
            table = make_table(grid.rows[0], grid.rows[1:], grid)
            yield table
            stop = table.lines.stop - 1 if _is_even(table) else stop
            candidates += 1
            if candidates == _MAX_CANDIDATES:
                return


def _is_even(table: Table) -> bool:
    """Whether a table has rows, all of them as long as its headings."""
    return bool(table.rows) and not table.grid.problems and all(len(row) == len(table.header) for row in table.rows)


def _has_headings(line: str, separator: str) -> bool:
    try:
        cells = split(line[:2000], 1, separator)
    except ValueError:
        return False
    return len(cells) <= MAX_COLUMNS and are_headings(cells)


def _most_alike(lines: Sequence[str], pipes: Sequence[Grid]) -> list[Table]:
    candidates = [(parameters_in(grid.rows[0][:MAX_COLUMNS]), -i, grid) for i, grid in enumerate(pipes[:100])]
    for index, line in enumerate(lines[:_MAX_HEADING_LINES]):
        for separator in "\t;,":
            if separator in line[:2000] and not is_comment(line):
                grid = separated_grid(lines[: index + 1], index, separator)
                if grid.rows:
                    candidates.append((parameters_in(grid.rows[0][:MAX_COLUMNS]), -index, grid))
    best = max(candidates, key=lambda candidate: candidate[:2], default=None)
    if best is None or best[0] < 1:
        return []
    return [make_table(best[2].rows[0], best[2].rows[1:], best[2])]
