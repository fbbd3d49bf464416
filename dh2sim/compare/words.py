"""Angles, lengths and rotations as people write them: degrees, mm, Rz(45°)."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from dh2sim.kinematics.transforms import rpy_from_rotation
from dh2sim.typing import Array

_DIGITS = 6
_NOTHING = 1e-10
"""rad and m that are not worth a word."""


def number(value: float, digits: int = _DIGITS) -> str:
    """Return a number with as many digits as it needs, at most six unless ``digits`` says otherwise."""
    text = f"{value:.{digits}g}"
    return "0" if text == "-0" else text


def degrees(angle: float, digits: int = _DIGITS) -> str:
    """Return an angle, rad, as ``90°``."""
    return f"{number(0.0 if abs(angle) < _NOTHING else math.degrees(angle), digits)}°"


def millimetres(length: float, digits: int = _DIGITS) -> str:
    """Return a length, m, as ``431.8 mm``."""
    return f"{number(0.0 if abs(length) < _NOTHING else 1000.0 * length, digits)} mm"


def told_apart(write: Callable[[float, int], str], x: float, y: float) -> tuple[str, str]:
    """Return two values as ``degrees`` or ``millimetres`` writes them, with the digits by which they differ."""
    for digits in range(_DIGITS, 17):
        texts = write(x, digits), write(y, digits)
        if texts[0] != texts[1]:
            break
    return texts


def rotation_text(R: Array, smallest: float) -> str:
    """Return a rotation as ``Rz(45°)``, or as a product about fixed axes; empty for none.

    Args:
        R: Rotation matrix or pose, shape (3, 3) or (4, 4).
        smallest: Angles up to it are left out, rad.
    """
    named = []
    for axis, angle in zip("zyx", rpy_from_rotation(R)[::-1].tolist(), strict=True):
        if abs(angle) > smallest:
            named.append(f"R{axis}({degrees(angle)})")
    return " ".join(named)


def pose_text(T: Array, smallest: float) -> str:
    """Return a pose as ``Rz(45°), 0 0 100 mm``; empty for the identity."""
    parts = []
    rotation = rotation_text(T, smallest)
    if rotation:
        parts.append(rotation)
    if float(np.abs(T[:3, 3]).max()) > smallest:
        xyz = (number(0.0 if abs(value) < smallest else 1000.0 * value) for value in T[:3, 3].tolist())
        parts.append(f"{' '.join(xyz)} mm")
    return ", ".join(parts)
