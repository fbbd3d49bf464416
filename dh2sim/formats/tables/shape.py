"""Whether a table is one: its rows are as long as its heading, and its numbers are written in one way."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from dh2sim.formats.tables.columns import Columns
from dh2sim.formats.tables.findings import Findings
from dh2sim.formats.tables.grid import MAX_COLUMNS, MAX_ROWS, Cell
from dh2sim.formats.tables.headers import PARAMETERS, Quantity
from dh2sim.formats.tables.locate import Table
from dh2sim.formats.tables.plain import plain
from dh2sim.robot.words import shown

_COMMA: Final = re.compile(r"\d,\d")
_POINT: Final = re.compile(r"\d\.\d")
_GROUPED: Final = re.compile(r"(?<![\d,])[1-9]\d{0,2},\d{3}(?![\d,])")


def check_shape(table: Table, findings: Findings) -> None:
    """Note in ``findings`` rows of another length than the heading, and tables without rows or with too many."""
    first = table.header[0]
    for line, column, message in table.grid.problems:
        findings.wrong_at(line, column, "", message)
    if not table.rows:
        findings.wrong(first, "", "the table has headings and no rows")
    if len(table.rows) > MAX_ROWS:
        findings.wrong(first, "", f"the table has {len(table.rows)} rows; at most {MAX_ROWS} are allowed")
    if len(table.header) > MAX_COLUMNS:
        findings.wrong(first, "", f"the table has {len(table.header)} columns; at most {MAX_COLUMNS} are allowed")
    for number, row in enumerate(table.rows[:MAX_ROWS], start=1):
        if len(row) != len(table.header):
            cells = "1 cell" if len(row) == 1 else f"{len(row)} cells"
            findings.wrong(row[0], f"row {number}", f"{cells} in a table of {len(table.header)} columns")


def has_decimal_comma(table: Table, columns: Columns, findings: Findings) -> bool:
    """Return whether the table's numbers are written with a decimal comma.

    They are where some have a comma between digits and none has a point. A table in which every such comma has
    three digits behind it and no 0 before it cannot be told from one with grouped thousands.
    """
    commas = [cell for cell in _numbers(table, columns) if _COMMA.search(cell.text)]
    if not commas or any(_POINT.search(cell.text) for cell in _numbers(table, columns)):
        return False
    if all(_GROUPED.search(plain(cell.text)) for cell in commas):
        message = (
            f"the comma in {shown(commas[0].text)} may group thousands or be a decimal comma; write a point, or none"
        )
        findings.wrong(commas[0], "", message)
    return True


def _numbers(table: Table, columns: Columns) -> Iterator[Cell]:
    for row in table.rows:
        for quantity in (*PARAMETERS, Quantity.OFFSET, Quantity.LOWER, Quantity.UPPER):
            cell = columns.cell(row, quantity)
            if cell is not None:
                yield cell
