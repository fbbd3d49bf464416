"""Printouts of Corke's Robotics Toolboxes around a table: name and convention, base and tool, configurations."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from dh2sim.formats.table.grid import PIPES, Findings, Grid
from dh2sim.formats.table.notation import plain
from dh2sim.kinematics.transforms import rpy_from_rotation
from dh2sim.messages import shown
from dh2sim.robot.fields import name_problem
from dh2sim.robot.links import Pose
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.units import LengthUnit, Units
from dh2sim.typing import Array, read_only

_ABOVE: Final = 8
"""Lines above a table that may be the printout's first."""
_STARTS: Final = (
    re.compile(
        r"[%#\s>]*[^\s:]+:\s*(?P<name>.*?)(?:\s*\(by .*?\))?,\s*\d+ joints? \((?P<types>[RP]+)\)"
        r".*?(?P<dh>std|sta|mod)\w* DH"
    ),
    re.compile(r"[%#\s>]*(?P<name>.*?)(?:\s*\[.*\])?\s*::\s*\d+ axis,\s*(?P<types>[RP]+),\s*(?P<dh>std|mod)DH"),
    re.compile(r"[%#\s>]*(?P<name>.*?)\s*\(\d+ axis,\s*(?P<types>[RP]+),\s*(?P<dh>std|mod)DH"),
)
_NUMBER: Final = r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*"
_POSE: Final = re.compile(
    rf"\b(base|tool)\b[\s:=│┃║|]*t\s*=\s*\(?{_NUMBER},{_NUMBER},{_NUMBER}\)?\s*[;,]\s*"
    rf"rpy(?:/(xyz|zyx|yxz|arm|vehicle|camera))?\s*=\s*\(?{_NUMBER}°?\s*,{_NUMBER}°?\s*,{_NUMBER}°?\s*\)?\s*(rad\b)?",
    re.IGNORECASE,
)
_ORDERS: Final = {"vehicle": "zyx", "arm": "xyz", "camera": "yxz"}
_NO_POSE: Final = re.compile(r"\W*(base|tool)\W*", re.IGNORECASE)
_MENTIONED: Final = re.compile(r"\b(base|tool|tcp|flange|end[ _-]?effector|gripper)\b", re.IGNORECASE)
_POSE_WORDS: Final = re.compile(
    r"\b(?:xyz|rpy|t)\b\s*[=:/]|\b(?:SE3|transl|trot[xyz]|Tx|Ty|Tz)\b|(?:[-+\d.]+\s*[,;]\s*){2}[-+\d.]"
)
_MATRIX: Final = re.compile(rf"base =((?:{_NUMBER}\s){{4}})\s*tool =(.*)")
_IDENTITY: Final = tuple(float(i == k) for i in range(4) for k in range(4))


@dataclass(frozen=True, slots=True, kw_only=True)
class Printout:
    """The first line of a printout."""

    name: str
    types: str
    """R or P for every joint."""
    convention: Convention
    in_radians: bool
    """The MATLAB toolbox prints radians, and no degree signs."""


def find_printout(lines: Sequence[str], table: range) -> Printout | None:
    """Return the first line of the printout that a table belongs to, or None where it is not part of one."""
    for number in range(table.start - 1, max(0, table.start - 1 - _ABOVE), -1):
        line = lines[number - 1][:1000]
        for index, pattern in enumerate(_STARTS):
            if found := pattern.match(line.strip()):
                convention = Convention.MODIFIED if found["dh"] == "mod" else Convention.STANDARD
                name = found["name"].strip()
                return Printout(name=name, types=found["types"], convention=convention, in_radians=index > 0)
    return None


def find_poses(
    lines: Sequence[str], table: range, around: range, length: LengthUnit | None, findings: Findings
) -> dict[str, Pose]:
    """Return the poses of base and tool that are printed beside a table, by ``base`` and ``tool``.

    Args:
        lines: All lines of the file.
        table: Numbers of the table's lines, counted from 1.
        around: Numbers of the lines that may belong to the table.
        length: The unit of lengths; None for metres.
        findings: Takes notes: on poses, which are rounded, and on lines that may hold one and were not read.
    """
    units = Units(length=length or LengthUnit.M)
    poses: dict[str, Pose] = {}
    for number in around:
        line = lines[number - 1][:1000]
        if number in table or not _MENTIONED.search(line):
            continue
        line = plain(line)
        if found := _POSE.search(line):
            poses[found[1].casefold()] = _pose(found, units)
        elif found := _MATRIX.search(line):
            poses |= _from_matrices(lines[number - 1 : number + 3], units, findings)
        elif found := _NO_POSE.fullmatch(line):
            if number > table.start and any(pipe in line for pipe in PIPES):
                findings.note(f"the printout names a {found[1].casefold()} without its pose: it was left out")
        elif (found := _MENTIONED.search(line)) and _POSE_WORDS.search(line):
            findings.note(
                f"line {number} may give the pose of the {found[1].casefold()} and was not read: {shown(line)}"
            )
    for name in poses:
        findings.note(
            f"the pose of the {name} is as printed, rounded: give it in the robot file if you know it better"
        )
    return poses


def is_first_line(line: str) -> bool:
    """Whether a line is the first of a printout."""
    return any(pattern.match(line[:1000].strip()) for pattern in _STARTS)


def find_configurations(grids: Sequence[Grid], rows: Sequence[Row], findings: Findings) -> Mapping[str, Array]:
    """Return the named joint vectors that a printout has in one of the tables around it, rad and m, as printed."""
    moving = [row for row in rows if row.type.moves]
    expected = ["name", *(f"q{index}" for index in range(len(moving)))]
    grid = next((g for g in grids if [plain(c.text) for c in g.rows[0]] == expected), None)
    configurations: dict[str, Array] = {}
    for name, *cells in ([cell.text for cell in row] for row in grid.rows[1:]) if grid else ():
        try:
            vector = [_coordinate(text, row) for text, row in zip(cells, moving, strict=True)]
        except ValueError as error:
            findings.note(f"the configuration {shown(name)} was left out: {error}")
            continue
        if problem := name_problem(name, "the name of a configuration"):
            findings.note(f"the configuration {shown(name)} was left out: {problem}")
        else:
            configurations[name] = read_only(vector)
    if configurations:
        findings.note("configurations are as printed, rounded to three digits")
    return configurations


def _coordinate(text: str, row: Row) -> float:
    angle = text.endswith("°")
    if angle is not row.type.turns or row.type is JointType.FIXED:
        raise ValueError(f"{shown(text)} is not a coordinate of a {row.type} joint")
    value = math.radians(float(text[:-1])) if angle else float(text)
    if not math.isfinite(value):
        raise ValueError(f"{shown(text)} is not a finite number")
    if row.limits.position and not row.limits.position[0] <= value <= row.limits.position[1]:
        raise ValueError(f"{shown(text)} is outside the limits of {row.name}")
    return value


def _pose(found: re.Match[str], units: Units) -> Pose:
    """Return the pose on a printed line; ``rpy/xyz`` is R = Rx(yaw) Ry(pitch) Rz(roll), printed roll first."""
    xyz = [units.metres(float(found[group])) for group in (2, 3, 4)]
    angles = [float(found[group]) for group in (6, 7, 8)]
    roll, pitch, yaw = angles if found[9] else map(math.radians, angles)
    order = (found[5] or "zyx").casefold()
    order = _ORDERS.get(order, order)
    if order == "zyx":
        return Pose(xyz=read_only(xyz), rpy=read_only([roll, pitch, yaw]))
    R = read_only(_about("z", roll))
    for axis, angle in (("y", pitch), ("x", yaw)) if order == "xyz" else (("x", pitch), ("y", yaw)):
        R = read_only(_about(axis, angle)) @ R
    return Pose(xyz=read_only(xyz), rpy=rpy_from_rotation(R))


def _about(axis: str, angle: float) -> list[list[float]]:
    s, c = math.sin(angle), math.cos(angle)
    match axis:
        case "x":
            return [[1, 0, 0], [0, c, -s], [0, s, c]]
        case "y":
            return [[c, 0, s], [0, 1, 0], [-s, 0, c]]
        case _:
            return [[c, -s, 0], [s, c, 0], [0, 0, 1]]


def pose_of(T: Sequence[Sequence[float]], units: Units) -> Pose:
    """Return the pose that a 4 x 4 transform is, its lengths in the table's unit."""
    return Pose(
        xyz=read_only([units.metres(row[3]) for row in T[:3]]),
        rpy=rpy_from_rotation(read_only([row[:3] for row in T[:3]])),
    )


def given_configurations(
    vectors: Mapping[str, Sequence[float]], rows: Sequence[Row], units: Units, findings: Findings
) -> dict[str, Array]:
    """Return the named joint vectors of a script, rad and m; what cannot be one is noted."""
    moving = [row for row in rows if row.type.moves]
    configurations: dict[str, Array] = {}
    for name, vector in vectors.items():
        if len(vector) != len(moving):
            findings.note(
                f"the configuration {shown(name)} was left out: {len(vector)} numbers for {len(moving)} joints"
            )
            continue
        q = [value if row.type.turns else units.metres(value) for value, row in zip(vector, moving, strict=True)]
        outside = next(
            (row.name for value, row in zip(q, moving, strict=True)
             if row.limits.position and not row.limits.position[0] <= value <= row.limits.position[1]), None
        )  # fmt: skip
        if outside is not None:
            findings.note(f"the configuration {shown(name)} was left out: it is outside the limits of {outside}")
        elif problem := name_problem(name, "the name of a configuration"):
            findings.note(f"the configuration {shown(name)} was left out: {problem}")
        else:
            configurations[name] = read_only(q)
    return configurations


def _from_matrices(lines: Sequence[str], units: Units, findings: Findings) -> dict[str, Pose]:
    """Return base and tool of an older MATLAB toolbox, which prints two 4 x 4 matrices side by side."""
    rows = [[float(number) for number in re.findall(_NUMBER, line.rpartition("grav")[2])][-8:] for line in lines]
    if len(rows) != 4 or any(len(row) != 8 for row in rows):
        findings.note("base and tool of the printout could not be read: they were left out")
        return {}
    poses: dict[str, Pose] = {}
    for name, start in (("base", 0), ("tool", 4)):
        matrix = [row[start : start + 4] for row in rows]
        if tuple(value for row in matrix for value in row) != _IDENTITY:
            poses[name] = pose_of(matrix, units)
    return poses
