"""RobotSpecs to robot files: texts that read back as the same robot.

Numbers are the shortest that read back as the same double; texts are plain where YAML allows it. Mappings and lists
are in braces where they fit on a line, and a table's numbers are below each other. What a reader fills in is left
out.
"""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from dh2sim.arguments import file_path, flag
from dh2sim.errors import ModelError, NotFiniteError, OutputError
from dh2sim.files import atomic_file
from dh2sim.messages import member
from dh2sim.robot.checks import default_name
from dh2sim.robot.fields import Choice, Color, Dimension, Flag, Kind, MeshFile, Number, Numbers
from dh2sim.robot.mechanism_checks import default_closure_name
from dh2sim.robot.number_text import UnitWriter, number, numbers
from dh2sim.robot.parts import Inertia, Internal, Part, fields_of
from dh2sim.robot.row import ActuatorSpec, Convention, Dynamics, JointType, Limits, Row
from dh2sim.robot.spec import RobotSpec, SpecLike, spec_of
from dh2sim.robot.units import AngleUnit, LengthUnit, Units
from dh2sim.robot.yaml_text import WIDTH, Tree, block_lines, comment_lines, entry_lines, inline, text_lines, word
from dh2sim.robot.yaml_tree import NOT_PRINTABLE
from dh2sim.typing import Array

_WORDS: Final = ("name", "type")
_NUMBERS: Final = ("a", "alpha", "beta", "d", "theta")


def table_lines(rows: Sequence[dict[str, Tree]]) -> list[str]:
    """Return the lines of a list of rows.

    A row takes one line where it fits and says nothing of a link. Such rows have their columns aligned, where
    they fit then, too.
    """
    simple = {index: row for index, row in enumerate(rows) if "link" not in row and len(_line(row)) <= WIDTH}
    aligned = _aligned(list(simple.values()))
    if all(len(line) <= WIDTH for line in aligned):
        lines = dict(zip(simple, aligned, strict=True))
    else:
        lines = {index: _line(row) for index, row in simple.items()}
    return [line for index, row in enumerate(rows) for line in ([lines[index]] if index in lines else _item(row))]


def _line(row: dict[str, Tree]) -> str:
    return f"  - {inline(row)}"


def _item(row: Mapping[str, Tree]) -> list[str]:
    """Return the lines of a row that has a line for each of its keys."""
    first, *others = block_lines(row, 4)
    return [f"  - {first[4:]}", *others]


def _aligned(rows: Sequence[dict[str, Tree]]) -> list[str]:
    """Return one line a row; words stand to the left in their columns, numbers to the right.

    The words come first in a row, then the numbers, then what has no columns.
    """
    cells = [[(key, inline(value)) for key, value in row.items()] for row in rows]
    tables = [[cell for cell in row if cell[0] in (*_WORDS, *_NUMBERS)] for row in cells]
    columns = itertools.zip_longest(*tables, fillvalue=("", ""))
    widths = [max(len(key) + len(text) for key, text in column) for column in columns]
    lines = []
    for row, table in zip(cells, tables, strict=True):
        parts = [_cell(key, text, width) for (key, text), width in zip(table, widths, strict=False)]
        parts += [f"{key}: {text}, " for key, text in row[len(table) :]]
        lines.append(f"  - {{{''.join(parts).rstrip(', ')}}}")
    return lines


def _cell(key: str, text: str, width: int) -> str:
    """Return a key, its value and a comma; ``width`` is that of the longest key and value of the column."""
    if key in _NUMBERS:
        return f"{key}: {text:>{width - len(key)}}, "
    return f"{key}: {text}, ".ljust(width + len(": , "))


_ONE_LINE: Final = (Limits, Dynamics)
"""Mappings that are easier to read on one line, however long."""


class PartWriter:
    """Writes the parts of a robot, each field as its kind says."""

    def __init__(self, units: UnitWriter, folder: Path | None) -> None:
        """``folder`` is where paths in the file start; without it they are absolute."""
        self._units = units
        self._folder = folder

    def part(self, part: Any, *, turns: bool = False) -> dict[str, Tree]:
        """Return the fields that are not as by default; ``turns`` says whether a joint coordinate is an angle."""
        tree: dict[str, Tree] = {}
        kinds = fields_of(type(part))
        for each in dataclasses.fields(part):
            value, kind = getattr(part, each.name), kinds[each.name]
            if isinstance(kind, Part) and kind.inline:
                tree |= self.part(value, turns=turns)
            elif not isinstance(kind, Internal) and value is not None and not _is_default(value, each, kind):
                try:
                    tree[each.name] = self._value(kind, value, turns=turns)
                except NotFiniteError as error:
                    raise error.inside(each.name) from None
        return {key: value for key, value in tree.items() if value}

    def _value(self, kind: Kind, value: Any, *, turns: bool) -> Tree:
        match kind:
            case Part():
                tree = self.part(value, turns=turns)
                return inline(tree) if tree and kind.of in _ONE_LINE else tree
            case Number():
                return self._units.text(value, kind.dimension, turns=turns)
            case Color():
                return numbers(value[:3] if value[3] == 1 else value)
            case Numbers():
                return [self._units.text(each, kind.item.dimension, turns=turns) for each in value]
            case Inertia():
                return _inertia(value)
            case MeshFile():
                return word(self._path(value))
            case Flag():
                return "true" if value else "false"
            case _:
                return word(str(value))

    def row(self, row: Row, convention: Convention, shared: Tree, *, named: bool) -> dict[str, Tree]:
        """Return a row of the table, with its zeros, so that it can be read as one."""
        tree = self.part(row, turns=row.type.turns)
        if not named:
            del tree["name"]
        if row.convention is convention:
            del tree["convention"]
        if not row.type.moves or self.part(row.actuator) == shared:
            tree.pop("actuator", None)
        hayati = row.convention is Convention.HAYATI
        left_out = {"d"} if hayati and row.type is not JointType.PRISMATIC else set() if hayati else {"beta"}
        words: dict[str, Tree] = {key: tree.pop(key) for key in _WORDS if key in tree}
        return {**words, **{key: tree.pop(key, "0") for key in _NUMBERS if key not in left_out}, **tree}

    def configuration(self, vector: Array, moving: Sequence[Row]) -> Tree:
        """Return a joint vector."""
        pairs = zip(vector.tolist(), moving, strict=True)
        return [self._units.text(value, Dimension.COORDINATE, turns=row.type.turns) for value, row in pairs]

    def _path(self, file: Path) -> str:
        """Return a path as the file names it; relative to its folder, where they are on one drive."""
        path = Path(os.path.abspath(file))
        if self._folder is not None:
            # links resolved on both sides: the system goes up from where a link leads, not from where it is
            path = path.parent.resolve() / path.name
            with contextlib.suppress(ValueError):
                path = Path(os.path.relpath(path, self._folder.resolve()))
        if NOT_PRINTABLE.search(str(path)):
            raise ModelError(f"a robot file cannot name the mesh file {str(path)!r}; rename it")
        return path.as_posix()


def _is_default(value: Any, of: dataclasses.Field[Any], kind: Kind) -> bool:
    """Return whether a reader would fill in the value; never so for what may be inherited."""
    if isinstance(value, np.ndarray):
        factory = of.default_factory
        return factory is not dataclasses.MISSING and np.array_equal(value, factory())
    return bool(value == of.default) and not (isinstance(kind, Choice) and kind.inherited)


def _inertia(matrix: Array) -> Tree:
    (ixx, ixy, ixz), (_, iyy, iyz), (_, _, izz) = matrix.tolist()
    products = {"ixy": ixy, "ixz": ixz, "iyz": iyz}
    moments = {"ixx": ixx, "iyy": iyy, "izz": izz}
    given = {**moments, **{key: value for key, value in products.items() if value}}
    return inline({key: number(value) for key, value in given.items()})


_GRAVITY: Final = [0.0, 0.0, -9.81]


def save_robot(
    robot: SpecLike, path: str | os.PathLike[str], *, notes: Iterable[str] = (), overwrite: bool = False
) -> None:
    """Write a robot file, in the units of the file that the robot was read from, or else in deg and m.

    Args:
        robot: The robot, in any form.
        path: The file.
        notes: Sentences for comments at its top.
        overwrite: Whether to replace a file.

    Raises:
        ArgumentError: An argument is of a wrong kind.
        OutputError: There is a file already, or it cannot be written.
        ModelError: As for ``robot_file_text``.
    """
    spec = spec_of(robot)
    file = file_path("path", path)
    if not flag("overwrite", overwrite) and file.exists():
        raise OutputError(f"'{file}' already exists; choose another name, or pass overwrite=True")
    units = spec.units if spec.source_file else Units(angle=AngleUnit.DEG)
    header = [f"Note: {note}" for note in notes]
    folder = file.absolute().parent
    text = robot_file_text(spec, header=header, folder=folder, angle=units.angle, length=units.length)
    with atomic_file(file) as draft:
        draft.write_text(text, encoding="utf-8")


def robot_file_text(
    robot: SpecLike,
    *,
    header: Sequence[str] = (),
    folder: Path | None = None,
    angle: AngleUnit | str = AngleUnit.DEG,
    length: LengthUnit | str = LengthUnit.M,
) -> str:
    """Return the text of a robot file that ``parse_robot`` reads as the same robot.

    Numbers read back as the same doubles in rad and m. In other units some have no text that does; those come back
    an ulp off, and stay the same from then on. Parameters are not written: the numbers that they gave are in
    their places. In description and source, characters that YAML cannot hold become U+FFFD. What a robot file
    does not allow (such as a kp of a velocity actuator) is written as it is, for the reader to complain of.

    Args:
        robot: The robot, in any form.
        header: Lines of comments to begin with, any text.
        folder: Where the file will stand: paths of meshes are relative to it; by default they are absolute.
        angle: Unit of the file's angles.
        length: Unit of the file's lengths.

    Raises:
        ModelError: A number is too large for the unit, or a mesh file has a name that YAML cannot hold.
    """
    spec = spec_of(robot)
    angle, length = member(AngleUnit, angle, "angle"), member(LengthUnit, length, "length")
    parts = PartWriter(UnitWriter(units=Units(angle=angle, length=length)), folder)
    shared = parts.part(_shared_actuator(spec, parts))
    lines = [*comment_lines(header), f"name: {word(spec.name)}"]
    for key, text in {"description": spec.description, "source": spec.source}.items():
        lines += text_lines(key, text) if text else []
    lines += [f"convention: {spec.convention}", f"units: {{angle: {angle}, length: {length}}}"]
    before: dict[str, Tree] = {key: parts.part(getattr(spec, key)) for key in ("base", "tool", "payload")}
    if spec.gravity.tolist() != _GRAVITY:
        before["gravity"] = numbers(spec.gravity.tolist())
    lines += [line for key, tree in before.items() if tree for line in entry_lines(key, tree)]
    lines += ["joints:", *table_lines(_table(spec, spec.rows, parts, shared))]
    if spec.branches:
        lines.append("branches:")
    for name, branch in spec.branches.items():
        lines.append(f"  {word(name)}:")
        pose = parts.part(branch.pose)
        start: dict[str, Tree] = {"from": word(branch.origin), **({"pose": pose} if pose else {})}
        rows = table_lines(_table(spec, branch.rows, parts, shared, name))
        lines += [*block_lines(start, 4), "    joints:", *(f"    {line}" for line in rows)]
    if spec.closures:
        lines.append("closures:")
    for index, closure in enumerate(spec.closures):
        own: dict[str, Tree] = {"name": word(closure.name)} if closure.name != default_closure_name(index) else {}
        own |= {"between": [word(frame) for frame in closure.between], "type": closure.type.value}
        lines.append(f"  - {inline(own)}")
    if spec.actuated is not None:
        lines += entry_lines("actuated", [word(name) for name in spec.actuated])
    if spec.assembly is not None:
        lines += entry_lines("assembly", {"q": parts.configuration(spec.assembly.q, spec.moving_rows)})
    if spec.configurations:
        lines.append("configurations:")
    for name, vector in spec.configurations.items():
        lines += entry_lines(word(name), parts.configuration(vector, spec.moving_rows), 2)
    if shared != parts.part(ActuatorSpec()):
        lines += entry_lines("actuators", shared)
    return "\n".join([*lines, ""])


def _table(
    spec: RobotSpec, rows: Sequence[Row], parts: PartWriter, shared: Tree, branch: str = ""
) -> list[dict[str, Tree]]:
    """Return the rows of the main chain, or of a branch."""
    named = any(row.name != default_name(index, branch) for index, row in enumerate(rows))
    passive = set() if spec.actuated is None else {row.name for row in rows} - set(spec.actuated)
    table = [parts.row(row, spec.convention, shared, named=named) for row in rows]
    for row, tree in zip(rows, table, strict=True):
        if row.name in passive:
            tree.pop("actuator", None)
    return table


def _shared_actuator(spec: RobotSpec, parts: PartWriter) -> ActuatorSpec:
    """Return the actuator of all driven rows where it is one and the same, else the default."""
    driven = [row for row in spec.moving_rows if spec.actuated is None or row.name in spec.actuated]
    first, *others = [row.actuator for row in driven] or [ActuatorSpec()]
    return first if all(parts.part(other) == parts.part(first) for other in others) else ActuatorSpec()
