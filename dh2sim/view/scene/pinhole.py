"""The pinhole model of a page's camera: where points are in its picture."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.typing import Array
from dh2sim.view.scene.items import Vector, vector

if TYPE_CHECKING:
    import viser


@dataclass(frozen=True, slots=True, kw_only=True)
class Pinhole:
    """A pinhole camera; compared by value."""

    position: Vector
    """m, in the world or in another frame, as all that follows."""
    right: Vector
    """Direction to the right in the picture, a unit vector."""
    up: Vector
    focal: float
    """Focal length, pixels."""

    @property
    def is_usable(self) -> bool:
        """Whether all numbers, which come from a browser, make sense."""
        finite = all(math.isfinite(value) for value in (*self.position, *self.right, *self.up, self.focal))
        return finite and self.focal > 0.0

    def resembles(self, other: Pinhole, share: float, distance: float) -> bool:
        """Return whether another camera sees nearly the same.

        Args:
            other: The other camera.
            share: Largest rotation, rad, and largest relative change of distance and focal length.
            distance: To what is looked at, m.
        """
        turned = max(math.dist(self.right, other.right), math.dist(self.up, other.up))
        moved = math.dist(self.position, other.position)
        return turned <= share and moved <= share * distance and abs(self.focal / other.focal - 1.0) <= share

    def in_frame(self, T_world_frame: ArrayLike) -> Pinhole:
        """Return the same camera in a frame instead of the world; the frame's pose has shape (4, 4)."""
        T = np.asarray(T_world_frame, dtype=np.float64)
        R = T[:3, :3]
        return Pinhole(
            position=vector((np.array(self.position) - T[:3, 3]) @ R),
            right=vector(np.array(self.right) @ R),
            up=vector(np.array(self.up) @ R),
            focal=self.focal,
        )

    def project(self, points: ArrayLike) -> Array:
        """Return where points are in the picture.

        Args:
            points: m, in the camera's frame of reference, shape (count, 3).

        Returns:
            Pixels right of the picture's middle, pixels above it, and depth, m, shape (count, 3). Points that are not
            in front of the camera have a depth that is not positive, and NaN for pixels.
        """
        offsets = np.asarray(points, dtype=np.float64).reshape(-1, 3) - self.position
        depth = offsets @ np.cross(self.up, self.right)
        with np.errstate(over="ignore"):  # next to the camera
            scale = self.focal / np.where(depth > 0.0, depth, np.nan)
            return np.stack([scale * (offsets @ self.right), scale * (offsets @ self.up), depth], axis=1)

    def raised(self, point: Vector, pixels: float, depth: float) -> Vector:
        """Return the point of the same depth that is seen ``pixels`` above another.

        Args:
            point: m.
            pixels: May be negative.
            depth: Of both points, m.
        """
        x, y, z = (p + pixels * depth / self.focal * u for p, u in zip(point, self.up, strict=True))
        return x, y, z


def pinhole_of(camera: viser.CameraHandle) -> Pinhole | None:
    """Return the model of a page's camera, or None if the browser sent nothing usable.

    viser's cameras follow OpenCV: x to the right, y down, z ahead. The unit quaternion (w, v) turns a vector
    x into x + 2 v × (v × x + w x).
    """
    height, field_of_view = float(camera.image_height), float(camera.fov)
    if not (height > 0.0 and 0.0 < field_of_view < math.pi):
        return None
    pinhole = Pinhole(
        position=vector(camera.position),
        right=vector(_rotated(camera.wxyz, (1.0, 0.0, 0.0))),
        up=vector(_rotated(camera.wxyz, (0.0, -1.0, 0.0))),
        focal=0.5 * height / math.tan(0.5 * field_of_view),
    )
    return pinhole if pinhole.is_usable else None


def _rotated(wxyz: Array, x: Vector) -> Array:
    w, v = wxyz[0], wxyz[1:]
    return np.asarray(np.array(x) + 2.0 * np.cross(v, np.cross(v, x) + w * np.array(x)))
