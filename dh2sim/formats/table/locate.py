"""Where in a text its tables of Denavit-Hartenberg parameters are."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from pathlib import PurePath
from typing import Final

from dh2sim.formats.table.data_tables import data_tables
from dh2sim.formats.table.dh_table import Located, Table, make_table, transposed
from dh2sim.formats.table.grid import (
    MAX_COLUMNS,
    Cells,
    Grid,
    is_comment,
    pipe_grids,
    separated_grid,
    split,
)
from dh2sim.formats.table.headers import are_headings, parameters_in
from dh2sim.formats.table.html_tables import html_grids
from dh2sim.formats.table.latex_tables import latex_grids
from dh2sim.formats.table.rst_tables import rst_grids
from dh2sim.formats.table.scripts import script_tables
from dh2sim.formats.table.wiki_tables import wiki_grids

_SEPARATED: Final = (".csv", ".tsv", ".tab")
_MAX_HEADING_LINES: Final = 2000
"""Lines that are searched for the headings of a table between separators."""
_MAX_GRIDS: Final = 500
"""Tables of a text that are looked at."""
_MAX_CANDIDATES: Final = 20
"""Lines that may be headings of a table between separators, and are looked at."""


def locate(lines: Sequence[str], file: str) -> Located:
    """Return the tables of DH parameters in a text; failing that, the table that is most like one.

    Args:
        lines: The file's lines.
        file: Its name, whose ending decides where to look first.
    """
    wiki = tuple(wiki_grids(lines))
    inside = {number for grid in wiki for number in grid.lines}
    pipes = tuple(pipe_grids(["" if number in inside else line for number, line in enumerate(lines, start=1)]))
    scripts, problems = script_tables(lines, file)
    suffix = PurePath(file).suffix.casefold()
    if not scripts:
        scripts, unnamed = data_tables(lines, suffix)
        problems += unnamed
    marked = [
        *_in_grids(pipes),
        *_in_grids(latex_grids(lines)),
        *_in_grids(html_grids(lines)),
        *_in_grids(rst_grids(lines)),
        *_in_grids(wiki),
        *scripts,
    ]
    taken = {number for table in marked for number in table.lines}
    separated = list(_between_separators(lines, taken))
    even = [table for table in separated if _is_even(table)]
    if suffix in _SEPARATED:
        found = even or separated[:1] or marked
    else:
        found = sorted([*marked, *even], key=lambda table: table.lines.start)
        found = found or ([] if problems else separated[:1])
    found = found if even or marked else list(_on_their_sides(lines)) or found
    found = sorted(found, key=lambda table: table.extent is None and is_comment(lines[table.lines.start - 1]))
    alike = [] if found or problems else _most_alike(lines, pipes)
    return Located(tables=(*found, *alike), pipes=pipes, problems=tuple(problems))


def _in_grids(grids: Iterable[Grid]) -> Iterator[Table]:
    for grid in itertools.islice(grids, _MAX_GRIDS):
        for index, row in enumerate(grid.rows[:5]):
            if are_headings(row[:MAX_COLUMNS]):
                yield make_table(row, grid.rows[index + 1 :], grid)
                break
        else:
            if (table := transposed(grid)) is not None:
                yield table


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


def _on_their_sides(lines: Sequence[str]) -> Iterator[Table]:
    """Yield the tables between separators whose rows are the parameters: lines of as many cells each."""
    rows: list[Cells] = []
    for separator in "\t;,":
        for index, line in enumerate([*lines[:_MAX_HEADING_LINES], ""]):
            try:
                cells = (
                    split(line[:2_000], index + 1, separator) if separator in line and not is_comment(line) else ()
                )
            except ValueError:
                cells = ()
            if rows and len(cells) != len(rows[0]):
                if (table := transposed(Grid(rows=tuple(rows), separator="|"))) is not None:
                    yield table
                rows = []
            if len(cells) > 1 and len(rows) <= MAX_COLUMNS:
                rows.append(cells)


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
