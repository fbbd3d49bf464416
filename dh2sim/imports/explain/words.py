"""Numbers, points and directions in words."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from dh2sim.kinematics.assignment.tolerances import LOOSE
from dh2sim.robot.spec import Pose
from dh2sim.typing import Array

GLUE = "\N{NO-BREAK SPACE}"
"""Stands for a space at which no line ends, such as those inside a point."""
_LEAST = 1e-9
"""Of the reach: lengths below it are rounding."""
_NEARLY = math.radians(0.5)
"""Directions closer than this to an axis are told as that axis, and by how much they miss it."""


def number(value: float) -> str:
    """Return a number with at most six significant digits."""
    text = f"{value:.6g}"
    return "0" if float(text) == 0.0 else text


def degrees(angle: float) -> str:
    """Return an angle, given in rad, in degrees."""
    return number(math.degrees(angle))


def apart(angle: float) -> str:
    """Return how two directions lie: ``at right angles`` or ``at 37.3 degrees``; rad."""
    if abs(angle - math.pi / 2) <= LOOSE:
        return "at right angles"
    if math.pi - angle <= _NEARLY:
        return f"at {degrees(math.pi - angle)} degrees to opposite directions"
    return f"at {degrees(angle)} degrees"


def place(point: Array, reach: float) -> str:
    """Return a point as ``(0.4318, 0, 0)``; what is rounding, compared with the reach, is zero."""
    values = [0.0 if abs(value) <= _LEAST * reach else value for value in point.tolist()]
    return _listed(map(number, values))


def direction(vector: Array) -> str:
    """Return a unit vector as ``+x``, ``-z`` or, where it is oblique, as ``(0.6, 0.8, 0)``."""
    largest = int(np.argmax(np.abs(vector)))
    name = f"{'+' if vector[largest] > 0.0 else '-'}{'xyz'[largest]}"
    off = math.asin(min(1.0, float(np.linalg.norm(np.delete(vector, largest)))))
    if off <= LOOSE:
        return name
    if off <= _NEARLY:
        return f"{name} but for {math.degrees(off):.2g} degrees"
    return _listed(number(round(value, 6)) for value in vector.tolist())


def pose(value: Pose) -> str:
    """Return a pose's numbers that are not zero, as ``xyz (0, 0, 0.1), rpy (0, 90, 0)``; empty for the identity."""
    parts = []
    if value.xyz.any():
        parts.append(f"xyz{GLUE}{_listed(map(number, value.xyz.tolist()))}")
    if value.rpy.any():
        parts.append(f"rpy{GLUE}{_listed(map(degrees, value.rpy.tolist()))}")
    return ", ".join(parts)


def equation(name: str, value: str) -> str:
    """Return ``name = value``, kept on one line."""
    return f"{name}{GLUE}={GLUE}{value}"


def _listed(values: Iterable[str]) -> str:
    return f"({f',{GLUE}'.join(values)})"
