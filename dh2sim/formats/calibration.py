"""Files in which makers keep how a robot of theirs was calibrated at the factory.

Three kinds, told apart by their content:

* ``kinematics: {shoulder: {x, y, z, roll, pitch, yaw}, upper_arm: …}``, of Universal Robots' ROS drivers
  (``calibration.yaml``, ``default_kinematics.yaml``): poses of joints in each other, in m and rad;
* ``joint1: {kinematic: {x, y, z, roll, pitch, yaw}}``, of Franka's descriptions (``kinematics.yaml``): the same,
  with or without the words ``kinematics`` and ``kinematic``;
* ``delta_theta = [ … ]`` and the like, of Universal Robots' controllers (``calibration.conf``): what is to be added
  to the nominal standard table.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from dh2sim.errors import ImportedFileError
from dh2sim.kinematics.serial_chain import SerialChain, SerialJoint
from dh2sim.kinematics.transforms import compose, pose_from_rpy
from dh2sim.messages import Loc, did_you_mean, listed, shown
from dh2sim.robot.links import Pose
from dh2sim.robot.magnitudes import ANGLE, LENGTH, MOST_ROWS, shown_size
from dh2sim.robot.row import JointType
from dh2sim.robot.yaml_tree import Entry, Node, Report, decode
from dh2sim.robot.yaml_tree import compose as compose_yaml
from dh2sim.typing import Array, read_only

UR_JOINTS: Final = {
    "shoulder": "shoulder_pan_joint",
    "upper_arm": "shoulder_lift_joint",
    "forearm": "elbow_joint",
    "wrist_1": "wrist_1_joint",
    "wrist_2": "wrist_2_joint",
    "wrist_3": "wrist_3_joint",
}
"""The links whose poses a UR's file gives, base first, and the joints that move them."""
PARAMETERS: Final = ("theta", "a", "d", "alpha")
_XYZ, _RPY = ("x", "y", "z"), ("roll", "pitch", "yaw")
_FRANKA_JOINTS: Final = 7
_NUMBERED = re.compile(r"[A-Za-z_]*?([0-9]+)")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointOrigins:
    """Poses of joints in each other at coordinates zero; each turns about its own z."""

    names: tuple[str, ...]
    """Of the joints, base first."""
    poses: tuple[Pose, ...]
    """Of each joint's link in the link before; the first one's in the base."""
    identifier: str = ""
    """That the maker gave the calibration; empty where there is none."""

    def chain(self, joints: int, T_base_first: Array) -> SerialChain:
        """Return the kinematics of the first joints; what is behind them is fixed to the last one.

        Args:
            joints: How many move.
            T_base_first: Pose of what the file calls the base in base_link, shape (4, 4).
        """
        transforms = [pose_from_rpy(pose.xyz, pose.rpy) for pose in self.poses]
        transforms[0] = compose(T_base_first, transforms[0])
        tip = pose_from_rpy([0, 0, 0], [0, 0, 0])
        for fixed in transforms[joints:]:
            tip = compose(tip, fixed)
        return SerialChain(
            joints=tuple(
                SerialJoint(
                    name=name,
                    type=JointType.REVOLUTE,
                    T_parent_link=T,
                    axis=read_only([0, 0, 1]),
                    point=read_only([0, 0, 0]),
                )
                for name, T in zip(self.names[:joints], transforms, strict=False)
            ),
            T_link_tip=tip,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class TableDeltas:
    """What is to be added to the numbers of a nominal table, row by row; m and rad."""

    theta: tuple[float, ...]
    a: tuple[float, ...]
    d: tuple[float, ...]
    alpha: tuple[float, ...]
    linearised: bool = True
    """Whether the controller calls the robot calibrated."""


_ANGLE = re.compile(rb"(?:^|[{,])[ \t]*(?:roll|yaw)[ \t]*:", re.MULTILINE)
_OTHER = re.compile(rb"^(?:(?:joints|axes)[ \t]*:|[ \t]*\|)", re.MULTILINE)
"""Robot files, axes, and texts with a Markdown table in them, which may quote a calibration."""
_DELTA = re.compile(rb"^[ \t]*delta_(theta|a|d|alpha)[ \t]*=", re.MULTILINE)


def is_calibration(data: bytes) -> bool:
    """Whether a file looks like one of a maker's calibration files."""
    if _OTHER.search(data) is not None:
        return False
    if len(set(_DELTA.findall(data))) > 1:
        return True
    return len(_ANGLE.findall(data)) > 1


class _CalibrationReport(Report):
    """Collects the problems of a calibration file."""

    def error(self) -> ImportedFileError:
        return ImportedFileError(dict.fromkeys(self.problems))


def read_calibration(data: bytes, *, file: str) -> JointOrigins | TableDeltas:
    """Read a maker's calibration file.

    Args:
        data: The file's content.
        file: Its name, for messages.

    Raises:
        ImportedFileError: The file is wrong; the error holds everything that is, with line and column.
    """
    report = _CalibrationReport(file)
    text = decode(data, report)
    found = _deltas(text, report) if len(set(_DELTA.findall(data))) > 1 else _origins(text, report)
    if report.problems or found is None:
        raise report.error()
    return found


# ---------------------------------------------------------------------------- poses of joints, in YAML


def _origins(text: str, report: Report) -> JointOrigins | None:
    root = compose_yaml(text, report, needs="a calibration needs poses of joints")
    top = root.value
    if not isinstance(top, dict):
        report.add(root.line, root.column, (), "expected poses of joints by name, or 'kinematics' with them in it")
        return None
    if "kinematics" in top:
        loc: Loc = ("kinematics",)
        for key, entry in top.items():
            if key != "kinematics":
                report.add(entry.line, entry.column, (key,), f"unknown key '{key}'. Allowed key: kinematics")
        node = top["kinematics"].value
        if not isinstance(node.value, dict):
            report.add(node.line, node.column, loc, f"expected poses of joints by name, got {_found(node)}")
            return None
        return _of_kinematics(node, loc, report)
    if any(name in top for name in UR_JOINTS):
        return _of_kinematics(root, (), report)
    if _too_many(root, (), len(top), report):
        return None
    poses = {}
    for key, entry in top.items():
        inner = entry.value.at("kinematic")
        loc = (key,) if inner is None else (key, "kinematic")
        poses[key] = _pose(entry.value if inner is None else inner, loc, report)
    return _numbered(top, poses, report)


def _of_kinematics(node: Node, loc: Loc, report: Report) -> JointOrigins | None:
    assert isinstance(node.value, dict)
    entries = dict(node.value)
    identifier = entries.pop("hash", None)
    known = [name for name in UR_JOINTS if name in entries]
    if known:
        for name, entry in entries.items():
            if name not in UR_JOINTS:
                hint = did_you_mean(name, UR_JOINTS)
                allowed = f"Allowed keys: {listed([*UR_JOINTS, 'hash'])}"
                report.add(entry.line, entry.column, (*loc, name), f"unknown key '{name}'.{hint} {allowed}")
        for name in UR_JOINTS:
            if name not in entries:
                report.add(node.line, node.column, loc, f"missing key '{name}'")
    order = known or list(entries)
    if _too_many(node, loc, len(order), report):
        return None
    poses = [_pose(entries[name].value, (*loc, name), report) for name in order]
    if not order:
        report.add(node.line, node.column, loc, "there is no joint")
    if report.problems:
        return None
    return JointOrigins(
        names=tuple(UR_JOINTS.get(name, name) for name in order),
        poses=tuple(pose for pose in poses if pose is not None),
        identifier="" if identifier is None else str(identifier.value.value),
    )


def _too_many(node: Node, loc: Loc, count: int, report: Report) -> bool:
    if count > MOST_ROWS:
        report.add(node.line, node.column, loc, f"there are {count} joints; at most {MOST_ROWS} are read")
    return count > MOST_ROWS


def _numbered(top: dict[str, Entry], poses: dict[str, Pose | None], report: Report) -> JointOrigins | None:
    """Bring joints into the order of their numbers."""
    numbers = {}
    for key in poses:
        found = _NUMBERED.fullmatch(key)
        if found is None:
            place = top[key]
            report.add(
                place.line, place.column, (key,), f"expected a numbered joint, such as 'joint1', got {shown(key)}"
            )
        else:
            numbers[key] = int(found[1])
    order = sorted(numbers, key=numbers.__getitem__)
    for i, key in enumerate(order, start=numbers[order[0]] if order else 1):
        if numbers[key] != i and len(numbers) == len(poses):
            place = top[key]
            report.add(place.line, place.column, (key,), f"expected joint {i} next, got {shown(key)}")
            break
    if report.problems:
        return None
    return JointOrigins(names=tuple(order), poses=tuple(pose for key in order if (pose := poses[key]) is not None))


def _pose(node: Node, loc: Loc, report: Report) -> Pose | None:
    keys = (*_XYZ, *_RPY)
    if not isinstance(node.value, dict):
        report.add(node.line, node.column, loc, f"expected {listed(keys)}, got {_found(node)}")
        return None
    for name, entry in node.value.items():
        if name not in keys:
            hint = did_you_mean(name, keys)
            report.add(
                entry.line, entry.column, (*loc, name), f"unknown key '{name}'.{hint} Allowed keys: {listed(keys)}"
            )
    values = []
    for key in keys:
        if key not in node.value:
            report.add(node.line, node.column, loc, f"missing key '{key}'")
            continue
        given = node.value[key].value
        number = given.value
        if isinstance(number, bool) or not isinstance(number, int | float):
            report.add(given.line, given.column, (*loc, key), f"expected a number, got {_found(given)}")
        elif problem := _number_problem(number, turns=key in _RPY):
            report.add(given.line, given.column, (*loc, key), f"{problem}, got {_found(given)}")
        else:
            values.append(float(number))
    return Pose(xyz=read_only(values[:3]), rpy=read_only(values[3:])) if len(values) == len(keys) else None


def _number_problem(number: float, *, turns: bool) -> str | None:
    """Return what is wrong with a number, perhaps an integer that no double holds; None if nothing is."""
    if isinstance(number, float) and not math.isfinite(number):
        return "expected a number"
    bounds = ANGLE if turns else LENGTH
    if abs(number) <= bounds.most:
        return None
    return f"must be from {shown_size(-bounds.most)} to {shown_size(bounds.most)} {bounds.unit}"


def _found(node: Node) -> str:
    if isinstance(node.value, dict):
        return "keys and values"
    if isinstance(node.value, list):
        return "a list"
    return shown(node.text) if node.text else "nothing"


def moving_joints(origins: JointOrigins, nominal: int | None) -> int:
    """Return how many of the poses belong to joints that move; the others lead on to the flange.

    Args:
        origins: The poses.
        nominal: How many joints the nominal robot has; None where there is none. Then an eighth of joints that are
            only numbered is taken for a flange: so it is in Franka's files.
    """
    count = len(origins.poses)
    if nominal is not None:
        return nominal if count == nominal + 1 else count
    numbered = all(_NUMBERED.fullmatch(name) for name in origins.names)
    return _FRANKA_JOINTS if numbered and count == _FRANKA_JOINTS + 1 else count


# ---------------------------------------------------------------------------- deltas of a table, in a .conf file

_ASSIGNMENT = re.compile(r"^[ \t]*(?P<key>\w+)[ \t]*=[ \t]*(?P<value>\[[^\]=]*\]?|[^\n#]*)", re.MULTILINE)
_ITEM = re.compile(r"[^\s,\[\]]+")


def _deltas(text: str, report: Report) -> TableDeltas | None:
    without_comments = re.sub(r"#[^\n]*", lambda comment: " " * len(comment[0]), text)
    found: dict[str, tuple[float, ...]] = {}
    places: dict[str, tuple[int, int]] = {}
    status = "2"
    for match in _ASSIGNMENT.finditer(without_comments):
        key, value = match["key"], match["value"]
        name = key.removeprefix("delta_")
        if key == "calibration_status":
            status = value.strip()
        if not key.startswith("delta_") or name not in PARAMETERS:
            continue  # checksums and encoders say nothing of the geometry
        place = _place(text, match.start("key"))
        if key in places:
            report.add(*place, (key,), f"given twice; line {places[key][0]} has it already")
            continue
        places[key] = place
        if not (value.startswith("[") and value.endswith("]")):
            report.add(*_place(text, match.start("value")), (key,), "expected numbers between brackets: [ …, … ]")
            continue
        found[name] = tuple(_numbers(text, key, value, match.start("value"), report))
    for name in PARAMETERS:
        if f"delta_{name}" not in places:
            report.add(*_place(text, len(text.rstrip())), (), f"missing key 'delta_{name}'")
    lengths = {name: len(values) for name, values in found.items()}
    if len(set(lengths.values())) > 1:
        counts = listed(f"{length} of delta_{name}" for name, length in lengths.items())
        report.add(*min(places.values()), (), f"expected as many numbers of each parameter, got {counts}")
    if report.problems:
        return None
    return TableDeltas(**found, linearised=status == "2")


def _numbers(text: str, key: str, value: str, start: int, report: Report) -> Iterator[float]:
    items = list(_ITEM.finditer(value))
    if not items:
        report.add(*_place(text, start), (key,), "there is no number between the brackets")
    for k, item in enumerate(items):
        try:
            number = float(item[0])
        except ValueError:
            number = math.nan
        if problem := _number_problem(number, turns=key in ("delta_theta", "delta_alpha")):
            report.add(*_place(text, start + item.start()), (key, k), f"{problem}, got {shown(item[0])}")
        yield number


def _place(text: str, offset: int) -> tuple[int, int]:
    return text.count("\n", 0, offset) + 1, offset - text.rfind("\n", 0, offset)
