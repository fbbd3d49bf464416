"""Waypoints: what a trajectory goes through, in code and in waypoint files."""

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from types import MappingProxyType
from typing import Annotated, Any, Final

import numpy as np

from dh2sim.errors import ConfigurationError, SettingsError
from dh2sim.inverse.goals import read_goals
from dh2sim.kinematics.rotations import rotations_of_quaternions
from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.messages import Loc, did_you_mean, listed, path_of, shown
from dh2sim.robot.expressions import NumberError, to_number
from dh2sim.robot.fields import (
    LENGTHS,
    WRONG,
    Choice,
    Dimension,
    Flag,
    Kind,
    Number,
    Numbers,
    Parameters,
    Scope,
    Text,
    Tree,
    UnitsLike,
)
from dh2sim.robot.parts import Internal, Part, Parts, plain
from dh2sim.robot.read import read_tree
from dh2sim.robot.row import Row
from dh2sim.robot.schema import NUMBER, schema_of
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit, LengthUnit, Units
from dh2sim.robot.yaml_tree import read_yaml_file
from dh2sim.trajectory.limits import GIVEN, QUANTITIES, LimitValue
from dh2sim.trajectory.profiles import Profile
from dh2sim.typing import Array, read_only


class MoveKind(StrEnum):
    """How a motion gets to its waypoint."""

    JOINT = "joint"
    """All joints move in step; the tool's path follows from that."""
    LINE = "line"
    """Along a straight line of the tool, with its orientation turning at a constant rate."""
    ARC = "arc"
    """Along an arc of a circle of the tool, likewise."""


class FreeKind(StrEnum):
    """What lines and arcs leave open."""

    ROTATION = "rotation"
    """The orientation."""
    ROLL = "roll"
    """The turn about z of tool0."""


PROFILES: Final = {"s-curve": "jerk", "scurve": "jerk", "linear": "line", "circle": "arc", "joints": "joint"}
"""Names that others use, which messages explain."""
_SECONDS: Final = 1e6


@dataclass(eq=False, repr=False)
class JointVector(Kind):
    """The name of a configuration, or joint coordinates."""

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return the name, or a list of numbers in the units given."""
        if isinstance(value, str) and not any(letter in value for letter in ",[ "):
            return value
        if isinstance(value, int | float) and not isinstance(value, bool):
            value = [value]
        if not isinstance(value, list):
            return scope.wrong(
                loc, f"expected the name of a configuration or a list of joint coordinates, found {shown(value)}"
            )
        found = []
        for index, each in enumerate(value):
            try:
                found.append(to_number(each, scope.parameters))
            except NumberError as error:
                found.append(scope.wrong((*loc, index), str(error)))
        return WRONG if WRONG in found else found

    def json_schema(self) -> dict[str, Any]:
        """Return the schema of either."""
        return {"anyOf": [NUMBER, {"type": "array", "items": NUMBER}]}


@dataclass(eq=False, repr=False)
class LimitsKind(Kind):
    """Limits by name; what they are of which joint is checked with the robot."""

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return a mapping of names to numbers, texts, lists or mappings of them."""
        if not isinstance(value, dict):
            return scope.wrong(loc, f"expected a mapping with the keys {listed(GIVEN)}, found {shown(value)}")
        for name in value:
            if name not in GIVEN:
                message = f"unknown key {shown(name)}.{did_you_mean(str(name), GIVEN)} Allowed keys: {listed(GIVEN)}"
                scope.report((*loc, str(name)), message, at_key=True, path=loc)
        return {name: _limit(each, (*loc, name), scope) for name, each in value.items() if name in GIVEN}

    def json_schema(self) -> dict[str, Any]:
        """Return the schema of limits: of all joints, of each, or of some by name."""
        of_joints = [NUMBER, {"type": "array", "items": NUMBER}, {"type": "object", "additionalProperties": NUMBER}]
        limits = {name: {"anyOf": of_joints} if name in QUANTITIES else NUMBER for name in GIVEN}
        return {"type": "object", "properties": limits, "additionalProperties": False}


def _limit(value: object, loc: Loc, scope: Scope) -> Any:
    match value:
        case str() if value.strip().endswith("%"):
            return value
        case dict():
            return {name: _limit(each, (*loc, str(name)), scope) for name, each in value.items()}
        case list():
            return [_limit(each, (*loc, index), scope) for index, each in enumerate(value)]
        case _:
            try:
                return to_number(value, scope.parameters)
            except NumberError as error:
                return scope.wrong(loc, str(error))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Waypoint:
    """A waypoint, and how the motion gets there: a joint vector, or a pose of tool0 in base_link."""

    name: Annotated[str, Text("What messages and reports call it.")] = ""
    q: Annotated[
        Any,
        JointVector("Name of a configuration, or joint coordinates in the file's units."),
    ] = None
    xyz: Annotated[Array | None, Numbers("Position of tool0 in base_link.", LENGTHS)] = None
    rpy: Annotated[
        Array | None,
        Numbers(
            "Its roll, pitch, yaw; by default the orientation of the waypoint before.",
            Number("", Dimension.ANGLE),
            of="roll, pitch, yaw",
        ),
    ] = None
    quaternion: Annotated[
        Array | None, Numbers("Its orientation as a quaternion, in place of rpy.", of="w, x, y, z", counts=(4,))
    ] = None
    kind: Annotated[MoveKind | None, Choice("How to get here; default the file's.", MoveKind)] = None
    via: Annotated[Array | None, Numbers("Position that an arc goes through.", LENGTHS)] = None
    centre: Annotated[Array | None, Numbers("Of an arc, in place of via and a pose.", LENGTHS)] = None
    axis: Annotated[Array | None, Numbers("Of the circle about centre; default 0, 0, 1.")] = None
    angle: Annotated[float | None, Number("By which the arc turns about it.", Dimension.ANGLE)] = None
    stop: Annotated[bool, Flag("False: pass without stopping, on a smooth curve of the joints.")] = True
    wait: Annotated[float, Number("Rest here, s.", least=0.0, most=_SECONDS)] = 0.0
    duration: Annotated[float | None, Number("Of the motion to here, s.", least=0.0, most=_SECONDS)] = None
    time: Annotated[float | None, Number("When to be here, s from the start.", least=0.0, most=_SECONDS)] = None
    place: Annotated[str, Internal("", str)] = ""
    """Where a file has it, for messages."""
    T: Annotated[Any, Internal("", object)] = None
    """Pose of tool0 in base_link, shape (4, 4), where it is known as a whole."""

    @property
    def orientation(self) -> Array | None:
        """Rotation of tool0 in base_link, shape (3, 3); None where none is given."""
        if self.T is not None:
            return np.asarray(self.T[:3, :3])
        if self.quaternion is not None:
            return rotations_of_quaternions(self.quaternion / np.linalg.norm(self.quaternion))
        return None if self.rpy is None else np.asarray(pose_from_rpy((0.0, 0.0, 0.0), self.rpy)[:3, :3])

    @property
    def position(self) -> Array | None:
        """Position of tool0 in base_link, m, shape (3,); None where none is given."""
        return self.xyz if self.T is None else np.asarray(self.T[:3, 3])


_WAYPOINT: Final = Part("", Waypoint, list_is="q", number_is="q")


@dataclass(frozen=True, slots=True, kw_only=True)
class WaypointUnits(Units):
    """Units of the angles and lengths in this file."""

    angle: Annotated[
        AngleUnit, Choice("Unit of angles; default that of the robot file.", AngleUnit, inherited=True)
    ] = AngleUnit.RAD
    length: Annotated[
        LengthUnit, Choice("Unit of lengths; default that of the robot file.", LengthUnit, inherited=True)
    ] = LengthUnit.M


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WaypointFile:
    """A trajectory as a file requests it, in SI units."""

    robot: Annotated[str, Text("Name of the robot that it is for.")] = ""
    units: Annotated[Units, Part("Units of this file; default those of the robot file.", WaypointUnits)] = field(
        default_factory=WaypointUnits
    )
    parameters: Annotated[Mapping[str, float], Parameters("Named constants for expressions.")] = field(
        default_factory=lambda: MappingProxyType({})
    )
    kind: Annotated[MoveKind | None, Choice("How to get from waypoint to waypoint.", MoveKind)] = None
    profile: Annotated[
        Profile | None, Choice("How motions speed up and slow down.", Profile, other_names=PROFILES)
    ] = None
    duration: Annotated[float | None, Number("Of the whole, s; default as fast as limits allow.", above=0.0)] = None
    limits: Annotated[Mapping[str, LimitValue], LimitsKind("In place of the robot's own.")] = field(
        default_factory=lambda: MappingProxyType({})
    )
    through: Annotated[bool, Flag("Pass singularities slowly.")] = False
    free: Annotated[FreeKind | None, Choice("What lines and arcs leave open.", FreeKind)] = None
    waypoints: Annotated[tuple[Waypoint, ...], Parts("At least two.", _WAYPOINT, required=True)] = ()


WAYPOINT_FILE: Final = Part("", WaypointFile)


def waypoint_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a waypoint file."""
    return schema_of(WAYPOINT_FILE, "waypoint file", "What a trajectory goes through.")


def read_waypoints(path: str | os.PathLike[str], spec: RobotSpec) -> WaypointFile:
    """Read a waypoint file.

    Args:
        path: The file.
        spec: The robot that it is for; its units are those of the file, unless that names others.

    Raises:
        RobotFileError: The file is wrong; the error holds everything that is, with its place.
        Dh2simError: It cannot be read.
    """
    data, report = read_yaml_file(path)
    tree, places = read_tree(
        WAYPOINT_FILE,
        lambda tree, scope: _check(tree, scope, spec),
        data,
        report,
        None,
        default_units=spec.units,
        needs="a trajectory needs waypoints",
    )
    units = Units(**{"angle": spec.units.angle, "length": spec.units.length, **tree.get("units", {})})
    fields = WAYPOINT_FILE.fields({key: value for key, value in tree.items() if key != "waypoints"}, units)
    points = tuple(
        replace(_in_si(entry, spec, units), place=places.place(("waypoints", index)))
        for index, entry in enumerate(tree["waypoints"])
    )
    limits = limits_in_si(tree.get("limits", {}), spec.moving_rows, units)
    return WaypointFile(**{**fields, "units": units, "limits": limits, "waypoints": points})


def waypoints_of(spec: RobotSpec, given: Iterable[Any]) -> tuple[Waypoint, ...]:
    """Return waypoints that are given in code, in rad and m.

    Raises:
        SettingsError: Something is wrong in them; the error holds everything that is.
    """
    if isinstance(given, str | Mapping) or not isinstance(given, Iterable):
        raise SettingsError([("", f"waypoints must be a list, got {shown(given)}")])
    note = _Noted()
    problems = note.problems
    scope = Scope(report=note, parameters=None, directory=None)
    found: list[Waypoint] = []
    for index, entry in enumerate(given):
        loc: Loc = ("waypoints", index)
        if isinstance(entry, Waypoint):
            found.append(entry)
            continue
        if not isinstance(entry, str | Mapping) and np.shape(entry) == (4, 4):
            try:
                found.append(Waypoint(T=read_only(read_goals(entry))))
            except ConfigurationError as error:
                note(loc, str(error))
            continue
        tree = _WAYPOINT.check(plain(entry), loc, scope)
        before = len(problems)
        if tree is not WRONG and WRONG not in tree.values():
            _check_one(tree, loc, scope, spec)
            if len(problems) == before and isinstance(tree, dict):
                found.append(_in_si(tree, spec, Units()))
    if problems:
        raise SettingsError(problems)
    return tuple(found)


class _Noted:
    """Collects the problems of waypoints made in code, which have paths but no lines."""

    def __init__(self) -> None:
        self.problems: list[tuple[str, str]] = []

    def __call__(self, loc: Loc, message: str, *, at_key: bool = False, path: Loc | None = None) -> None:  # noqa: ARG002
        self.problems.append(("", f"{path_of(loc if path is None else path)}: {message}"))

    def line(self, *locs: Loc) -> str:  # noqa: ARG002
        return ""


def _check(tree: Tree, scope: Scope, spec: RobotSpec) -> None:
    """Report what does not go together in a waypoint file."""
    robot = tree.get("robot")
    if isinstance(robot, str) and robot not in ("", spec.name):
        scope.report(("robot",), f"these waypoints are for {shown(robot)}, not for '{spec.name}'")
    points = tree.get("waypoints")
    if not isinstance(points, list):
        return
    if len(points) < 2:
        scope.report(("waypoints",), "at least two waypoints are needed: the first is where the motion starts")
    for index, entry in enumerate(points):
        if isinstance(entry, dict):
            _check_one(entry, ("waypoints", index), scope, spec)


def _check_one(entry: Tree, loc: Loc, scope: Scope, spec: RobotSpec) -> None:
    """Report what does not go together in a waypoint."""
    q, rows = entry.get("q"), spec.moving_rows
    circle = "centre" in entry
    goals = [key for key in ("q", "xyz", "centre") if key in entry]
    if len(goals) != 1:
        found = f"{' and '.join(goals)} exclude each other" if goals else "no place is given"
        scope.report(loc, f"{found}; give one of q, xyz and centre")
    if isinstance(q, str):
        try:
            spec.configuration(q)
        except ConfigurationError as error:
            scope.report((*loc, "q"), str(error))
    if isinstance(q, list) and len(q) != len(rows):
        names = listed(row.name for row in rows)
        scope.report((*loc, "q"), f"expected {len(rows)} joint coordinates ({names}), found {len(q)}")
    if "rpy" in entry and "quaternion" in entry:
        scope.report((*loc, "quaternion"), "cannot be combined with rpy")
    if isinstance(entry.get("quaternion"), list) and not any(entry["quaternion"]):
        scope.report((*loc, "quaternion"), "has length zero")
    if isinstance(entry.get("axis"), list) and not any(entry["axis"]):
        scope.report((*loc, "axis"), "has length zero")
    scope_of = {"rpy": "xyz", "quaternion": "xyz", "axis": "centre", "angle": "centre"}
    for key, wanted in scope_of.items():
        if key in entry and wanted not in entry:
            scope.report((*loc, key), f"needs {wanted}")
    if circle and "angle" not in entry:
        scope.report(loc, "an arc about a centre needs its angle")
    kind = entry.get("kind")
    if ("via" in entry or circle) and kind not in (None, MoveKind.ARC, WRONG):
        scope.report((*loc, "kind"), f"via and centre make an arc, found kind {shown(str(kind))}")
    if "via" in entry and circle:
        scope.report((*loc, "via"), "cannot be combined with centre")
    if "duration" in entry and "time" in entry:
        scope.report((*loc, "time"), "cannot be combined with duration")
    if entry.get("stop") is False and entry.get("wait"):
        scope.report((*loc, "wait"), "cannot be combined with stop: false")


def _in_si(entry: Tree, spec: RobotSpec, units: UnitsLike) -> Waypoint:
    """Return a checked waypoint in SI units."""
    fields = _WAYPOINT.fields({key: value for key, value in entry.items() if key != "q"}, units)
    q = entry.get("q")
    if isinstance(q, str):
        fields["name"] = fields.get("name") or q
        fields["q"] = spec.named_configurations[q]
    elif q is not None:
        fields["q"] = read_only(
            [
                units.to_si(value, Dimension.COORDINATE, turns=row.type.turns)
                for value, row in zip(q, spec.moving_rows, strict=True)
            ]
        )
    return Waypoint(**fields)


def limits_in_si(given: Mapping[str, Any], rows: Sequence[Row], units: Units) -> Mapping[str, LimitValue]:
    """Return limits in rad and m that are given in some units; shares of the robot's own stay as they are.

    Args:
        given: By name, as ``requested_limits`` takes them.
        rows: The moving rows.
        units: Of the numbers.
    """

    def si(value: Any, *, turns: bool) -> Any:
        number = isinstance(value, int | float) and math.isfinite(value)
        return units.coordinate(float(value), turns=turns) if number else value

    turns = {row.name: row.type.turns for row in rows}
    found: dict[str, Any] = {}
    for name, value in given.items():
        if name in ("tool_speed", "tool_turn"):
            found[name] = si(value, turns=name == "tool_turn")
        elif isinstance(value, Mapping):
            found[name] = {joint: si(each, turns=turns.get(joint, True)) for joint, each in value.items()}
        elif isinstance(value, list):
            found[name] = [
                si(each, turns=turn)
                for each, turn in zip(value, [*turns.values(), *[True] * len(value)], strict=False)
            ]
        else:
            found[name] = {joint: si(value, turns=turn) for joint, turn in turns.items()}
    return found
