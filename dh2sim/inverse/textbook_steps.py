"""The worksheet of a derivation: steps with formulas in letters, then the numbers for each choice of signs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from dh2sim.inverse.textbook_axes import wrapped
from dh2sim.robot.units import AngleUnit, Units
from dh2sim.typing import Array

Signs = tuple[tuple[str, int], ...]
"""Choices made so far, in order: the letter of a sign in the formulas, and +1 or -1."""

RAD: Final = "rad"
METRE: Final = "m"


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A formula of a step with the numbers of this pose."""

    symbol: str
    """What is computed, such as ``q1``."""
    value: float
    """rad or m, or without unit."""
    unit: str
    """``rad``, ``m`` or nothing."""
    numbers: str
    """The formula's right side with its numbers and what it gives, in the robot file's units."""
    signs: Signs = ()
    """Which signs lead here."""

    @property
    def is_plain(self) -> bool:
        """Whether no formula is shown with numbers: the value is read from a matrix or the goal."""
        return " = " not in self.numbers and "   " not in self.numbers

    def as_json(self) -> dict[str, Any]:
        """Return the line as plain data."""
        return {
            "symbol": self.symbol,
            "value": self.value,
            "unit": self.unit,
            "numbers": self.numbers,
            "signs": dict(self.signs),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A step of a derivation."""

    title: str
    formulas: tuple[str, ...]
    """In letters."""
    remark: str = ""
    """Why, or what the signs mean: whole sentences."""
    lines: tuple[Line, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return the step as plain data."""
        return {
            "title": self.title,
            "formulas": list(self.formulas),
            "remark": self.remark,
            "lines": [line.as_json() for line in self.lines],
        }


@dataclass(slots=True)
class _OpenStep:
    title: str
    formulas: tuple[str, ...]
    remark: str
    lines: list[Line] = field(default_factory=list)


class Worksheet:
    """Collects the steps of a derivation, and writes numbers in the units of the robot file."""

    def __init__(self, units: Units, size: float, parameters: Mapping[str, float]) -> None:
        self._degrees = units.angle is AngleUnit.DEG
        self._unit = units.length.value
        self._per_metre = 1.0 / units.metres(1.0)
        self._decimals = max(0, math.ceil(3.3 - math.log10(size * self._per_metre)))
        self._size = size
        self._parameters = {name: value / self._per_metre for name, value in parameters.items()}
        self._steps: list[_OpenStep] = []
        self.notes: list[str] = []

    @property
    def steps(self) -> tuple[Step, ...]:
        """What was written so far."""
        return tuple(
            Step(title=step.title, formulas=step.formulas, remark=step.remark, lines=tuple(step.lines))
            for step in self._steps
        )

    def step(self, title: str, *formulas: str, remark: str = "") -> None:
        """Begin a step."""
        self._steps.append(_OpenStep(title, tuple(formula for formula in formulas if formula), remark))

    def line(self, symbol: str, value: float, unit: str, formula: str, signs: Signs = ()) -> None:
        """Write a line of the step at hand.

        Args:
            symbol: What is computed.
            value: rad or m, or without unit.
            unit: ``rad``, ``m`` or nothing.
            formula: The right side with its numbers; may be empty.
            signs: Which signs lead here.
        """
        shown = {RAD: self.angle, METRE: self.length}.get(unit, number)(value)
        suffix = f" {self._unit}" if unit == METRE else ""
        numbers = f"{formula} = {shown}{suffix}" if formula and formula != shown else f"{shown}{suffix}"
        self._steps[-1].lines.append(Line(symbol=symbol, value=value, unit=unit, numbers=numbers, signs=signs))

    def turned(self, symbol: str, angle: float, formula: str, signs: Signs = ()) -> None:
        """Write a line whose value is an angle, rad, brought into (-pi, pi] by whole turns."""
        value = wrapped(angle)
        turns = 2.0 * math.pi * round((value - angle) / (2.0 * math.pi))
        self.line(symbol, value, RAD, formula + term(self.angle(turns)) if formula and turns else formula, signs)

    def letter(self, symbol: str, value: float, unit: str, meaning: str = "") -> None:
        """Write what a letter of the formulas stands for: a length, m, or an angle, rad, of the mechanism."""
        shown = self.angle(value) if unit == RAD else self.measure(value)
        also = [meaning, self._parameter(value) if unit == METRE else ""]
        more = "; ".join(text for text in also if text)
        self._steps[-1].lines.append(
            Line(symbol=symbol, value=value, unit=unit, numbers=f"{shown}   {more}" if more else shown)
        )

    def vector(self, symbol: str, direction: Array) -> None:
        """Write a unit vector in base_link, shape (3,), a line for each component."""
        for axis, value in zip("xyz", direction.tolist(), strict=True):
            self.line(f"{symbol}{axis}", value, "", "")

    def note(self, sentence: str) -> None:
        """Keep what must be known about the result; once."""
        if sentence not in self.notes:
            self.notes.append(sentence)

    def length(self, value: float) -> str:
        """Return a length, m, in the file's unit without its name."""
        return _fixed(value * self._per_metre, self._decimals)

    def measure(self, value: float) -> str:
        """Return a length, m, in the file's unit with its name."""
        return f"{self.length(value)} {self._unit}"

    def angle(self, value: float) -> str:
        """Return an angle, rad, in the file's unit with its name."""
        return f"{_fixed(math.degrees(value), 2)}°" if self._degrees else f"{_fixed(value, 4)} rad"

    def square(self, value: float) -> str:
        """Return the square of a length, to be read in a sum."""
        return f"{self.length(abs(value))}²"

    def _parameter(self, value: float) -> str:
        """Return which of the robot file's parameters this length, m, is, or nothing."""
        names = [
            f"{sign}{name}"
            for name, length in self._parameters.items()
            for sign, signed in (("", length), ("-", -length))
            if abs(signed - value) <= 1e-9 * self._size
        ]
        return f"{names[0]} in the file" if len(names) == 1 and abs(value) > 1e-6 * self._size else ""


def number(value: float) -> str:
    """Return a number without unit, such as a cosine."""
    return _fixed(value, 4)


def term(text: str) -> str:
    """Return a number's text as a term of a sum, with its sign in front: `` + 0.3`` or `` - 0.3``."""
    return f" - {text[1:]}" if text.startswith("-") else f" + {text}"


def _fixed(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text
