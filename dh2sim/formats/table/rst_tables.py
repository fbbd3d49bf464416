"""Tables of reStructuredText that are not drawn with pipes: simple tables, ``list-table`` and ``csv-table``."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final

from dh2sim.formats.table.grid import MAX_COLUMNS, MAX_ROWS, Cell, Cells, Grid, split

_RULE: Final = re.compile(r"\s*=+(?:\s+=+)+\s*")
_DIRECTIVE: Final = re.compile(r"\s*\.\.\s+(list-table|csv-table)::")
_OPTION: Final = re.compile(r"\s*:([\w-]+):\s*(.*)")
_BULLET: Final = re.compile(r"(\s*)(?:\*\s+)?-(?:\s+(.*))?")


def rst_grids(lines: Sequence[str]) -> Iterator[Grid]:
    """Yield the tables of a text that are written in reStructuredText."""
    index = 0
    while index < len(lines):
        found = _DIRECTIVE.match(lines[index])
        if found:
            last = _end_of_block(lines, index)
            rows = (
                _list_table(lines, index + 1, last)
                if found[1] == "list-table"
                else _csv_table(lines, index + 1, last)
            )
            index = last
        elif "=" in lines[index] and _RULE.fullmatch(lines[index]):
            rows, index = _simple_table(lines, index)
        else:
            rows, index = [], index + 1
        if rows:
            yield Grid(rows=tuple(rows), separator="=", filled=True)


def _end_of_block(lines: Sequence[str], start: int) -> int:
    """Return the index of the line behind a directive: the next that is not indented deeper."""
    indent = len(lines[start]) - len(lines[start].lstrip())
    for index in range(start + 1, min(len(lines), start + MAX_ROWS * MAX_COLUMNS)):
        line = lines[index]
        if line.strip() and len(line) - len(line.lstrip()) <= indent:
            return index
    return len(lines)


def _list_table(lines: Sequence[str], start: int, stop: int) -> list[Cells]:
    rows: list[list[Cell]] = []
    for index in range(start, stop):
        found = _BULLET.fullmatch(lines[index])
        if found is None:
            continue
        if lines[index].lstrip().startswith("*"):
            rows.append([])
        if rows and len(rows) <= MAX_ROWS + 2 and len(rows[-1]) <= MAX_COLUMNS:
            column = found.start(2) if found[2] is not None else len(lines[index])
            rows[-1].append(Cell(text=(found[2] or "").strip(), line=index + 1, column=column + 1))
    return [tuple(row) for row in rows if row]


def _csv_table(lines: Sequence[str], start: int, stop: int) -> list[Cells]:
    rows: list[Cells] = []
    for index in range(start, min(stop, start + MAX_ROWS + 20)):
        line, option = lines[index], _OPTION.fullmatch(lines[index])
        text = line
        if option is not None:
            if option[1] != "header":
                continue
            text = " " * option.start(2) + option[2]
        try:
            cells = split(text, index + 1, ",")
        except ValueError:
            continue
        if len(cells) > 1:
            rows.append(cells)
    return rows


def _simple_table(lines: Sequence[str], start: int) -> tuple[list[Cells], int]:
    """Return the rows below a rule of equals signs and the index of the line behind the table."""
    starts = [found.start() for found in re.finditer("=+", lines[start])][:MAX_COLUMNS]
    rows: list[Cells] = []
    rules = 1
    for index in range(start + 1, min(len(lines), start + MAX_ROWS + 20)):
        line = lines[index]
        if _RULE.fullmatch(line):
            rules += 1
            if rules == 3 or (rules == 2 and not "".join(lines[index + 1 : index + 2]).strip()):
                return rows, index + 1
        elif line.strip():
            spans = zip(starts, [*starts[1:], max(len(line), starts[-1])], strict=True)
            rows.append(tuple(_cut(line, index + 1, begin, end) for begin, end in spans))
    return [], start + 1


def _cut(line: str, number: int, begin: int, end: int) -> Cell:
    text = line[begin:end]
    return Cell(text=text.strip(), line=number, column=begin + len(text) - len(text.lstrip()) + 1)
