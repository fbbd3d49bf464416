"""Robots that scripts for Corke's Robotics Toolboxes make: their links, base and tool, and the tables of them.

A script is text. What it assigns is computed here, number by number; nothing of it is ever run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, TypeAlias, TypeGuard

from dh2sim.formats.table.dh_table import Given, Table
from dh2sim.formats.table.grid import Cell, Grid
from dh2sim.messages import listed, shown
from dh2sim.robot.row import Convention

MAX_ITEMS: Final = 1000
"""Elements of a list, links of a robot."""

MAX_PROBLEMS: Final = 100
"""Problems of a script, behind which it is not followed."""
_DEEPEST: Final = 3
"""Lists in lists."""

Matrix: TypeAlias = tuple[tuple[float, ...], ...]
"""A 4 x 4 homogeneous transform."""


class ScriptError(ValueError):
    """Something in a script cannot be read; the message is for the user."""

    def __init__(self, message: str, line: int = 0, column: int = 0, *, reported: bool = False) -> None:
        """Keep the message and its place; line 0 where the place is not known yet.

        Args:
            message: What is wrong.
            line: From 1.
            column: From 1.
            reported: It follows from a problem that is reported already.
        """
        super().__init__(message)
        self.line = line
        self.column = column
        self.reported = reported


@dataclass(frozen=True, slots=True)
class Unknown:
    """A value that cannot be computed, which matters only where a robot needs it."""

    why: str
    reported: bool = False
    """That is reported already."""


class NumberArray(list[object]):
    """A list that arithmetic goes through element by element, as NumPy's and MATLAB's do."""


@dataclass(slots=True, kw_only=True, eq=False)
class ToolboxLink:
    """A link, as its constructor and later assignments have it."""

    line: int
    column: int
    numbers: dict[str, float] = field(default_factory=dict)
    """theta, d, a, alpha and offset, as far as they are given; rad, and the script's unit of length."""
    prismatic: bool | None = None
    modified: bool | None = None
    flip: bool = False
    limits: tuple[float, float] | None = None
    unused: set[str] = field(default_factory=set)


@dataclass(slots=True, kw_only=True, eq=False)
class ToolboxRobot:
    """A robot, as its constructor and later assignments have it."""

    line: int
    column: int
    links: list[ToolboxLink]
    name: str = ""
    base: Matrix | None = None
    tool: Matrix | None = None
    configurations: dict[str, list[float]] = field(default_factory=dict)


IDENTITY: Final[Matrix] = tuple(tuple(float(i == k) for k in range(4)) for i in range(4))


def translation(x: float, y: float, z: float) -> Matrix:
    """Return the transform that shifts."""
    return ((1.0, 0.0, 0.0, x), (0.0, 1.0, 0.0, y), (0.0, 0.0, 1.0, z), (0.0, 0.0, 0.0, 1.0))


def rotation(axis: str, angle: float) -> Matrix:
    """Return the transform that turns about x, y or z by an angle, rad."""
    quarters = round(angle / (math.pi / 2))
    exact = angle == quarters * (math.pi / 2)
    s, c = ((0.0, 1.0, 0.0, -1.0)[quarters % 4], (1.0, 0.0, -1.0, 0.0)[quarters % 4]) if exact else (
        math.sin(angle), math.cos(angle))  # fmt: skip
    match axis:
        case "x":
            return ((1.0, 0.0, 0.0, 0.0), (0.0, c, -s, 0.0), (0.0, s, c, 0.0), IDENTITY[3])
        case "y":
            return ((c, 0.0, s, 0.0), (0.0, 1.0, 0.0, 0.0), (-s, 0.0, c, 0.0), IDENTITY[3])
        case _:
            return ((c, -s, 0.0, 0.0), (s, c, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), IDENTITY[3])


def product(one: Matrix, other: Matrix) -> Matrix:
    """Return one transform after the other."""
    return tuple(tuple(sum(one[i][j] * other[j][k] for j in range(4)) for k in range(4)) for i in range(4))


def roll_pitch_yaw(roll: float, pitch: float, yaw: float, order: str) -> Matrix:
    """Return the toolbox's rotation: ``zyx`` is Rz(yaw) Ry(pitch) Rx(roll), ``xyz`` Rx(yaw) Ry(pitch) Rz(roll)."""
    orders = {"zyx": "zyx", "vehicle": "zyx", "xyz": "xyz", "arm": "xyz", "yxz": "yxz", "camera": "yxz"}
    if order not in orders:
        raise ScriptError(
            "roll, pitch and yaw are in an order that differs between toolboxes: write 'zyx' or 'xyz' there"
        )
    first, second, third = list(orders[order])
    return product(product(rotation(first, yaw), rotation(second, pitch)), rotation(third, roll))


FUNCTIONS_OF_NUMBERS: Final[Mapping[str, Callable[..., float]]] = {
    **{name: getattr(math, name) for name in ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "radians",
                                              "degrees", "hypot", "exp", "log")},
    "arcsin": math.asin, "arccos": math.acos, "arctan": math.atan, "arctan2": math.atan2, "abs": abs, "float": float,
    "deg2rad": math.radians, "rad2deg": math.degrees, "d2r": math.radians, "r2d": math.degrees,
    "sind": lambda x: math.sin(math.radians(x)), "cosd": lambda x: math.cos(math.radians(x)),
    "tand": lambda x: math.tan(math.radians(x)), "double": float, "float64": float, "sym": float,
    "Rational": lambda a, b=1.0: a / b,
}  # fmt: skip
"""Functions of numbers; those of one number go through lists element by element."""
NUMBERS: Final = {"pi": math.pi, "inf": math.inf, "Inf": math.inf, "tau": math.tau}


def number(value: object) -> float:
    """Return a value as a finite number.

    Raises:
        ScriptError: It is none.
    """
    for _ in range(_DEEPEST):
        if isinstance(value, list) and len(value) == 1:
            value = value[0]
    if isinstance(value, Unknown):
        raise ScriptError(value.why, reported=value.reported)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ScriptError(f"expected a number, found {described(value)}")
    return float(value)


def numbers_of(value: object) -> list[float]:
    """Return the numbers of a list, or of a matrix of one row or one column.

    Raises:
        ScriptError: It is none.
    """
    if isinstance(value, Unknown):
        raise ScriptError(value.why, reported=value.reported)
    if not isinstance(value, list):
        raise ScriptError(f"expected a list of numbers, found {described(value)}")
    if len(value) == 1 and isinstance(value[0], list):
        value = value[0]
    return [number(item) for item in value]


def described(value: object) -> str:
    """Return a value as messages name it."""
    match value:
        case Unknown():
            return value.why
        case ToolboxLink():
            return "a link"
        case ToolboxRobot():
            return "a robot"
        case tuple():
            return "a transform"
        case list():
            return "a list"
        case _:
            return shown(value)


def elementwise(operation: Callable[..., object], *values: object, depth: int = 0) -> object:
    """Return an operation on numbers, on every element of arrays; ``Unknown`` where an operand is."""
    unknown = next((value for value in values if isinstance(value, Unknown)), None)
    if unknown is not None:
        return unknown
    arrays = [value for value in values if isinstance(value, list)]
    if not arrays:
        try:
            return operation(*map(number, values))
        except OverflowError:
            return Unknown("the number is too large")
        except (ArithmeticError, TypeError, ValueError) as error:  # TypeError: the wrong number of arguments
            return Unknown(str(error))
    size = len(arrays[0])
    if depth == _DEEPEST:
        return Unknown("lists are nested too deep")
    if any(len(array) != size for array in arrays):
        return Unknown("the sizes of two arrays differ")
    return NumberArray(
        elementwise(operation, *(value[i] if isinstance(value, list) else value for value in values), depth=depth + 1)
        for i in range(size)
    )


def power(base: float, exponent: float) -> float:
    """Return a power, where it is a real number.

    Raises:
        ValueError: It is not.
    """
    value: float | complex = base**exponent
    if isinstance(value, complex):
        raise ValueError("a negative number has no real power of a fraction")
    return value


def transform(value: object) -> Matrix:
    """Return a value as a 4 x 4 transform.

    Raises:
        ScriptError: It is none.
    """
    if isinstance(value, Unknown):
        raise ScriptError(value.why, reported=value.reported)
    if isinstance(value, list) and len(value) == 4 and all(isinstance(row, list) and len(row) == 4 for row in value):
        rows = tuple(tuple(number(item) for item in row) for row in value)
        _check_rotation(rows)
        return rows
    if not isinstance(value, tuple):
        raise ScriptError(
            f"expected a pose, found {described(value)}; write it with transl, trotx, troty, trotz, SE3 or numbers"
        )
    return value


def _check_rotation(T: Matrix) -> None:
    for i in range(3):
        for k in range(3):
            dot = sum(T[i][j] * T[k][j] for j in range(3))
            if abs(dot - float(i == k)) > 1e-3:
                raise ScriptError("the matrix is not a pose: its first three rows and columns are not a rotation")
    if any(abs(T[3][k] - float(k == 3)) > 1e-9 for k in range(4)):
        raise ScriptError("the matrix is not a pose: its last row is not 0 0 0 1")


_ANGLES: Final = ("trotx", "troty", "trotz", "Rx", "Ry", "Rz")


def pose_function(name: str, arguments: Sequence[object], keywords: Mapping[str, object]) -> object:
    """Return what a toolbox's function of poses gives; None where ``name`` is not such a function.

    Raises:
        ScriptError: The arguments are wrong.
    """
    order = next((a for a in arguments if isinstance(a, str) and a != "deg"), keywords.get("order", "zyx"))
    degrees = "deg" in (*[a for a in arguments if isinstance(a, str)], keywords.get("unit"))
    values = [argument for argument in arguments if not isinstance(argument, str)]
    unknown = next((value for value in values if isinstance(value, Unknown)), None)
    if unknown is not None and name in (*_ANGLES, "transl", "SE3", "Trans", "Tx", "Ty", "Tz", "RPY", "rpy2tr"):
        return unknown
    match name:
        case _ if name in _ANGLES and len(values) == 1:
            angle = number(values[0])
            T = rotation(name[-1], math.radians(angle) if degrees else angle)
            shift = keywords.get("t")
            return T if shift is None else product(translation(*_three(numbers_of(shift))), T)
        case "Tx" | "Ty" | "Tz" if len(values) == 1:
            xyz = [0.0, 0.0, 0.0]
            xyz["xyz".index(name[-1])] = number(values[0])
            return translation(*xyz)
        case "transl" | "SE3" | "Trans" | "transl2tr":
            if not values:
                return IDENTITY
            if len(values) == 1 and (isinstance(values[0], tuple) or _is_square(values[0])):
                return transform(values[0])
            return translation(*_three(numbers_of(values[0]) if len(values) == 1 else [number(v) for v in values]))
        case "RPY" | "rpy2tr":
            angles = numbers_of(values[0]) if len(values) == 1 else [number(v) for v in values]
            roll, pitch, yaw = (math.radians(a) if degrees else a for a in _three(angles))
            return roll_pitch_yaw(roll, pitch, yaw, order if isinstance(order, str) else "")
        case "eye" | "identity" if len(values) == 1 and values[0] == 4:
            return IDENTITY
        case _:
            return None


def _is_square(value: object) -> bool:
    return isinstance(value, list) and len(value) == 4 and isinstance(value[0], list)


def _three(values: Sequence[float]) -> Sequence[float]:
    if len(values) != 3:
        raise ScriptError(f"expected three numbers, found {len(values)}")
    return values


_PARAMETERS: Final = ("theta", "d", "a", "alpha", "offset")
_IGNORED: Final = ("name", "names", "symbolic")


def set_property(link: ToolboxLink, key: str, value: object) -> None:
    """Set a property of a link, as a keyword of its constructor or an assignment does.

    Raises:
        ScriptError: The value is wrong.
    """
    name = {"A": "a", "D": "d", "jointtype": "sigma", "isprismatic": "sigma"}.get(key, key)
    if name in _PARAMETERS:
        try:
            link.numbers[name] = number(value)
        except ScriptError as error:
            raise ScriptError(f"{name}: {error}") from None
    elif name == "sigma":
        link.prismatic = value in ("P", "prismatic") if isinstance(value, str) else number(value) == 1
    elif name in ("mdh", "flip"):
        flag = value if isinstance(value, bool) else number(value) != 0
        if name == "mdh":
            link.modified = flag
        else:
            link.flip = flag
    elif name == "qlim":
        if value is None or value == []:
            return
        limits = numbers_of(value)
        if len(limits) != 2:
            raise ScriptError(f"qlim: expected two numbers, found {len(limits)}")
        link.limits = (limits[0], limits[1])
    elif name not in _IGNORED:
        link.unused.add(key)


def links_in(value: object, *, depth: int = 0) -> list[ToolboxLink]:
    """Return the links of a value: of a list, a matrix, a link, a robot.

    Raises:
        ScriptError: Something else is in it.
    """
    match value:
        case ToolboxLink():
            return [value]
        case ToolboxRobot():
            return list(value.links)
        case []:
            raise ScriptError("there are no links")
        case list() if len(value) <= MAX_ITEMS and depth < _DEEPEST:
            links = [link for item in value for link in links_in(item, depth=depth + 1)]
            if len(links) > MAX_ITEMS:
                raise ScriptError(f"more than {MAX_ITEMS} links")
            return links
        case Unknown():
            raise ScriptError(f"the links cannot be read: {value.why}", reported=value.reported)
        case _:
            raise ScriptError(f"expected links, found {described(value)}")


def are_links(value: object) -> TypeGuard[list[object]]:
    """Whether a value is a list with links in it."""
    return isinstance(value, list) and any(isinstance(item, ToolboxLink) for item in value)


def loose_robot(
    links: list[ToolboxLink], values: Iterable[object], problems: list[ScriptError]
) -> list[ToolboxRobot]:
    """Return the robot of a script that makes links, but no robot: that of its longest list of links, else of all.

    Args:
        links: All links that the script makes.
        values: The values of its variables.
        problems: What cannot be read of it; a list of links that cannot be used is added if there is nothing yet.
    """
    if not links:
        return []
    held = [value for value in values if are_links(value)]
    try:
        links = links_in(max(held, key=len)) if held else links
    except ScriptError as error:
        if not problems:
            problems.append(ScriptError(str(error), links[0].line, links[0].column))
    return [ToolboxRobot(line=links[0].line, column=links[0].column, links=links)]


_HEADINGS: Final = ("theta (rad)", "d", "a", "alpha (rad)", "offset (rad)", "type", "flip", "min (rad)", "max (rad)")


def table_of(robot: ToolboxRobot, *, by: str, wrong: Sequence[tuple[int, int, str]]) -> Table:
    """Return the table of a robot.

    Args:
        robot: The robot, with at least one link.
        by: What made it, for messages, such as ``SerialLink``.
        wrong: Line, column and what cannot be read of its script.
    """
    problems = list(wrong)
    notes: list[str] = []
    modified = {link.modified is True for link in robot.links}
    if len(modified) == 2:
        odd = next(link for link in robot.links if (link.modified is True) is not (robot.links[0].modified is True))
        problems.append(
            (odd.line, odd.column, "some links are standard and others modified; a robot has only one of them")
        )
    unused = sorted({key for link in robot.links for key in link.unused})
    if unused:
        notes.append(f"of the links, {listed(unused)} were not read" if len(unused) > 1 else
                     f"of the links, {unused[0]} was not read")  # fmt: skip
    rows = [_row(number, link, problems, notes) for number, link in enumerate(robot.links, start=1)]
    line = min(robot.line, *(link.line for link in robot.links))
    header = tuple(Cell(text=text, line=line, column=1) for text in _HEADINGS)
    last = max(robot.line, *(link.line for link in robot.links))
    return Table(
        header=header,
        rows=tuple(rows),
        grid=Grid(rows=(header, *rows), separator=""),
        notes=tuple(notes),
        problems=tuple(problems),
        extent=range(line, last + 1),
        given=Given(
            by=by,
            convention=Convention.MODIFIED if modified == {True} else Convention.STANDARD,
            description=robot.name,
            base=robot.base,
            tool=robot.tool,
            configurations=robot.configurations,
        ),
    )


def _row(number: int, link: ToolboxLink, problems: list[tuple[int, int, str]], notes: list[str]) -> tuple[Cell, ...]:
    prismatic = link.prismatic
    given = link.numbers
    if prismatic is None:
        prismatic = "theta" in given and "d" not in given
        if "theta" in given and "d" in given:
            message = "theta and d are both given: one of them is the joint's coordinate; leave that one out"
            problems.append((link.line, link.column, f"row {number}: {message}"))
    coordinate = "d" if prismatic else "theta"
    if given.get(coordinate):
        notes.append(
            f"row {number}: {coordinate} is the joint's coordinate, and its value {given[coordinate]!r} was left "
            "out, as the toolbox does; an offset is given by offset"
        )
    texts = ["" if name == coordinate else repr(given.get(name, 0.0)) for name in _PARAMETERS]
    texts += ["P" if prismatic else "R", "true" if link.flip else "", *(map(repr, link.limits or ()))]
    texts += [""] * (len(_HEADINGS) - len(texts))
    return tuple(Cell(text=text, line=link.line, column=link.column) for text in texts)
