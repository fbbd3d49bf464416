"""Units that a robot file may be written in, and their way to SI."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum


class AngleUnit(StrEnum):
    """Unit of the file's angles."""

    RAD = "rad"
    DEG = "deg"


class LengthUnit(StrEnum):
    """Unit of the file's lengths."""

    M = "m"
    MM = "mm"
    CM = "cm"
    IN = "in"


@dataclass(frozen=True, slots=True, kw_only=True)
class Units:
    """The units of one file."""

    angle: AngleUnit = AngleUnit.RAD
    length: LengthUnit = LengthUnit.M

    def radians(self, angle: float) -> float:
        """Return an angle of the file in rad."""
        return math.radians(angle) if self.angle is AngleUnit.DEG else angle

    def metres(self, length: float) -> float:
        """Return a length of the file in m; dividing by a power of ten rounds only once."""
        match self.length:
            case LengthUnit.M:
                return length
            case LengthUnit.MM:
                return length / 1000
            case LengthUnit.CM:
                return length / 100
            case LengthUnit.IN:
                return length * 0.0254

    def coordinate(self, value: float, *, turns: bool) -> float:
        """Return a joint coordinate, or its rate, in rad or m."""
        return self.radians(value) if turns else self.metres(value)
