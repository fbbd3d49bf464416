"""How much room scenes take."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from dh2sim.typing import Array
from dh2sim.view.items import Arrow, Item, Path, Quaternion, Scene, Solid, Triad, Vector


@dataclass(frozen=True, slots=True, kw_only=True)
class Extent:
    """A ball."""

    centre: Vector
    """m."""
    radius: float
    """m, positive."""


def extent_of(scenes: Iterable[Scene]) -> Extent:
    """Return a ball around all that scenes hold; its centre is that of the box along base_link's axes.

    Args:
        scenes: At least one, with at least one item; what carries others comes before them.
    """
    boxes: dict[int, Array] = {}
    corners = []
    for scene in scenes:
        poses: dict[str, Array] = {}
        for name, item in scene.items():
            pose = poses[name] = poses.get(name.rsplit("/", 1)[0], np.eye(4)) @ _pose(item)
            corners.append(_box(item, boxes) @ pose[:3, :3].T + pose[:3, 3])
    points = np.concatenate(corners)
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    x, y, z = (float(value) for value in centre)
    return Extent(centre=(x, y, z), radius=float(np.linalg.norm(points - centre, axis=1).max()) or 1.0)


def _box(item: Item, boxes: dict[int, Array]) -> Array:
    """Return the corners of a box around an item, in its own frame, shape (8, 3)."""
    match item:
        case Solid():
            if id(item.vertices) not in boxes:  # solids share them from scene to scene
                boxes[id(item.vertices)] = _corners(np.array(item.vertices))
            return boxes[id(item.vertices)]
        case Path():
            return _corners(np.array(item.points))
        case Arrow():
            return _corners(np.array([item.start, item.end]))
        case Triad():
            return _corners(np.array([np.zeros(3), np.full(3, item.length)]))
        case _:
            return np.zeros((8, 3))


def _corners(points: Array) -> Array:
    ends = np.array([points.min(axis=0), points.max(axis=0)])
    return np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])


def _pose(item: Item) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = _rotation(item.orientation), item.position
    return T


def _rotation(quaternion: Quaternion) -> Array:
    """Return the rotation of a unit quaternion, shape (3, 3)."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
