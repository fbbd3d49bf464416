"""Draws scenes with viser; only what differs from what is drawn already is sent."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from dh2sim.typing import Array
from dh2sim.view.scene.items import (
    Arrow,
    Color,
    Item,
    Label,
    Lines,
    Placed,
    Polyline,
    Scene,
    Solid,
    Triad,
    Triads,
    Vector,
    batched,
)

if TYPE_CHECKING:
    import viser

_SHAFT: Final = 0.018
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
        scene = batched(scene)
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
        if old is not None and _appearance(old) == _appearance(item):
            handle = self._handles[name]
            # assigning an unchanged value costs time: viser compares before it sends nothing
            if item.position != old.position:
                handle.position = item.position
            if item.orientation != old.orientation:
                handle.wxyz = item.orientation
            if isinstance(item, Triads):
                handle.batched_positions, handle.batched_wxyzs = _arrays(item)
        else:
            self._handles[name] = self._added(name, item)

    def _added(self, name: str, item: Item) -> Any:
        """Add an item, in place of one with the same name."""
        pose: dict[str, Any] = {"position": item.position, "wxyz": item.orientation}
        match item:
            case Solid():
                return self._scene.add_mesh_simple(
                    name,
                    vertices=np.array(item.vertices, dtype=np.float32),
                    faces=np.array(item.faces, dtype=np.uint32),
                    color=_bytes(item.color),
                    opacity=None if item.opacity >= 1.0 else item.opacity,
                    material="toon5" if item.plain else "standard",
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
            case Triads():
                positions, orientations = _arrays(item)
                return self._scene.add_batched_axes(
                    name,
                    batched_positions=positions,
                    batched_wxyzs=orientations,
                    axes_length=item.length,
                    axes_radius=_SHAFT * item.length,
                    **pose,
                )
            case Polyline() | Lines():
                return self._scene.add_line_segments(
                    name,
                    points=np.array(_segments(item), dtype=np.float32).reshape(-1, 2, 3),
                    colors=_bytes(item.color),
                    thickness=item.width,
                    thickness_units="screen",
                    **pose,
                )
            case Arrow():
                return self._scene.add_arrows(
                    name,
                    points=np.array([[item.start, item.end]], dtype=np.float32),
                    colors=_bytes(item.color),
                    shaft_radius=0.5 * item.thickness,
                    head_radius=1.25 * item.thickness,
                    head_length=min(3.0 * item.thickness, 0.6 * _length(item)),
                    **pose,
                )
            case Label():
                return self._scene.add_label(name, item.text, anchor="center-center", **pose)
            case Placed():
                return self._scene.add_frame(name, show_axes=False, **pose)


def _appearance(item: Item) -> tuple[object, ...]:
    """Return everything of an item but its pose."""
    if isinstance(item, Triads):
        return Triads, item.length, len(item.positions)
    names = [name for name in type(item).__dataclass_fields__ if name not in ("position", "orientation")]
    return (type(item), *(getattr(item, name) for name in names))


def _arrays(triads: Triads) -> tuple[Array, Array]:
    """Return positions and orientations as viser expects them."""
    return np.array(triads.positions, dtype=np.float32), np.array(triads.orientations, dtype=np.float32)


def _segments(item: Polyline | Lines) -> Sequence[tuple[Vector, Vector]]:
    return item.segments if isinstance(item, Lines) else tuple(pairwise(item.points))


def _length(arrow: Arrow) -> float:
    return float(np.linalg.norm(np.subtract(arrow.end, arrow.start)))


def _bytes(color: Color) -> tuple[int, int, int]:
    red, green, blue = (round(255 * min(max(part, 0.0), 1.0)) for part in color)
    return red, green, blue
