"""Numbers that are meant to be simple: zero, multiples of 15 degrees, few decimals."""

from __future__ import annotations

import math

from dh2sim.kinematics.frame_assignment.result import Tolerances
from dh2sim.typing import Array, read_only

_STEP = 15.0
_ROUNDING = 8 * 2.0**-52
"""What a number may lose in a few operations, of the larger of 1 and itself."""
_FEW_DECIMALS = range(3, 10)
_MOST_DECIMALS = 12
_LUCK = 1e-6
"""How likely a number that is not meant to be simple may be taken for one of few decimals."""
_FINE = 3e-10
"""Tolerances above this are asked for: then more luck is allowed, in proportion, up to"""
_MOST_LUCK = 0.05


def simple_angle(angle: float, tolerances: Tolerances) -> float:
    """Return the simple angle that is within the tolerance, or else the angle without its rounding errors.

    Simple are multiples of 15 degrees, then degrees with few decimals.

    Args:
        angle: rad.
        tolerances: ``angle`` is what a change may amount to.

    Returns:
        rad in (-pi, pi], 0.0 rather than -0.0.
    """
    simple = simple_turn(math.remainder(angle, math.tau), tolerances)
    return math.pi if simple <= -math.pi else simple


def simple_turn(angle: float, tolerances: Tolerances) -> float:
    """As ``simple_angle``, for a coordinate that may be more than half a turn."""
    simple = math.radians(_STEP * round(math.degrees(angle) / _STEP))
    if abs(simple - angle) > max(tolerances.angle, _ROUNDING):
        allowed, rounding = math.degrees(tolerances.angle), math.degrees(_ROUNDING)
        simple = math.radians(_few_decimals(math.degrees(angle), allowed, rounding, _luck(tolerances)))
    return simple + 0.0


def simple_length(value: float, tolerances: Tolerances) -> float:
    """Return the simple length that is within the tolerance, or else the length without its rounding errors.

    Simple is zero, then what has few decimals.

    Args:
        value: m.
        tolerances: ``length`` is what a change may amount to.

    Returns:
        m, 0.0 rather than -0.0.
    """
    rounding = _ROUNDING * max(tolerances.reach, abs(value))
    if abs(value) <= max(tolerances.length, rounding):
        return 0.0
    return _few_decimals(value, tolerances.length, rounding, _luck(tolerances)) + 0.0


def _luck(tolerances: Tolerances) -> float:
    return min(_MOST_LUCK, _LUCK * max(1.0, tolerances.angle / _FINE))


def _few_decimals(value: float, tolerance: float, rounding: float, luck: float) -> float:
    """Return the value with as few decimals as the tolerance and chance allow."""
    for decimals in _FEW_DECIMALS:
        candidate = round(value, decimals)
        if abs(candidate - value) <= max(min(tolerance, luck * 10.0**-decimals), rounding):
            return candidate
    candidate = round(value, _MOST_DECIMALS)
    return candidate if abs(candidate - value) <= rounding else value


def simple_vector(vector: Array, tolerances: Tolerances) -> Array:
    """Return a position with its components made simple, m, shape (3,)."""
    return read_only([simple_length(float(component), tolerances) for component in vector])


def simple_angles(angles: Array, tolerances: Tolerances) -> Array:
    """Return angles made simple, rad, shape (3,)."""
    return read_only([simple_angle(float(angle), tolerances) for angle in angles])
