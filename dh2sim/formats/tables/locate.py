"""Which part of a text is the table of DH parameters."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import PurePath
from typing import Final

from dh2sim.formats.tables.columns import are_headings, parameters_in
from dh2sim.formats.tables.grid import MAX_COLUMNS, Cells, Grid, is_comment, pipe_grids, separated_grid, split

_SEPARATED: Final = (".csv", ".tsv", ".tab")
_MOST_LINES: Final = 2000
"""Lines that are looked at for the headings of a table between separators."""
_DELIMITER: Final = re.compile(r":?-+:?")
"""A cell of the row that Markdown wants under the headings."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Table:
    """A table of DH parameters."""

    header: Cells
    rows: tuple[Cells, ...] = field(repr=False)
    grid: Grid = field(repr=False)
    pipes: tuple[Grid, ...] = field(repr=False)
    """All tables between pipes in the file."""

    @property
    def lines(self) -> range:
        """Numbers of its lines, from that of its headings to that of its last row."""
        return range(self.header[0].line, self.grid.lines.stop)


def locate(lines: Sequence[str], file: str) -> Table | None:
    """Return the first table of DH parameters in a text; failing that, the table that is most like one.

    Args:
        lines: The file's lines.
        file: Its name, whose ending is a hint where to look first.
    """
    pipes = tuple(pipe_grids(lines))
    if PurePath(file).suffix.casefold() in _SEPARATED:
        table = _between_separators(lines, pipes) or _between_pipes(pipes)
    else:
        table = _between_pipes(pipes) or _between_separators(lines, pipes)
    return table or _most_alike(lines, pipes)


def others(table: Table) -> Iterator[int]:
    """Yield the lines on which further tables of DH parameters start, which are not read."""
    for grid in table.pipes:
        if (
            grid.lines.start > table.lines.start
            and grid is not table.grid
            and any(are_headings(row) for row in grid.rows[:3])
        ):
            yield grid.lines.start


def _between_pipes(pipes: Sequence[Grid]) -> Table | None:
    for grid in pipes:
        for index, row in enumerate(grid.rows[:5]):
            if are_headings(row[:MAX_COLUMNS]):
                rows = grid.rows[index + 1 :]
                if rows and all(_DELIMITER.fullmatch(cell.text) for cell in rows[0]):
                    rows = rows[1:]
                return Table(header=row, rows=rows, grid=grid, pipes=tuple(pipes))
    return None


def _between_separators(lines: Sequence[str], pipes: Sequence[Grid]) -> Table | None:
    """Return the table under the first line that has headings; one in a comment only where no other has."""
    for comments in (False, True):
        for index, line in enumerate(lines[:_MOST_LINES]):
            if is_comment(line) is not comments or not line.strip():
                continue
            grids = [
                separated_grid(lines, index, separator)
                for separator in "\t;, "
                if separator in line and _has_headings(line, separator)
            ]
            if grids:
                even = (grid for grid in grids if len({len(row) for row in grid.rows[:2]}) == 1)
                grid = next(even, grids[0])
                return Table(header=grid.rows[0], rows=grid.rows[1:], grid=grid, pipes=tuple(pipes))
    return None


def _has_headings(line: str, separator: str) -> bool:
    try:
        cells = split(line[:2000], 1, separator)
    except ValueError:
        return False
    return len(cells) <= MAX_COLUMNS and are_headings(cells)


def _most_alike(lines: Sequence[str], pipes: Sequence[Grid]) -> Table | None:
    candidates = [(parameters_in(grid.rows[0][:MAX_COLUMNS]), -i, grid) for i, grid in enumerate(pipes[:100])]
    for index, line in enumerate(lines[:_MOST_LINES]):
        for separator in "\t;,":
            if separator in line[:2000] and not is_comment(line):
                grid = separated_grid(lines[: index + 1], index, separator)
                if grid.rows:
                    candidates.append((parameters_in(grid.rows[0][:MAX_COLUMNS]), -index, grid))
    best = max(candidates, key=lambda candidate: candidate[:2], default=None)
    if best is None or best[0] < 1:
        return None
    return Table(header=best[2].rows[0], rows=best[2].rows[1:], grid=best[2], pipes=tuple(pipes))
