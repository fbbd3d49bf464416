"""Where points of space are in a picture: central projection, as cameras see, and parallel projection."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.typing import Array, read_only

Vector = tuple[float, float, float]


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
            position=_vector((np.array(self.position) - T[:3, 3]) @ R),
            right=_vector(np.array(self.right) @ R),
            up=_vector(np.array(self.up) @ R),
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

    def pixels(self, points: ArrayLike, size: tuple[int, int]) -> Array:
        """Return where points are in a picture of a width and height, pixels.

        Args:
            points: m, in the camera's frame of reference, shape (count, 3).
            size: width and height.

        Returns:
            Pixels from the top left corner, x to the right and y down, shape (count, 2), and NaN for points that are
            not in front of the camera.
        """
        return np.array([0.5, 0.5]) * size + np.array([1.0, -1.0]) * self.project(points)[:, :2]

    def raised(self, point: Vector, pixels: float, depth: float) -> Vector:
        """Return the point of the same depth that is seen ``pixels`` above another.

        Args:
            point: m.
            pixels: May be negative.
            depth: Of both points, m.
        """
        x, y, z = (p + pixels * depth / self.focal * u for p, u in zip(point, self.up, strict=True))
        return x, y, z


def scene_pinhole(scene: Any, height: int) -> Pinhole:
    """Return the camera that MuJoCo renders a scene with; its frustum must be symmetric, as it is by default.

    Args:
        scene: ``mujoco.MjvScene``, updated before.
        height: Of the picture, pixels.
    """
    left, right = scene.camera[0], scene.camera[1]  # the eyes of a stereoscopic picture
    forward, up = np.array(left.forward, dtype=float), np.array(left.up, dtype=float)
    return Pinhole(
        position=_vector(0.5 * (np.array(left.pos, dtype=float) + np.array(right.pos, dtype=float))),
        right=_vector(np.cross(forward, up)),
        up=_vector(up),
        focal=float(left.frustum_near * height / (left.frustum_top - left.frustum_bottom)),
    )


def _vector(values: Array) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ParallelView:
    """Parallel projection with base_link's z upright."""

    right: Array
    """What is to the right in the picture, a unit vector, shape (3,)."""
    up: Array
    """What is upwards in the picture, a unit vector, shape (3,)."""

    def project(self, points: ArrayLike) -> Array:
        """Project points, shape (..., 3), to the right and up, shape (..., 2), in their own unit."""
        return np.stack([np.asarray(points) @ self.right, np.asarray(points) @ self.up], axis=-1)


def look_from(azimuth: float, elevation: float) -> ParallelView:
    """Return the parallel projection that looks from a direction, degrees."""
    az, el = math.radians(azimuth), math.radians(elevation)
    return ParallelView(
        right=read_only([-math.sin(az), math.cos(az), 0.0]),
        up=read_only([-math.sin(el) * math.cos(az), -math.sin(el) * math.sin(az), math.cos(el)]),
    )
