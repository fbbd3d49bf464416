"""Draws scenes with viser; only what differs from what is drawn already is sent."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from dh2sim.view.scene.items import (
    Arrow,
    Color,
    Item,
    Label,
    Lines,
    Placed,
    Points,
    Polyline,
    Scene,
    Solid,
    Triad,
    Vector,
)

if TYPE_CHECKING:
    import viser

_SHAFT: Final = 0.026
"""Radius of a frame's axes, as a share of their length."""


class Painter:
    """Draws on one viser scene; not thread-safe."""

    def __init__(self, scene: viser.SceneApi) -> None:
        """Draw on ``scene``, a client's own or a server's for all clients."""
        self._scene = scene
        self._drawn: dict[str, Item] = {}
        self._handles: dict[str, Any] = {}

    def draw(self, scene: Scene) -> int:
        """Make viser show a scene.

        Args:
            scene: Items by name.

        Returns:
            How many items were added, changed or removed.
        """
        gone = [name for name in self._drawn if name not in scene]
        for name in sorted(gone, reverse=True):  # children before their parents
            self._handles.pop(name).remove()
            del self._drawn[name]
        changed = [name for name, item in scene.items() if self._drawn.get(name) != item]
        for name in changed:
            self._paint(name, scene[name])
            self._drawn[name] = scene[name]
        return len(gone) + len(changed)

    def solids(self) -> dict[str, Any]:
        """Return viser's handles of the surfaces, by name."""
        return {name: self._handles[name] for name, item in self._drawn.items() if isinstance(item, Solid)}

    def _paint(self, name: str, item: Item) -> None:
        old = self._drawn.get(name)
        if old is None or _made_of(old) != _made_of(item):
            self._handles[name] = self._added(name, item)
            return
        handle = self._handles[name]
        # assigning an unchanged value costs time: viser compares before it sends nothing
        if item.position != old.position:
            handle.position = item.position
        if item.orientation != old.orientation:
            handle.wxyz = item.orientation
        for (key, value), before in zip(_properties(item).items(), _properties(old).values(), strict=True):
            if value is not before and not np.array_equal(value, before):
                setattr(handle, key, value)

    def _added(self, name: str, item: Item) -> Any:
        """Add an item, in place of one with the same name."""
        pose: dict[str, Any] = {"position": item.position, "wxyz": item.orientation}
        match item:
            case Solid():
                return self._scene.add_mesh_simple(
                    name,
                    vertices=np.array(item.vertices, dtype=np.float32),
                    faces=np.array(item.faces, dtype=np.uint32),
                    **_properties(item),
                    **pose,
                )
            case Triad():
                return self._scene.add_frame(
                    name,
                    axes_length=item.length,
                    axes_radius=_SHAFT * item.length,
                    origin_radius=2.0 * _SHAFT * item.length,
                    origin_color=(90, 90, 95),
                    **pose,
                )
            case Polyline() | Lines():
                return self._scene.add_line_segments(
                    name,
                    colors=_bytes(item.color),
                    thickness=item.width,
                    thickness_units="screen",
                    **_properties(item),
                    **pose,
                )
            case Points():
                return self._scene.add_point_cloud(
                    name,
                    points=np.array(item.points, dtype=np.float32),
                    colors=np.round(255.0 * np.array(item.colors)).astype(np.uint8),
                    point_size=item.size,
                    point_shape="circle",
                    precision="float32",
                    **pose,
                )
            case Arrow():
                return self._scene.add_arrows(
                    name,
                    colors=_bytes(item.color),
                    shaft_radius=0.5 * item.thickness,
                    head_radius=1.25 * item.thickness,
                    **_properties(item),
                    **pose,
                )
            case Label():
                return self._scene.add_label(name, anchor="center-center", **_properties(item), **pose)
            case Placed():
                return self._scene.add_frame(name, show_axes=False, **pose)


def _made_of(item: Item) -> tuple[object, ...]:
    """Return everything of an item that cannot change without adding it again."""
    match item:
        case Solid():
            return Solid, item.vertices, item.faces
        case Polyline() | Lines():
            return type(item), item.color, item.width
        case Points():
            return Points, item.points, item.colors, item.size
        case Arrow():
            return Arrow, item.color, item.thickness
        case Triad():
            return Triad, item.length
        case Label():
            return Label, item.color
        case Placed():
            return (Placed,)


def _properties(item: Item) -> dict[str, Any]:
    """Return what can change of an item that is drawn, besides its pose, by viser's names."""
    match item:
        case Solid():
            return {
                "color": _bytes(item.color),
                "opacity": None if item.opacity >= 1.0 else item.opacity,
                "material": "toon5" if item.plain else "standard",
                "scale": item.scale,
            }
        case Polyline() | Lines():
            return {"points": np.array(_segments(item), dtype=np.float32).reshape(-1, 2, 3)}
        case Arrow():
            return {
                "points": np.array([[item.start, item.end]], dtype=np.float32),
                "head_length": min(3.0 * item.thickness, 0.6 * _length(item)),
            }
        case Label():
            return {"text": item.text}
        case _:
            return {}


def _segments(item: Polyline | Lines) -> Sequence[tuple[Vector, Vector]]:
    return item.segments if isinstance(item, Lines) else tuple(pairwise(item.points))


def _length(arrow: Arrow) -> float:
    return float(np.linalg.norm(np.subtract(arrow.end, arrow.start)))


def _bytes(color: Color) -> tuple[int, int, int]:
    red, green, blue = (round(255 * min(max(part, 0.0), 1.0)) for part in color)
    return red, green, blue
