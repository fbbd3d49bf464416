"""Denavit-Hartenberg tables to RobotSpecs, with the constants that the text around a table gives."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from types import MappingProxyType
from typing import Final

from dh2sim.errors import Dh2simError, ImportedFileError, RobotError, RobotFileError
from dh2sim.formats.table import conventions, units
from dh2sim.formats.table.constants import find_constants
from dh2sim.formats.table.dh_table import Located, Table
from dh2sim.formats.table.grid import MAX_COLUMNS, MAX_ROWS, Cell, Findings, is_comment
from dh2sim.formats.table.headers import (
    PARAMETERS,
    Columns,
    Quantity,
    find_columns,
)
from dh2sim.formats.table.locate import locate
from dh2sim.formats.table.notation import plain
from dh2sim.formats.table.printout import (
    find_configurations,
    find_poses,
    find_printout,
    given_configurations,
    is_first_line,
    pose_of,
)
from dh2sim.formats.table.rows import Body, ResolvedUnits, is_hayati, read_body, to_row
from dh2sim.messages import loc_of, member, path_of, shown
from dh2sim.robot.fields import name_problem
from dh2sim.robot.links import BaseSpec, Pose, ToolSpec
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit, LengthUnit, Units
from dh2sim.robot.yaml_tree import Report, decode

_COMMA: Final = re.compile(r"\d,\d")
_POINT: Final = re.compile(r"\d\.\d")
_GROUPED: Final = re.compile(r"(?<![\d,])[1-9]\d{0,2},\d{3}(?![\d,])")


def check_shape(table: Table, findings: Findings) -> None:
    """Complain of rows of another length than the heading, and of a table without rows or with too many."""
    first = table.header[0]
    for line, column, message in table.grid.problems:
        findings.wrong_at(line, column, "", message)
    if not table.rows:
        findings.wrong(first, "", "the table has headings and no rows")
    if len(table.rows) > MAX_ROWS:
        findings.wrong(first, "", f"the table has more than {MAX_ROWS} rows")
    if len(table.header) > MAX_COLUMNS:
        findings.wrong(first, "", f"the table has {len(table.header)} columns; at most {MAX_COLUMNS} are allowed")
    for number, row in enumerate(table.rows[:MAX_ROWS], start=1):
        if len(row) != len(table.header):
            cells = "1 cell" if len(row) == 1 else f"{len(row)} cells"
            findings.wrong(row[0], f"row {number}", f"{cells} in a table of {len(table.header)} columns")


def has_decimal_comma(table: Table, columns: Columns, findings: Findings) -> bool:
    """Whether the table's numbers are written with a decimal comma.

    They are where some have a comma between digits and none has a point. A table in which every such comma has
    three digits behind it and no 0 before it may also be one with grouped thousands.
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


_MAX_LISTED: Final = 20
_NO_TABLE: Final = (
    "no table of Denavit-Hartenberg parameters found: none has headings such as theta, d, a and alpha. "
    "Allowed: a table in Markdown, LaTeX, HTML, MediaWiki, CSV, TSV, YAML or JSON, or a printout or a script of the "
    "Robotics Toolbox for Python or MATLAB"
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TableImport:
    """A robot made from a table, and how the table was read."""

    spec: RobotSpec
    units: Units
    """Of the numbers that carry no unit of their own."""
    notes: tuple[str, ...]
    """What was chosen, assumed or left out, one sentence each, for the user to read."""


def read_table(
    data: bytes,
    *,
    file: str,
    name: str,
    convention: Convention | str | None = None,
    angle: AngleUnit | str | None = None,
    length: LengthUnit | str | None = None,
    table: int | None = None,
) -> TableImport:
    """Return the robot that a table of Denavit-Hartenberg parameters describes.

    The table is, unless ``table`` says otherwise, the first one in the text that has at least three of the headings
    theta, d, a, alpha and beta: a Markdown table, values separated by commas, semicolons, tabs or spaces, or what
    Corke's Robotics Toolbox for Python or MATLAB prints for a robot. A script that makes a robot with that toolbox
    is a table too; it is read as text.

    Args:
        data: The file's content, UTF-8.
        file: Its name, for messages; its ending is only a hint.
        name: Of the robot.
        convention: The convention, where the text does not give it.
        angle: The unit of angles that have none of their own; goes before headings.
        length: The unit of lengths that have none of their own; goes before headings.
        table: Number of the table, from 1, where a text has several; by default the first.

    Raises:
        ImportedFileError: There is no table, or it is wrong, or it leaves open what has to be known; the error holds
            everything that is wrong.
        Dh2simError: ``name`` is not allowed as the name of a robot, or there is no table of that number.
    """
    if problem := name_problem(name, "the name of a robot"):
        raise Dh2simError(problem)
    findings = Findings(file)
    try:
        lines = decode(data, Report(file)).split("\n")
    except RobotFileError as error:
        raise ImportedFileError(error.problems) from None
    located = locate(lines, file)
    if not located.tables:
        for line, column, message in located.problems or [(1, 1, _NO_TABLE)]:
            findings.wrong_at(line, column, "", message)
        raise findings.error()
    reader = _Reader(lines, located, _chosen(located.tables, table, findings), findings)
    return reader.read(
        name,
        None if convention is None else member(Convention, convention, "convention"),
        None if angle is None else member(AngleUnit, angle, "angle"),
        None if length is None else member(LengthUnit, length, "length"),
    )


def _chosen(tables: Sequence[Table], number: int | None, findings: Findings) -> Table:
    """Return the table of a number, from 1, or the first."""
    if number is not None and (isinstance(number, bool) or not isinstance(number, int)):
        raise Dh2simError(f"table must be the number of a table, from 1, got {number!r}")
    if number is None:
        if len(tables) > 1:
            findings.note(
                f"the file has {len(tables)} tables, of which the first was read; pass table=2 for the second. "
                f"They are: {_listing(tables)}"
            )
        return tables[0]
    if not 1 <= number <= len(tables):
        has = "the file has only one table" if len(tables) == 1 else f"the file has {len(tables)} tables"
        raise Dh2simError(f"{findings.file}: there is no table {number}; {has}: {_listing(tables)}")
    return tables[number - 1]


def _listing(tables: Sequence[Table]) -> str:
    """Return number, line and headings of every table."""
    shown_of = [
        f"{number} on line {table.lines.start} ({', '.join(cell.text or '-' for cell in table.header[:8])})"
        for number, table in enumerate(tables[:_MAX_LISTED], start=1)
    ]
    rest = len(tables) - len(shown_of)
    return "; ".join([*shown_of, *([f"and {rest} more"] if rest > 0 else [])])


class _Reader:
    """Reads one table."""

    def __init__(self, lines: Sequence[str], located: Located, table: Table, findings: Findings) -> None:
        """Find out what the columns hold.

        Raises:
            ImportedFileError: The columns are ambiguous, or the rows are not all as long as the heading.
        """
        self._lines = lines
        self._located = located
        self._table = table
        self._findings = findings
        self._given = table.given
        self._printout = find_printout(lines, table.lines) if table.given is None else None
        for line, column, message in table.problems:
            findings.wrong_at(line, column, "", message)
        self._columns = find_columns(table.header[:MAX_COLUMNS], table.rows[:MAX_ROWS], findings)
        check_shape(table, findings)
        findings.check()
        for note in table.notes:
            findings.note(note)

    def read(
        self, name: str, convention: Convention | None, angle: AngleUnit | None, length: LengthUnit | None
    ) -> TableImport:
        findings, columns = self._findings, self._columns
        grids = [grid for grid in self._located.pipes if grid is not self._table.grid]
        constants = find_constants(self._lines, self._table, grids)
        comma = has_decimal_comma(self._table, columns, findings)
        body = read_body(self._table, columns, constants, comma=comma, findings=findings)
        used, resolved = self._units(body, angle, length)
        chosen, of_rows = self._conventions(body, convention)
        rows = tuple(
            to_row(row.row, row.numbers, row.limits, resolved, name=row.name, convention=own, findings=findings)
            for row, own in zip(body.rows, of_rows, strict=True)
        )
        self._check_printout(rows)
        findings.check()
        try:
            spec = self._spec(name, rows, chosen, used.length)
        except RobotError as error:
            self._note_wrong(error)
            raise findings.error() from None
        for symbol in body.constants:
            findings.note(f"line {constants[symbol].line} gives {symbol} its value")
        self._note_unread()
        return TableImport(spec=spec, units=used, notes=tuple(findings.notes))

    def _units(self, body: Body, angle: AngleUnit | None, length: LengthUnit | None) -> tuple[Units, ResolvedUnits]:
        """Return the units of numbers that have none of their own."""
        stated_angle, stated_length = units.stated_units(conventions.caption(self._lines, self._table.lines))
        if self._printout and self._printout.in_radians:
            stated_angle = AngleUnit.RAD
        kinds = ((units.ANGLES, angle, stated_angle), (units.LENGTHS, length, stated_length))
        found = {
            kind.what: units.decide_unit(kind, body.numbers(kind), option, stated, self._findings)
            for kind, option, stated in kinds
        }
        used = Units(
            angle=AngleUnit(found[units.ANGLES.what] or AngleUnit.RAD),
            length=LengthUnit(found[units.LENGTHS.what] or LengthUnit.M),
        )
        return used, ResolvedUnits(option={kind.what: option for kind, option, _ in kinds}, default=found)

    def _conventions(self, body: Body, option: Convention | None) -> tuple[Convention, list[Convention]]:
        """Return the table's convention and each row's; a row with beta is a Hayati row."""
        hayati = [option is Convention.HAYATI or is_hayati(row.numbers, self._columns) for row in body.rows]
        if all(hayati):
            return Convention.HAYATI, [Convention.HAYATI] * len(hayati)
        printed = None
        if self._printout is not None:
            printed = conventions.Evidence(self._printout.convention, "the printout's first line")
        elif self._given is not None and self._given.convention is not None:
            printed = conventions.Evidence(self._given.convention, self._given.by)
        lines = self._table.lines
        chosen = conventions.decide_convention(option, printed, self._columns, self._lines, lines, self._findings)
        chosen = chosen or Convention.STANDARD
        return chosen, [Convention.HAYATI if own else chosen for own in hayati]

    def _note_wrong(self, error: RobotError) -> None:
        """Note what is wrong with the robot at the rows of the table."""
        cells = self._table.rows
        for problem in error.problems:
            match loc_of(problem.path):
                case ("joints", int(number), *rest) if number < len(cells):
                    self._findings.wrong(
                        cells[number][0], f"row {number + 1}, {path_of(tuple(rest))}", problem.message
                    )
                case _:
                    self._findings.wrong(self._table.header[0], problem.path, problem.message)

    def _check_printout(self, rows: Sequence[Row]) -> None:
        """Check that the joints of a printout are those that its first line announces."""
        if self._printout is None:
            return
        types = "".join("P" if row.type is JointType.PRISMATIC else "R" for row in rows if row.type.moves)
        if types != self._printout.types:
            message = (
                f"the printout's first line says {self._printout.types}, but the joints of the table are {types}"
            )
            self._findings.wrong(self._table.header[0], "", message)
        self._findings.note("numbers are as printed, and a printout rounds them: poses are no better than its digits")
        if self._printout.in_radians:
            self._findings.note(
                "the toolbox for MATLAB does not print which joints are flipped, and 1.5708 stays 1.5708: write pi/2 "
                "for a right angle"
            )

    def _spec(self, name: str, rows: tuple[Row, ...], convention: Convention, length: LengthUnit) -> RobotSpec:
        table, printout, given, findings = self._table, self._printout, self._given, self._findings
        if given is None:
            around = self._around()
            poses = find_poses(self._lines, table.lines, around, length, findings)
            following = [
                grid for grid in self._located.pipes if grid.lines.start in around and grid is not table.grid
            ]
            configurations = dict(find_configurations(following, rows, findings))
        else:
            units = Units(length=length)
            matrices = (("base", given.base), ("tool", given.tool))
            poses = {key: pose_of(matrix, units) for key, matrix in matrices if matrix is not None}
            configurations = given_configurations(given.configurations, rows, units, findings)
        return RobotSpec(
            name=name,
            rows=rows,
            description=printout.name if printout else given.description if given else "",
            source=f"{PurePath(findings.file).name}, line {table.header[0].line}",
            convention=convention,
            base=BaseSpec(pose=poses.get("base", Pose())),
            tool=ToolSpec.at(poses.get("tool", Pose())),
            configurations=MappingProxyType(configurations),
        )

    def _around(self) -> range:
        """Return the numbers of the lines that may belong to the table: up to other tables and other printouts."""
        around, table = self._located.around(self._table), self._table.lines
        start = around.start
        if start > 1:  # what is behind another table belongs to that one
            start = next((n for n in range(table.start - 1, start - 1, -1) if self._is_first(n)), table.start)
        stop = min(around.stop, len(self._lines) + 1)
        stop = next((number for number in range(table.stop, stop) if self._is_first(number)), stop)
        return range(start, stop)

    def _is_first(self, number: int) -> bool:
        return is_first_line(self._lines[number - 1])

    def _note_unread(self) -> None:
        table = self._table
        behind = range(table.lines.stop, self._around().stop)
        texts = [self._lines[number - 1] for number in behind]
        if (
            table.grid.separator in (",", ";", "\t", " ")
            and self._printout is None
            and any(t.strip() and not is_comment(t) for t in texts)
        ):
            self._findings.note(f"the text after the table, from line {behind.start}, was not read as rows")
