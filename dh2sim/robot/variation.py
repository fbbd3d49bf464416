"""Robots that differ from one robot in some numbers of its file.

A number is named by a parameter of the robot file (``d1``); by a cell of the main table (``a2``, ``alpha2``,
``theta1``, ``beta4``, ``d3``: of rows 2, 2, 1, 4 and 3); or by its path as messages spell it
(``joints[1].link.mass``), in which a joint's name may stand for its entry (``elbow.link.mass``). A parameter comes
before a cell of the same name.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, Final

import numpy as np

from dh2sim.errors import Problem, RobotError
from dh2sim.messages import Loc, did_you_mean, listed, loc_of, path_of, shown
from dh2sim.robot.expressions import CONSTANTS, evaluate_in, names_in
from dh2sim.robot.fields import IN_SI, WRONG, Color, Dimension, Kind, Number, Numbers, Scope, Tree
from dh2sim.robot.parts import Inertia, InertiaNumbers, NamedParts, Part, Parts
from dh2sim.robot.read import Places, evaluate_parameters, plain_node, units_of
from dh2sim.robot.row import Dynamics, Row
from dh2sim.robot.spec import ROBOT, RobotSpec, check_robot, robot_fields, robot_of_checked
from dh2sim.robot.units import Units
from dh2sim.robot.write import robot_file_text
from dh2sim.robot.yaml_tree import Report, compose
from dh2sim.typing import Array

CELLS: Final = ("a", "alpha", "d", "theta", "beta")
"""Of a row of a table."""
_CELL: Final = re.compile(rf"({'|'.join(CELLS)})_?([1-9][0-9]*)")
_NOT_DESIGNED: Final = ("parameters", "units", "configurations", "assembly", "closures")
"""Parts of a file that hold no number of the robot, or none by itself."""
_DEFAULTS: Final[Mapping[str, list[float]]] = {
    "xyz": [0.0, 0.0, 0.0],
    "rpy": [0.0, 0.0, 0.0],
    "gravity": [0.0, 0.0, -9.81],
}
"""Of vectors that a file leaves out and of which one number is named."""


class Variation:
    """Makes robots that have other values of some numbers."""

    def __init__(self, spec: RobotSpec, names: Sequence[str]) -> None:
        """Look the names up.

        Args:
            spec: The robot that the others differ from.
            names: Of the numbers, each once.

        Raises:
            RobotError: Something is not the name of a number of the robot. The error has a problem for each, whose
                path is the name.
        """
        self.names = tuple(names)
        self._file = _document(spec)
        problems: list[Problem] = []
        locs: dict[Loc, str] = {}
        units, nominal = [], []
        for name in self.names:
            try:
                loc, unit = self._file.find(name)
            except _UnknownNameError as error:
                problems.append(Problem(path=name, message=str(error)))
                continue
            if loc in locs:
                same = f"is the same number as {shown(locs[loc])}" if locs[loc] != name else "is given twice"
                problems.append(Problem(path=name, message=same))
            locs[loc] = name
            units.append(unit)
            nominal.append(self._file.value(loc))
        if problems:
            raise RobotError(problems)
        self._locs = tuple(locs)
        self.units = tuple(units)
        """Of each value, as in the robot file; empty for parameters, and for what has no unit."""
        self.nominal = tuple(nominal)
        """The values that the robot's own file gives; NaN for those that it leaves open."""

    def check(self, values: Sequence[float]) -> None:
        """Check that there is a robot with these values, in the order of the names and the units of the robot file.

        Raises:
            RobotError: There is none; the error has everything that is wrong.
        """
        self._file.checked(dict(zip(self._locs, values, strict=True)))

    def make(self, values: Sequence[float]) -> RobotSpec:
        """Return the robot with these values, in the order of the names and the units of the robot file.

        Raises:
            RobotError: There is none; the error has everything that is wrong.
        """
        return self._file.robot(self._file.checked(dict(zip(self._locs, values, strict=True))))

    def geometry(self, values: Array) -> dict[Loc, Array]:
        """Return the numbers of the table, the base and the tool that differ, computed for many robots at once.

        Args:
            values: In the order of the names and the units of the robot file, shape (T, names).

        Returns:
            In rad and m, shape (T,), by place: ``("joints", 1, "a")``, ``("tool", "xyz", 2)``. They may differ from
            those of ``make`` in the last bit; whether there are such robots is not checked.

        Raises:
            RobotError: A name is not that of such a number, or of a parameter.
        """
        given = dict(zip(self._locs, values.T, strict=True))
        others = [
            Problem(path=name, message="is not a number of the table, the base or the tool's pose")
            for name, loc in zip(self.names, self._locs, strict=True)
            if loc[0] != "parameters" and not _is_geometry(loc)
        ]
        if others:
            raise RobotError(others)
        return self._file.geometry(given)


class _UnknownNameError(ValueError):
    """No number of the robot has this name."""


class _Document:
    """The tree of a robot file, in which numbers are exchanged."""

    def __init__(self, text: str, file: str, spec: RobotSpec) -> None:
        self._report = Report(file)
        self._root = compose(text, self._report)
        self._tree: Any = _with_mesh_files(plain_node(self._root), spec)
        self._parameters = evaluate_parameters(self._root, self._report)
        self._spec = spec
        given: Any = self._tree.get("units")
        self._units = {"angle": "rad", "length": "m", **(given if isinstance(given, dict) else {})}

    def checked(self, values: Mapping[Loc, float]) -> Tree:
        """Return the checked tree of the file in which numbers have other values.

        Raises:
            RobotError: There is no such robot.
        """
        report = Report(self._report.file)
        tree, parameters = self._tree, self._parameters
        exchanged = {str(loc[1]): value for loc, value in values.items() if loc[0] == "parameters"}
        if exchanged:
            parameters = evaluate_parameters(self._root, report, exchanged)
        for loc, value in values.items():
            if loc[0] != "parameters":
                tree = _exchanged(tree, loc, float(value))
        scope = Scope(
            report=Places(self._root, report),
            parameters=parameters,
            directory=Path(),
            angle=self._units["angle"],
            length=self._units["length"],
        )
        found: Tree = ROBOT.check(tree, (), scope)
        if found is not WRONG:
            check_robot(found, scope)
        if report.problems:
            raise RobotError(Problem(path=each.path, message=each.message) for each in report.error().problems)
        return found

    def robot(self, checked: Tree) -> RobotSpec:
        """Return the robot that a checked tree describes."""
        return robot_of_checked(robot_fields(checked, units_of(checked)))

    def geometry(self, given: Mapping[Loc, Array]) -> dict[Loc, Array]:
        """Return the numbers of the robot's geometry that depend on those that are given, in SI units."""
        found = {loc: array for loc, array in given.items() if loc[0] != "parameters"}
        names: dict[str, Array] = {name: np.asarray(value) for name, value in self._parameters.items()}
        changed = {str(loc[1]): array for loc, array in given.items() if loc[0] == "parameters"}
        own = self._tree.get("parameters") or {}
        texts = {name: text for name, text in own.items() if isinstance(text, str) and name not in changed}
        names |= changed
        for _ in texts:  # once more for each, as one may need another
            for name, text in texts.items():
                if changed.keys() & {*names_in(text)}:
                    names[name] = changed[name] = evaluate_in(text, _Arrays(names))
        rows = self._spec.rows
        places: list[Loc] = [("joints", i, cell) for i in range(len(rows)) for cell in CELLS]
        places += [(owner, key, i) for owner in ("base", "tool") for key in ("xyz", "rpy") for i in range(3)]
        for loc in places:
            text = _at(self._tree, loc)
            if loc not in found and isinstance(text, str) and changed.keys() & {*names_in(text)}:
                found[loc] = evaluate_in(text, _Arrays(names))
        length = float(IN_SI[self._units["length"]])
        return {
            loc: np.radians(array)
            if _is_angle(loc) and self._units["angle"] == "deg"
            else array
            if _is_angle(loc)
            else array * length
            for loc, array in found.items()
        }

    def value(self, loc: Loc) -> float:
        """Return a number of the file itself; NaN where it has none."""
        if loc[0] == "parameters":
            return float(self._parameters[str(loc[1])])
        value = _at(self._tree, loc)
        if value is None:
            return _default(loc)
        scope = Scope(report=Places(self._root, Report("")), parameters=self._parameters, directory=None)
        found = Number().check(value, loc, scope)
        return math.nan if found is WRONG else float(found)

    def find(self, name: str) -> tuple[Loc, str]:
        """Return the place of the number that a name stands for, and its unit.

        Raises:
            _UnknownNameError: There is none.
        """
        if name in self._spec.parameters and name in self._parameters:
            if not self._is_used(name):
                raise _UnknownNameError("is a parameter that no number of the robot depends on")
            return ("parameters", name), ""
        rows = len(self._spec.rows)
        if cell := _CELL.fullmatch(name):
            if int(cell[2]) > rows:
                raise _UnknownNameError(f"is of row {cell[2]}, and the table has {rows}")
            return self._number(("joints", int(cell[2]) - 1, cell[1]))
        joints = [row.name for row in self._spec.rows]
        loc = loc_of(name)
        if loc and loc[0] in joints and loc[0] not in ROBOT.keys:
            loc = ("joints", joints.index(str(loc[0])), *loc[1:])
        if not loc or loc[0] not in ROBOT.keys or loc[0] in _NOT_DESIGNED:
            known = [*self._parameters, *(f"{cell}{i}" for i in range(1, rows + 1) for cell in CELLS)]
            examples = dict.fromkeys([*self._parameters, *(f"{cell}1" for cell in CELLS[:4])])
            raise _UnknownNameError(
                f"is not the name of a number of {self._spec.name}.{did_you_mean(name, known)} Names: "
                f"{listed(examples)} and so on, or a path such as {joints[0]}.link.mass"
            )
        return self._number(loc)

    def _number(self, path: Loc) -> tuple[Loc, str]:
        """Return the full place of a number whose path may leave out what a file may, and its unit."""
        kind: Kind = ROBOT
        loc: Loc = ()
        for part in (*path, None):
            if isinstance(kind, Part) and isinstance(part, int) and kind.list_is:
                loc, kind = (*loc, kind.list_is), kind.keys[kind.list_is]
            if isinstance(kind, Part) and part is None and kind.number_is:
                loc, kind = (*loc, kind.number_is), kind.keys[kind.number_is]
            if isinstance(kind, Inertia):
                kind = Part("", InertiaNumbers)
            if part is None:
                break
            where = path_of(loc) or "a robot file"
            match kind:
                case Part() if part in kind.keys:
                    kind = kind.keys[str(part)]
                case Part():
                    guess = did_you_mean(str(part), kind.keys)
                    raise _UnknownNameError(f"{where} has no {shown(part)}.{guess} Allowed: {listed(kind.keys)}")
                case Parts() | NamedParts():
                    entries = _at(self._tree, loc)
                    has = part in entries if isinstance(entries, dict) else False
                    if isinstance(entries, list):
                        has = isinstance(part, int) and part < len(entries)
                    if not has:
                        raise _UnknownNameError(f"{where} has no {shown(part)}")
                    kind = kind.item
                case Numbers() if isinstance(part, int) and part < kind.counts[0] and not isinstance(kind, Color):
                    if _at(self._tree, loc) is None and loc[-1] not in _DEFAULTS:
                        raise _UnknownNameError(f"is one of {kind.of} of {where}, which the robot file does not give")
                    kind = kind.item
                case _:
                    break
            loc = (*loc, part)
        if not isinstance(kind, Number) or len(loc) < len(path):
            raise _UnknownNameError(f"is not a number{_inside(kind)}")
        row = _at(self._tree, loc[:2]) if loc[0] == "joints" else {}
        turns = str(row.get("type", "")).casefold() not in ("prismatic", "p")
        unit = {Dimension.ANGLE: self._units["angle"], Dimension.LENGTH: self._units["length"], None: kind.size.unit}
        dimension = kind.dimension
        if dimension is Dimension.COORDINATE:
            dimension = Dimension.ANGLE if turns else Dimension.LENGTH
        return loc, f"{unit[dimension]}{('', '/s', '/s2', '/s3')[kind.rate]}"

    def _is_used(self, name: str) -> bool:
        """Whether a number of the robot depends on a parameter."""
        needed = {name}
        own = self._tree["parameters"]
        for _ in own:
            needed |= {key for key, text in own.items() if isinstance(text, str) and needed & {*names_in(text)}}
        others = ("description", "source", *_NOT_DESIGNED)
        rest = {key: value for key, value in self._tree.items() if key not in others}
        return any(needed & {*names_in(text)} for text in _texts(rest))


def _default(loc: Loc) -> float:
    """Return what a number is where a file leaves it out; NaN for what is then estimated."""
    *_, whole, last = loc
    if isinstance(last, int):
        return _DEFAULTS.get(str(whole), [math.nan] * 3)[last]
    owner = {"dynamics": Dynamics, "inertia": InertiaNumbers}.get(str(whole), Row)
    default = next((each.default for each in fields(owner) if each.name == last), None)
    return default if isinstance(default, float) else math.nan


def _is_geometry(loc: Loc) -> bool:
    """Whether a place holds a number of the table, the base or the tool's pose."""
    match loc:
        case ("joints", _, cell):
            return cell in CELLS
        case ("base" | "tool", "xyz" | "rpy", _):
            return True
        case _:
            return False


def _is_angle(loc: Loc) -> bool:
    return loc[-1] in ("alpha", "theta", "beta") or loc[1] == "rpy"


class _Arrays:
    """Arrays of doubles, for expressions of many robots at once."""

    def __init__(self, names: Mapping[str, Array]) -> None:
        self._names = names

    def number(self, text: str) -> Array:
        return np.asarray(float(text))

    def name(self, name: str) -> Array:
        return np.asarray(CONSTANTS[name]) if name in CONSTANTS else self._names[name]

    def call(self, function: str, arguments: list[Array]) -> Array:
        return np.asarray(_FUNCTIONS[function](*arguments))

    def power(self, base: Array, exponent: Array) -> Array:
        return np.asarray(np.power(base, exponent))


_FUNCTIONS: Final[Mapping[str, Callable[..., Any]]] = {
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "atan2": np.arctan2,
}


def _inside(kind: Kind) -> str:
    match kind:
        case Part():
            return f"; it has {listed(kind.keys)}"
        case Numbers():
            return f"; it has [0] to [{kind.counts[0] - 1}]: {kind.of}"
        case _:
            return ""


def _document(spec: RobotSpec) -> _Document:
    """Return the robot's own file, or where it has none or is not what that describes, the one written of it."""
    source = spec.source_file
    if source is not None:
        own = _Document(source.text, source.path, spec)
        written = robot_file_text(spec)
        try:
            if robot_file_text(own.robot(own.checked({}))) == written:
                return own
        except RobotError:  # such as that of a file that was found in another folder
            pass
    units = spec.units if source is not None else Units()
    return _Document(robot_file_text(spec, angle=units.angle, length=units.length), spec.name, spec)


def _with_mesh_files(tree: Any, spec: RobotSpec) -> Any:
    """Return a file's tree in which mesh files have the paths under which they were found."""
    owners: list[tuple[Loc, Any]] = [(("base",), spec.base), (("tool",), spec.tool)]
    owners += [(("joints", i, "link"), row.link) for i, row in enumerate(spec.rows)]
    for loc, owner in owners:
        if owner.mesh is not None and isinstance(_at(tree, (*loc, "mesh")), dict):
            tree = _exchanged(tree, (*loc, "mesh", "file"), str(owner.mesh.file))
    return tree


def _at(tree: Any, loc: Loc) -> Any:
    """Return what stands at a place; None for nothing."""
    for depth, part in enumerate(loc):
        if isinstance(tree, list) and isinstance(part, int):
            tree = tree[part] if part < len(tree) else None
        elif isinstance(tree, dict):
            tree = tree.get(part)
        elif tree is not None and part in ("position", "mass") and depth:  # the short form of limits and payload
            continue
        else:
            return None
    return tree


def _exchanged(tree: Any, loc: Loc, value: object) -> Any:
    """Return a tree with another value at a place; what is not on the way there is shared."""
    if not loc:
        return value
    part, rest = loc[0], loc[1:]
    if isinstance(part, int):
        items = list(tree)
        items[part] = _exchanged(items[part], rest, value)
        return items
    if not isinstance(tree, dict):  # left out, or the short form of limits or a payload
        tree = {} if tree is None else {part: tree}
    inner = tree.get(part)
    if inner is None and rest and isinstance(rest[0], int):
        inner = _DEFAULTS[part]
    return {**tree, part: _exchanged(inner, rest, value)}


def _texts(tree: Any) -> Iterator[str]:
    match tree:
        case str():
            yield tree
        case dict():
            for inner in tree.values():
                yield from _texts(inner)
        case list():
            for inner in tree:
                yield from _texts(inner)
