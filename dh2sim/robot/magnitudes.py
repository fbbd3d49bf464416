"""How large and how small the numbers of a robot may be: the one place of all bounds.

They are chosen so that whatever is made of a robot stays within doubles and within what simulators read, and so that
what dh2sim estimates is within them too: masses up to density · area · reach, inertias up to mass · reach², and the
efforts and gains for them. So everything that is read can be exported, and what is exported can be imported again.

Robots near the bound of lengths are the exception: lengths and centres of mass are those of one table. An import may
choose frames that are farther apart, on skew or nearly parallel axes, or make two lengths of one. A bound that all
tables of a mechanism share would be one on its axes, which are not known where numbers are read.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True, eq=False)
class Magnitude:
    """Bounds of a kind of number, in its SI unit."""

    name: str
    unit: str
    most: float
    """Of its size, whatever the sign."""
    least: float = 0.0
    """Of one that must be positive, or may be 0 but not negative."""


ZERO: Final = 1e-60
"""Smaller numbers count as 0: they are what rounding leaves, and their products would be no normal doubles."""

LENGTH: Final = Magnitude("lengths", "m", 1e6, 1e-6)
"""Positions, DH lengths, sizes and coordinates of joints that slide; in a second, their rates.

Nearly parallel axes put frames far away: calibrated tables have d of 574 m.
"""
ANGLE: Final = Magnitude("angles", "rad", 1e6, 1e-6)
"""Also coordinates of joints that turn, and in a second, their rates. MuJoCo reads coordinates up to 1e10."""
ACCELERATION: Final = Magnitude("gravity", "m/s²", 1e6)
MASS: Final = Magnitude("masses", "kg", 1e30, 1e-12)
"""MuJoCo reads masses from 1e-15, and 2e-14 stands for a link that weighs nothing."""
DENSITY: Final = Magnitude("densities", "kg/m³", 1e5, 1e-6)
INERTIA: Final = Magnitude("inertias", "kg·m²", 1e50, 2e-14)
"""The least is that of a principal moment. MuJoCo takes 1e-14 for 0."""
ARMATURE: Final = Magnitude("armature", "kg·m² or kg", 1e50)
EFFORT: Final = Magnitude("effort limits", "N·m or N", 1e60, 1e-15)
FRICTION: Final = Magnitude("friction", "N·m or N", 1e60)
DAMPING: Final = Magnitude("damping", "N·m·s/rad or N·s/m", 1e60)
POSITION_GAIN: Final = Magnitude("kp", "N·m/rad or N/m", 1e60, 1e-15)
VELOCITY_GAIN: Final = Magnitude("kv", "N·m·s/rad or N·s/m", 1e60, 1e-15)
SCALE: Final = Magnitude("scales of meshes", "m", 1e6, 1e-9)
"""Metres per unit of a mesh file."""
ANY: Final = Magnitude("any number", "", math.inf)
"""Of parameters, which may measure anything, and of directions, whose length does not count."""

MAGNITUDES: Final = (
    LENGTH,
    ANGLE,
    ACCELERATION,
    MASS,
    DENSITY,
    INERTIA,
    ARMATURE,
    EFFORT,
    FRICTION,
    DAMPING,
    POSITION_GAIN,
    VELOCITY_GAIN,
    SCALE,
)
"""All that have bounds."""
MOST_ROWS: Final = 494
"""Of a table. MuJoCo's XML reader nests at most 496 bodies; base_link is one of them, and a tool or a last frame may
be another."""
MOST_CLOSURES: Final = 100
"""Of a mechanism: closing them takes time that grows with their cube."""
LARGEST: Final = max(of.most for of in MAGNITUDES)
"""Greatest number of any kind."""


def shown_size(value: float) -> str:
    """Return a bound as robot files write numbers: ``1e6``, ``5.73e7``, ``0.001``."""
    digits, _, exponent = f"{value:.3g}".partition("e")
    return f"{digits}e{int(exponent)}" if exponent else digits
