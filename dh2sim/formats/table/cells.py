"""A cell as people write it: a number, an expression or a joint coordinate with an offset, with a unit or without."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final, TypeAlias

from dh2sim.formats.table.grid import Cell
from dh2sim.formats.table.headers import ANGLE_WORDS, LENGTH_WORDS, UNIT
from dh2sim.formats.table.notation import LONGEST_CELL, plain
from dh2sim.messages import shown
from dh2sim.robot.expressions import CONSTANTS, FUNCTIONS, ExpressionError, digit_hint, evaluate
from dh2sim.robot.units import AngleUnit, LengthUnit

Unit: TypeAlias = AngleUnit | LengthUnit

_EMPTY: Final = ("", "-", "--", "---", "n/a", "na", "n.a.", "none", "nil", "null", "not applicable")
_NAME: Final = r"[A-Za-z_][A-Za-z0-9_]*"
_TOKEN: Final = re.compile(
    rf"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+(?![A-Za-z0-9]))?)|(?P<name>{_NAME})|(?P<sign>\*\*|\S)"
)
_MARKED_UNIT: Final = re.compile(rf"(?<=[\d.)i])\s*({UNIT})(?![A-Za-z0-9_(])", re.IGNORECASE)
_STARRED_NAME: Final = re.compile(rf"(?<![A-Za-z0-9_])(?!pi\b)({_NAME})\s*\*(?!\*)(?=\s*(?:[-+)]|$))", re.IGNORECASE)
_TIMES_MINUS_ONE: Final = re.compile(rf"({_NAME})\s*\*\s*-\s*1")
_VARIABLE_WORD: Final = re.compile(r"\(?\b(?:joint )?(?:variable|var)\b\.?\)?", re.IGNORECASE)
_INVERSE: Final = re.compile(r"\ba(?:sin|cos|tan2?)\b")
_TURNED: Final = re.compile(r"\b(?:sin|cos|tan)\s*\([^()]*\)")
"""A function of an angle, whose value is none."""
_DEGREES_INSIDE: Final = re.compile(r"\b(sin|cos|tan)\s*\(\s*([-+]?[\d.]+)\s*(?:°|deg(?:rees?)?\b)\s*\)")
_NUMBER_INSIDE: Final = re.compile(r"\b(sin|cos|tan)\s*\(\s*([-+]?(?:\d+\.?\d*|\.\d+))\s*\)")
_DECIMAL_COMMA: Final = re.compile(r"(?<=\d),(?=\d)")


class CellError(ValueError):
    """A cell cannot be read; the message is for the user."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Constant:
    """A symbol that the text around the table gives a value."""

    value: float
    """In rad or m where the text gives a unit, else as written."""
    unit: Unit | None
    """Rad, m or None."""
    line: int
    problem: str = ""
    """Why the value cannot be used."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """What a cell holds."""

    cell: Cell
    value: float = 0.0
    """The number, or what is added to the coordinate; in ``unit``, else in the unit of the table."""
    unit: Unit | None = None
    """The cell's own, or that of the symbols in it; rad where the number is written with pi."""
    borrowed: bool = False
    """The unit is that of the symbols in the cell."""
    symbol: str | None = None
    """The coordinate's name, such as ``theta3``; None where the cell has none, or only a star."""
    sign: int = 1
    """-1 where the coordinate is subtracted."""
    starred: bool = False
    """A star or the word variable marks the cell."""
    empty: bool = False
    constants: tuple[str, ...] = ()

    @property
    def bare(self) -> bool:
        """Whether the table has to give the unit of the number."""
        return self.unit is None and self.value != 0.0


def read_cell(
    cell: Cell, coordinates: re.Pattern[str] | None, constants: Mapping[str, Constant], *, comma: bool
) -> Reading:
    """Return what a cell holds.

    Args:
        cell: The cell.
        coordinates: What names of coordinates look like in this column, such as ``theta3``; they are no constants.
            None where the cell has no coordinate.
        constants: Symbols that have a value.
        comma: Whether numbers are written with a decimal comma.

    Raises:
        CellError: With what was found and what is allowed.
    """
    if len(cell.text) > LONGEST_CELL:
        raise CellError(f"the cell has {len(cell.text)} characters; at most {LONGEST_CELL} are allowed")
    text = plain(cell.text)
    if text.casefold() in _EMPTY:
        return Reading(cell=cell, empty=True)
    text, starred = _without_star(text)
    if comma:
        text = _DECIMAL_COMMA.sub(".", text)
    text = _DEGREES_INSIDE.sub(r"\1(((\2)*pi/180))", text)
    if found := next((f for f in _NUMBER_INSIDE.finditer(text) if abs(float(f[2])) > 2 * math.pi), None):
        raise CellError(f"{shown(found.group())} is of radians; write {found[1]}({found[2]}°) if degrees are meant")
    text, unit = _without_unit(text)
    if not text:
        return Reading(cell=cell, starred=starred, empty=not starred)
    text, names = _expression(text)
    symbols = [name for name in names if coordinates is not None and coordinates.fullmatch(name.casefold())]
    if len(symbols) > 1:
        symbols = [name for name in symbols if name not in constants] or symbols
    known = {name: constants[name] for name in names if name in constants and name not in symbols}
    _check_names(cell, names, {*symbols, *known}, symbols)
    if problem := next((constant.problem for constant in known.values() if constant.problem), None):
        raise CellError(problem)
    own, symbol = unit, symbols[0] if symbols else None
    pi = "pi" in names and "pi" in _TURNED.sub("", text)
    inverse = _INVERSE.search(text) is not None
    unit = None if inverse else _unit(cell, unit, known, pi=pi)
    value, sign, unitless = _linear(cell, text, symbol, known)
    if inverse:
        unit = _unit(cell, own, {} if unitless else known, pi=pi or unitless)
    return Reading(
        cell=cell, value=value, unit=unit, symbol=symbol, sign=sign, starred=starred,
        constants=tuple(known), borrowed=own is None and bool(known),
    )  # fmt: skip


def no_value(name: str) -> str:
    """Return the complaint about a symbol that nothing gives a value."""
    value = "30°" if name.casefold().startswith(("alpha", "beta", "th")) else "0.4 m"
    hint = f"give its value in the text around the table, such as '{name} = {value}'"
    return f"the symbol {shown(name)} has no value; write the number, or {hint}"


def canonical(name: str) -> str:
    """Return a symbol without the underscores that set its index off."""
    return name.replace("_", "")


def _without_star(text: str) -> tuple[str, bool]:
    if found := _TIMES_MINUS_ONE.fullmatch(text):
        name = found[1]
        raise CellError(
            f"{shown(text)} may mean '-{name}' or, with a star that marks the variable, '{name} - 1'; write that"
        )
    bare = _VARIABLE_WORD.sub("", text)
    bare = _STARRED_NAME.sub(r"\1", bare)
    bare = re.sub(r"^\*+(?=\s*[A-Za-z(])|(?<!\*)\*$|\(\*\)$|^\*+$", "", bare.strip())
    return bare.strip(), bare.strip() != text.strip()


def _without_unit(text: str) -> tuple[str, Unit | None]:
    """Return an expression without the units behind its numbers, and the unit."""
    words = {found[1].casefold() for found in _MARKED_UNIT.finditer(text)}
    units: set[Unit] = {ANGLE_WORDS.get(word) or LENGTH_WORDS[word] for word in words}
    if len(units) > 1:
        raise CellError(f"two units in one cell: {' and '.join(sorted(units))}; write one")
    return _MARKED_UNIT.sub("", text).strip(), next(iter(units), None)


def _expression(text: str) -> tuple[str, list[str]]:
    """Return an expression with every product written out, and the names that it uses, in canonical form."""
    tokens: list[str] = []
    names: dict[str, None] = {}
    before = ""
    for found in _TOKEN.finditer(text):
        token, kind = found.group(), found.lastgroup
        if kind == "name":
            token = "pi" if token.casefold() == "pi" else token if token in FUNCTIONS else canonical(token)
            if token not in FUNCTIONS and token not in CONSTANTS:
                names[token] = None
        if (
            (before == "name" and token in FUNCTIONS)
            or (before == "number" and (kind == "name" or token == "("))
            or (before == ")" and kind != "sign")
        ):
            tokens.append("*")
        tokens.append(token)
        before = token if token == ")" else "" if token in FUNCTIONS else kind or ""
    return " ".join(tokens), [*names, *(["pi"] if "pi" in tokens else [])]


def _check_names(cell: Cell, names: Iterable[str], known: set[str], symbols: list[str]) -> None:
    for name in names:
        if name not in known and name != "pi":
            hint = digit_hint(cell.text, known)
            raise CellError(f"{no_value(name)}.{hint}" if hint else no_value(name))
    if len(symbols) > 1:
        which = " and ".join(map(shown, symbols[:2]))
        message = f"two joint coordinates, {which}, in one cell; a row takes one"
        raise CellError(f"{message}, and joints that move together have no DH table")


def _unit(cell: Cell, unit: Unit | None, known: Mapping[str, Constant], *, pi: bool) -> Unit | None:
    units = {constant.unit for constant in known.values() if constant.unit is not None}
    if unit is not None:
        units.add(unit)
    if pi and unit is AngleUnit.DEG:
        raise CellError(f"{shown(cell.text)} is written with pi and in degrees; write one of them")
    if pi and not units & set(LengthUnit):
        units.add(AngleUnit.RAD)
    if len(units) > 1:
        raise CellError(f"two units in one cell: {' and '.join(sorted(units))}; write one")
    return next(iter(units), None)


def _linear(cell: Cell, text: str, symbol: str | None, known: Mapping[str, Constant]) -> tuple[float, int, bool]:
    """Return the value at coordinate zero, the coordinate's sign, and whether the value does not depend on units."""

    def at(coordinate: float, factor: float = 1.0) -> float:
        names = {name: c.value * (factor if c.unit else 1.0) for name, c in known.items()}
        try:
            return evaluate(text, names if symbol is None else {**names, symbol: coordinate})
        except ExpressionError as error:
            raise CellError(f"{shown(cell.text)} cannot be read: {error}") from None

    value = at(0.0)
    scaled = any(constant.unit for constant in known.values())
    unitless = not scaled or (bool(_INVERSE.search(text)) and math.isclose(at(0.0, 2.0), value))
    if not unitless and not math.isclose(at(0.0, 2.0), 2.0 * value):
        raise CellError("a number without a unit beside a symbol that has one; write the unit behind the number too")
    if symbol is None:
        return value, 1, unitless
    step = max(1.0, abs(value))
    slopes = [(at(factor * step) - value) / (factor * step) for factor in (1.0, -2.0, 3.0)]
    sign = 1 if slopes[0] > 0 else -1
    if not all(math.isclose(slope, sign, rel_tol=1e-9) for slope in slopes):
        allowed = f"as in '{symbol} + 1' or '1 - {symbol}'"
        raise CellError(
            f"the coordinate {shown(symbol)} may only be added or subtracted, {allowed}; found {shown(cell.text)}"
        )
    return value, sign, unitless
