"""Parts of a robot: dataclasses whose fields are annotated with their kinds, and mappings in robot files.

A part is checked as a whole: unknown and missing keys, then each field by its kind (``fields``).
"""

import dataclasses
import functools
import math
import numbers
import operator
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from types import MappingProxyType
from typing import Annotated, Any, Final

import numpy as np

from dh2sim.messages import Loc, closest, did_you_mean, listed, shown
from dh2sim.robot.fields import WRONG, Choice, Kind, Number, Scope, Tree, UnitsLike
from dh2sim.robot.magnitudes import INERTIA, MOST_ROWS, shown_size
from dh2sim.typing import Array, read_only

FILLED_IN: Final[Any] = None
"""Default of a field that the robot fills in: in its rows there is always a value."""
_TRIANGLE_TOLERANCE: Final = 1e-9
"""By which two principal moments may fall short of the third, relative to it."""


@dataclass(eq=False, repr=False)
class Internal(Kind):
    """What a spec knows and no file says."""

    of: type = object

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return the value."""
        if isinstance(value, self.of):
            return value
        return scope.wrong(loc, f"expected {_article(self.of)}, found {shown(value)}")


@dataclass(eq=False, repr=False)
class Part(Kind):
    """A part of a robot that has fields of its own: a mapping in files."""

    of: type = object
    inline: bool = field(default=False, kw_only=True)
    """Whether its keys are among those of the whole."""
    more: Mapping[str, Kind] = field(default_factory=dict, kw_only=True)
    """Keys of files that are no fields."""
    list_is: str | None = field(default=None, kw_only=True)
    """The key that a list in place of the mapping is the value of."""
    number_is: str | None = field(default=None, kw_only=True)
    """The key that a number in place of the mapping is the value of."""

    @functools.cached_property
    def keys(self) -> Mapping[str, Kind]:
        """The keys in a file, those of inline parts too."""
        keys = {k: kind for k, kind in _keys(self.of).items() if not isinstance(kind, Internal)}
        return {**keys, **self.more} if self.more else keys

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return a tree of the keys that are given."""
        keys = self.keys if scope.in_file else _keys(self.of)
        if self.list_is and isinstance(value, list):
            value = {self.list_is: value}
        if self.number_is and isinstance(value, int | float | str) and not isinstance(value, bool):
            value = {self.number_is: value}
        if not isinstance(value, dict):
            expected = f"a mapping with the keys {listed(keys)}" if scope.in_file else _article(self.of)
            return scope.wrong(loc, f"expected {expected}, found {shown(value)}")
        kind = keys.get("type")
        if isinstance(kind, Choice) and isinstance(given := value.get("type"), str):
            scope = dataclasses.replace(scope, joint_type=kind.short.get(given.casefold(), given))
        unknown = [key for key in value if key not in keys]
        for key in unknown:
            if not scope.in_file and key in fields_of(self.of):  # an inline part of the wrong type
                fields_of(self.of)[key].check(value[key], (*loc, key), scope)
                continue
            message = f"unknown key {shown(key)}.{did_you_mean(str(key), keys)} Allowed keys: {listed(keys)}"
            scope.report((*loc, str(key)), message, at_key=True, path=loc)
        guessed = {closest(str(key), keys) for key in unknown}
        for key, kind in keys.items():
            if kind.required and key not in value and key not in guessed:
                scope.report(loc, f"missing key '{key}'")
        return {key: kind.check(value[key], (*loc, key), scope) for key, kind in keys.items() if key in value}

    def to_si(self, value: Any, units: UnitsLike, *, turns: bool) -> Any:
        """Return the part in SI units."""
        return self.of(**self.fields(value, units, turns=turns))

    def fields(self, tree: Tree, units: UnitsLike, *, turns: bool = False) -> dict[str, Any]:
        """Return what the part is made from: the fields that a checked tree has, in SI units."""
        turns = getattr(tree.get("type"), "turns", turns)
        fields: dict[str, Any] = {}
        for name, kind in fields_of(self.of).items():
            key = kind.key or name
            if isinstance(kind, Part) and kind.inline:
                fields[name] = kind.to_si(tree, units, turns=turns)
            elif key in tree:
                fields[name] = kind.to_si(tree[key], units, turns=turns)
        return fields


_NO_PART: Final = Part()


@dataclass(eq=False, repr=False)
class Parts(Kind):
    """A list of parts, at most ``MOST_ROWS``, and at least one unless it may be empty."""

    item: Part = _NO_PART
    may_be_empty: bool = field(default=False, kw_only=True)

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return a list of trees, some of which may be WRONG."""
        if not isinstance(value, list):
            return scope.wrong(loc, f"expected a list, found {shown(value)}")
        if not value and not self.may_be_empty:
            return scope.wrong(loc, "the list is empty; at least one entry is needed")
        if len(value) > MOST_ROWS:
            return scope.wrong(loc, f"the list has {len(value)} entries; at most {MOST_ROWS} are allowed")
        return [self.item.check(item, (*loc, index), scope) for index, item in enumerate(value)]

    def to_si(self, value: Any, units: UnitsLike, *, turns: bool) -> Any:
        """Return a tuple of parts in SI units."""
        return tuple(self.item.to_si(tree, units, turns=turns) for tree in value)


@dataclass(eq=False, repr=False)
class NamedParts(Kind):
    """Parts by name, at most ``MOST_ROWS``; the names are checked with the robot."""

    item: Part = _NO_PART

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return a mapping of names to trees, some of which may be WRONG."""
        if not isinstance(value, dict):
            return scope.wrong(loc, f"expected a mapping of names to mappings, found {shown(value)}")
        if len(value) > MOST_ROWS:
            return scope.wrong(loc, f"the mapping has {len(value)} entries; at most {MOST_ROWS} are allowed")
        return {name: self.item.check(item, (*loc, str(name)), scope) for name, item in value.items()}

    def to_si(self, value: Any, units: UnitsLike, *, turns: bool) -> Any:
        """Return a mapping of names to parts in SI units."""
        return MappingProxyType({name: self.item.to_si(tree, units, turns=turns) for name, tree in value.items()})


@dataclass(frozen=True, slots=True, kw_only=True)
class InertiaNumbers:
    """Inertia about the centre of mass along DH frame i's axes, kg·m²."""

    ixx: Annotated[float, Number("kg·m²", size=INERTIA, required=True)]
    iyy: Annotated[float, Number("kg·m²", size=INERTIA, required=True)]
    izz: Annotated[float, Number("kg·m²", size=INERTIA, required=True)]
    ixy: Annotated[float, Number("kg·m²; the matrix entry, as in URDF.", size=INERTIA)] = 0.0
    ixz: Annotated[float, Number("kg·m²; the matrix entry, as in URDF.", size=INERTIA)] = 0.0
    iyz: Annotated[float, Number("kg·m²; the matrix entry, as in URDF.", size=INERTIA)] = 0.0


class Inertia(Kind):
    """An inertia that a body can have: in files six numbers by name, in specs a matrix of shape (3, 3)."""

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return the matrix as a list of rows."""
        matrix = self._named(value, loc, scope) if scope.in_file else self._matrix(value, loc, scope)
        if matrix is WRONG:
            return WRONG
        problem = inertia_problem(np.array(matrix))
        return matrix if problem is None else scope.wrong(loc, problem)

    def _named(self, value: object, loc: Loc, scope: Scope) -> Any:
        given = Part("", InertiaNumbers).check(value, loc, scope)
        if given is WRONG or WRONG in given.values() or any(key not in given for key in ("ixx", "iyy", "izz")):
            return WRONG
        entries = InertiaNumbers(**given)
        return [
            [entries.ixx, entries.ixy, entries.ixz],
            [entries.ixy, entries.iyy, entries.iyz],
            [entries.ixz, entries.iyz, entries.izz],
        ]

    def _matrix(self, value: object, loc: Loc, scope: Scope) -> Any:
        if not isinstance(value, list) or [len(row) for row in value if isinstance(row, list)] != [3, 3, 3]:
            return scope.wrong(loc, f"expected a 3 × 3 matrix, found {shown(value)}")
        number = Number(size=INERTIA)
        matrix = [
            [number.check(x, (*loc, i, j), scope) for j, x in enumerate(row)]  # a place in the matrix
            for i, row in enumerate(value)
        ]
        if any(WRONG in row for row in matrix):
            return WRONG
        if any(matrix[i][j] != matrix[j][i] for i, j in ((0, 1), (0, 2), (1, 2))):
            return scope.wrong(loc, "the matrix is not symmetric")
        return matrix

    def to_si(self, value: Any, units: UnitsLike, *, turns: bool) -> Any:  # noqa: ARG002
        """Return the matrix, read-only."""
        return read_only(value)


def inertia_problem(matrix: Array) -> str | None:
    """Return why no body has an inertia of shape (3, 3), or one too small for simulators; or None."""
    scale = float(np.abs(matrix).max())
    if math.isnan(scale):
        return None
    a, b, c = np.linalg.eigvalsh(matrix / scale).tolist() if scale > 0 else (0.0, 0.0, 0.0)
    moments = ", ".join(f"{moment * scale:.6g}" for moment in (a, b, c))
    if a <= 0:
        return f"not positive definite: the principal moments are {moments}"
    if a + b < c * (1 - _TRIANGLE_TOLERANCE):
        return f"no body has the principal moments {moments}: two make less than the third"
    rounding = 4.0 * float(np.finfo(float).eps) * scale  # of the least of moments that differ much
    if a * scale < max(INERTIA.least * (1 - _TRIANGLE_TOLERANCE) - rounding, 0.5 * INERTIA.least):
        return f"the principal moments must be at least {shown_size(INERTIA.least)} kg·m², found {moments}"
    return None


def _article(part: type) -> str:
    """Return the name of a class with its article: a Row, an ActuatorSpec."""
    return f"{'an' if part.__name__[0] in 'AEIO' else 'a'} {part.__name__}"


def fields_of(part: type) -> Mapping[str, Kind]:
    """Return the kinds of a dataclass's fields, by name."""
    return _fields_of(part)


@functools.cache
def _fields_of(part: type) -> Mapping[str, Kind]:
    return {
        field.name: kind
        for field in dataclasses.fields(part)
        for kind in getattr(field.type, "__metadata__", ())
        if isinstance(kind, Kind)
    }


@functools.cache
def _keys(part: type) -> Mapping[str, Kind]:
    """Return the kinds of a part by key, with those of inline parts in their places."""
    keys: dict[str, Kind] = {}
    for name, kind in fields_of(part).items():
        keys |= _keys(kind.of) if isinstance(kind, Part) and kind.inline else {kind.key or name: kind}
    return keys


def plain(value: object) -> object:
    """Return a value of a spec as checks take it."""
    match value:
        case Enum():
            return value.value
        case None | bool() | str() | int():
            return value
        case np.ndarray():
            return plain(value.tolist())
        case np.generic():
            return plain(value.item())
        case numbers.Real():
            return float(value)
        case os.PathLike():
            return os.fspath(value)
        case Mapping():
            return {key: plain(inner) for key, inner in value.items()}
        case str() | bytes():
            return value
        case Sequence():
            return [plain(inner) for inner in value]
        case _ if dataclasses.is_dataclass(type(value)) and fields_of(type(value)):
            return plain_part(value)
        case _:
            return value


def plain_part(part: Any) -> dict[str, object]:
    """Return the fields of a part of a spec as a file would hold them; those that are as by default are left out."""
    tree: dict[str, object] = {}
    defaults = {field.name: field.default for field in dataclasses.fields(part)}
    for name, kind in fields_of(type(part)).items():
        value = getattr(part, name)
        default = defaults[name]
        if value is default or (type(value) is type(default) and value == default):
            continue
        other = isinstance(kind, Part) and dataclasses.is_dataclass(value) and not _can_be(type(value), kind.of)
        inner = value if other else plain(value)  # a part of another kind is for the check to refuse
        if isinstance(kind, Part) and isinstance(inner, dict):
            tree |= inner if kind.inline else {kind.key or name: inner} if inner else {}
        else:
            tree[kind.key or name] = inner
    return tree


def _can_be(given: type, part: type) -> bool:
    """Whether a value of a class has the fields of a part: a Pose is a ToolSpec of which the rest is not given."""
    return issubclass(given, part) or issubclass(part, given)


def kept(old: Any, new: Any) -> Any:
    """Return the new value, or the old one if that is the same, so that robots share what they have in common."""
    if type(old) is not type(new):
        return new
    match new:
        case np.ndarray():
            same = old.dtype == new.dtype and not old.flags.writeable and np.array_equal(old, new)
        case tuple():
            new = tuple(map(kept, old, new)) if len(old) == len(new) else new
            same = len(old) == len(new) and all(map(operator.is_, old, new))
        case MappingProxyType():
            same = list(old) == list(new) and all(kept(old[key], value) is old[key] for key, value in new.items())
        case _ if dataclasses.is_dataclass(new):
            pairs = [(getattr(old, each.name), getattr(new, each.name)) for each in dataclasses.fields(new)]
            same = all(kept(before, after) is before for before, after in pairs)
        case _:
            same = old == new
    return old if same else new
