"""Checks between parts of a robot file; each works on what is well-formed and leaves the rest alone.

What can be told of each row of the table, or of each axis, even where other parts of the file are wrong.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, TypeVar

from dh2sim.messages import listed, shown
from dh2sim.robot.expressions import NumberError, to_number
from dh2sim.robot.schema import is_reserved, name_problem
from dh2sim.robot.spec import ActuatorType, Convention, JointType
from dh2sim.robot.yaml_tree import Loc, Node, Report, path_of

Choice = TypeVar("Choice", bound=StrEnum)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RowView:
    """A row of the table, or an axis; None or NaN where the file is wrong."""

    key: str
    """Of the list that it stands in."""
    index: int
    """From 0."""
    node: Node
    name: str | None
    """The name given, or the default one."""
    type: JointType | None
    position: tuple[float, float] | None
    """Limits in the file's units; None where there are none."""

    @property
    def loc(self) -> Loc:
        """Where the row stands."""
        return (self.key, self.index)


def number_at(node: Node | None, names: Mapping[str, float]) -> float:
    """Return a number, or NaN where there is none or a wrong one."""
    try:
        return math.nan if node is None else to_number(node.value, names)
    except NumberError:
        return math.nan


def choice_at(node: Node | None, choices: type[Choice]) -> Choice | None:
    """Return a member of an enumeration, or None where there is none or a wrong one."""
    value = None if node is None else node.value
    return next((choice for choice in choices if choice.value == value), None)


def row_views(root: Node, names: Mapping[str, float], key: str = "joints") -> list[RowView]:
    """Return a view of every entry of the list that stands at ``key``."""
    joints = root.at(key)
    items = joints.value if joints is not None and isinstance(joints.value, list) else []
    return [_view(key, index, node, names) for index, node in enumerate(items)]


def default_name(index: int) -> str:
    """Return the name of a row that is given none; ``index`` counts from 0, the name from 1."""
    return f"joint_{index + 1}"


def _view(key: str, index: int, node: Node, names: Mapping[str, float]) -> RowView:
    name_node = node.at("name")
    name: object = default_name(index) if name_node is None else name_node.value
    limits = node.at("limits", "position")
    lower, upper = (number_at(node.at("limits", "position", side), names) for side in (0, 1))
    return RowView(
        key=key,
        index=index,
        node=node,
        name=name if isinstance(name, str) and name_problem(name) is None else None,
        type=choice_at(node.at("type"), JointType),
        position=None if limits is None else (lower, upper),
    )


_SLACK: Final = 1e-12
"""By which a configuration may pass a limit, of the larger of the two limits' sizes."""
_TAKEN_BY: Final = {
    "kp": (ActuatorType.POSITION,),
    "kv": (ActuatorType.POSITION, ActuatorType.VELOCITY),
}
"""Which actuators a gain is for."""


def check(root: Node, names: Mapping[str, float], report: Report) -> None:
    """Note in ``report`` what does not go together; ``names`` are the evaluated parameters."""
    rows = row_views(root, names)
    check_names(rows, report)
    for row in rows:
        check_type(row, report)
        _check_convention(row, root, report)
    check_configurations(root, rows, names, report)
    check_actuators(root, rows, report)


def check_names(rows: Sequence[RowView], report: Report) -> None:
    """Joint names are unique, and none is one that the exports need."""
    first: dict[str, RowView] = {}
    for row in rows:
        if row.name is None:
            continue
        given = row.node.at("name")
        place = given or row.node
        loc: Loc = (*row.loc, "name") if given else row.loc
        if is_reserved(row.name):
            message = f"{shown(row.name)} is the name of a fixed joint in the exports; choose another"
            report.add(place.line, place.column, loc, message)
        other = first.setdefault(row.name, row)
        if other is not row:
            line = (other.node.at("name") or other.node).line
            what = "joint name" if given else "default joint name"
            message = f"duplicate {what} {shown(row.name)}; {path_of(other.loc)} on line {line} has it already"
            report.add(place.line, place.column, loc, message)


def check_type(row: RowView, report: Report) -> None:
    """A row has nothing that its type has no use for."""
    node, here = row.node, row.loc
    if row.type is JointType.CONTINUOUS and (entry := node.entry("limits", "position")):
        message = "a continuous joint has no position limits; make it revolute or remove them"
        report.add(entry.line, entry.column, (*here, "limits", "position"), message)
    if row.type is not JointType.FIXED:
        return
    for key in ("flip", "limits", "dynamics", "actuator"):
        entry = node.entry(key)
        if entry is not None and (key != "flip" or entry.value.value is True):
            message = f"a fixed row does not move: it takes no '{key}'"
            report.add(entry.line, entry.column, (*here, key), message)


def _check_convention(row: RowView, root: Node, report: Report) -> None:
    """A row has no parameter that its convention has no use for."""
    node, here = row.node, row.loc
    convention = choice_at(node.at("convention") or root.at("convention"), Convention)
    if convention is Convention.HAYATI:
        entry = node.entry("d") if row.type not in (None, JointType.PRISMATIC) else None
        if entry is not None:
            message = f"a {row.type} Hayati row takes no 'd', which nearly parallel axes leave free; "
            message += "use 'a' and 'beta', or another convention for this row"
            report.add(entry.line, entry.column, (*here, "d"), message)
    elif convention is not None and (entry := node.entry("beta")):
        message = f"a {convention} row takes no 'beta', the second twist of a row of 'convention: hayati'"
        report.add(entry.line, entry.column, (*here, "beta"), message)


def check_configurations(
    root: Node, rows: Sequence[RowView], names: Mapping[str, float], report: Report, *, each: str = "moving row"
) -> None:
    """Configurations have proper names, a value for each moving row, and each value within its limits."""
    node = root.at("configurations")
    if node is None or not isinstance(node.value, dict):
        return
    moving = [row for row in rows if row.type is not JointType.FIXED]
    countable = bool(rows) and all(row.type is not None for row in rows)
    for name, entry in node.value.items():
        if problem := name_problem(name, "the name of a configuration"):
            report.add(entry.line, entry.column, ("configurations",), problem)
        values = entry.value
        loc: Loc = ("configurations", name)
        if not countable or not isinstance(values.value, list):
            continue
        if len(values.value) != len(moving):
            joints = listed(row.name or path_of(row.loc) for row in moving)
            expected = f"expected {len(moving)} numbers, one for each {each} ({joints})"
            message = f"{expected}, found a list of {len(values.value)}"
            report.add(values.line, values.column, loc, message)
            continue
        for index, (value, row) in enumerate(zip(values.value, moving, strict=True)):
            if outside := _outside(number_at(value, names), row):
                report.add(value.line, value.column, (*loc, index), outside)


def _outside(value: float, row: RowView) -> str | None:
    """Return a complaint about a coordinate outside a row's position limits, or None."""
    if row.position is None or row.type is JointType.CONTINUOUS:
        return None
    lower, upper = row.position
    slack = _SLACK * max(abs(lower), abs(upper))
    if math.isnan(slack) or lower >= upper or not (value < lower - slack or value > upper + slack):
        return None
    return f"{value!r} is outside the limits of {row.name or path_of(row.loc)}: {lower!r} to {upper!r}"


def check_actuators(root: Node, rows: Sequence[RowView], report: Report) -> None:
    """An actuator has only the gains that its type uses."""
    default = _actuator_type(root.at("actuators"), ActuatorType.POSITION)
    _check_gains(root, ("actuators",), default, report)
    for row in rows:
        if row.type is not JointType.FIXED:
            place: Loc = (*row.loc, "actuator")
            _check_gains(root, place, _actuator_type(root.at(*place), default), report)


def _actuator_type(node: Node | None, inherited: ActuatorType | None) -> ActuatorType | None:
    """Return an actuator's type; None where it is wrong."""
    if node is None or node.at("type") is None:
        return inherited
    return choice_at(node.at("type"), ActuatorType)


def _check_gains(root: Node, loc: Loc, kind: ActuatorType | None, report: Report) -> None:
    for gain, kinds in _TAKEN_BY.items():
        entry = root.entry(*loc, gain)
        if entry is not None and kind is not None and kind not in kinds:
            message = f"an actuator of type '{kind}' takes no {gain}; {gain} is for {' and '.join(kinds)}"
            report.add(entry.line, entry.column, (*loc, gain), message)
