"""How each row of a table moves: which of its cells is the joint's coordinate, and between which limits."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from dh2sim.formats.table.cells import CellError, Constant, Reading, no_value, read_cell
from dh2sim.formats.table.grid import Cell, Cells, Findings
from dh2sim.formats.table.headers import Columns, Heading, Quantity
from dh2sim.formats.table.notation import plain
from dh2sim.formats.table.units import Kind, Number
from dh2sim.messages import listed, shown
from dh2sim.robot.row import JointType

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
        """Yield the cells that hold the limits: two columns are preferred to one."""
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
        message = f"{shown(cell.text)} is not a pair of limits; write it as '[-170, 170]', '-170 to 170' or '±170'"
        raise CellError(message)


COORDINATES: Final = {
    Quantity.THETA: re.compile(r"(?:theta|th|teta|tetha|thetha|t|q|phi|psi|gamma)[0-9]*[ijkn]?"),
    Quantity.D: re.compile(r"(?:d|s|r|q)[0-9]*[ijkn]?"),
}
"""Names of a joint's coordinate in the columns that may hold one, in lower case."""
_LIKELY, _SURE = 1, 2
_MARK: Final = "mark the joint's coordinate with a star, as in theta1* or d3*, or add a column type with R or P"


@dataclass(slots=True, kw_only=True, eq=False)
class TableRow:
    """A row whose cells have been read."""

    number: int
    """From 1."""
    readings: dict[Quantity, Reading] = field(default_factory=dict)
    """Of the cells that could be read."""
    type: JointType | None = None
    """As the table gives it, until ``decide_motion`` has decided."""
    no_type: bool = False
    """The table has a column for types or variables, and the row's cell there is empty."""
    sign: int = 1

    def path(self, quantity: Quantity) -> str:
        """Return how messages call one of its cells."""
        return f"row {self.number}, {quantity}"

    def strength(self, quantity: Quantity) -> int:
        """Return how certain it is that a cell is the joint's coordinate: 0 for a plain number."""
        reading = self.readings.get(quantity)
        if reading is None or not (reading.starred or reading.symbol):
            return 0
        return _SURE if reading.starred or (reading.symbol or "").casefold().startswith("q") else _LIKELY


def decide_motion(
    rows: Sequence[TableRow], constants: Mapping[str, Constant], comma: bool, findings: Findings
) -> None:
    """Give every row its type and sign; what is ambiguous goes to ``findings``.

    Args:
        rows: The table; theta and d are read again where a symbol turns out not to be a coordinate.
        constants: Symbols that the text gives a value.
        comma: Whether numbers have a decimal comma.
        findings: Takes problems and notes.
    """
    typed = any(row.type or row.no_type for row in rows)
    moving = {row.number: row for row in rows if row.strength(Quantity.THETA) or row.strength(Quantity.D)}
    no_theta = all(row.readings[Quantity.THETA].empty for row in rows if Quantity.THETA in row.readings)
    still, unsaid = [], False
    for row in rows:
        if row.number in moving or row.type is not None:
            _check_ambiguous(row, constants, no_theta=no_theta, findings=findings)
            _decide_moving_row(row, constants, comma, findings)
        elif row.no_type or (moving and not no_theta and not typed):
            row.type = JointType.FIXED
            still.append(str(row.number))
        else:
            row.type, unsaid = JointType.REVOLUTE, True
    if unsaid and not no_theta:
        findings.note(
            f"no cell is marked as variable: every joint was read as revolute, its theta as an offset; {_MARK}"
        )
    if len(still) == 1:
        findings.note(f"row {still[0]} has no variable: it was read as fixed")
    elif still:
        findings.note(f"rows {listed(still)} have no variable: they were read as fixed")
    _check_coordinates(rows, findings)


def _check_ambiguous(row: TableRow, constants: Mapping[str, Constant], *, no_theta: bool, findings: Findings) -> None:
    """Complain of a symbol such as d1 that may be the coordinate or a length, unless it must be the coordinate."""
    reading = row.readings.get(Quantity.D)
    if row.type is not None or row.strength(Quantity.D) != _LIKELY or row.strength(Quantity.THETA) or reading is None:
        return
    symbol = reading.symbol or ""
    line = constants[symbol].line if symbol in constants else None
    if line is None and not no_theta:
        return
    number = f"the number given on line {line}" if line else "a length"
    message = f"{shown(symbol)} may be the joint's coordinate or {number}; {_MARK}, or write the number"
    findings.wrong(reading.cell, row.path(Quantity.D), message)


def _decide_moving_row(row: TableRow, constants: Mapping[str, Constant], comma: bool, findings: Findings) -> None:
    turn, slide = row.strength(Quantity.THETA), row.strength(Quantity.D)
    if turn == slide == _SURE:
        both = " and ".join(shown(row.readings[quantity].cell.text) for quantity in (Quantity.THETA, Quantity.D))
        message = f"two variables in one row, {both}; a row has one joint: write two rows, one with only the second"
        findings.wrong(row.readings[Quantity.D].cell, row.path(Quantity.D), message)
        return
    along = JointType.PRISMATIC if slide > turn else JointType.REVOLUTE
    kind = row.type or along
    here, there = (Quantity.THETA, Quantity.D) if kind.turns else (Quantity.D, Quantity.THETA)
    if kind is JointType.FIXED:
        here = Quantity.THETA
        _must_not_move(row, here, kind, constants, comma, findings)
    _must_not_move(row, there, kind, constants, comma, findings)
    row.type = kind
    if kind.moves and here in row.readings:
        row.sign = row.readings[here].sign


def _must_not_move(
    row: TableRow,
    quantity: Quantity,
    kind: JointType,
    constants: Mapping[str, Constant],
    comma: bool,
    findings: Findings,
) -> None:
    """Read a cell that is not the coordinate as a number, or complain that it is not one."""
    reading = row.readings.get(quantity)
    if reading is None or not row.strength(quantity):
        return
    cell, path = reading.cell, row.path(quantity)
    if row.strength(quantity) == _SURE:
        findings.wrong(cell, path, f"{shown(cell.text)} is variable, but the row's joint is {kind}")
        return
    try:
        row.readings[quantity] = read_cell(cell, None, constants, comma=comma)
    except CellError as error:
        symbol = reading.symbol or ""
        star = f"; if it is the joint's coordinate, mark it with a star: {symbol}*"
        findings.wrong(cell, path, f"{error}{star}" if str(error) == no_value(symbol) else str(error))


def _check_coordinates(rows: Sequence[TableRow], findings: Findings) -> None:
    """Check that every coordinate belongs to one row; note where they are not numbered in the order of the rows."""
    seen: dict[str, TableRow] = {}
    numbers: list[int] = []
    for row in rows:
        if row.type is None or not row.type.moves:
            continue
        quantity = Quantity.THETA if row.type.turns else Quantity.D
        reading = row.readings.get(quantity)
        if reading is None or reading.symbol is None:
            continue
        digits = re.sub(r"\D", "", reading.symbol)
        if not digits:
            continue
        first = seen.setdefault(reading.symbol.casefold(), row)
        if first is not row:
            message = (
                f"{shown(reading.symbol)} is the coordinate of row {first.number} already; every row has its own"
            )
            findings.wrong(reading.cell, row.path(quantity), message)
        numbers.append(int(digits[:6]))
    if numbers != sorted(numbers):
        findings.note("the coordinates are not numbered in the order of the rows; a joint vector follows the rows")
