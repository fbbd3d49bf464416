"""Robots in any form: names, robot files, lists of axes, URDFs, MJCFs, tables, makers' calibrations."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

from dh2sim.formats.calibration import is_calibration
from dh2sim.importing.axes import import_axes
from dh2sim.importing.source_errors import errors_of
from dh2sim.importing.sources import STDIN, ImportOptions, import_data, read_file
from dh2sim.kinematics.chain import serial_spec_of
from dh2sim.robot.axes_file import read_axes
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.spec import RobotSpec, SpecLike

PLAINLY = ImportOptions()
"""As a file says itself."""
_AXES = re.compile(rb"^axes\s*:", re.MULTILINE)
_JOINTS = re.compile(rb"^joints\s*:", re.MULTILINE)
_XML_OR_TABLE = (b"<", b"|")


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadRobot:
    """A serial robot, and what was chosen or left out when it was read."""

    spec: RobotSpec
    notes: tuple[str, ...] = ()


def read_any(
    source: SpecLike | str | os.PathLike[str], options: ImportOptions = PLAINLY, *, strangers: bool = False
) -> ReadRobot:
    """Return a serial robot of whatever describes one.

    Args:
        source: A robot; the name of one that comes with dh2sim; or a file: a robot file, a list of axes, a URDF, an
            MJCF, a Denavit-Hartenberg table or a maker's calibration. '-' reads standard input, which may be any of
            them but an MJCF.
        options: Which part of a file to import, and how; robot files need none.
        strangers: Whether a robot file is a stranger's, and may name no other files.

    Raises:
        Dh2simError: The file is wrong, or its robot has closed loops or branches.
    """
    if not isinstance(source, str | os.PathLike):
        return ReadRobot(spec=serial_spec_of(source))
    file = os.fspath(source)
    path = Path(file)
    if file != STDIN and (not path.exists() or path.is_dir()):
        return ReadRobot(spec=serial_spec_of(load_robot(file)))  # a name, or the message for what is not there
    data = read_file(path)
    if not data.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(_XML_OR_TABLE) and not is_calibration(data):
        folder = Path.cwd() if file == STDIN else path.parent
        if _JOINTS.search(data):
            return ReadRobot(
                spec=serial_spec_of(parse_robot(data, file=file, directory=folder, mesh_files=not strangers))
            )
        if _AXES.search(data):
            with errors_of(file):
                axes = read_axes(data, file=file, directory=folder)
                imported = import_axes(axes)
            return ReadRobot(spec=imported.spec, notes=imported.notes)
        if path.suffix.lower() in (".yaml", ".yml"):
            return ReadRobot(
                spec=serial_spec_of(parse_robot(data, file=file, directory=folder, mesh_files=not strangers))
            )
    imported = import_data(data, file, options)
    return ReadRobot(spec=serial_spec_of(imported.spec), notes=imported.notes)
