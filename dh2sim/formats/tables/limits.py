"""Position limits of a joint, from two columns or from one with both."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Final

from dh2sim.formats.tables.cells import CellError, Constant, Reading, read_cell
from dh2sim.formats.tables.columns import Columns
from dh2sim.formats.tables.findings import Findings
from dh2sim.formats.tables.grid import Cell, Cells
from dh2sim.formats.tables.headers import Heading, Quantity
from dh2sim.formats.tables.plain import plain
from dh2sim.formats.tables.units import Kind, Number
from dh2sim.robot.words import shown

_NONE: Final = (
    "",
    "-",
    "inf",
    "+inf",
    "-inf",
    "±inf",
    "∞",
    "+∞",
    "-∞",
    "±∞",
    "none",
    "n/a",
    "unlimited",
    "continuous",
)
_BETWEEN: Final = (
    r"\s*\.{2,}\s*",
    r"\s+to\s+",
    r"\s*~\s*",
    r"\s*;\s*",
    r"\s*,\s+|,(?=[-+])",
    r"\s+/\s+",
    r"\s+-\s+",
    r"(?<=[\d°])\s+(?=[-+\d.])",
)
_BOTH_SIDES: Final = re.compile(r"(?:±|\+/-|\+-)\s*(.+)")
_BRACKETS: Final = re.compile(r"[\[(](.+)[\])]\s*(\S*)")


class LimitReader:
    """Reads the limits of the rows of one table."""

    def __init__(
        self, columns: Columns, constants: Mapping[str, Constant], *, comma: bool, findings: Findings
    ) -> None:
        """Remember what cells are read with."""
        self._columns = columns
        self._constants = constants
        self._comma = comma
        self._findings = findings

    def read(self, row: Cells, number: int, kind: Kind) -> tuple[Number, Number] | None:
        """Return the lower and the upper limit of a row, or None where it has none or wrong ones.

        Args:
            row: The row's cells.
            number: The row's number, from 1.
            kind: Angles or lengths, as the joint moves.
        """
        found = []
        for cell, heading, what in self._cells(row):
            text = plain(cell.text)
            if text.casefold() in _NONE:
                continue
            path = f"row {number}, {what}"
            try:
                readings = self._both(cell, text) if what is Quantity.LIMITS else [self._one(cell, text)]
            except CellError as error:
                self._findings.wrong(cell, path, str(error))
                return None
            found += [Number(kind=kind, reading=reading, heading=heading, path=path) for reading in readings]
        if len(found) == 1:
            self._findings.note(
                f"row {number} has only one limit, {shown(found[0].reading.cell.text)}: it was left out"
            )
        return (found[0], found[1]) if len(found) == 2 else None

    def _cells(self, row: Cells) -> Iterator[tuple[Cell, Heading, Quantity]]:
        """The cells that hold the limits, two columns before one."""
        pair = Quantity.LOWER in self._columns.at and Quantity.UPPER in self._columns.at
        for quantity in (Quantity.LOWER, Quantity.UPPER) if pair else (Quantity.LIMITS,):
            cell, heading = self._columns.cell(row, quantity), self._columns.heading(quantity)
            if cell is not None and heading is not None:
                yield cell, heading, quantity

    def _one(self, cell: Cell, text: str) -> Reading:
        reading = read_cell(replace(cell, text=text), None, self._constants, comma=self._comma)
        return replace(reading, cell=cell)

    def _both(self, cell: Cell, text: str) -> list[Reading]:
        """Return the two limits in a cell such as ``[-170°, 170°]``, ``-170..170`` or ``±170``."""
        if found := _BOTH_SIDES.fullmatch(text):
            upper = self._one(cell, found[1])
            return [replace(upper, value=-upper.value), upper]
        if (found := _BRACKETS.fullmatch(text)) and re.search(r",|\.\.|;|\bto\b", found[1]):
            unit = f" {found[2]}" if found[2] else ""
            sides = re.split(r"\s*(?:;|\.\.+|\bto\b)\s*", found[1])
            sides = sides if len(sides) == 2 else found[1].split(",")
            if len(sides) == 2:
                return [self._one(cell, side.strip() + unit) for side in sides]
        for pattern in _BETWEEN:
            sides = re.split(pattern, text)
            if len(sides) == 2 and all(sides):
                lower, upper = (self._one(cell, side) for side in sides)
                if lower.unit is None and upper.unit is not None:
                    lower = replace(lower, unit=upper.unit)
                return [lower, upper]
        message = f"{shown(cell.text)} is no pair of limits; write it as '[-170, 170]', '-170 to 170' or '±170'"
        raise CellError(message)
