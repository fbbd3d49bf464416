"""Robot files to RobotSpecs."""

from __future__ import annotations

import hashlib
import math
import os
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType
from typing import Final

from dh2sim.errors import ArgumentError, Dh2simError, RobotError, UnknownRobotError
from dh2sim.input_files import read_input
from dh2sim.messages import Loc, did_you_mean, listed, loc_of, path_of, shown
from dh2sim.robot.catalog import builtin_mechanisms, builtin_path, builtin_robots
from dh2sim.robot.checks import placed_rows
from dh2sim.robot.expressions import NumberError, is_name, names_in, parameter_name_problem, to_number
from dh2sim.robot.fields import WRONG, Scope, Tree
from dh2sim.robot.parts import Part
from dh2sim.robot.spec import ROBOT, RobotSpec, SourceFile, SpecLike, check_robot, robot_fields, robot_of_checked
from dh2sim.robot.units import AngleUnit, LengthUnit, Units
from dh2sim.robot.yaml_tree import MAX_BYTES, Entry, Node, Report, check_size, compose, decode

_MOST_NAMED: Final = 8
"""Robots that an error names."""


def load_robot(path_or_name: str | os.PathLike[str]) -> RobotSpec:
    """Return the robot that a file describes.

    Args:
        path_or_name: A robot file; or the name of a robot that comes with dh2sim, with or without ``.yaml``.
            A path that exists wins.

    Raises:
        UnknownRobotError: Neither such a file nor such a robot exists.
        RobotFileError: The file is wrong; the error holds everything that is.
        Dh2simError: The file cannot be read.
    """
    given = os.fsdecode(path_or_name)
    path, file = _find(given)
    try:
        data = read_input(path, MAX_BYTES)
        size = max(len(data), path.stat().st_size)
    except OSError as error:
        raise Dh2simError(f"{given}: cannot be read: {error.strerror or error}") from error
    check_size(size, Report(file))
    return parse_robot(data, file=file, directory=path.parent)


def loaded(robot: SpecLike | str | os.PathLike[str]) -> SpecLike:
    """Return a robot that may be given by its file or name.

    Raises:
        Dh2simError: As for :func:`load_robot`.
    """
    return load_robot(robot) if isinstance(robot, str | os.PathLike) else robot


def parse_robot(
    text: str | bytes, *, file: str = "<string>", directory: Path | None = None, mesh_files: bool = True
) -> RobotSpec:
    """Return the robot that the text of a robot file describes.

    Args:
        text: The file's content.
        file: Its name, for messages.
        directory: Where paths in it start; by default the current folder.
        mesh_files: Whether it may name mesh files; if not, no path in it is followed.

    Raises:
        ArgumentError: ``text`` is neither a string nor bytes.
        RobotFileError: The text is wrong; the error holds everything that is.
    """
    if not isinstance(text, str | bytes):
        raise ArgumentError(f"text must be a string or bytes, got {type(text).__name__}")
    data = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
    report = Report(file)
    folder = directory or Path.cwd()
    tree, places = read_tree(ROBOT, check_robot, data, report, folder if mesh_files else None)
    _locate(tree, places)
    units = units_of(tree)
    fields = robot_fields(tree, units)
    if units == Units():
        return robot_of_checked(fields)
    try:
        return RobotSpec(**fields)
    except RobotError as error:  # right in the file's units alone, such as a radius that is too small in m
        for problem in error.problems:
            places(loc_of(problem.path), f"{problem.message} once converted to SI units")
        raise report.error() from None


def read_tree(
    kind: Part,
    check: Callable[[Tree, Scope], None],
    data: bytes,
    report: Report,
    directory: Path | None,
    *,
    default_units: Units | None = None,
    **compose_options: str,
) -> tuple[Tree, Places]:
    """Return the checked tree of a file, with its text as ``source_file``, and the places of its values.

    Args:
        kind: What the file describes.
        check: Checks between the values.
        data: The file's content.
        report: Where problems are noted.
        directory: Where paths in the file start; None where it may name no files.
        default_units: Of a file that names none; by default rad and m.
        **compose_options: As for ``compose``.

    Raises:
        RobotFileError: The file is wrong, in the form that ``report.error`` gives it.
    """
    text = decode(data, report)
    root = compose(text, report, **compose_options)
    places = Places(root, report)
    usual = default_units or Units()
    scope = Scope(
        report=places,
        parameters=evaluate_parameters(root, report),
        directory=directory,
        angle=_unit(root.at("units", "angle"), AngleUnit, usual.angle),
        length=_unit(root.at("units", "length"), LengthUnit, usual.length),
    )
    tree = kind.check(plain_node(root), (), scope)
    if tree is not WRONG:
        check(tree, scope)
    if report.problems:
        raise report.error()
    file = report.file
    source = SourceFile(name=Path(file).name, path=file, text=text, sha256=hashlib.sha256(data).hexdigest())
    return {**tree, "source_file": source}, places


class Places:
    """Notes the problems that checks find at their places in a file."""

    def __init__(self, root: Node, report: Report) -> None:
        """``root`` is the tree of the file."""
        self._root = root
        self._report = report

    def __call__(self, loc: Loc, message: str, *, at_key: bool = False, path: Loc | None = None) -> None:
        """Note a problem of the value at a place, or of its key."""
        path = loc if path is None else path
        if at_key and (entry := self._root.entry(*loc)):
            self._report.add(entry.line, entry.column, path, message)
        elif not (node := self._node(loc)).wrong:
            self._report.add(node.line, node.column, path, message)

    def line(self, *locs: Loc) -> str:
        """Return `` on line 4`` for the first of these places that the file has."""
        return next((f" on line {node.line}" for loc in locs if (node := self._root.at(*loc))), "")

    def place(self, loc: Loc) -> str:
        """Return ``file:line:column: path`` of a value."""
        node = self._node(loc)
        return f"{self._report.file}:{node.line}:{node.column}: {path_of(loc)}"

    def _node(self, loc: Loc) -> Node:
        """Return the node at a place, or the innermost one around it."""
        return next(node for end in range(len(loc), -1, -1) if (node := self._root.at(*loc[:end])))


def _unit(node: Node | None, units: type[StrEnum], usual: StrEnum) -> str:
    """Return a unit of the file; the usual one where it names none, or a wrong one."""
    allowed = [unit.value for unit in units]
    return str(node.value) if node is not None and node.value in allowed else usual.value


def units_of(tree: Tree) -> Units:
    """Return the units that a checked file is written in."""
    return Units(**tree.get("units", {}))


def plain_node(node: Node) -> object:
    """Return a node's value without places."""
    match node.value:
        case dict() as entries:
            return {key: plain_node(entry.value) for key, entry in entries.items()}
        case list() as items:
            return [plain_node(item) for item in items]
        case scalar:
            return scalar


def place_in(source: SourceFile, loc: Loc) -> tuple[int, int]:
    """Return the line and the column of a value in the file of a robot, or of the nearest part around it.

    Args:
        source: Its ``source_file``.
        loc: The value's place in the robot.
    """
    root = compose(source.text, Report(source.path))
    node = next(node for k in range(len(loc), -1, -1) if (node := root.at(*loc[:k])) is not None)
    return node.line, node.column


def _locate(tree: Tree, places: Places) -> None:
    """Note where the file names meshes and the assembly, of which more is found out later."""
    owners: list[tuple[Loc, Tree]] = [((key,), tree.get(key, {})) for key in ("base", "tool")]
    owners += [((*placed.loc, "link"), placed.row.get("link", {})) for placed in placed_rows(tree)]
    for loc, owner in owners:
        if "mesh" in owner:
            owner["mesh"]["location"] = places.place((*loc, "mesh", "file"))
    if "assembly" in tree:
        tree["assembly"]["location"] = places.place(("assembly", "q"))


def evaluate_parameters(
    root: Node, report: Report, exchanged: Mapping[str, float] = MappingProxyType({})
) -> Mapping[str, float]:
    """Return every parameter's value; NaN for one that is wrong, which is then in ``report``.

    Where keys of ``parameters`` could not be read, every other name has the value NaN as well.

    Args:
        root: The tree of the file.
        report: Where problems are noted.
        exchanged: Values that take the place of the file's own.
    """
    node = root.at("parameters")
    if node is None:
        return {}
    if not isinstance(node.value, dict):
        message = f"expected a mapping of names to numbers, found {shown(node.value)}"
        if not node.wrong:
            report.add(node.line, node.column, ("parameters",), message)
        return defaultdict(lambda: math.nan)
    for name, entry in node.value.items():
        if not is_name(name):
            report.add(entry.line, entry.column, ("parameters",), parameter_name_problem(name))
    entries = {name: entry for name, entry in node.value.items() if is_name(name)}
    values: dict[str, float] = defaultdict(lambda: math.nan) if node.wrong else {}
    values.update(dict.fromkeys(entries, math.nan))
    order, cycles = _order({name: _needs(entry, entries) for name, entry in entries.items()})
    for name in order:
        node = entries[name].value
        if node.wrong:
            continue
        try:
            values[name] = exchanged[name] if name in exchanged else to_number(node.value, values)
        except NumberError as error:
            report.add(node.line, node.column, ("parameters", name), str(error))
    for cycle in cycles:
        node = entries[cycle[0]].value
        message = f"parameters need each other in a circle: {listed([*cycle, cycle[0]], ' -> ')}"
        report.add(node.line, node.column, ("parameters", cycle[0]), message)
    return values


def _needs(entry: Entry, entries: Mapping[str, Entry]) -> Sequence[str]:
    text = entry.value.value
    return [name for name in names_in(text) if name in entries] if isinstance(text, str) else []


def _order(needs: Mapping[str, Sequence[str]]) -> tuple[list[str], list[tuple[str, ...]]]:
    """Return names with every name after those it needs, and the cycles that keep others out."""
    waiting_for = {name: len(needed) for name, needed in needs.items()}
    needed_by: dict[str, list[str]] = {name: [] for name in needs}
    for name, needed in needs.items():
        for other in needed:
            needed_by[other].append(name)
    order = [name for name, count in waiting_for.items() if count == 0]
    for name in order:
        for other in needed_by[name]:
            waiting_for[other] -= 1
            if waiting_for[other] == 0:
                order.append(other)
    ordered = set(order)
    cycles: list[tuple[str, ...]] = []
    seen: set[str] = set()
    for start in needs:
        trail: dict[str, int] = {}
        name = start
        while name not in ordered and name not in seen:
            seen.add(name)
            trail[name] = len(trail)
            name = next(other for other in needs[name] if other not in ordered)
        if name in trail:
            cycles.append(tuple(trail)[trail[name] :])
    return order, cycles


def _find(given: str) -> tuple[Path, str]:
    """Return the file of a path or a name, and what messages call it."""
    path = Path(given)
    if given and os.path.lexists(given):
        if path.is_dir():
            named = builtin_path(given) is not None
            hint = f"; '{given}.yaml' is the robot that comes with dh2sim" if named else ""
            raise Dh2simError(f"{given}: is a folder, not a robot file{hint}")
        return path, given
    builtin = builtin_path(given)
    if builtin is not None:
        return builtin, builtin.name
    known = [*builtin_robots(), *builtin_mechanisms()]
    here = f"{given}.yaml"
    hint = (
        f" Did you mean '{here}'?"
        if given and os.path.isfile(here)
        else did_you_mean(given.removesuffix(".yaml"), known)
    )
    raise UnknownRobotError(f"no file or robot named {shown(given)}.{hint} {_robots(known)}")


def _robots(known: Sequence[str]) -> str:
    """Return which robots there are, or how to list them where they are many."""
    if len(known) <= _MOST_NAMED:
        return f"Robots that come with dh2sim: {listed(known)}"
    return f"'dh2sim list' lists the {len(known)} robots that come with dh2sim, such as {listed(known[:3])}"
