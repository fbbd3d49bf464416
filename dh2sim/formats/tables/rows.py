"""The cells of a table to the rows of a robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from dh2sim.formats.tables.cells import CellError, Constant, Unit, read_cell
from dh2sim.formats.tables.columns import Columns
from dh2sim.formats.tables.findings import Findings
from dh2sim.formats.tables.grid import Cells
from dh2sim.formats.tables.headers import Quantity
from dh2sim.formats.tables.motion import COORDINATES, TableRow
from dh2sim.formats.tables.plain import plain
from dh2sim.formats.tables.units import ANGLES, LENGTHS, Kind, Number, to_si
from dh2sim.robot.spec import ActuatorSpec, ActuatorType, Convention, JointType, Limits, Row
from dh2sim.robot.words import shown

_KINDS: Final = {
    Quantity.THETA: ANGLES,
    Quantity.ALPHA: ANGLES,
    Quantity.BETA: ANGLES,
    Quantity.D: LENGTHS,
    Quantity.A: LENGTHS,
}
_FLIPS: Final = {
    Quantity.FLIP: {"true": -1, "yes": -1, "1": -1, "false": 1, "no": 1, "0": 1, "": 1, "-": 1},
    Quantity.SIGN: {"-1": -1, "-": -1, "1": 1, "+1": 1, "+": 1, "": 1},
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Resolved:
    """Units that numbers are read in, of each kind: the user's, and those of numbers that have none."""

    option: Mapping[str, Unit | None]
    default: Mapping[str, Unit | None]

    def si(self, number: Number | None) -> float:
        """Return a number in rad or m; 0 where there is none."""
        if number is None:
            return 0.0
        what = number.kind.what
        return to_si(number, option=self.option[what], default=self.default[what])


def read_rows(
    rows: Sequence[Cells], columns: Columns, constants: Mapping[str, Constant], *, comma: bool, findings: Findings
) -> list[TableRow]:
    """Return the rows with every cell of a parameter read."""
    return [
        _read_row(row, number, columns, constants, comma=comma, findings=findings)
        for number, row in enumerate(rows, start=1)
    ]


def _read_row(
    cells: Cells, number: int, columns: Columns, constants: Mapping[str, Constant], *, comma: bool, findings: Findings
) -> TableRow:
    row = TableRow(number=number)
    for quantity in (*_KINDS, Quantity.OFFSET):
        cell = columns.cell(cells, quantity)
        if cell is None:
            continue
        try:
            reading = read_cell(cell, COORDINATES.get(quantity), constants, comma=comma)
        except CellError as error:
            findings.wrong(cell, row.path(quantity), str(error))
            continue
        row.readings[quantity] = reading
        if reading.starred and quantity not in COORDINATES:
            findings.note(f"the star in {shown(cell.text)} ({row.path(quantity)}) was taken for a footnote's")
    return row


def read_flips(rows: Sequence[TableRow], cells: Sequence[Cells], columns: Columns, findings: Findings) -> None:
    """Turn the sign of rows that a column ``flip`` or ``sign`` says are counted the other way."""
    for row, row_cells in zip(rows, cells, strict=True):
        for quantity, signs in _FLIPS.items():
            cell = columns.cell(row_cells, quantity)
            if cell is None:
                continue
            sign = signs.get(plain(cell.text).casefold())
            if sign is None:
                allowed = " or ".join(shown(word) for word in signs if word)
                findings.wrong(cell, row.path(quantity), f"found {shown(cell.text)}. Allowed: {allowed}")
            else:
                row.sign *= sign


def numbers_in(row: TableRow, columns: Columns) -> dict[Quantity, Number]:
    """Return the numbers of a settled row; ``offset`` is an angle or a length as the joint moves."""
    kinds: dict[Quantity, Kind] = dict(_KINDS)
    kinds[Quantity.OFFSET] = LENGTHS if row.type is JointType.PRISMATIC else ANGLES
    return {
        quantity: Number(kind=kinds[quantity], reading=reading, heading=heading, path=row.path(quantity))
        for quantity, reading in row.readings.items()
        if (heading := columns.heading(quantity)) is not None
    }


def to_row(
    row: TableRow,
    numbers: Mapping[Quantity, Number],
    limits: tuple[Number, Number] | None,
    units: Resolved,
    *,
    name: str,
    convention: Convention,
    findings: Findings,
) -> Row:
    """Return a row of the robot.

    Args:
        row: The row, settled.
        numbers: Its numbers.
        limits: Its lower and upper limit.
        units: The units of numbers.
        name: The joint's name.
        convention: The row's convention.
        findings: Takes what does not go together.
    """
    kind = row.type or JointType.REVOLUTE
    values = {quantity: units.si(numbers.get(quantity)) for quantity in (*_KINDS, Quantity.OFFSET)}
    offset, added = numbers.get(Quantity.OFFSET), values[Quantity.OFFSET]
    if offset is not None and added and not kind.moves:
        findings.wrong(
            offset.reading.cell, offset.path, "an offset belongs to a joint's coordinate; this row is fixed"
        )
    if convention is Convention.HAYATI and kind is not JointType.PRISMATIC and values[Quantity.D]:
        message = "a row with beta, after Hayati, has no d unless its joint is prismatic"
        findings.wrong(numbers[Quantity.D].reading.cell, row.path(Quantity.D), message)
    return Row(
        name=name,
        type=kind,
        convention=convention,
        a=values[Quantity.A],
        alpha=values[Quantity.ALPHA],
        d=values[Quantity.D] + (added if kind is JointType.PRISMATIC else 0.0),
        theta=values[Quantity.THETA] + (added if kind.turns else 0.0),
        beta=values[Quantity.BETA] if convention is Convention.HAYATI else 0.0,
        flip=kind.moves and row.sign < 0,
        limits=_limits(kind, limits, units, row.number, findings),
        actuator=ActuatorSpec() if kind.moves else ActuatorSpec(type=ActuatorType.NONE),
    )


def is_hayati(numbers: Mapping[Quantity, Number], columns: Columns) -> bool:
    """Return whether a row is a Hayati row: its table has no d, or its beta is not 0."""
    beta = numbers.get(Quantity.BETA)
    return beta is not None and (Quantity.D not in columns.at or beta.reading.value != 0.0)


def _limits(
    kind: JointType, limits: tuple[Number, Number] | None, units: Resolved, number: int, findings: Findings
) -> Limits:
    if limits is None:
        return Limits()
    lower, upper = (units.si(limit) for limit in limits)
    if kind in (JointType.FIXED, JointType.CONTINUOUS):
        findings.note(f"row {number} is {kind}: its limits were left out")
        return Limits()
    if lower >= upper:
        first, second = (shown(limit.reading.cell.text) for limit in limits)
        which = first if limits[0].reading.cell is limits[1].reading.cell else f"{first} and {second}"
        message = f"the lower limit is not below the upper one: {which}"
        findings.wrong(limits[0].reading.cell, limits[0].path, message)
    return Limits(position=(lower, upper))
