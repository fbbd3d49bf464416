"""The table as typed, and the robot that its text describes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from dh2sim.errors import Dh2simError, RobotFileError
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.edit import (
    PARAMETERS,
    Cell,
    can_be_edited,
    unit_words,
    with_cells,
    written_cells,
    written_parameters,
)
from dh2sim.robot.read import parse_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit, LengthUnit, Units
from dh2sim.robot.write import robot_file_text
from dh2sim.view.state import COLUMNS, CONVENTION, CellError, TableRow, TableState

MAX_CELL_LENGTH: Final = 200
"""Characters that may be typed into a cell."""
MAX_REACH: Final = 1e6
"""m: larger robots cannot be drawn in single precision."""
MAX_UPLOADED: Final = 200
"""Joints, and named configurations, of an uploaded robot file."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Source:
    """Where a robot file's text comes from."""

    file: str
    """Its name, for messages."""
    folder: Path | None
    """Where paths in it start; None without a folder: then it may name no files."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Invalid:
    """The errors of a text that describes no robot: a message for each place, such as ``joints[2].alpha``."""

    messages: Mapping[str, str]
    lines: tuple[str, ...] = ()
    """All messages of the robot file's reader with lines and columns; empty for other errors."""

    @property
    def text(self) -> str:
        """All messages, one line each."""
        return "\n".join(self.lines) or self.first

    @property
    def first(self) -> str:
        """The first message, with its place."""
        return next((f"{path}: {message}" if path else message for path, message in self.messages.items()), "")


def read(text: str | bytes, source: Source) -> RobotModel | Invalid:
    """Return the robot that a text describes, or the errors if it describes none that can be shown."""
    try:
        spec = parse_robot(text, file=source.file, directory=source.folder, mesh_files=source.folder is not None)
        if source.folder is None and (long := _too_much(spec)):
            return Invalid(messages={"": f"{source.file}: {long}"})
        model = build_model(spec)
    except RobotFileError as error:
        messages = {problem.path: problem.message for problem in reversed(error.problems)}
        return Invalid(messages=messages, lines=tuple(str(problem) for problem in error.problems))
    except Dh2simError as error:
        return Invalid(messages={"": str(error)})
    except (OverflowError, ZeroDivisionError, ValueError):
        return Invalid(messages={"": "the numbers are too large to compute with"})
    if not model.extent <= MAX_REACH:
        return Invalid(
            messages={"": f"the robot's frames reach {model.extent:.3g} m; at most {MAX_REACH:g} m can be shown"}
        )
    return model


def _too_much(spec: RobotSpec) -> str:
    """Return why an uploaded robot is not even built: it would keep this machine busy for long."""
    for what, count in {"joints": len(spec.rows), "configurations": len(spec.configurations)}.items():
        if count > MAX_UPLOADED:
            return f"the robot has {count} {what}; at most {MAX_UPLOADED} are allowed in an uploaded file"
    return ""


def editable_text(spec: RobotSpec, source: Source) -> str:
    """Return a robot's own text, or a newly written one if cells of that cannot be edited."""
    own = None if spec.source_file is None else spec.source_file.text
    if own is not None and can_be_edited(own):
        return own
    units = Units() if own is None else units_of(own)
    return robot_file_text(spec, folder=source.folder, angle=units.angle, length=units.length)


def units_of(text: str) -> Units:
    """Return the units of a valid robot file's text."""
    words = unit_words(text)
    return Units(angle=AngleUnit(words.get("angle", "rad")), length=LengthUnit(words.get("length", "m")))


def table_state_of(text: str, spec: RobotSpec, errors: tuple[CellError, ...] = ()) -> TableState:
    """Return the table of a text; cells with errors show what was typed."""
    typed = {(found.row, found.column): found.text for found in errors}
    rows = tuple(
        TableRow(
            name=row.name,
            type=row.type,
            convention=row.convention,
            cells=tuple(typed.get((i, column), written.get(column, "0")) for column in COLUMNS),
        )
        for i, (row, written) in enumerate(zip(spec.rows, written_cells(text), strict=True))
    )
    parameters = {name: typed.get((PARAMETERS, name), written) for name, written in written_parameters(text).items()}
    return TableState(
        rows=rows, convention=spec.convention, units=units_of(text), parameters=parameters, errors=errors
    )


def too_long(cells: Mapping[Cell, str]) -> Invalid | None:
    """Return the errors of cells that are too long to be read."""
    messages = {
        path_of_cell(cell): f"{len(text)} characters; at most {MAX_CELL_LENGTH} are allowed"
        for cell, text in cells.items()
        if len(text) > MAX_CELL_LENGTH
    }
    return Invalid(messages=messages) if messages else None


def try_cells(text: str, cells: Mapping[Cell, str | None], source: Source) -> tuple[str, RobotModel] | Invalid:
    """Return the text with other cells and the robot that it describes, or the errors."""
    changed = with_cells(text, cells)
    result = read(changed, source)
    return result if isinstance(result, Invalid) else (changed, result)


def cell_errors(cells: Mapping[Cell, str], invalid: Invalid) -> tuple[CellError, ...]:
    """Return the errors of those cells that messages are about; if they are about none, of all cells."""
    found = {cell: invalid.messages.get(path_of_cell(cell)) for cell in cells if cell[0] is not None}
    if not any(found.values()):
        found = dict.fromkeys(found, invalid.first)
    return tuple(
        CellError(row=row, column=column, text=cells[row, column], message=message)
        for (row, column), message in found.items()
        if message and row is not None and (row == PARAMETERS or column in (*COLUMNS, CONVENTION))
    )


def path_of_cell(cell: Cell) -> str:
    """Return the place of a cell as in messages."""
    row, column = cell
    if row is None:
        return column
    return f"joints[{row}].{column}" if isinstance(row, int) else f"{row}.{column}"
