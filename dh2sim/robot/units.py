"""Units of robot files, and what they are in SI units."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from dh2sim.robot.fields import Choice, Dimension


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
    """Units of the angles and lengths in this file."""

    angle: Annotated[AngleUnit, Choice("Unit of angles.", AngleUnit)] = AngleUnit.RAD
    length: Annotated[LengthUnit, Choice("Unit of lengths.", LengthUnit)] = LengthUnit.M

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

    def to_si(self, value: float, dimension: Dimension | None, *, turns: bool) -> float:
        """Return a number of the file in SI units; ``turns`` says whether a joint coordinate is an angle."""
        match dimension:
            case Dimension.ANGLE:
                return self.radians(value)
            case Dimension.LENGTH:
                return self.metres(value)
            case Dimension.COORDINATE:
                return self.coordinate(value, turns=turns)
            case None:
                return value
