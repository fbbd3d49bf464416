"""The rows of a table: types, names, numbers and limits of each, and the rows of a robot made of them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from dh2sim.formats.table.cells import CellError, Constant, Unit, read_cell
from dh2sim.formats.table.dh_table import Table
from dh2sim.formats.table.grid import Cell, Cells, Findings
from dh2sim.formats.table.headers import Columns, Quantity, is_no_variable, variable_in
from dh2sim.formats.table.motion import COORDINATES, LimitReader, TableRow, decide_motion
from dh2sim.formats.table.notation import plain
from dh2sim.formats.table.units import ANGLES, LENGTHS, Kind, Number, to_si
from dh2sim.messages import shown
from dh2sim.robot.checks import default_name
from dh2sim.robot.fields import is_reserved, name_problem
from dh2sim.robot.row import ActuatorSpec, ActuatorType, Convention, JointType, Limits, Row

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
class ResolvedUnits:
    """The units of angles and lengths: the user's choice, and the default of numbers that have none."""

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
    """Turn the sign of the rows that a column ``flip`` or ``sign`` marks as counted the other way."""
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
    """Return the numbers of a row of known type; ``offset`` is an angle or a length as the joint moves."""
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
    units: ResolvedUnits,
    *,
    name: str,
    convention: Convention,
    findings: Findings,
) -> Row:
    """Return a row of the robot.

    Args:
        row: The row, its type known.
        numbers: Its numbers.
        limits: Its lower and upper limit.
        units: The units of numbers.
        name: The joint's name.
        convention: The row's convention.
        findings: Takes contradictions.
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
    """Whether a row is a Hayati row: its table has no d, or its beta is not 0."""
    beta = numbers.get(Quantity.BETA)
    return beta is not None and (Quantity.D not in columns.at or beta.reading.value != 0.0)


def _limits(
    kind: JointType, limits: tuple[Number, Number] | None, units: ResolvedUnits, number: int, findings: Findings
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


TYPES: Final[Mapping[str, JointType]] = {
    **dict.fromkeys(("r", "rev", "revol", "revolute", "rot", "rotary", "rotational", "rotation", "rotating", "hinge",
                     "turn", "0", "rotatorisch", "drehgelenk", "rotacional", "revoluta", "rotoide"),
                    JointType.REVOLUTE),
    **dict.fromkeys(("p", "pri", "pris", "prism", "prismatic", "sliding", "slide", "slider", "linear", "trans",
                     "translational", "translation", "1", "translatorisch", "schubgelenk", "prismatica",
                     "prismatique"),
                    JointType.PRISMATIC),
    **dict.fromkeys(("c", "continuous"), JointType.CONTINUOUS),
    **dict.fromkeys(("f", "fix", "fixed", "2"), JointType.FIXED),
}  # fmt: skip
"""Words for the type of a joint; the digits are Corke's and Khalil's sigma."""
_ALLOWED: Final = "Allowed: revolute (R, 0), prismatic (P, 1), continuous, fixed"
_ORDINAL: Final = re.compile(r"(?:joint|link|axis|frame|row|j|l|a)?[ _]*#?\d+", re.IGNORECASE)
_BY_VARIABLE: Final = {Quantity.THETA: JointType.REVOLUTE, Quantity.D: JointType.PRISMATIC}


def read_types(rows: Sequence[TableRow], cells: Sequence[Cells], columns: Columns, findings: Findings) -> None:
    """Give the rows the types that a column for types or for variables says; a row without one has ``no_type``."""
    given = [columns.cell(row, Quantity.TYPE) for row in cells]
    if not given or given[0] is None:
        given = [columns.cell(row, Quantity.JOINT) for row in cells]
        words = [_type_word(cell) for cell in given if cell]
        if not words or not all(word in TYPES and not word.isdigit() for word in words):
            given = []
    variables = [columns.cell(row, Quantity.VARIABLE) for row in cells]
    some = any(not is_no_variable(cell.text) or cell.text == "0" for cell in given if cell)
    for row, cell in zip(rows, given if some else (), strict=False):
        if cell is None:
            continue
        word = _type_word(cell)
        row.type = TYPES.get(word) or _BY_VARIABLE.get(variable_in(cell.text) or Quantity.JOINT)
        row.no_type = row.type is None and is_no_variable(cell.text)
        if row.type is None and not row.no_type:
            findings.wrong(cell, f"row {row.number}, type", f"found {shown(cell.text)}. {_ALLOWED}")
    for row, cell in zip(rows, variables, strict=True):
        if cell is None:
            continue
        kind = _BY_VARIABLE.get(variable_in(cell.text) or Quantity.JOINT)
        if row.type is None:
            row.type, row.no_type = kind, is_no_variable(cell.text)
        elif kind is not None and kind.turns is not row.type.turns:
            findings.wrong(
                cell, f"row {row.number}, variable", f"{shown(cell.text)} is not a variable of a {row.type} joint"
            )


def _type_word(cell: Cell) -> str:
    word = plain(cell.text).casefold().strip(" *.()")
    return word.removesuffix("joint").strip() or word


def check_numbers(rows: Sequence[Cells], columns: Columns, findings: Findings) -> None:
    """Check that numbered rows are in order, and that none is missing."""
    last: int | None = None
    for number, row in enumerate(rows, start=1):
        cell = columns.cell(row, Quantity.JOINT)
        text = plain(cell.text) if cell else ""
        if cell is None or not re.fullmatch(r"\d{1,6}", text):
            continue
        if last is not None and int(text) != last + 1:
            message = f"this row is numbered {text}, and the one before it {last}"
            findings.wrong(cell, f"row {number}", f"{message}; rows go from the base to the tool, each once")
            return
        last = int(text)


def joint_names(rows: Sequence[Cells], columns: Columns, findings: Findings) -> list[str]:
    """Return a name for every row: the table's where a robot file allows it, else ``joint_1`` and so on."""
    given = [columns.cell(row, Quantity.NAME) or _label(row, columns) for row in rows]
    names = [_name(cell) for cell in given]
    chosen = [name or default_name(index) for index, name in enumerate(names)]
    if len(set(chosen)) < len(chosen):
        findings.note("the names of the joints were left out, since two are the same")
        return [default_name(index) for index in range(len(rows))]
    for cell, name, used in zip(given, names, chosen, strict=True):
        if cell is not None and name is None and cell.text and not _ORDINAL.fullmatch(plain(cell.text)):
            findings.note(f"{shown(cell.text)} is not allowed as the name of a joint: it is called {used}")
    return chosen


def _label(row: Cells, columns: Columns) -> Cell | None:
    """Return the cell of a column for joints, where it holds a name rather than a number or a type."""
    cell = columns.cell(row, Quantity.JOINT)
    if cell is None or plain(cell.text).casefold() in (*TYPES, "", "-") or re.fullmatch(r"\W*\d.*", cell.text):
        return None
    return cell


def _name(cell: Cell | None) -> str | None:
    """Return the name that a cell holds, or None where a robot file does not allow it."""
    text = plain(cell.text).strip(" *") if cell else ""
    return text if text and name_problem(text) is None and not is_reserved(text) else None


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
    read_types(rows, cells, columns, findings)
    check_numbers(cells, columns, findings)
    decide_motion(rows, constants, comma, findings)
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
