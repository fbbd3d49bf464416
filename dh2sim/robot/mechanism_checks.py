"""Checks of branches, closures, actuated joints and the assembly: frames exist, and every closure closes a loop."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from dh2sim.messages import Loc, did_you_mean, listed, path_of, shown
from dh2sim.robot.checks import check_joint_vector, placed_rows, trees
from dh2sim.robot.fields import WRONG, Scope, Tree, name_problem
from dh2sim.robot.magnitudes import MOST_CLOSURES, MOST_ROWS

Carrier = tuple[str, int]
"""Branch, empty for the main chain, and how many of its rows carry a frame."""
_BASE: Final[Carrier] = ("", 0)


def default_closure_name(index: int) -> str:
    """Return the name of a closure that is given none; ``index`` counts from 0, the name from 1."""
    return f"closure_{index + 1}"


def chain_frames(rows: int, branch: str = "") -> Iterator[tuple[str, int]]:
    """Yield the frames of a chain, each with how many rows carry it.

    Those of the main chain are base_link, link_1 … link_n, dh_0 … dh_n and tool0; those of a branch ``rocker``
    are rocker/link_1 … and rocker/dh_0 ….
    """
    prefix = f"{branch}/" if branch else ""
    if not branch:
        yield "base_link", 0
    yield from ((f"{prefix}link_{i}", i) for i in range(1, rows + 1))
    yield from ((f"{prefix}dh_{i}", i) for i in range(rows + 1))
    if not branch:
        yield "tool0", rows


def check_mechanism(robot: Tree, scope: Scope) -> None:
    """Report what does not go together in the branches and closures of a robot."""
    branches = robot.get("branches")
    tables = {str(name): b for name, b in branches.items()} if isinstance(branches, dict) else {}
    if branches is WRONG or any(not isinstance(branch, dict) for branch in tables.values()):
        return
    rows = placed_rows(robot)
    if tables and len(rows) > MOST_ROWS:
        scope.report(
            ("branches",), f"the main chain and the branches have {len(rows)} rows; at most {MOST_ROWS} are allowed"
        )
    main = trees(robot, "joints")
    frames: dict[str, Carrier] = {name: ("", carried) for name, carried in chain_frames(len(main))}
    chains: dict[str, list[Tree]] = {"": main}
    starts: dict[str, Carrier] = {}
    for name, branch in tables.items():
        if problem := name_problem(name, "the name of a branch"):
            scope.report(("branches", name), problem, at_key=True, path=("branches",))
        origin = _check_origin(name, tables, frames, scope)
        starts[name] = _BASE if origin is WRONG else origin
        chains[name] = trees(branch, "joints")
        frames |= {frame: (name, carried) for frame, carried in chain_frames(len(chains[name]), name)}
    if not main:
        return
    bodies = {frame: _body(carrier, chains, starts) for frame, carrier in frames.items()}
    _check_closures(robot, bodies, scope)
    _check_actuated(robot, scope)
    _check_assembly(robot, scope)


def _check_origin(name: str, branches: Mapping[str, Tree], frames: Mapping[str, Carrier], scope: Scope) -> Any:
    """A branch starts from a frame of the main chain, or of a branch before it; return what carries that."""
    loc: Loc = ("branches", name, "from")
    origin = branches[name].get("from", WRONG)
    if origin is WRONG:
        return WRONG
    if origin in frames:
        return frames[origin]
    other = origin.partition("/")[0]
    if other in branches and "/" in origin and (circle := _circle(name, branches)):
        message = f"branches start from each other in a circle: {listed(circle, ' -> ')}"
    elif other in branches and "/" in origin and list(branches).index(other) > list(branches).index(name):
        message = f"{shown(origin)} is of a branch that comes later; put '{other}' before '{name}'"
    else:
        message = f"unknown frame {shown(origin)}.{did_you_mean(origin, frames)} Frames: {listed(frames)}"
    return scope.wrong(loc, message)


def _circle(name: str, branches: Mapping[str, Tree]) -> list[str]:
    """Return the branches that lead from one back to itself, or nothing."""
    trail = [name]
    while True:
        origin = branches[trail[-1]].get("from")
        following = origin.partition("/")[0] if isinstance(origin, str) and "/" in origin else ""
        if following not in branches:
            return []
        trail.append(following)
        if following == name:
            return trail
        if following in trail[:-1]:
            return []


def _body(carrier: Carrier, chains: Mapping[str, list[Tree]], starts: Mapping[str, Carrier]) -> Carrier:
    """Return the last moving row that carries a frame: frames of one are fixed to each other."""
    branch, carried = carrier
    while carried and chains[branch][carried - 1].get("type") == "fixed":
        carried -= 1
    return (branch, carried) if carried else _body(starts[branch], chains, starts) if branch else _BASE


_INSIDE = ("_slide", "_hinge")
"""Ends of the names of joints that an MJCF has inside of closures."""


def _check_closures(robot: Tree, bodies: Mapping[str, Carrier], scope: Scope) -> None:
    """Closures have names of their own, and lie between frames that move against each other."""
    closures = trees(robot, "closures")
    if len(closures) > MOST_CLOSURES:
        scope.report(("closures",), f"the list has {len(closures)} entries; at most {MOST_CLOSURES} are allowed")
    first: dict[str, int] = {}
    joints = {row.name for row in placed_rows(robot) if row.name is not WRONG}
    for index, closure in enumerate(closures):
        loc: Loc = ("closures", index)
        name = closure.get("name", default_closure_name(index))
        if name is not WRONG and first.setdefault(name, index) != index:
            place: Loc = ("closures", first[name])
            line = scope.report.line((*place, "name"), place)
            message = f"duplicate closure name {shown(name)}; {path_of(place)}{line} has it already"
            scope.report((*loc, "name") if "name" in closure else loc, message)
        taken = (
            [] if name is WRONG else [each for each in (name, *(f"{name}{end}" for end in _INSIDE)) if each in joints]
        )
        if taken:
            own = "" if taken[0] == name else f"; {taken[0]} is the name of a joint inside the closure"
            message = f"{shown(name)} clashes with the joint {shown(taken[0])}{own}"
            scope.report((*loc, "name") if "name" in closure else loc, message)
        between = closure.get("between", WRONG)
        if between is WRONG:
            continue
        unknown = [(k, frame) for k, frame in enumerate(between) if frame is not WRONG and frame not in bodies]
        for k, frame in unknown:
            message = f"unknown frame {shown(frame)}.{did_you_mean(frame, bodies)} Frames: {listed(bodies)}"
            scope.report((*loc, "between", k), message)
        if unknown or WRONG in between:
            continue
        a, b = between
        if bodies[a] == bodies[b]:
            scope.report((*loc, "between"), f"no joint moves between {shown(a)} and {shown(b)}: they close no loop")


def _check_actuated(robot: Tree, scope: Scope) -> None:
    """Actuated are joints that move, each named once; others have no actuator of their own."""
    actuated = robot.get("actuated")
    if not isinstance(actuated, list):
        return
    rows = placed_rows(robot)
    moving = [placed.name for placed in rows if placed.row.get("type") != "fixed" and placed.name is not WRONG]
    fixed = [placed.name for placed in rows if placed.row.get("type") == "fixed"]
    for index, name in enumerate(actuated):
        loc: Loc = ("actuated", index)
        if name is WRONG:
            continue
        if name in fixed:
            scope.report(loc, f"{shown(name)} is a fixed row, which does not move")
        elif name not in moving:
            message = f"unknown joint {shown(name)}.{did_you_mean(name, moving)} Joints: {listed(moving)}"
            scope.report(loc, message)
        elif name in actuated[:index]:
            scope.report(loc, f"{shown(name)} is named twice")
    for loc, row, name in rows:
        actuator = row.get("actuator")
        if isinstance(actuator, dict) and name not in actuated and actuator.get("type") != "none" and name in moving:
            message = f"{name} is not among 'actuated', and takes no 'actuator'"
            scope.report((*loc, "actuator"), message, at_key=True)


def _check_assembly(robot: Tree, scope: Scope) -> None:
    """The assembly is of a robot with loops, and has a value for each moving row."""
    assembly = robot.get("assembly")
    if not isinstance(assembly, dict):
        return
    if not robot.get("closures"):
        scope.report(("assembly",), "there is nothing to assemble: the robot has no closures", at_key=True)
    check_joint_vector(assembly.get("q"), ("assembly", "q"), placed_rows(robot), scope)
