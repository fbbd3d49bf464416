"""The rows of a table, each with its type, name, numbers and limits; units and convention are still open."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from dh2sim.formats.tables.cells import Constant
from dh2sim.formats.tables.columns import Columns
from dh2sim.formats.tables.findings import Findings
from dh2sim.formats.tables.headers import Quantity
from dh2sim.formats.tables.labels import check_numbers, joint_names, read_types
from dh2sim.formats.tables.limits import LimitReader
from dh2sim.formats.tables.locate import Table
from dh2sim.formats.tables.motion import TableRow, settle
from dh2sim.formats.tables.rows import numbers_in, read_flips, read_rows
from dh2sim.formats.tables.units import ANGLES, LENGTHS, Kind, Number
from dh2sim.robot.spec import JointType


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BodyRow:
    """A row, read."""

    row: TableRow
    name: str
    numbers: Mapping[Quantity, Number]
    limits: tuple[Number, Number] | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Body:
    """All rows of a table."""

    rows: tuple[BodyRow, ...] = field(repr=False)

    def numbers(self, kind: Kind) -> list[Number]:
        """Return the numbers of one kind, the parameters before the limits."""
        found = [number for row in self.rows for number in row.numbers.values()]
        found += [limit for row in self.rows for limit in row.limits or ()]
        return [number for number in found if number.kind is kind]

    @property
    def constants(self) -> tuple[str, ...]:
        """The symbols whose value is used."""
        readings = [number.reading for kind in (ANGLES, LENGTHS) for number in self.numbers(kind)]
        return tuple(dict.fromkeys(name for reading in readings for name in reading.constants))


def read_body(
    table: Table, columns: Columns, constants: Mapping[str, Constant], *, comma: bool, findings: Findings
) -> Body:
    """Return the rows of a table.

    Args:
        table: The table, its rows as long as its heading.
        columns: What the columns hold.
        constants: Symbols that the text around the table gives a value.
        comma: Whether numbers have a decimal comma.
        findings: Takes problems and notes.
    """
    cells = table.rows
    rows = read_rows(cells, columns, constants, comma=comma, findings=findings)
    for row, kind in zip(rows, read_types(cells, columns, findings), strict=True):
        row.type = kind
    check_numbers(cells, columns, findings)
    settle(rows, constants, comma, findings)
    read_flips(rows, cells, columns, findings)
    limits = LimitReader(columns, constants, comma=comma, findings=findings)
    return Body(
        rows=tuple(
            BodyRow(
                row=row,
                name=name,
                numbers=numbers_in(row, columns),
                limits=limits.read(row_cells, row.number, LENGTHS if row.type is JointType.PRISMATIC else ANGLES),
            )
            for row, row_cells, name in zip(rows, cells, joint_names(cells, columns, findings), strict=True)
        )
    )
