"""A Denavit-Hartenberg table, as people write it -> a robot file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from dh2sim.formats.table.read import read_table
from dh2sim.importing.result import Imported
from dh2sim.importing.serial import robot_name
from dh2sim.importing.source_errors import MADE, errors_of
from dh2sim.kinematics.far_frames import far_frames
from dh2sim.kinematics.frame_assignment.recover import TOLERANCE
from dh2sim.kinematics.frame_assignment.result import Tolerances
from dh2sim.kinematics.frame_assignment.rounding import simple_angle, simple_length
from dh2sim.robot.read import parse_robot
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.robot.write import robot_file_text


def import_table(
    data: bytes,
    *,
    file: str,
    convention: Convention | str | None,
    angle: AngleUnit | str | None = None,
    length: LengthUnit | str | None = None,
    table: int | None = None,
    name: str | None = None,
    tolerance: float = TOLERANCE,
    folder: Path | None = None,
) -> Imported:
    """Make a robot file of a Denavit-Hartenberg table in Markdown, CSV, TSV or a toolbox's printout.

    Args:
        data: The file's content.
        file: Its name, for messages and for the robot's name; '-' for standard input.
        convention: Of the table, where it does not say.
        angle: Unit of its angles, where it does not say.
        length: Unit of its lengths, where it does not say.
        table: Number of the table, from 1, where the file has several; by default the first.
        name: Of the robot.
        tolerance: Where it is greater than the default, numbers within it of a simple one are made simple, rad and m.
        folder: Of the robot file, to which paths of meshes are relative.

    Raises:
        ImportedFileError: The table is wrong, or leaves open what has to be known.
        Dh2simError: There is no table of that number, or no such convention or unit.
    """
    own_name = robot_name(Path(file).stem if name is None else name)
    read = read_table(data, file=file, name=own_name, convention=convention, angle=angle, length=length, table=table)
    spec = read.spec
    if not spec.source:
        origin = "standard input" if file == "-" else Path(file).name
        spec = replace(spec, source=f"The table in {origin}, as dh2sim read it.")
    notes = [_sentence(note) for note in read.notes]
    if tolerance > TOLERANCE:
        spec = _simpler(spec, Tolerances(angle=tolerance, length=tolerance, reach=1.0))
        notes.append(f"Numbers within {tolerance:g} rad or m of a simple one were made simple.")
    far = far_frames(spec)
    if far.frames:
        notes.append(
            f"{far.sentence} 'dh2sim convert {spec.name}.yaml --to compact' rewrites the table without them."
        )
    header = [f"Note: {note}" for note in notes]
    text = robot_file_text(spec, header=header, folder=folder, angle=read.units.angle, length=read.units.length)
    with errors_of(file):
        made = parse_robot(text, file=MADE, directory=folder)
    return Imported(text=text, spec=made, notes=tuple(notes))


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
