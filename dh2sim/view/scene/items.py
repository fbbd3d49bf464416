"""The contents of a scene as plain values, which can be compared, and tested without a browser.

An item's name is its path in the scene's tree: ``/robot/link_2/shape_0`` moves with ``/robot/link_2``. Poses are in
the parent's frame. Numbers are tuples, so that items compare by value.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

Vector: TypeAlias = tuple[float, float, float]
Quaternion: TypeAlias = tuple[float, float, float, float]
"""(w, x, y, z)."""
Color: TypeAlias = tuple[float, float, float]
"""Red, green, blue, each from 0 to 1."""

ORIGIN: Vector = (0.0, 0.0, 0.0)
NO_ROTATION: Quaternion = (1.0, 0.0, 0.0, 0.0)


def vector(values: Iterable[float]) -> Vector:
    """Return three numbers, such as an array of shape (3,), as a tuple."""
    x, y, z = (float(value) for value in values)
    return x, y, z


@dataclass(frozen=True, slots=True, kw_only=True)
class Placed:
    """An item with a pose; by itself an invisible frame that carries others."""

    position: Vector = ORIGIN
    """m."""
    orientation: Quaternion = NO_ROTATION


@dataclass(frozen=True, slots=True, kw_only=True)
class Solid(Placed):
    """A surface made of triangles."""

    vertices: tuple[Vector, ...] = field(repr=False)
    """m."""
    faces: tuple[tuple[int, int, int], ...] = field(repr=False)
    color: Color
    opacity: float = 1.0
    plain: bool = False
    """Whether it is shaded in a few steps, which is faster without a graphics card."""
    scale: Vector = (1.0, 1.0, 1.0)
    """Factors along its axes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Triad(Placed):
    """The axes of a frame: x red, y green, z blue."""

    length: float
    """m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Polyline(Placed):
    """A line through points."""

    points: tuple[Vector, ...] = field(repr=False)
    """m."""
    color: Color
    width: float = 2.0
    """Pixels."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lines(Placed):
    """Separate lines, each from one point to another."""

    segments: tuple[tuple[Vector, Vector], ...] = field(repr=False)
    """m."""
    color: Color
    width: float = 2.0
    """Pixels."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Points(Placed):
    """A cloud of points, each with its colour."""

    points: tuple[Vector, ...] = field(repr=False)
    """m."""
    colors: tuple[Color, ...] = field(repr=False)
    size: float
    """Of a point, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrow(Placed):
    """An arrow from one point to another."""

    start: Vector
    """m."""
    end: Vector
    color: Color
    thickness: float
    """Of the shaft, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Label(Placed):
    """A text that always faces the camera."""

    text: str
    color: Color = (0.1, 0.1, 0.1)


Item: TypeAlias = Placed | Solid | Triad | Polyline | Lines | Points | Arrow | Label
Scene: TypeAlias = Mapping[str, Item]
"""Items by name."""
