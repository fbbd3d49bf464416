"""Tables as people write them to robot files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from dh2sim.formats.tables.read import read_table
from dh2sim.imports.imported import Imported
from dh2sim.imports.names import robot_name
from dh2sim.kinematics.assignment.recover import TOLERANCE
from dh2sim.kinematics.assignment.simple import simple_angle, simple_length
from dh2sim.kinematics.assignment.tolerances import Tolerances
from dh2sim.robot.load import parse_robot
from dh2sim.robot.spec import Convention, RobotSpec
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.robot.writing.robot_file import robot_file_text


def import_table(
    data: bytes,
    *,
    file: str,
    convention: Convention | None = None,
    angle: AngleUnit | None = None,
    length: LengthUnit | None = None,
    name: str | None = None,
    tolerance: float = TOLERANCE,
    folder: Path | None = None,
) -> Imported:
    """Make a robot file of a Denavit-Hartenberg table in Markdown, CSV, TSV or a toolbox's printout.

    Args:
        data: The file's content.
        file: Its name, for messages and for the robot's name; '-' for standard input.
        convention: That the table is in, where it does not say.
        angle: Unit of its angles, where it does not say.
        length: Unit of its lengths, where it does not say.
        name: Of the robot.
        tolerance: Where it is greater than the default, numbers within it of a simple one are made simple, rad and m.
        folder: Where the robot file will stand.

    Raises:
        ImportedFileError: The table is wrong, or says too little.
    """
    own_name = robot_name(Path(file).stem if name is None else name)
    read = read_table(data, file=file, name=own_name, convention=convention, angle=angle, length=length)
    spec = read.spec
    if not spec.source:
        origin = "standard input" if file == "-" else Path(file).name
        spec = replace(spec, source=f"The table in {origin}, as dh2sim read it.")
    notes = [_sentence(note) for note in read.notes]
    if tolerance > TOLERANCE:
        spec = _simpler(spec, Tolerances(angle=tolerance, length=tolerance, reach=1.0))
        notes.append(f"Numbers within {tolerance:g} rad or m of a simple one were made simple.")
    header = [f"Note: {note}" for note in notes]
    text = robot_file_text(spec, header=header, folder=folder, angle=read.units.angle, length=read.units.length)
    return Imported(text=text, spec=parse_robot(text, file="the robot file", directory=folder), notes=tuple(notes))


def _sentence(note: str) -> str:
    return f"{note[0].upper()}{note[1:]}{'' if note.endswith('.') else '.'}"


def _simpler(spec: RobotSpec, tolerances: Tolerances) -> RobotSpec:
    rows = [
        replace(
            row,
            a=simple_length(row.a, tolerances),
            alpha=simple_angle(row.alpha, tolerances),
            d=simple_length(row.d, tolerances),
            theta=simple_angle(row.theta, tolerances),
        )
        for row in spec.rows
    ]
    return replace(spec, rows=tuple(rows))
