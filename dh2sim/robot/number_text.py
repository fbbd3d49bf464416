"""Numbers as texts: the shortest that read back as the same double, in the units of a robot file."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from dh2sim.errors import ModelError, NotFiniteError
from dh2sim.robot.fields import Dimension
from dh2sim.robot.units import AngleUnit, LengthUnit, Units

_NEIGHBOURS = 4
"""Doubles tried on either side: the way to a unit and back rounds three times, less than an ulp each time."""


def number(value: float) -> str:
    """Return the shortest text of a double, such as ``-90``, ``0.4318`` or ``1e-9``; zero has no sign.

    Raises:
        NotFiniteError: It is NaN or infinite.
    """
    if not math.isfinite(value):
        raise NotFiniteError("", repr(float(value)))
    digits, _, exponent = repr(float(value) + 0.0).partition("e")
    digits = digits.removesuffix(".0")
    return f"{digits}e{int(exponent)}" if exponent else digits


def numbers(values: Iterable[float]) -> list[str]:
    """Return the texts of several doubles."""
    return [number(value) for value in values]


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitWriter:
    """Writes SI values in the units of one file.

    Read back through ``Units``, a text gives the same double in rad and in m. In another unit there may be no
    double that does: the steps of the two units do not match. Then it gives the next one, an ulp away, which is
    one that has such a text; what was read once is therefore written and read again without change.
    """

    units: Units = field(default_factory=Units)

    def angle(self, value: float) -> str:
        """Return the text of an angle in rad.

        Raises:
            ModelError: Too large for the file's unit.
        """
        if self.units.angle is AngleUnit.RAD:
            return number(value)
        return _shortest(value, self.units.radians, math.degrees, "rad", self.units.angle)

    def length(self, value: float) -> str:
        """Return the text of a length in m.

        Raises:
            ModelError: Too large for the file's unit.
        """
        if self.units.length is LengthUnit.M:
            return number(value)
        return _shortest(value, self.units.metres, self._from_metres, "m", self.units.length)

    def text(self, value: float, dimension: Dimension | None, *, turns: bool) -> str:
        """Return the text of a number in SI units; ``turns`` says whether a joint coordinate is an angle.

        Raises:
            ModelError: Too large for the file's unit.
        """
        match dimension:
            case None:
                return number(value)
            case Dimension.COORDINATE:
                return self.angle(value) if turns else self.length(value)
            case Dimension.ANGLE:
                return self.angle(value)
            case Dimension.LENGTH:
                return self.length(value)

    def _from_metres(self, value: float) -> float:
        """Return a length in the file's unit, an ulp off at most."""
        match self.units.length:
            case LengthUnit.M:
                return value
            case LengthUnit.MM:
                return value * 1000
            case LengthUnit.CM:
                return value * 100
            case LengthUnit.IN:
                return value / 0.0254


def _shortest(
    value: float, to_si: Callable[[float], float], from_si: Callable[[float], float], si: str, unit: str
) -> str:
    """Return the shortest text that reads back as ``value``, or as the double nearest to it that has one."""
    if not math.isfinite(from_si(value)):
        raise ModelError(f"{value!r} {si} is too large to be written in {unit}")
    reached = min(map(to_si, _around(from_si(value))), key=lambda si_value: (abs(si_value - value), abs(si_value)))
    # from the reached value, not from the given one: so both have the same text
    doubles = [double for double in _around(from_si(reached)) if to_si(double) == reached]
    return min(map(number, doubles), key=len)


def _around(centre: float) -> list[float]:
    """Return a double and its neighbours, the nearest first."""
    doubles = [centre]
    below = above = centre
    for _ in range(_NEIGHBOURS):
        below, above = math.nextafter(below, -math.inf), math.nextafter(above, math.inf)
        doubles += [below, above]
    return doubles
