"""What a scene is made of: plain values, so that scenes can be compared, and tested without a browser.

An item's name is its place in the scene's tree: ``/robot/link_2/shape_0`` moves with ``/robot/link_2``. Poses are in
the parent's frame. Numbers are tuples, so that items compare by value.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

Vector: TypeAlias = tuple[float, float, float]
Quaternion: TypeAlias = tuple[float, float, float, float]
"""(w, x, y, z)."""
Color: TypeAlias = tuple[float, float, float]
"""Red, green, blue, each from 0 to 1."""

STILL: Quaternion = (1.0, 0.0, 0.0, 0.0)
ORIGIN: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Placed:
    """Anything that stands somewhere; by itself an invisible frame that carries others."""

    position: Vector = ORIGIN
    """m."""
    orientation: Quaternion = STILL


@dataclass(frozen=True, slots=True, kw_only=True)
class Solid(Placed):
    """A surface: a capsule, cylinder, sphere, box, or one made of triangles."""

    vertices: tuple[Vector, ...] = field(repr=False)
    """m."""
    faces: tuple[tuple[int, int, int], ...] = field(repr=False)
    color: Color
    opacity: float = 1.0
    plain: bool = False
    """Whether it is shaded in a few steps, which is faster where there is no graphics card."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Triad(Placed):
    """The axes of a frame: x red, y green, z blue."""

    length: float
    """m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Triads(Placed):
    """The axes of many frames, as one item: a browser draws them much faster so."""

    positions: tuple[Vector, ...]
    """m."""
    orientations: tuple[Quaternion, ...]
    length: float
    """m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Path(Placed):
    """A line through points; an arc, a trace, a dashed axis."""

    points: tuple[Vector, ...] = field(repr=False)
    """m."""
    color: Color
    width: float = 2.0
    """Pixels."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lines(Placed):
    """Lines of their own, each from one point to another."""

    segments: tuple[tuple[Vector, Vector], ...] = field(repr=False)
    """m."""
    color: Color
    width: float = 2.0
    """Pixels."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrow(Placed):
    """An arrow from one point to another."""

    start: Vector
    end: Vector
    color: Color
    thickness: float
    """Of the shaft, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Label(Placed):
    """A text that always faces the eye."""

    text: str
    color: Color = (0.1, 0.1, 0.1)


Item: TypeAlias = Placed | Solid | Triad | Triads | Path | Lines | Arrow | Label
Scene: TypeAlias = Mapping[str, Item]
"""Items by name."""
