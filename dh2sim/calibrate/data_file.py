"""Files of measurements: CSV with joint columns by name, and units in the header."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Final, NoReturn

import numpy as np

from dh2sim.arguments import file_path
from dh2sim.calibrate.measurements import OTHER_KINDS, Kind, Measurements, grouped, problems_of
from dh2sim.errors import Dh2simError, MeasurementFileError, Problem
from dh2sim.input_files import check_columns, read_input, utf16_hint
from dh2sim.kinematics.chain import serial_spec_of
from dh2sim.kinematics.rotations import rotations_of_quaternions, rotations_of_vectors
from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.messages import closest, counted, did_you_mean, listed, member, shown
from dh2sim.robot.spec import RobotSpec, SpecLike
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.typing import Array, read_only

MAX_BYTES: Final = 100_000_000
MOST_ROWS: Final = 20_000
_MOST_PROBLEMS: Final = 50
_LENGTH_UNITS: Final = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "µm": 1e-6, "in": 0.0254}
_DEGREE: Final = math.pi / 180.0
_ANGLE_UNITS: Final = {"rad": 1.0, "radian": 1.0, "deg": _DEGREE, "degree": _DEGREE, "°": _DEGREE, "mrad": 1e-3}
_HEADING: Final = re.compile(r"(?P<name>[^\[(]*?)\s*(?:[\[(]\s*(?P<unit>[^\])]*?)\s*[\])])?\s*")
_SUFFIXED: Final = re.compile(r"(?P<name>.+)_(?P<unit>m|mm|cm|um|in|rad|deg|mrad)")
_JOINT_ALIAS: Final = re.compile(r"(?:q|j|joint)_?([0-9]{1,3})", re.IGNORECASE)
_POSITION: Final = ("x", "y", "z")
_QUATERNION: Final = ("qw", "qx", "qy", "qz")
_RPY: Final = ("roll", "pitch", "yaw")
_VECTOR: Final = ("rx", "ry", "rz")
_MATRIX: Final = tuple(f"r{i}{k}" for i in (1, 2, 3) for k in (1, 2, 3))
_TRANSFORM: Final = tuple(f"t{i}{k}" for i in (1, 2, 3) for k in (1, 2, 3, 4))
_LAST_ROW: Final = tuple(f"t4{k}" for k in (1, 2, 3, 4))
_LENGTHS: Final = (*_POSITION, "distance", "t14", "t24", "t34")
_ANGLES: Final = (*_RPY, *_VECTOR)
_PLAIN: Final = (*_QUATERNION, *_MATRIX, *(name for name in _TRANSFORM if not name.endswith("4")), *_LAST_ROW)
_TEXTS: Final = ("station", "placement", "socket", "to", "pair", "group")
_IGNORED: Final = ("name", "note", "notes", "comment", "time", "id", "index", "number")
_ORIENTATIONS: Final = {
    "a quaternion": _QUATERNION,
    "roll, pitch, yaw": _RPY,
    "a rotation vector": _VECTOR,
    "a rotation matrix": _MATRIX,
    "a 4x4 transform": _TRANSFORM,
}
_COLUMNS: Final = (
    "x, y, z; qw, qx, qy, qz or roll, pitch, yaw or rx, ry, rz or r11 … r33 or t11 … t34; distance; "
    f"{listed(_TEXTS)}; ignored: {listed(_IGNORED)}"
)
_DEGREES: Final = 4.0 * math.pi
"""rad, beyond which no joint turns that is not meant in degrees."""
_MILLIMETRES: Final = 20.0
"""m, farther than which nothing is from a robot's base that is not meant in mm."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Cell:
    text: str
    column: int
    """In the line, from 1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Column:
    name: str
    """In lower case, or the name of a joint."""
    heading: str
    index: int
    factor: float
    """By which a number becomes one in SI units; 0 for texts."""
    joint: int = -1
    unit: str = ""


class _Report:
    """Collects what is wrong in a file."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.problems: list[Problem] = []

    def __call__(self, line: int, column: int, path: str, message: str) -> None:
        self.problems.append(Problem(file=self.file, line=line, column=column, path=path, message=message))

    def stop(self, line: int, column: int, message: str) -> NoReturn:
        """Report what makes the rest of the file unreadable."""
        self(line, column, "", message)
        self.raise_any()
        raise AssertionError

    def raise_any(self) -> None:
        if self.problems:
            problems = sorted(self.problems)
            if len(problems) > _MOST_PROBLEMS:
                more = len(problems) - _MOST_PROBLEMS
                last = problems[_MOST_PROBLEMS]
                problems = [*problems[:_MOST_PROBLEMS], replace(last, path="", message=f"and {more} more problems")]
            raise MeasurementFileError(problems)


def read_measurements(
    path: str | os.PathLike[str], robot: SpecLike, *, kind: Kind | str | None = None, groups: str | None = None
) -> Measurements:
    """Read a file of measurements.

    Args:
        path: A CSV file: commas, semicolons or tabs between columns, the first line names them. Columns of other
            names are left out, with a note, where the file has all that is needed without them.
        robot: That was measured.
        kind: 'pose', 'position', 'distance' or 'socket'; by default as the columns say.
        groups: The column whose rows of one value are held out together; by default ``placement``, else ``group``,
            ``station`` or ``socket``.

    Raises:
        MeasurementFileError: The file is wrong; the error holds everything that is, with its place.
        Dh2simError: It cannot be read, or the kind is unknown.
    """
    file_path("path", path)
    spec = serial_spec_of(robot)
    name = os.fspath(path)
    wanted = None if kind is None else member(Kind, OTHER_KINDS.get(str(kind), str(kind)), "kind")
    try:
        data = read_input(Path(path), MAX_BYTES)
    except OSError as error:
        raise Dh2simError(f"{name}: cannot be read: {error.strerror or error}") from None
    report = _Report(name)
    if len(data) > MAX_BYTES:
        report.stop(1, 1, f"the file has more than {MAX_BYTES} bytes")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        report.stop(line, 1, f"the file is not UTF-8 text{utf16_hint(data)}")
    return _read(text, spec, report, wanted, groups)


def _read(text: str, spec: RobotSpec, report: _Report, kind: Kind | None, groups: str | None) -> Measurements:
    every = (
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    )
    lines = list(islice(every, MOST_ROWS + 1))
    more = sum(1 for _ in every)
    if not lines:
        report.stop(1, 1, "the file is empty; the first line must name the columns")
    if more:
        message = f"the file has {len(lines) - 1 + more} measurements; at most {MOST_ROWS} are fitted: choose some"
        report.stop(lines[0][0], 1, message)
    number, header = lines[0]
    separator = max(",;\t", key=header.count)
    cells = _split(header, separator)
    try:
        check_columns(len(cells))
    except ValueError as error:
        report.stop(number, 1, f"the file {error}")
    columns, unused = _columns(cells, number, spec, report, groups)
    kind = _kind(columns, kind, number, report)
    _require_columns(columns, kind, spec, number, report)
    if report.problems:
        _report_unused(unused, number, spec, report)
    rows = [(line, _split(content, separator)) for line, content in lines[1:]]
    if not rows:
        report(number, 1, "", "there are no measurements below the header")
    values, texts = _cells(columns, rows, len(cells), separator, report)
    places = [line for line, _ in rows]
    _look_at_units(columns, values, rows, report)
    report.raise_any()
    joints = sorted((column for column in columns.values() if column.joint >= 0), key=lambda column: column.joint)
    position = _stack(values, _POSITION) if "x" in values else None
    rotation = _rotations(values, rows, columns, report) if kind is Kind.POSE else None
    if position is None and "t14" in values:
        position = _stack(values, ("t14", "t24", "t34"))
    report.raise_any()
    used = groups or ("group" if "group" in texts and "placement" not in texts else None)
    found = Measurements(
        kind=kind,
        q=read_only(np.stack([values[column.name] for column in joints], axis=1)),
        position=None if position is None or kind is Kind.SOCKET else read_only(position),
        rotation=None if rotation is None else read_only(rotation),
        distance=read_only(values["distance"])
        if "distance" in values and kind in (Kind.DISTANCE, Kind.SOCKET)
        else None,
        station=texts.get("station") if kind is not Kind.SOCKET else None,
        pair=texts.get("pair") if kind is Kind.DISTANCE else None,
        socket=texts.get("socket") if kind is Kind.SOCKET else None,
        placement=texts.get("placement", texts.get("station")) if kind is Kind.SOCKET else texts.get("placement"),
        to=texts.get("to"),
        groups=texts.get(_folded(used)) if used else None,
        group_name=_folded(used) if used else "",
        lines=tuple(places),
        file=report.file,
        notes=_note_on(unused),
    )
    for row, column_name, message in problems_of(found):
        line = places[row] if row >= 0 else number
        column = columns.get(column_name)
        at = rows[row][1][column.index].column if column is not None and row >= 0 else 1
        report(line, at, column.heading if column is not None else "", message.removeprefix(f"line {line}: "))
    report.raise_any()
    return grouped(found)


def _split(line: str, separator: str) -> list[_Cell]:
    """Split a line into cells, some of which may be in double quotes."""
    cells, at = [], 0
    while True:
        start = at
        while at < len(line) and line[at] in " " and line[at] != separator:
            at += 1
        if at < len(line) and line[at] == '"':
            end = at + 1
            while end < len(line) and (line[end] != '"' or line[end + 1 : end + 2] == '"'):
                end += 2 if line[end] == '"' else 1
            text = line[at + 1 : end].replace('""', '"')
            column = at + 2
            following = line.find(separator, end)
        else:
            following = line.find(separator, start)
            raw = line[start:] if following < 0 else line[start:following]
            text, column = raw.strip(), start + 1 + len(raw) - len(raw.lstrip())
        cells.append(_Cell(text=text, column=column))
        if following < 0:
            return cells
        at = following + 1


def _folded(name: str) -> str:
    return name.strip().casefold()


def _columns(
    cells: Sequence[_Cell], line: int, spec: RobotSpec, report: _Report, groups: str | None
) -> tuple[dict[str, _Column], list[_Cell]]:
    """Return the columns by name, and the headings of others; report columns twice there, or without a unit."""
    rows = spec.moving_rows
    joints = {_folded(row.name): k for k, row in enumerate(rows)}
    found: dict[str, _Column] = {}
    unused: list[_Cell] = []
    for index, cell in enumerate(cells):
        name, unit = _parts(cell.text)
        key = _folded(name)
        if not unit and key not in joints and (suffixed := _SUFFIXED.fullmatch(key)):
            key, unit = suffixed["name"], suffixed["unit"]
        joint = joints.get(key, -1)
        alias = _JOINT_ALIAS.fullmatch(key)
        if joint < 0 and alias and 1 <= int(alias[1]) <= len(rows):
            joint = int(alias[1]) - 1
        if groups is not None and key == _folded(groups) and joint < 0 and key not in _LENGTHS:
            column = _Column(name=key, heading=cell.text, index=index, factor=0.0)
        elif joint >= 0:
            row = rows[joint]
            units = _ANGLE_UNITS if row.type.turns else _LENGTH_UNITS
            factor = _unit(unit, units, row.name, line, cell, report)
            column = _Column(name=row.name, heading=cell.text, index=index, factor=factor, joint=joint, unit=unit)
        elif key in _LENGTHS or key in _ANGLES:
            units = _LENGTH_UNITS if key in _LENGTHS else _ANGLE_UNITS
            factor = _unit(unit, units, key, line, cell, report)
            column = _Column(name=key, heading=cell.text, index=index, factor=factor, unit=unit)
        elif key in _PLAIN:
            column = _Column(name=key, heading=cell.text, index=index, factor=1.0)
        elif key in _TEXTS:
            column = _Column(name=key, heading=cell.text, index=index, factor=0.0)
        elif key in _IGNORED:
            continue
        else:
            if _is_number(cell.text):
                message = (
                    f"expected the name of a column, found {shown(cell.text)}: the first line must name the columns"
                )
                report.stop(line, cell.column, message)
            unused.append(cell)
            continue
        if column.name in found:
            report(line, cell.column, cell.text, f"column {shown(column.name)} is there twice")
            continue
        found[column.name] = column
    if groups is not None and _folded(groups) not in found:
        names = [cell.text for cell in cells]
        report(line, 1, "", f"there is no column {shown(groups)} to group by.{did_you_mean(groups, names)}")
    _report_slips(unused, found, line, spec, report)
    return found, unused


def _parts(heading: str) -> tuple[str, str]:
    """Return the name and the unit of a heading."""
    match = _HEADING.fullmatch(heading)
    return (match["name"], match["unit"] or "") if match else (heading, "")


def _report_slips(
    unused: list[_Cell], found: Mapping[str, _Column], line: int, spec: RobotSpec, report: _Report
) -> None:
    """Report unknown columns that look like one that is not there, or like a joint that the robot does not have."""
    oriented = any(part in found for parts in _ORIENTATIONS.values() for part in parts)
    absent = {*_POSITION, "distance", *_TEXTS, *(() if oriented else (*_ANGLES, *_PLAIN))} - found.keys()

    def is_slip(name: str) -> bool:
        joint = _JOINT_ALIAS.fullmatch(name)
        return joint is not None or (len(name) > 2 and closest(name, sorted(absent), likeness=0.75) is not None)

    if any(is_slip(_folded(_parts(cell.text)[0])) for cell in unused):
        _report_unused(unused, line, spec, report)


def _report_unused(unused: list[_Cell], line: int, spec: RobotSpec, report: _Report) -> None:
    """Report unknown columns as what may be wrong, once."""
    joints = [row.name for row in spec.moving_rows]
    known = [*joints, *_LENGTHS, *_ANGLES, *_PLAIN, *_TEXTS, *_IGNORED]
    columns = f" Columns: {listed(joints)}; {_COLUMNS}"
    for cell in unused:
        name = _parts(cell.text)[0]
        message = f"unknown column {shown(name)}.{did_you_mean(name, known)}{columns}"
        report(line, cell.column, "", message if cell.text else "the column has no name")
        columns = "" if cell.text else columns
    unused.clear()


def _note_on(unused: Sequence[_Cell]) -> tuple[str, ...]:
    names = [shown(cell.text) if cell.text else "one without a name" for cell in unused]
    return (f"Columns of the file that are left out: {listed(names)}.",) if names else ()


def _unit(unit: str, units: Mapping[str, float], name: str, line: int, cell: _Cell, report: _Report) -> float:
    factor = units.get(unit) or units.get(unit.casefold()) or units.get(unit.casefold().removesuffix("s"))
    if factor is None:
        *most, last = [f"{name} [{each}]" for each in ("rad", "deg", "mrad") if each in units] or [
            f"{name} [{each}]" for each in ("m", "mm", "cm")
        ]
        allowed = f"{', '.join(most)} or {last}"
        message = f"has no unit: write {allowed}" if not unit else f"unknown unit {shown(unit)}: write {allowed}"
        report(line, cell.column, cell.text, message)
        return 1.0
    return factor


def _kind(columns: Mapping[str, _Column], kind: Kind | None, line: int, report: _Report) -> Kind:
    if kind is not None:
        return kind
    if "socket" in columns:
        return Kind.SOCKET
    if "distance" in columns:
        return Kind.DISTANCE
    if any(name in columns for names in _ORIENTATIONS.values() for name in names):
        return Kind.POSE
    if not any(name in columns for name in _POSITION):
        message = "nothing was measured: expected columns x, y, z (and an orientation), distance, or socket"
        report(line, 1, "", message)
    return Kind.POSITION


def _require_columns(columns: Mapping[str, _Column], kind: Kind, spec: RobotSpec, line: int, report: _Report) -> None:

    def require(names: Iterable[str], what: str) -> None:
        lacking = [name for name in names if name not in columns]
        if lacking:
            report(line, 1, "", f"missing {'column' if len(lacking) == 1 else 'columns'} {listed(lacking)}{what}")

    require((row.name for row in spec.moving_rows), ": each joint needs one")
    some = [name for name, parts in _ORIENTATIONS.items() if any(part in columns for part in parts)]
    match kind:
        case Kind.DISTANCE:
            require(("distance",), " of --kind distance")
            if any(name in columns for name in _POSITION):
                require(_POSITION, " of the stations' fixed points")
        case Kind.SOCKET:
            require(("socket",), " of --kind socket")
        case Kind.POSE | Kind.POSITION:
            if kind is Kind.POSITION or "a 4x4 transform" not in some:
                require(_POSITION, f" of --kind {kind}")
    if kind is not Kind.POSE:
        return
    if len(some) > 1:
        report(line, 1, "", f"{listed(some, ' and ')} exclude each other")
    if not some:
        report(line, 1, "", f"a pose needs an orientation: {_COLUMNS.split('; ')[1]}; or else --kind position")
    for name in some:
        require(_ORIENTATIONS[name], f" of {name}")


def _cells(
    columns: Mapping[str, _Column],
    rows: Sequence[tuple[int, list[_Cell]]],
    width: int,
    separator: str,
    report: _Report,
) -> tuple[dict[str, Array], dict[str, tuple[str, ...]]]:
    """Return numbers in SI units and texts, by column."""
    values = {column.name: np.full(len(rows), np.nan) for column in columns.values() if column.factor}
    texts: dict[str, list[str]] = {column.name: [""] * len(rows) for column in columns.values() if not column.factor}
    may_be_empty = {"to"} | ({"distance"} if "socket" in columns else set())
    for k, (line, cells) in enumerate(rows):
        if len(cells) != width:
            report(line, 1, "", f"expected {counted(width, 'cell')} as in the header, found {len(cells)}")
            continue
        for column in columns.values():
            cell = cells[column.index]
            if not cell.text:
                if column.name not in may_be_empty:
                    report(line, cell.column, column.heading, "the cell is empty")
                continue
            if not column.factor:
                texts[column.name][k] = cell.text
                continue
            text = cell.text.replace(",", ".") if separator != "," else cell.text
            try:
                number = float(text) if "_" not in text else float("x")
            except ValueError:
                report(line, cell.column, column.heading, f"expected a number, found {shown(cell.text)}")
                continue
            if not math.isfinite(number):
                report(line, cell.column, column.heading, f"must be finite, found {cell.text}")
                continue
            values[column.name][k] = number * column.factor
    return values, {name: tuple(found) for name, found in texts.items()}


def _look_at_units(
    columns: Mapping[str, _Column],
    values: Mapping[str, Array],
    rows: Sequence[tuple[int, list[_Cell]]],
    report: _Report,
) -> None:
    """Report numbers that cannot be in the unit of their column."""
    for column in columns.values():
        found = values.get(column.name)
        if found is None or np.isnan(found).all():
            continue
        row = int(np.nanargmax(np.abs(found)))
        largest, line = float(abs(found[row])), rows[row][0]
        cell = rows[row][1][column.index]
        turning = column.name in _ANGLES or (column.joint >= 0 and column.unit in ("rad",))
        if turning and column.unit == "rad" and largest > _DEGREES:
            report(line, cell.column, column.heading, f"found {cell.text} rad, which looks like degrees: write [deg]")
        sliding = column.name in _LENGTHS or (column.joint >= 0 and column.unit in _LENGTH_UNITS)
        if sliding and column.unit == "m" and largest > _MILLIMETRES:
            report(line, cell.column, column.heading, f"found {cell.text} m, which looks like mm: write [mm]")
    joints = [column for column in columns.values() if column.joint >= 0 and column.unit in ("deg", "°")]
    if joints and len(rows) >= 5:
        largest = max(float(np.abs(values[column.name]).max()) for column in joints)
        spread = max(float(np.ptp(values[column.name])) for column in joints)
        if math.degrees(largest) <= 2.0 * math.pi and math.degrees(spread) > 0.5:
            column = joints[0]
            line, cells = rows[0]
            angles = f"all joint angles are within {math.degrees(largest):.3g} deg"
            message = f"{angles}, which looks like radians: write [rad]"
            report(line, cells[column.index].column, column.heading, message)


def _stack(values: Mapping[str, Array], names: Sequence[str]) -> Array:
    return np.stack([values[name] for name in names], axis=1)


def _rotations(
    values: Mapping[str, Array],
    rows: Sequence[tuple[int, list[_Cell]]],
    columns: Mapping[str, _Column],
    report: _Report,
) -> Array:
    """Return orientations, whichever way they are given; report those that are none."""

    def wrong(off: Array, name: str, message: Callable[[float], str]) -> None:
        for k in np.flatnonzero(~(off < 1e-2)):
            line, cells = rows[int(k)]
            report(line, cells[columns[name].index].column, columns[name].heading, message(float(off[k])))

    if "qw" in values:
        q = _stack(values, _QUATERNION)
        norm = np.linalg.norm(q, axis=1)
        wrong(
            np.abs(norm - 1.0), "qw", lambda off: f"a quaternion must have length 1, which this is off by {off:.3g}"
        )
        return rotations_of_quaternions(q / np.maximum(norm, 1e-12)[:, None])
    if "roll" in values:
        return np.array([pose_from_rpy(np.zeros(3), rpy)[:3, :3] for rpy in _stack(values, _RPY)])
    if "rx" in values:
        return rotations_of_vectors(_stack(values, _VECTOR))
    names = _MATRIX if "r11" in values else tuple(name for name in _TRANSFORM if not name.endswith("4"))
    R = _stack(values, names).reshape(-1, 3, 3)
    off = np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    off = np.where(np.linalg.det(R) > 0.0, off, 2.0)
    wrong(
        off,
        names[0],
        lambda off: "this is not a rotation matrix" + (f": R Rᵀ differs from 1 by {off:.3g}" if off < 2.0 else ""),
    )
    U, _, Vt = np.linalg.svd(R)
    return np.asarray(U @ Vt)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def configurations_text(spec: RobotSpec, q: Array) -> str:
    """Return joint vectors as a CSV with the columns that measurements need, in the robot file's units.

    Args:
        spec: The robot.
        q: rad and m, shape (N, n).
    """
    units, rows = spec.units, spec.moving_rows
    names = [f"{row.name} [{units.angle if row.type.turns else units.length}]" for row in rows]
    scale = [units.coordinate(1.0, turns=row.type.turns) for row in rows]
    digits = [
        (5 if units.angle is AngleUnit.RAD else 3) if row.type.turns else (3 if units.length is LengthUnit.MM else 5)
        for row in rows
    ]
    lines = [",".join(names)]
    for vector in q.tolist():
        cells = zip(vector, scale, digits, strict=True)
        lines.append(",".join(f"{value / factor:.{places}f}" for value, factor, places in cells))
    return "\n".join([*lines, ""])
