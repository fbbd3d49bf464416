"""Which unit the numbers of a table are in; never guessed where it matters."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from dh2sim.formats.table.cells import Reading, Unit
from dh2sim.formats.table.grid import Findings
from dh2sim.formats.table.headers import ANGLE_WORDS, LENGTH_WORDS, Heading
from dh2sim.messages import shown
from dh2sim.robot.units import AngleUnit, LengthUnit, Units

_LARGE: Final = 10.0
"""A length from which on metres are not taken for granted."""
_TURN: Final = 2.0 * math.pi
_DECIMALS: Final = re.compile(r"\d*[.,](\d{3,})")
_UNIT_WORDS: Final = "|".join(sorted((*ANGLE_WORDS, *LENGTH_WORDS), key=len, reverse=True))
_STATED: Final = re.compile(
    rf"\b(?:angles?|lengths?|distances?|dimensions?)\b[^.|;]{{0,30}}?(?:\bin|:)\s*\(?({_UNIT_WORDS})(?![a-z])",
    re.IGNORECASE,
)

_BOTH: Final = re.compile(
    rf"(?:\b(?:in|units?)\b\s*:?\s*|[(\[])({_UNIT_WORDS})\s*(?:[,;/&]|and)\s*({_UNIT_WORDS})(?![a-z])", re.IGNORECASE
)
"""Such as ``(deg, mm)``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """Angles or lengths."""

    units: type[AngleUnit] | type[LengthUnit]
    what: str
    arguments: str
    """The arguments of an import that give the unit."""
    of_heading: Callable[[Heading], Unit | None]
    fits: Callable[[Unit, float], bool]
    """Whether a number without a unit is plausible in the unit that other cells are marked with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Number:
    """A number of the table, and its heading."""

    kind: Kind
    reading: Reading
    heading: Heading
    path: str
    """Such as ``row 3, alpha``."""

    @property
    def heading_unit(self) -> Unit | None:
        """The unit that the heading gives for numbers of this kind."""
        return self.kind.of_heading(self.heading)


ANGLES: Final = Kind(
    units=AngleUnit,
    what="an angle",
    arguments="angle='deg' or angle='rad'",
    of_heading=lambda heading: heading.angle,
    fits=lambda unit, value: (abs(value) > _TURN) is (unit is AngleUnit.DEG),
)
LENGTHS: Final = Kind(
    units=LengthUnit,
    what="a length",
    arguments="length='m' or length='mm'",
    of_heading=lambda heading: heading.length,
    fits=lambda unit, value: unit is (LengthUnit.MM if abs(value) >= _LARGE else LengthUnit.M),
)


def stated_units(lines: Sequence[str]) -> tuple[AngleUnit | None, LengthUnit | None]:
    """Return the units that words such as ``angles in degrees, lengths in mm`` name; None where they name several."""
    words = [found[1].casefold() for line in lines for found in _STATED.finditer(line[:1000])]
    words += [word.casefold() for line in lines for found in _BOTH.finditer(line[:1000]) for word in found.groups()]
    angles = {ANGLE_WORDS[word] for word in words if word in ANGLE_WORDS}
    lengths = {LENGTH_WORDS[word] for word in words if word in LENGTH_WORDS}
    return (angles.pop() if len(angles) == 1 else None), (lengths.pop() if len(lengths) == 1 else None)


def decide_unit(
    kind: Kind, numbers: Sequence[Number], option: Unit | None, stated: Unit | None, findings: Findings
) -> Unit | None:
    """Return the unit of a table's numbers without a unit of their own or in the heading.

    Args:
        kind: Angles or lengths.
        numbers: All numbers of the kind; contradictions between them go to ``findings``.
        option: The user's choice; goes before headings.
        stated: From the text around the table.
        findings: Takes problems and notes.

    Returns:
        The unit; None where none is needed, or where it is ambiguous (``findings`` has the problem then).
    """
    for number in numbers:
        _check(number, option, findings)
    over = {unit for number in numbers if (unit := number.heading_unit) is not None}
    marked = {unit for number in numbers if isinstance(unit := number.reading.unit, kind.units)}
    unmarked = [number for number in numbers if number.reading.bare and number.heading_unit is None]
    if option or stated or not unmarked:
        unit = option or stated or min(over | marked, default=None)
        if unit is None and numbers and kind is ANGLES:
            findings.note(
                f"all angles are 0, in any unit: the robot file is in rad, unless you pass {kind.arguments}"
            )
        return unit
    if len(over) == 1:
        (unit,) = over
        findings.note(f"{kind.what} without a unit was read in {unit}, the unit of other columns")
        return unit
    return _plausible_unit(kind, unmarked, marked, findings)


def to_si(number: Number, *, option: Unit | None, default: Unit | None) -> float:
    """Return a number in rad or m.

    Args:
        number: The number; its own unit goes first.
        option: The user's unit, which goes before the heading's.
        default: Where none of these gives a unit; None for rad and m.
    """
    unit = number.reading.unit or option or number.heading_unit or default
    if isinstance(unit, AngleUnit):
        return Units(angle=unit).radians(number.reading.value)
    return number.reading.value if unit is None else Units(length=unit).metres(number.reading.value)


def _plausible_unit(kind: Kind, unmarked: Sequence[Number], marked: set[Unit], findings: Findings) -> Unit | None:
    """Return the unit that numbers without one are plausible in."""
    if marked:
        unit = min(marked)
        if len(marked) == 1 and all(kind.fits(unit, number.reading.value) for number in unmarked):
            findings.note(f"{kind.what} without a unit was read in {unit}, the unit of other cells")
            return unit
    elif kind is ANGLES and all(_is_printed_pi(number.reading) for number in unmarked):
        findings.note("angles without a unit were read in rad: they are multiples of pi/4 to the last digit")
        return AngleUnit.RAD
    elif kind is LENGTHS and all(abs(number.reading.value) < _LARGE for number in unmarked):
        findings.note("no unit of lengths is given: they were read in m")
        return LengthUnit.M
    first = unmarked[0]
    number = f"{shown(first.reading.cell.text)} is {kind.what}"
    message = f"{number}, and nothing says in which unit; write the unit in the heading, or pass {kind.arguments}"
    findings.wrong(first.reading.cell, first.path, message)
    return None


def _is_printed_pi(reading: Reading) -> bool:
    """Whether a number is a multiple of pi/4, rounded to three decimals or more, such as 1.5708."""
    found = _DECIMALS.search(reading.cell.text)
    half_a_digit = 0.5 * 10.0 ** -len(found[1]) if found else 0.0
    quarters = round(reading.value / (math.pi / 4))
    return 0 < abs(quarters) <= 8 and abs(reading.value - quarters * math.pi / 4) <= 1.01 * half_a_digit


def _check(number: Number, option: Unit | None, findings: Findings) -> None:
    """Check that a cell's own unit is of the right kind and that of its heading; an option that differs is noted."""
    unit, cell = number.reading.unit, number.reading.cell
    over, heading = number.heading_unit, shown(number.heading.cell.text)
    if unit is not None and not isinstance(unit, number.kind.units):
        findings.wrong(cell, number.path, f"{shown(cell.text)} is in {unit}, and {number.kind.what} belongs here")
    elif (
        unit is not None and not number.reading.borrowed and over not in (None, unit) and number.reading.value != 0.0
    ):
        findings.wrong(cell, number.path, f"{shown(cell.text)} is in {unit}, but the heading {heading} says {over}")
    if option is not None and over not in (None, option):
        findings.note(f"the heading {heading} says {over}; {option} was asked for, and used")
