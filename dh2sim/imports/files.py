"""Files of other formats to robot files: which reader a file needs, and what it is given."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dh2sim.errors import Dh2simError
from dh2sim.formats.serial_robot import SerialRobot
from dh2sim.imports.imported import Imported
from dh2sim.imports.serial import import_serial
from dh2sim.kinematics.assignment.recover import TOLERANCE
from dh2sim.robot.spec import Convention
from dh2sim.robot.units import AngleUnit, LengthUnit

STDIN = "-"
MOST_BYTES = 50_000_000
_ROOT = re.compile(rb"<\s*([A-Za-z_][\w:.-]*)")
_HIDDEN = re.compile(rb"<\?.*?\?>|<!--.*?-->|<![^>]*>", re.DOTALL)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportOptions:
    """What an import is asked for."""

    base: str | None = None
    """Link or body that becomes base_link; by default the root."""
    tip: str | None = None
    """Link, body or site that becomes tool0; by default where the arm ends."""
    convention: Convention | None = None
    """Of the table to make (default standard), or that a table to read is in."""
    angle: AngleUnit | None = None
    """Of a table's angles, where the table does not say."""
    length: LengthUnit | None = None
    """Of a table's lengths, where the table does not say."""
    tolerance: float = TOLERANCE
    """Greatest residual, rad, and m for a reach of up to 1 m, then of the reach."""
    package_paths: Sequence[Path] = ()
    """Folders in which ``package://`` is looked for first."""
    name: str | None = None
    """Of the robot, instead of the file's."""


def import_robot(path: Path, options: ImportOptions = ImportOptions(), *, folder: Path | None = None) -> Imported:
    """Make a robot file of a URDF, an MJCF or a Denavit-Hartenberg table.

    Args:
        path: The file; its content says what it is.
        options: What is asked for.
        folder: Where the robot file will stand, which paths of meshes are relative to; by default they are absolute.

    Raises:
        ImportedFileError: The file is wrong, or says too little.
        MismatchError: The table that was made is not the file's kinematics to within the tolerance.
        Dh2simError: The file cannot be read, or is of another format.
    """
    return import_data(read_file(path), str(path), options, folder=folder)


def read_file(path: Path) -> bytes:
    """Return a file's content.

    Raises:
        Dh2simError: It cannot be read, or is too large.
    """
    try:
        with path.open("rb") as stream:
            data = stream.read(MOST_BYTES + 1)
    except OSError as error:
        raise Dh2simError(f"{path}: cannot be read: {error.strerror or error}") from error
    if len(data) > MOST_BYTES:
        raise Dh2simError(f"{path}: has more than {MOST_BYTES} bytes, the most that is read")
    return data


def import_data(data: bytes, file: str, options: ImportOptions, *, folder: Path | None = None) -> Imported:
    """As ``import_robot``, for content that was read already; ``file`` is its path, or '-' for standard input."""
    root = _root_element(data)
    match root:
        case "robot":
            return _serial(_read_urdf(data, file, options), data, options, folder)
        case "mujoco" | "mujocoinclude":
            return _serial(_read_mjcf(file, options), data, options, folder)
        case None:
            return _table(data, file, options, folder)
        case _:
            hint = " Convert it to URDF first." if root == "sdf" else ""
            raise Dh2simError(
                f"{file}: a file of <{root}> is not read. Read are URDF (<robot>), MJCF (<mujoco>), and tables in "
                f"Markdown, CSV or TSV.{hint}"
            )


def _root_element(data: bytes) -> str | None:
    """Return the name of an XML file's outermost element; None for what is no XML."""
    text = data.removeprefix(b"\xef\xbb\xbf").lstrip()
    if text[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", "replace").encode().lstrip(b"\xef\xbb\xbf \t\r\n")
    if not text.startswith(b"<"):
        return None
    found = _ROOT.search(_HIDDEN.sub(b"", text[:1_000_000]))
    return found.group(1).decode("ascii", "replace") if found else "robot"


def _read_urdf(data: bytes, file: str, options: ImportOptions) -> SerialRobot:
    from dh2sim.formats.from_urdf.reader import read_urdf
    from dh2sim.formats.mesh_paths import mesh_finder

    _refuse_units(file, "URDF", options)
    directory = Path.cwd() if file == STDIN else Path(file).parent
    find_mesh = mesh_finder(directory, options.package_paths)
    return read_urdf(data, file=file, base=options.base, tip=options.tip, find_mesh=find_mesh)


def _read_mjcf(file: str, options: ImportOptions) -> SerialRobot:
    if file == STDIN:
        raise Dh2simError("an MJCF is read from a file, not from standard input: it may include others")
    from dh2sim.formats.from_mjcf.reader import read_mjcf

    _refuse_units(file, "MJCF", options)
    return read_mjcf(Path(file), file=file, base=options.base, tip=options.tip)


def _refuse_units(file: str, kind: str, options: ImportOptions) -> None:
    if options.angle is not None or options.length is not None:
        raise Dh2simError(f"{file}: --angle and --length are for tables; this is {kind}, which has its own units")


def _serial(robot: SerialRobot, data: bytes, options: ImportOptions, folder: Path | None) -> Imported:
    return import_serial(
        robot,
        convention=options.convention or Convention.STANDARD,
        tolerance=options.tolerance,
        folder=folder,
        name=options.name,
        source=f"{robot.description} (SHA-256 {hashlib.sha256(data).hexdigest()[:16]}…).",
    )


def _table(data: bytes, file: str, options: ImportOptions, folder: Path | None) -> Imported:
    from dh2sim.imports.tables import import_table

    if options.base is not None or options.tip is not None:
        raise Dh2simError(f"{file}: --base and --tip are for URDF and MJCF; this is read as a table, without links")
    return import_table(
        data,
        file=file,
        convention=options.convention,
        angle=options.angle,
        length=options.length,
        name=options.name,
        tolerance=options.tolerance,
        folder=folder,
    )
