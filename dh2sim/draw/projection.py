"""Where points of space are in a picture: central projection, as cameras see, and parallel projection."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.typing import Array, read_only


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PinholeCamera:
    """Central projection, without distortion."""

    position: Array
    """m, shape (3,)."""
    right: Array
    """What is to the right in the picture, a unit vector, shape (3,)."""
    up: Array
    """What is upwards in the picture, a unit vector, shape (3,)."""
    focal: float
    """Pixels that a length of 1 m takes at a distance of 1 m."""
    size: tuple[int, int]
    """Width and height of the picture, pixels."""

    def pixels(self, points: ArrayLike) -> Array:
        """Return where points are seen, pixels from the top left corner, x to the right and y down.

        Args:
            points: m, shape (..., 3).

        Returns:
            Shape (..., 2); NaN for points that are not in front of the camera.
        """
        offsets = np.asarray(points) - self.position
        depth = self.depth(points)
        scale = self.focal / np.where(depth > 0.0, depth, np.nan)
        width, height = self.size
        return np.stack(
            [width / 2 + scale * (offsets @ self.right), height / 2 - scale * (offsets @ self.up)], axis=-1
        )

    def depth(self, points: ArrayLike) -> Array:
        """Return how far points are in front of the camera, m, shape (...,)."""
        return np.asarray((np.asarray(points) - self.position) @ np.cross(self.up, self.right))


def scene_camera(scene: Any, width: int, height: int) -> PinholeCamera:
    """Return the camera that MuJoCo renders a scene with; its frustum must be symmetric, as it is by default.

    Args:
        scene: ``mujoco.MjvScene``, updated before.
        width: of the picture, pixels.
        height: of the picture, pixels.
    """
    left, right = scene.camera[0], scene.camera[1]  # the eyes of a stereoscopic picture
    forward, up = np.array(left.forward, dtype=float), np.array(left.up, dtype=float)
    return PinholeCamera(
        position=read_only(0.5 * (np.array(left.pos, dtype=float) + np.array(right.pos, dtype=float))),
        right=read_only(np.cross(forward, up)),
        up=read_only(up),
        focal=float(left.frustum_near * height / (left.frustum_top - left.frustum_bottom)),
        size=(width, height),
    )


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
