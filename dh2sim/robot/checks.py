"""Checks between the values of a robot; each looks at what is right by itself and leaves the rest alone.

They work on the trees that ``parts.Part.check`` returns, in whatever units, of robot files, axes files and robots
made in code.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final, NamedTuple

from dh2sim.messages import Loc, listed, path_of, shown
from dh2sim.robot.fields import COORDINATE, IN_SI, WRONG, Scope, Tree, is_reserved, name_problem
from dh2sim.robot.magnitudes import LENGTH, shown_size

_SLACK: Final = 1e-12
"""By which a configuration may pass a limit, of the larger of the two limits' sizes."""
_WHOLE_SLACK: Final = 1.0 + 1e-9
"""By which the lengths of a robot may pass their bound together, times."""
_GAINS: Final = {"kp": ("position",), "kv": ("position", "velocity")}
"""The actuators that a gain is for."""
_SIZES: Final = {"box": ("size",), "cylinder": ("radius", "length"), "sphere": ("radius",)}
"""The sizes that a shape has."""


def default_name(index: int, branch: str = "") -> str:
    """Return the name of a row that is given none, of the main chain or of a branch; ``index`` counts from 0."""
    return f"{branch}_joint_{index + 1}" if branch else f"joint_{index + 1}"


class PlacedRow(NamedTuple):
    """A row of a checked tree, and its place."""

    loc: Loc
    row: Tree
    name: Any
    """Its own or default name; WRONG where that is wrong."""


def placed_rows(robot: Tree, key: str = "joints") -> list[PlacedRow]:
    """Return the rows of a checked tree in the order of a joint vector: the main chain, then the branches."""
    placed = _placed(trees(robot, key), (key,), "")
    branches = robot.get("branches")
    for name, branch in branches.items() if isinstance(branches, dict) else ():
        if isinstance(branch, dict):
            placed += _placed(trees(branch, key), ("branches", str(name), key), str(name))
    return placed


def _placed(rows: Sequence[Tree], loc: Loc, branch: str) -> list[PlacedRow]:
    return [
        PlacedRow((*loc, index), row, row.get("name", default_name(index, branch))) for index, row in enumerate(rows)
    ]


def check(robot: Tree, scope: Scope) -> None:
    """Report what does not go together in a robot."""
    rows = placed_rows(robot)
    check_names(rows, scope)
    for placed in rows:
        check_type(placed.row, placed.loc, scope)
        _check_convention(placed.row, placed.loc, robot, scope)
    check_configurations(robot, rows, scope)
    check_actuators(robot, rows, scope)
    _check_tool(robot.get("tool"), scope)
    _check_masses(robot, rows, scope)
    _check_whole_length(robot, rows, scope)


def trees(tree: Any, key: str) -> list[Tree]:
    """Return the entries of a list in a checked tree; an empty tree for one that is wrong."""
    entries = tree.get(key, ()) if isinstance(tree, dict) else ()
    return [entry if isinstance(entry, dict) else {} for entry in entries] if isinstance(entries, list) else []


def check_names(rows: Sequence[PlacedRow], scope: Scope) -> None:
    """Joint names are unique, and none is one that the exports need."""
    first: dict[str, Loc] = {}
    for place, row, name in rows:
        if name is WRONG:
            continue
        loc: Loc = (*place, "name") if "name" in row else place
        if is_reserved(name):
            scope.report(loc, f"{shown(name)} is the name of a fixed joint in the exports; choose another")
        other = first.setdefault(name, place)
        if other != place:
            what = "joint name" if "name" in row else "default joint name"
            line = scope.report.line((*other, "name"), other)
            scope.report(loc, f"duplicate {what} {shown(name)}; {path_of(other)}{line} has it already")


def check_type(row: Tree, loc: Loc, scope: Scope) -> None:
    """A row has nothing that its type has no use for."""
    limits = row.get("limits")
    if row.get("type") == "continuous" and isinstance(limits, dict) and "position" in limits:
        message = "a continuous joint has no position limits; make it revolute or remove them"
        scope.report((*loc, "limits", "position"), message, at_key=True)
    if row.get("type") != "fixed":
        return
    for key in ("flip", "limits", "dynamics", "actuator"):
        if key not in row or (key == "flip" and row[key] is not True):
            continue
        if key == "actuator" and row[key] == {"type": "none"} and not scope.in_file:
            continue  # as a RobotSpec fills it in
        scope.report((*loc, key), f"a fixed row does not move: it takes no '{key}'", at_key=True)


def _check_convention(row: Tree, loc: Loc, robot: Tree, scope: Scope) -> None:
    """A row has no parameter that its convention has no use for."""
    convention, kind = row.get("convention", robot.get("convention")), row.get("type")
    if convention == "hayati":
        if "d" in row and isinstance(kind, str) and kind != "prismatic":
            message = f"a {kind} Hayati row takes no 'd', which nearly parallel axes leave free; "
            message += "use 'a' and 'beta', or another convention for this row"
            scope.report((*loc, "d"), message, at_key=True)
    elif isinstance(convention, str) and "beta" in row:
        message = f"a {convention} row takes no 'beta', the second twist of a row of 'convention: hayati'"
        scope.report((*loc, "beta"), message, at_key=True)


def check_configurations(robot: Tree, rows: Sequence[PlacedRow], scope: Scope, *, each: str = "moving row") -> None:
    """Configurations have proper names, a value for each moving row, and each value within its limits."""
    configurations = robot.get("configurations")
    if not isinstance(configurations, dict):
        return
    for name, values in configurations.items():
        if problem := name_problem(name, "the name of a configuration"):
            scope.report(("configurations", str(name)), problem, at_key=True, path=("configurations",))
        check_joint_vector(values, ("configurations", str(name)), rows, scope, each=each)


def check_joint_vector(
    values: Any, loc: Loc, rows: Sequence[PlacedRow], scope: Scope, *, each: str = "moving row"
) -> None:
    """A joint vector has a value for each moving row, each within its limits."""
    countable = bool(rows) and all(isinstance(placed.row.get("type"), str) for placed in rows)
    if not countable or not isinstance(values, list):
        return
    moving = [placed for placed in rows if placed.row["type"] != "fixed"]
    called = [path_of(placed.loc) if placed.name is WRONG else placed.name for placed in moving]
    if len(values) != len(moving):
        expected = f"expected {len(moving)} numbers, one for each {each} ({listed(called)})"
        scope.report(loc, f"{expected}, found a list of {len(values)}")
        return
    scopes = {kind: replace(scope, joint_type=kind) for kind in {placed.row["type"] for placed in moving}}
    largest = {kind: COORDINATE.largest(within) for kind, within in scopes.items()}
    for place, (value, placed, joint) in enumerate(zip(values, moving, called, strict=True)):
        if value is WRONG:
            continue
        kind = placed.row["type"]
        if abs(value) > largest[kind] and (problem := COORDINATE.size_problem(value, scopes[kind])):
            scope.report((*loc, place), f"{problem}, found {shown(value)}")
        elif limits := _outside(value, placed.row):
            lower, upper = limits
            outside = f"{value!r} is outside the limits of {joint}: {lower!r} to {upper!r}"
            scope.report((*loc, place), outside + _whole_turn_hint(value, placed.row, limits, scope))


def _outside(value: float, row: Tree) -> tuple[float, float] | None:
    """Return a row's position limits if a coordinate is outside of them."""
    limits = row.get("limits")
    position: Any = limits.get("position", WRONG) if isinstance(limits, dict) else WRONG
    if position is WRONG or row["type"] == "continuous":
        return None
    lower, upper = position
    slack = _SLACK * max(abs(lower), abs(upper))
    if math.isnan(slack) or not (value < lower - slack or value > upper + slack):
        return None
    return lower, upper


def _whole_turn_hint(value: float, row: Tree, limits: tuple[float, float], scope: Scope) -> str:
    """Return which coordinate within the limits is the same angle, or the empty string."""
    if row["type"] != "revolute":
        return ""
    turn = 360.0 if scope.angle == "deg" else 2 * math.pi
    same = value - turn * round((value - (limits[0] + limits[1]) / 2) / turn)
    return f"; {same:.12g} is the same angle" if limits[0] <= same <= limits[1] else ""


def check_actuators(robot: Tree, rows: Sequence[PlacedRow], scope: Scope) -> None:
    """An actuator has only the gains that its type uses."""
    shared = robot.get("actuators")
    default = _check_gains(shared, ("actuators",), "position", scope)
    for loc, row, _ in rows:
        if row.get("type") != "fixed":
            _check_gains(row.get("actuator"), (*loc, "actuator"), default, scope)


def _check_gains(actuator: Any, loc: Loc, inherited: Any, scope: Scope) -> Any:
    """Report gains that an actuator has no use for; return its type."""
    if not isinstance(actuator, dict):
        return inherited
    kind = actuator.get("type", inherited)
    for gain, kinds in _GAINS.items():
        if gain in actuator and isinstance(kind, str) and kind not in kinds:
            message = f"an actuator of type '{kind}' takes no {gain}; {gain} is for {' and '.join(kinds)}"
            scope.report((*loc, gain), message, at_key=True)
    if kind == "velocity" and actuator.get("kv") == 0.0:
        scope.report((*loc, "kv"), "must be greater than 0 for an actuator of type 'velocity', found 0")
    return kind


def _check_tool(tool: Any, scope: Scope) -> None:
    """A shape has the sizes of its type, and what has a centre of mass has a mass."""
    if not isinstance(tool, dict):
        return
    shape = tool.get("shape")
    if isinstance(shape, dict) and isinstance(kind := shape.get("type"), str):
        for key in ("size", "radius", "length"):
            if key in shape and key not in _SIZES[kind]:
                message = f"a {kind} takes no '{key}'; its sizes: {listed(_SIZES[kind])}"
                scope.report(("tool", "shape", key), message, at_key=True)
            elif key not in shape and key in _SIZES[kind]:
                scope.report(("tool", "shape"), f"missing key '{key}', of a {kind}")
    if "shape" not in tool and "mass" not in tool:
        for key in ("com", "inertia"):
            if key in tool:
                message = f"a tool that has a '{key}' needs a 'mass', or a 'shape' to estimate it from"
                scope.report(("tool", key), message, at_key=True)


def _check_masses(robot: Tree, rows: Sequence[PlacedRow], scope: Scope) -> None:
    """What weighs nothing has no centre of mass, and the last joint of each chain moves some mass."""
    tool = _part(robot, "tool")
    links = [((*placed.loc, "link"), _part(placed.row, "link")) for placed in rows]
    for loc, owner in [*links, (("tool",), tool)]:
        for key in ("com", "inertia"):
            if owner.get("mass") == 0 and key in owner:
                scope.report((*loc, key), f"what has a mass of 0 has no '{key}'", at_key=True)
    chains: dict[Loc, list[PlacedRow]] = {}
    for placed in rows:
        chains.setdefault(placed.loc[:-1], []).append(placed)
    for loc, chain in chains.items():
        _check_last_mass(chain, tool if len(loc) == 1 else {}, scope)


def _check_last_mass(rows: Sequence[PlacedRow], tool: Tree, scope: Scope) -> None:
    last = max((k for k, placed in enumerate(rows) if placed.row.get("type") not in (None, "fixed")), default=None)
    if last is None or any(_part(placed.row, "link").get("mass") != 0 for placed in rows[last:]):
        return  # what is not given is estimated
    if tool.get("mass", 0) == 0 and ("mass" in tool or "shape" not in tool):
        message = f"{rows[last].name} would move nothing that has mass; 0 is for links between others"
        scope.report((*rows[last].loc, "link", "mass"), f"{message}, or before a tool that has a mass")


def _check_whole_length(robot: Tree, rows: Sequence[PlacedRow], scope: Scope) -> None:
    """The lengths of a robot are not too large together: those of neighbours add up when an export is imported."""
    most = LENGTH.most / IN_SI[scope.length]
    lengths: list[tuple[Loc, Any]] = [(("base",), _part(robot, "base").get("xyz"))]
    lengths += [(placed.loc, [placed.row.get("a", 0.0), placed.row.get("d", 0.0)]) for placed in rows]
    lengths.append((("tool",), _part(robot, "tool").get("xyz")))
    total = 0.0
    for loc, values in lengths:
        total += _length(values)
        if total > most * _WHOLE_SLACK:
            message = f"the lengths up to here add up to {total:.6g} {scope.length}"
            scope.report(loc, f"{message}; those of a robot may be {shown_size(most)} {scope.length} together")
            return


def _length(values: Any) -> float:
    """Return the size of a vector; 0 for one that is wrong or not given."""
    known = isinstance(values, list) and all(isinstance(value, int | float) for value in values)
    return math.hypot(*values) if known else 0.0


def _part(tree: Tree, key: str) -> Tree:
    """Return a part of a checked tree; an empty tree for one that is wrong or not given."""
    part = tree.get(key)
    return part if isinstance(part, dict) else {}
