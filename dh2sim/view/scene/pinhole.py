"""How a camera sees: enough to tell what covers what in its picture."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.typing import Array
from dh2sim.view.scene.items import Vector

if TYPE_CHECKING:
    import viser


@dataclass(frozen=True, slots=True, kw_only=True)
class Sight:
    """A pinhole camera: where it is, how it is turned, and how large it shows things."""

    position: Vector
    """m, in the world or in another frame; as all that follows."""
    right: Vector
    """What is to the right in its picture, a unit vector."""
    up: Vector
    focal: float
    """Pixels that a length is shown with where it is as far away as it is long."""

    @property
    def is_usable(self) -> bool:
        """Whether anything can be seen so: numbers come from a browser."""
        finite = all(math.isfinite(value) for value in (*self.position, *self.right, *self.up, self.focal))
        return finite and self.focal > 0.0

    def resembles(self, other: Sight, share: float, distance: float) -> bool:
        """Whether things are seen nearly as another camera sees them.

        Args:
            other: The other camera.
            share: rad that it may be turned by; shares of the distance and of the scale that may differ.
            distance: Of what is looked at, m.
        """
        turned = max(math.dist(self.right, other.right), math.dist(self.up, other.up))
        moved = math.dist(self.position, other.position)
        return turned <= share and moved <= share * distance and abs(self.focal / other.focal - 1.0) <= share

    def seen_from(self, T_world_frame: ArrayLike) -> Sight:
        """Return the same camera, in a frame instead of the world; the frame's pose has shape (4, 4)."""
        T = np.asarray(T_world_frame, dtype=np.float64)
        R = T[:3, :3]
        return Sight(
            position=_vector((np.array(self.position) - T[:3, 3]) @ R),
            right=_vector(np.array(self.right) @ R),
            up=_vector(np.array(self.up) @ R),
            focal=self.focal,
        )

    def in_picture(self, points: ArrayLike) -> Array:
        """Return where points are seen.

        Args:
            points: m, in the camera's own frame of reference, shape (count, 3).

        Returns:
            Pixels to the right of the picture's middle, pixels above it, and the depth, m, shape (count, 3). What
            is not in front of the camera has a depth that is not positive, and no place.
        """
        offsets = np.asarray(points, dtype=np.float64).reshape(-1, 3) - self.position
        depth = offsets @ np.cross(self.up, self.right)
        with np.errstate(over="ignore"):  # of what is next to the camera
            scale = self.focal / np.where(depth > 0.0, depth, np.nan)
            return np.stack([scale * (offsets @ self.right), scale * (offsets @ self.up), depth], axis=1)

    def raised(self, point: Vector, pixels: float, depth: float) -> Vector:
        """Return a point that is seen so many pixels above another, and is as deep in the picture.

        Args:
            point: m.
            pixels: May be negative.
            depth: Of both, m.
        """
        x, y, z = (p + pixels * depth / self.focal * u for p, u in zip(point, self.up, strict=True))
        return x, y, z


def sight_of(camera: viser.CameraHandle) -> Sight | None:
    """Return how a page's camera sees, or None where the browser told nothing usable.

    viser's cameras are those of OpenCV: x to the right, y down, z ahead. The unit quaternion (w, v) turns a vector
    x into x + 2 v × (v × x + w x).
    """
    height, field = float(camera.image_height), float(camera.fov)
    if not (height > 0.0 and 0.0 < field < math.pi):
        return None
    sight = Sight(
        position=_vector(camera.position),
        right=_vector(_turned(camera.wxyz, (1.0, 0.0, 0.0))),
        up=_vector(_turned(camera.wxyz, (0.0, -1.0, 0.0))),
        focal=0.5 * height / math.tan(0.5 * field),
    )
    return sight if sight.is_usable else None


def _turned(wxyz: Array, x: Vector) -> Array:
    w, v = wxyz[0], wxyz[1:]
    return np.asarray(np.array(x) + 2.0 * np.cross(v, np.cross(v, x) + w * np.array(x)))


def _vector(values: Array) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
