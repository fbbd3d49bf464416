"""Kinds of values in a robot: what a value means, its unit and what is allowed.

A field of a spec is annotated with its kind, such as ``Annotated[float, Number("Rotor inertia …", least=0)]``.
Everything else follows from it: the check of robot files and of robots made in code, the conversion to SI units,
the JSON Schema (``schema``) and the text of a robot file (``write``). Fields make up parts (``parts``).

Checks work on plain values (text, numbers, booleans, None, lists, mappings), which ``parts.plain`` makes of specs and
the reader of files makes of YAML.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, StrEnum
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, Protocol, TypeAlias

from dh2sim.messages import Loc, did_you_mean, listed, shown
from dh2sim.robot.expressions import NumberError, is_name, names_in, parameter_name_problem, to_number
from dh2sim.robot.magnitudes import ANGLE, ANY, LENGTH, ZERO, Magnitude, shown_size
from dh2sim.typing import read_only

Tree: TypeAlias = dict[str, Any]
"""Checked values by key, in the units that they were given in; WRONG where a value is wrong."""

WRONG: Final = object()
"""Stands for a value that a problem was reported of."""
NAME_PATTERN: Final = "^[A-Za-z][A-Za-z0-9_-]*$"
LONGEST_NAME: Final = 100
_RESERVED: Final = r"base_link-base|flange-tool0|base_link-dh_0|link_[0-9]+-(flange|tool|dh_[0-9]+)"
MESH_SUFFIXES: Final = (".stl", ".obj", ".ply", ".glb", ".dae")


class Dimension(Enum):
    """What a number measures, where robot files have a choice of units."""

    ANGLE = "angle"
    LENGTH = "length"
    COORDINATE = "coordinate"
    """Of the joint: an angle or a length."""


class UnitsLike(Protocol):
    """Units that values are given in."""

    def to_si(self, value: float, dimension: Dimension | None, *, turns: bool) -> float:
        """Return a value in SI units; ``turns`` says whether a joint coordinate is an angle."""


class Reporter(Protocol):
    """Takes the problems that checks find."""

    def __call__(self, loc: Loc, message: str, *, at_key: bool = False, path: Loc | None = None) -> None:
        """Report a problem of the value at a place, or of its key; ``path`` is what the message calls the place."""

    def line(self, *locs: Loc) -> str:
        """Return `` on line 4`` for the first of these places that a file has, or the empty string."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scope:
    """What checks need to know besides the value."""

    report: Reporter
    parameters: Mapping[str, float] | None
    """Of the expressions in a file; NaN for a parameter that is wrong. None for robots made in code."""
    directory: Path | None
    """Where relative paths start; None where meshes are not allowed."""
    angle: str = "rad"
    """Unit of the file's angles."""
    length: str = "m"
    """Unit of the file's lengths."""
    joint_type: object = None
    """Of the row that the value is in, as given."""

    @property
    def turns(self) -> bool:
        """Whether the coordinate of the row that the value is in is an angle."""
        return self.joint_type in ("revolute", "continuous")

    @property
    def in_file(self) -> bool:
        """Whether the values come from a file."""
        return self.parameters is not None

    def wrong(self, loc: Loc, message: str) -> Any:
        """Report a problem and return WRONG."""
        self.report(loc, message)
        return WRONG


def name_problem(value: object, what: str = "a name") -> str | None:
    """Return what is wrong with the name of a robot, a joint or a configuration, or None."""
    if isinstance(value, str) and len(value) > LONGEST_NAME:
        return f"{what} has at most {LONGEST_NAME} characters, found {len(value)}"
    if isinstance(value, str) and re.fullmatch(NAME_PATTERN[1:-1], value):
        return None
    allowed = "letters, digits, '_' and '-', starting with a letter"
    return f"{what} is made of {allowed}; found {shown(value)}"


def is_reserved(name: str) -> bool:
    """Whether a joint cannot have this name, which a fixed joint of the exports has."""
    return re.fullmatch(_RESERVED, name) is not None


@dataclass(eq=False, repr=False)  # quick to import: every command reads a robot file
class Kind:
    """A kind of field."""

    description: str = ""
    """For the JSON Schema and the reference of robot files."""
    required: bool = field(default=False, kw_only=True)
    """Whether a file must have it."""
    key: str = field(default="", kw_only=True)
    """Its key in files, where that is not the field's name."""

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return a plain value as the spec holds it, in the units given; WRONG with the problem reported."""
        raise NotImplementedError

    def to_si(self, value: Any, units: UnitsLike, *, turns: bool) -> Any:  # noqa: ARG002
        """Return a checked value in SI units; ``turns`` says whether the joint coordinate is an angle."""
        return value

    def json_schema(self) -> dict[str, Any] | None:
        """Return its JSON Schema; None of kinds that :mod:`dh2sim.robot.schema` knows."""
        return None


class Name(Kind):
    """A name that every format can hold."""

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return the name."""
        problem = name_problem(value)
        return value if problem is None else scope.wrong(loc, problem)


class Text(Kind):
    """Any text."""

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return the text."""
        if isinstance(value, str):
            return value
        hint = "; put it in quotes" if scope.in_file and isinstance(value, bool | int | float) else ""
        return scope.wrong(loc, f"expected text, found {shown(value)}{hint}")


class Flag(Kind):
    """True or false."""

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return the boolean."""
        return value if isinstance(value, bool) else scope.wrong(loc, f"expected true or false, found {shown(value)}")


@dataclass(eq=False, repr=False)
class Choice(Kind):
    """A member of an enumeration."""

    of: type[StrEnum] = StrEnum
    without: tuple[str, ...] = ()
    """Members that are not allowed here."""
    short: Mapping[str, str] = field(default_factory=dict)
    """Other spellings that are taken; lower case."""
    inherited: bool = False
    """Whether a file that leaves it out has not the field's default but that of the whole."""
    other_names: Mapping[str, str] = field(default_factory=dict)
    """Other names of members, lower case, that messages explain but that are not taken."""

    @cached_property
    def allowed(self) -> list[str]:
        """The values allowed."""
        return [choice.value for choice in self.of if choice.value not in self.without]

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return the member."""
        word = self.short.get(value.casefold(), value) if isinstance(value, str) else value
        if word in self.allowed:
            return self.of(word)
        meant = self.other_names.get(value.casefold()) if isinstance(value, str) else None
        called = f", which is called '{meant}' here" if meant else ""
        guess = did_you_mean(value, self.allowed) if isinstance(value, str) and not meant else ""
        return scope.wrong(loc, f"found {shown(value)}{called}.{guess} Allowed: {listed(self.allowed)}")


@dataclass(eq=False, repr=False)
class Number(Kind):
    """A finite number; in files also an expression."""

    dimension: Dimension | None = None
    """None for a number that is in SI units everywhere."""
    size: Magnitude = field(default=ANY, kw_only=True)
    """How large it may be, where the dimension does not say so."""
    rate: int = field(default=0, kw_only=True)
    """How often it is one of the dimension per second: 1 for a velocity."""
    above: float | None = field(default=None, kw_only=True)
    """It must be greater than this."""
    least: float | None = field(default=None, kw_only=True)
    most: float | None = field(default=None, kw_only=True)

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return the number; NaN where it uses a parameter that is wrong itself."""
        try:
            number = to_number(value, scope.parameters)
        except NumberError as error:
            hint = number_hint(value, self.dimension, loc, scope) if isinstance(value, str) else None
            return scope.wrong(loc, hint or str(error))
        if problem := self._problem(number) or self.size_problem(number, scope):
            result = f" = {number!r}" if isinstance(value, str) else ""
            return scope.wrong(loc, f"{problem}, found {shown(value)}{result}")
        counts_as_zero = abs(number) < ZERO and self.magnitude(turns=scope.turns) is not ANY
        return 0.0 if counts_as_zero else number

    def _problem(self, number: float) -> str | None:
        if self.above is not None and number <= self.above:
            return f"must be greater than {self.above:g}"
        if self.most is not None and self.least is not None and (number < self.least or number > self.most):
            return f"must be from {self.least:g} to {self.most:g}"
        if self.least is not None and number < self.least:
            return "must not be negative" if self.least == 0 else f"must be at least {self.least:g}"
        return None

    def largest(self, scope: Scope) -> float:
        """Return how large a number may be at most, in the units that it is given in."""
        bounds = self.magnitude(turns=scope.turns)
        return bounds.most / IN_SI[self._own_unit(bounds, scope) or "m"] * _SLACK

    def _own_unit(self, bounds: Magnitude, scope: Scope) -> str:
        """Return the unit of angle or length that the number is in; empty for one that is neither."""
        return "" if self.dimension is None else scope.angle if bounds is ANGLE else scope.length

    def size_problem(self, number: float, scope: Scope) -> str | None:
        """Return what is wrong with how large or small a number is, in the units that it is given in."""
        bounds = self.magnitude(turns=scope.turns)
        if bounds is ANY:
            return None
        own = self._own_unit(bounds, scope)
        si = IN_SI[own] if own else 1.0
        most, least = bounds.most / si, bounds.least / si
        size, positive = abs(number), self.above is not None
        if math.isnan(size) or (size <= most * _SLACK and (size * _SLACK >= least or size == 0 or not self.unsigned)):
            return None
        unit = f" {own}{_PER_SECOND[self.rate]}" if own else f" {self.size.unit}".rstrip()
        if self.unsigned and not positive:
            small = f"0, or from {shown_size(least)} to" if least else "at most"
            return f"must be {small} {shown_size(most)}{unit}"
        return f"must be from {shown_size(least if positive else -most)} to {shown_size(most)}{unit}"

    @property
    def unsigned(self) -> bool:
        """Whether no negative number is allowed."""
        return self.above is not None or self.least is not None

    def magnitude(self, *, turns: bool) -> Magnitude:
        """Return its bounds in SI units; ``turns`` says whether a joint coordinate is an angle."""
        dimension = self.dimension
        if dimension is None:
            return self.size
        if dimension is Dimension.COORDINATE:
            return ANGLE if turns else LENGTH
        return ANGLE if dimension is Dimension.ANGLE else LENGTH

    def to_si(self, value: Any, units: UnitsLike, *, turns: bool) -> Any:
        """Return the number in SI units."""
        return value if self.dimension is None else units.to_si(value, self.dimension, turns=turns)


WITH_UNIT: Final = (
    r"([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s*"
    r"(deg|degrees?|°|rad|radians?|mm|cm|m|in|inch|inches|kg|g|Nm|N·m|N)"
)
"""A number with a unit: two groups."""
_SPELLINGS: Final = {
    "°": "deg",
    "degree": "deg",
    "degrees": "deg",
    "radian": "rad",
    "radians": "rad",
    "inch": "in",
    "inches": "in",
}
_METRES: Final = {"m": 1.0, "mm": 0.001, "cm": 0.01, "in": 0.0254}
IN_SI: Final = {"rad": 1.0, "deg": math.pi / 180, **_METRES}
"""Units of robot files in SI units, to a rounding."""
_VARIABLE: Final = r"(?:q|theta|th|t|θ|ϑ|d)_?(?:[0-9]+|i)?\*?"
"""Names of joint variables in textbooks."""


def number_hint(text: str, dimension: Dimension | None, loc: Loc, scope: Scope) -> str | None:
    """Return what is wrong with a number that has a unit or is the joint variable; None for other mistakes."""
    turns = scope.turns
    moving = "theta" if turns else "d" if scope.joint_type == "prismatic" else None
    if moving is not None and loc[-1] == moving:
        whole = re.fullmatch(_VARIABLE, text.strip())
        names = [text] if whole else [name for name in names_in(text) if re.fullmatch(_VARIABLE, name)]
        unknown = [name for name in names if name not in (scope.parameters or {})]
        if unknown:
            what = shown(text) if whole else f"in {shown(text)}: {shown(unknown[0])}"
            zero = ", or write 0" if whole else ""
            return f"{what} looks like the joint variable; leave it out{zero}: the joint coordinate adds to {moving}"
    found = re.fullmatch(WITH_UNIT, text.strip())
    if found is None:
        return None
    number, unit = found[1], _SPELLINGS.get(found[2], found[2])
    if dimension is Dimension.COORDINATE:
        dimension = Dimension.ANGLE if turns else Dimension.LENGTH
    if dimension is None:
        return f"{shown(text)} has a unit; write the number alone, {number}"
    what, own, units = ("angles", scope.angle, ["deg", "rad"])
    if dimension is Dimension.LENGTH:
        what, own, units = "lengths", scope.length, [*_METRES]
    here = f"{shown(text)} has a unit; {what} of this file are in {own}"
    if unit not in units:
        return f"{here}, written as numbers alone"
    if unit == own:
        return f"{here}: write {number}"
    if dimension is Dimension.LENGTH:
        converted = f"{float(number) * _METRES[unit] / _METRES[own]:.12g}"
    else:
        converted = f"{number} * pi / 180" if own == "rad" else f"{number} * 180 / pi"
    return f"{here}: write {converted}, or set 'units: {{{what.removesuffix('s')}: {unit}}}' for all"


_PER_SECOND: Final = ("", "/s", "/s²", "/s³")
_SLACK: Final = 1 + 1e-9
"""By which a number may pass its bound: another unit and back is rounding."""
_ANY: Final = Number()
_FRACTION: Final = Number(least=0, most=1)
ANGLES: Final = Number("", Dimension.ANGLE)
LENGTHS: Final = Number("", Dimension.LENGTH)
COORDINATE: Final = Number("", Dimension.COORDINATE)
"""Of a joint."""


@dataclass(eq=False, repr=False)
class Numbers(Kind):
    """A list of numbers."""

    item: Number = _ANY
    of: str = field(default="x, y, z", kw_only=True)
    """What the numbers are, as messages name them."""
    counts: tuple[int, ...] = field(default=(3,), kw_only=True)
    """The lengths allowed."""

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return a list of numbers."""
        expected = f"expected a list of {' or '.join(map(str, self.counts))} numbers ({self.of})"
        if not isinstance(value, list):
            return scope.wrong(loc, f"{expected}, found {shown(value)}")
        if len(value) not in self.counts:
            return scope.wrong(loc, f"{expected}, found a list of {len(value)}")
        checked = [self.item.check(number, (*loc, index), scope) for index, number in enumerate(value)]
        return WRONG if WRONG in checked else checked

    def to_si(self, value: Any, units: UnitsLike, *, turns: bool) -> Any:
        """Return a read-only array in SI units."""
        return read_only([self.item.to_si(number, units, turns=turns) for number in value])


@dataclass(eq=False, repr=False)
class Range(Numbers):
    """A lower and an upper number."""

    of: str = field(default="lower, upper", kw_only=True)
    counts: tuple[int, ...] = field(default=(2,), kw_only=True)

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return both; the lower one is less than the upper one."""
        checked = Numbers.check(self, value, loc, scope)
        if checked is WRONG or not checked[0] >= checked[1]:
            return checked
        lower, upper = checked
        return scope.wrong(loc, f"the lower limit {lower!r} is not below the upper limit {upper!r}")

    def to_si(self, value: Any, units: UnitsLike, *, turns: bool) -> Any:
        """Return a tuple in SI units."""
        return tuple(self.item.to_si(number, units, turns=turns) for number in value)


@dataclass(eq=False, repr=False)
class Color(Numbers):
    """Red, green, blue and optionally alpha."""

    item: Number = _FRACTION
    of: str = field(default="red, green, blue, alpha", kw_only=True)
    counts: tuple[int, ...] = field(default=(3, 4), kw_only=True)

    def to_si(self, value: Any, units: UnitsLike, *, turns: bool) -> Any:  # noqa: ARG002
        """Return a tuple of four; opaque where alpha is left out."""
        return (*value, 1.0)[:4]


class MeshFile(Kind):
    """A mesh file; one that a robot file names exists."""

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return its path; an absolute one for a file's."""
        text = Text().check(value, loc, scope)
        if text is WRONG:
            return WRONG
        if scope.directory is None:  # nothing is looked for: an answer would disclose what is on this machine
            return scope.wrong(loc, f"found {shown(text)}; a robot file that was uploaded cannot name mesh files")
        path = scope.directory / text
        if path.suffix.lower() not in MESH_SUFFIXES:
            return scope.wrong(
                loc, f"{shown(text)} is not a mesh file that can be read; allowed: {listed(MESH_SUFFIXES)}"
            )
        if not scope.in_file:  # a robot stays one when its meshes are moved; the model complains of missing ones
            return Path(text)
        try:
            exists = path.is_file()
        except (OSError, ValueError):
            exists = False
        if not exists:
            return scope.wrong(loc, f"file {shown(text)} not found in {scope.directory.absolute()}")
        return path.absolute()


class Parameters(Kind):
    """Named constants; those of a file have been evaluated before."""

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return a mapping of names to numbers."""
        if scope.parameters is not None:
            return scope.parameters
        if not isinstance(value, dict):
            return scope.wrong(loc, f"expected a mapping of names to numbers, found {shown(value)}")
        for name in value:
            if not isinstance(name, str) or not is_name(name):
                scope.report(loc, parameter_name_problem(name))
        return {name: _ANY.check(number, (*loc, str(name)), scope) for name, number in value.items()}

    def to_si(self, value: Any, units: UnitsLike, *, turns: bool) -> Any:  # noqa: ARG002
        """Return them as they are: what they measure is not known."""
        return MappingProxyType(dict(value))


class Configurations(Kind):
    """Named joint vectors; names and lengths are checked with the table."""

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return a mapping of names to lists of numbers, some of which may be WRONG."""
        if not isinstance(value, dict):
            return scope.wrong(loc, f"expected a mapping, found {shown(value)}")
        return {name: Vector().check(vector, (*loc, str(name)), scope) for name, vector in value.items()}


@dataclass(eq=False, repr=False)
class Texts(Kind):
    """A list of texts, such as names that are looked up elsewhere."""

    of: str = field(default="names", kw_only=True)
    """What they are, as messages name them."""
    count: int | None = field(default=None, kw_only=True)
    """How many there are."""

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return a list of texts, some of which may be WRONG."""
        number = "" if self.count is None else f"{self.count} "
        expected = f"expected a list of {number}{self.of}"
        if not isinstance(value, list):
            return scope.wrong(loc, f"{expected}, found {shown(value)}")
        if self.count not in (None, len(value)):
            return scope.wrong(loc, f"{expected}, found a list of {len(value)}")
        return [Text().check(text, (*loc, index), scope) for index, text in enumerate(value)]

    def to_si(self, value: Any, units: UnitsLike, *, turns: bool) -> Any:  # noqa: ARG002
        """Return a tuple."""
        return tuple(value)


@dataclass(eq=False, repr=False)
class Vector(Kind):
    """A joint vector; its length and its bounds are checked with the table."""

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return a list of numbers, some of which may be WRONG."""
        if not isinstance(value, list):
            return scope.wrong(loc, f"expected a list, found {shown(value)}")
        return [
            number if type(number) is float and math.isfinite(number) else _ANY.check(number, (*loc, index), scope)
            for index, number in enumerate(value)  # most of a large file
        ]
