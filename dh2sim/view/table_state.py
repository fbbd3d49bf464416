"""The table as it is typed, and the robot that its text describes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from dh2sim.errors import Dh2simError, RobotFileError
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.edit import Cell, can_be_edited, unit_words, with_cells, written_cells
from dh2sim.robot.read import parse_robot
from dh2sim.robot.spec import AngleUnit, LengthUnit, RobotSpec, Units
from dh2sim.robot.write import robot_file_text
from dh2sim.view.state import COLUMNS, CONVENTION, Complaint, Draft, DraftRow

LONGEST_CELL: Final = 200
"""Characters that may be typed into a cell."""
GREATEST_REACH: Final = 1e6
"""m: larger robots cannot be drawn in single precision."""
MOST_UPLOADED: Final = 200
"""Joints, and configurations that have names, of a robot whose file was uploaded."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Source:
    """What a robot file's text needs besides itself to be read."""

    file: str
    """Its name, for messages."""
    folder: Path | None
    """Where paths in it start; None where it has no folder: then it may name no files."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wrong:
    """Why a text describes no robot: a message for each place, such as ``joints[2].alpha``."""

    messages: Mapping[str, str]
    lines: tuple[str, ...] = ()
    """All of them as the reader tells them, with lines and columns, where it is the reader who complains."""

    @property
    def told(self) -> str:
        """All that is wrong, a line for each."""
        return "\n".join(self.lines) or self.first

    @property
    def first(self) -> str:
        """The first message, with its place."""
        return next((f"{path}: {message}" if path else message for path, message in self.messages.items()), "")


def read(text: str | bytes, source: Source) -> RobotModel | Wrong:
    """Return the robot that a text describes, or why it describes none that can be shown."""
    try:
        spec = parse_robot(text, file=source.file, directory=source.folder, mesh_files=source.folder is not None)
        if source.folder is None and (long := _too_much(spec)):
            return Wrong(messages={"": f"{source.file}: {long}"})
        model = build_model(spec)
    except RobotFileError as error:
        messages = {problem.path: problem.message for problem in reversed(error.problems)}
        return Wrong(messages=messages, lines=tuple(str(problem) for problem in error.problems))
    except Dh2simError as error:
        return Wrong(messages={"": str(error)})
    except (OverflowError, ZeroDivisionError, ValueError):
        return Wrong(messages={"": "numbers so large that nothing can be computed with them"})
    if not model.reach <= GREATEST_REACH:
        return Wrong(
            messages={"": f"the robot would reach {model.reach:.3g} m; at most {GREATEST_REACH:g} m are shown"}
        )
    return model


def _too_much(spec: RobotSpec) -> str:
    """Return why a robot of somebody else is not even built: it would keep this machine busy for long."""
    for what, count in {"joints": len(spec.rows), "configurations": len(spec.configurations)}.items():
        if count > MOST_UPLOADED:
            return f"the robot has {count} {what}; at most {MOST_UPLOADED} are shown of one that was uploaded"
    return ""


def editable_text(spec: RobotSpec, source: Source) -> str:
    """Return a robot's own text, or where cells of that do not stand for themselves, one written anew."""
    own = None if spec.source_file is None else spec.source_file.text
    if own is not None and can_be_edited(own):
        return own
    units = Units() if own is None else units_of(own)
    return robot_file_text(spec, folder=source.folder, angle=units.angle, length=units.length)


def units_of(text: str) -> Units:
    """Return the units of a robot file's text that is right."""
    words = unit_words(text)
    return Units(angle=AngleUnit(words.get("angle", "rad")), length=LengthUnit(words.get("length", "m")))


def draft_of(text: str, spec: RobotSpec, complaints: tuple[Complaint, ...] = ()) -> Draft:
    """Return the table of a text, with what is typed into cells that are wrong in their places."""
    typed = {(found.row, found.column): found.text for found in complaints}
    rows = tuple(
        DraftRow(
            name=row.name,
            type=row.type,
            convention=row.convention,
            cells=tuple(typed.get((i, column), written.get(column, "0")) for column in COLUMNS),
        )
        for i, (row, written) in enumerate(zip(spec.rows, written_cells(text), strict=True))
    )
    return Draft(rows=rows, convention=spec.convention, units=units_of(text), complaints=complaints)


def too_long(cells: Mapping[Cell, str]) -> Wrong | None:
    """Return what is wrong where a text is too long to be looked at."""
    messages = {
        path_of_cell(cell): f"{len(text)} characters; at most {LONGEST_CELL} are allowed"
        for cell, text in cells.items()
        if len(text) > LONGEST_CELL
    }
    return Wrong(messages=messages) if messages else None


def try_cells(text: str, cells: Mapping[Cell, str | None], source: Source) -> tuple[str, RobotModel] | Wrong:
    """Return the text with other cells and the robot that it describes, or what is wrong."""
    changed = with_cells(text, cells)
    result = read(changed, source)
    return result if isinstance(result, Wrong) else (changed, result)


def complaints_of(cells: Mapping[Cell, str], wrong: Wrong) -> tuple[Complaint, ...]:
    """Return a complaint for each of the cells that messages are about; for all of them where they are about none."""
    found = {cell: wrong.messages.get(path_of_cell(cell)) for cell in cells if cell[0] is not None}
    if not any(found.values()):
        found = dict.fromkeys(found, wrong.first)
    return tuple(
        Complaint(row=row, column=column, text=cells[row, column], message=message)
        for (row, column), message in found.items()
        if message and row is not None and column in (*COLUMNS, CONVENTION)
    )


def path_of_cell(cell: Cell) -> str:
    """Return how messages name the place of a cell."""
    row, column = cell
    return f"joints[{row}].{column}" if row is not None else column
