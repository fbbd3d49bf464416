"""Robot files from other sources: a URDF, an MJCF, a table as people write it, or a calibration file."""

from __future__ import annotations

import hashlib
import math
import os
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from dh2sim.arguments import file_path, file_paths, instance, mapping, number, text
from dh2sim.errors import Dh2simError
from dh2sim.formats.calibration import is_calibration
from dh2sim.formats.serial_robot import SerialRobot
from dh2sim.formats.xml_read import Element
from dh2sim.importing.result import Imported
from dh2sim.importing.serial import import_serial
from dh2sim.importing.source_errors import errors_of
from dh2sim.importing.table import import_table
from dh2sim.input_files import read_input
from dh2sim.kinematics.frame_assignment.recover import TOLERANCE
from dh2sim.messages import Choice, member, shown
from dh2sim.robot.read import loaded
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import SpecLike, spec_of
from dh2sim.robot.units import AngleUnit, LengthUnit

STDIN = "-"
_NO_HAYATI = "a table is made in the standard or the modified convention; Hayati rows are used where they are needed"
MAX_BYTES = 50_000_000
_ROOT = re.compile(rb"<\s*([A-Za-z_][\w:.-]*)")
_XML_NAMES = (".xml", ".urdf", ".xacro", ".sdf", ".mjcf", ".dae")
_HIDDEN = re.compile(rb"<\?.*?\?>|<!--.*?-->|<![^>]*>", re.DOTALL)


def _choice(kind: type[Choice], value: Choice | str | None, what: str) -> Choice | None:
    return None if value is None else member(kind, value, what)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportOptions:
    """Which part of a file to import, and how."""

    base: str | None = None
    """Link or body that becomes base_link; by default the root."""
    tip: str | None = None
    """Link, body or site that becomes tool0; by default where the arm ends."""
    convention: Convention | str | None = None
    """Of the table to make (default standard), or of the table to read where it does not say."""
    angle: AngleUnit | str | None = None
    """Unit of a table's angles, where the table does not say."""
    length: LengthUnit | str | None = None
    """Unit of a table's lengths, where the table does not say."""
    table: int | None = None
    """Number of the table to read, from 1, where a file has several; by default the first."""
    tolerance: float = TOLERANCE
    """Greatest residual, rad, and m for a reach of up to 1 m, then of the reach."""
    package_paths: Sequence[str | os.PathLike[str]] = ()
    """Folders, or the path of one, in which ``package://`` is looked for first."""
    root: str | os.PathLike[str] | None = None
    """Folder outside of which an MJCF or a xacro file includes no file; by default the file's own. Meshes in it are
    used, too."""
    arguments: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    """Values of a xacro file's arguments, by name."""
    nominal: SpecLike | str | os.PathLike[str] | None = None
    """The robot as its maker designed it, which a calibration file is of: a robot, a robot file, or the name of one
    that comes with dh2sim."""
    name: str | None = None
    """Of the robot, instead of the file's."""

    def __post_init__(self) -> None:
        """Take names for members of enumerations, and one folder for several.

        Raises:
            Dh2simError: An option has a value that is not allowed.
        """
        given = mapping("arguments", self.arguments).items()
        changed: dict[str, Any] = {
            "convention": _choice(Convention, self.convention, "convention"),
            "angle": _choice(AngleUnit, self.angle, "angle"),
            "length": _choice(LengthUnit, self.length, "length"),
            "arguments": MappingProxyType({name: str(value) for name, value in given}),
            "package_paths": tuple(file_paths("package_paths", self.package_paths)),
            "root": None if self.root is None else file_path("root", self.root),
        }
        for name, value in changed.items():
            object.__setattr__(self, name, value)
        if not 0.0 < number("tolerance", self.tolerance) < math.inf:
            raise Dh2simError(f"tolerance must be a positive number, got {self.tolerance!r}")
        for what in ("base", "tip", "name"):
            if (value := getattr(self, what)) is not None:
                text(what, value)


def import_robot(
    path: str | os.PathLike[str], options: ImportOptions = ImportOptions(), *, folder: Path | None = None
) -> Imported:
    """Make a robot file of a URDF, an MJCF, a Denavit-Hartenberg table or a maker's calibration file.

    Args:
        path: The file; its content says what it is.
        options: Which part of it, and how.
        folder: Of the robot file, to which paths of meshes are relative; by default they are absolute.

    Raises:
        ImportedFileError: The file is wrong, or leaves open what has to be known.
        MismatchError: The table that was made is not the file's kinematics to within the tolerance.
        Dh2simError: The file cannot be read, or is of another format.
    """
    instance("options", options, ImportOptions)
    file = os.fspath(file_path("path", path))
    return import_data(read_file(Path(file)), file, options, folder=folder)


def read_file(path: Path) -> bytes:
    """Return a file's content, or that of standard input for '-'.

    Raises:
        Dh2simError: It cannot be read, or is too large.
    """
    try:
        data = sys.stdin.buffer.read(MAX_BYTES + 1) if os.fspath(path) == STDIN else read_input(path, MAX_BYTES)
    except OSError as error:
        raise Dh2simError(f"{path}: cannot be read: {error.strerror or error}") from error
    if len(data) > MAX_BYTES:
        raise Dh2simError(f"{path}: more than {MAX_BYTES} bytes, the most that is read")
    return data


def import_data(data: bytes, file: str, options: ImportOptions, *, folder: Path | None = None) -> Imported:
    """Import content that was read already, as ``import_robot``; ``file`` is its path, or '-' for standard input."""
    root = _root_element(data, file)
    if root is None and is_calibration(data):
        return _calibration(data, file, options, folder)
    if options.nominal is not None:
        raise Dh2simError(f"{file}: nominal is for makers' calibration files; this is not one")
    if root is None and file.lower().endswith((".yaml", ".yml")):
        _refuse_yaml(data, file)
    match root:
        case "robot":
            return _serial(_read_urdf(data, file, options), data, file, options, folder)
        case "mujoco" | "mujocoinclude":
            return _serial(_read_mjcf(file, options), data, file, options, folder)
        case None:
            return _table(data, file, options, folder)
        case _:
            hint = " Convert it to URDF first." if root == "sdf" else ""
            raise Dh2simError(
                f"{file}: a file of <{root}> cannot be imported. Allowed: URDF (<robot>), MJCF (<mujoco>), and "
                f"tables in Markdown, CSV or TSV.{hint}"
            )


def read_arm(path: str | os.PathLike[str], options: ImportOptions = ImportOptions()) -> SerialRobot:
    """Return the arm that a URDF or an MJCF describes, as ``import_robot`` reads it.

    Raises:
        ImportedFileError: The file is wrong, or holds no such arm.
        Dh2simError: The file cannot be read, or is of another format.
    """
    file = os.fspath(path)
    data = read_file(Path(file))
    match _root_element(data, file):
        case "robot":
            return _read_urdf(data, file, options)
        case "mujoco" | "mujocoinclude":
            return _read_mjcf(file, options)
        case _:
            raise Dh2simError(f"{file}: must be a URDF or an MJCF, which have masses")


def _refuse_yaml(data: bytes, file: str) -> None:
    if re.search(rb"^joints\s*:", data, re.MULTILINE):
        raise Dh2simError(f"{file}: this is a robot file already, and needs no import")
    if re.search(rb"^axes\s*:", data, re.MULTILINE):
        raise Dh2simError(f"{file}: this lists joint axes; 'dh2sim frames' makes a robot file of them")


def _root_element(data: bytes, file: str) -> str | None:
    """Return the name of an XML file's outermost element; None for what is not XML, such as Markdown after HTML."""
    text = data.lstrip(b"\xef\xbb\xbf \t\r\n")
    if text[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", "replace").encode().lstrip(b"\xef\xbb\xbf \t\r\n")
    if not text.startswith(b"<"):
        return None
    xml = text.startswith(b"<?xml") or file.lower().endswith(_XML_NAMES)
    found = _ROOT.match(_HIDDEN.sub(b"", text[:1_000_000]).lstrip())
    root = found.group(1).decode("ascii", "replace") if found else "robot"
    known = found is not None and root in ("robot", "mujoco", "mujocoinclude", "sdf")
    return root if known or xml else None


def _read_urdf(data: bytes, file: str, options: ImportOptions) -> SerialRobot:
    from dh2sim.formats.mesh_paths import mesh_finder
    from dh2sim.formats.urdf.read import read_urdf
    from dh2sim.formats.xml_read import parse_xml

    _refuse_units(file, "URDF", options)
    directory = Path.cwd() if file == STDIN else Path(file).parent
    find_mesh = mesh_finder(directory, [Path(folder) for folder in options.package_paths], _root(file, options))
    element, notes = _expanded(parse_xml(data, file=file), data, file, options)
    robot = read_urdf(element, file=file, base=options.base, tip=options.tip, find_mesh=find_mesh)
    return replace(robot, notes=(*notes, *robot.notes))


def _expanded(robot: Element, data: bytes, file: str, options: ImportOptions) -> tuple[Element, list[str]]:
    """Return the root element of a URDF, expanded by xacro where that is needed, and notes."""
    from dh2sim.formats.xacro import expand, unexpanded

    if unexpanded(robot) is None:
        if options.arguments:
            raise Dh2simError(f"{file}: arguments are for xacro files; this one needs no xacro")
        return robot, []
    path = Path("standard_input.xacro" if file == STDIN else file)
    expanded = expand(data, file=file, path=path, root=_root(file, options), arguments=options.arguments)
    return expanded.robot, [f"xacro says: {message}" for message in expanded.messages]


def _read_mjcf(file: str, options: ImportOptions) -> SerialRobot:
    if file == STDIN:
        raise Dh2simError("an MJCF is read from a file, not from standard input: it may include others")
    from dh2sim.formats.mjcf.read import read_mjcf

    _refuse_units(file, "MJCF", options)
    return read_mjcf(Path(file), file=file, base=options.base, tip=options.tip, root=_root(file, options))


def _root(file: str, options: ImportOptions) -> Path | None:
    """Return the folder outside of which no file is read, where the options name one.

    Raises:
        Dh2simError: It is not a folder, or does not hold the file.
    """
    if options.root is None:
        return None
    root = Path(options.root)
    if not root.is_dir():
        raise Dh2simError(f"{root}: no such folder, to read files in and below it")
    if file != STDIN and not Path(os.path.normpath(Path(file).absolute())).is_relative_to(
        os.path.normpath(root.absolute())
    ):
        raise Dh2simError(f"{file}: not in the folder {shown(str(root))}, in and below which files are read")
    return root


def _refuse_units(file: str, kind: str, options: ImportOptions) -> None:
    if options.angle is not None or options.length is not None:
        raise Dh2simError(f"{file}: angle and length are units of tables; this is {kind}, which has its own units")
    if options.table is not None:
        raise Dh2simError(f"{file}: table is the number of a table in a text; this is {kind}")


def _serial(robot: SerialRobot, data: bytes, file: str, options: ImportOptions, folder: Path | None) -> Imported:
    if options.convention is Convention.HAYATI:
        raise Dh2simError(_NO_HAYATI)
    given = ", ".join(f"{name}:={value}" for name, value in options.arguments.items())
    expanded = f", expanded by xacro with {given}" if given else ""
    with errors_of(file, data, [joint.name for joint in robot.chain.joints]):
        return import_serial(
            robot,
            convention=_choice(Convention, options.convention, "convention") or Convention.STANDARD,
            tolerance=options.tolerance,
            folder=folder,
            name=options.name,
            source=f"{robot.description}{expanded} (SHA-256 {hashlib.sha256(data).hexdigest()[:16]}…).",
        )


def _calibration(data: bytes, file: str, options: ImportOptions, folder: Path | None) -> Imported:
    from dh2sim.importing.calibration import import_calibration

    _refuse_units(file, "a maker's calibration", options)
    if options.base is not None or options.tip is not None:
        raise Dh2simError(f"{file}: base and tip are links of a URDF or an MJCF; this is a maker's calibration")
    if options.convention is Convention.HAYATI:
        raise Dh2simError(_NO_HAYATI)
    given = options.nominal
    nominal = None if given is None else spec_of(loaded(given))
    called = "standard input" if file == STDIN else Path(file).name
    with errors_of(file):
        return import_calibration(
            data,
            file=file,
            nominal=nominal,
            convention=_choice(Convention, options.convention, "convention"),
            tolerance=options.tolerance,
            name=options.name,
            folder=folder,
            origin=f"Calibration in {called} (SHA-256 {hashlib.sha256(data).hexdigest()[:16]}…)",
        )


def _table(data: bytes, file: str, options: ImportOptions, folder: Path | None) -> Imported:
    if options.base is not None or options.tip is not None:
        raise Dh2simError(
            f"{file}: base and tip are links of a URDF or an MJCF; this is read as a table, without links"
        )
    return import_table(
        data,
        file=file,
        convention=options.convention,
        angle=options.angle,
        length=options.length,
        table=options.table,
        name=options.name,
        tolerance=options.tolerance,
        folder=folder,
    )
