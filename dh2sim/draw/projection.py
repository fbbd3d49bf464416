"""Where points of the scene are in the picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dh2sim.draw.offscreen import import_mujoco
from dh2sim.typing import Array, read_only


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Projection:
    """A pinhole camera: what MuJoCo draws with, for points."""

    position: Array
    """Of the camera, m, shape (3,)."""
    rotation: Array
    """Rows: to the right, up, forward; shape (3, 3)."""
    scale: float
    """Pixels that a length of 1 m at a distance of 1 m takes."""
    centre: tuple[float, float]
    """Pixel that the camera looks at, from top left."""
    near: float
    """Nearest distance that is drawn, m."""

    def pixels(self, points: Array) -> Array:
        """Return pixels, x to the right and y down, shape (count, 2); NaN for what is not before the camera.

        Args:
            points: m, shape (count, 3).
        """
        local = (points - self.position) @ self.rotation.T
        depth = np.where(local[:, 2] > self.near, local[:, 2], np.nan)
        x = self.centre[0] + self.scale * local[:, 0] / depth
        y = self.centre[1] - self.scale * local[:, 1] / depth
        return np.stack([x, y], axis=1)

    def depth(self, points: Array) -> Array:
        """Return how far before the camera points are, m, shape (count,)."""
        return np.asarray((points - self.position) @ self.rotation[2])


def scene_projection(scene: Any, width: int, height: int) -> Projection:
    """Return the projection of a scene's camera, as ``mjr_render`` uses it.

    Args:
        scene: ``mujoco.MjvScene``, updated before.
        width: of the picture, pixels.
        height: of the picture, pixels.
    """
    camera = import_mujoco().mjv_averageCamera(scene.camera[0], scene.camera[1])
    forward, up = np.array(camera.forward, dtype=float), np.array(camera.up, dtype=float)
    tall = camera.frustum_top - camera.frustum_bottom
    scale = camera.frustum_near * height / tall
    middle = 0.5 * (camera.frustum_top + camera.frustum_bottom) / camera.frustum_near
    aside = camera.frustum_center / camera.frustum_near
    return Projection(
        position=read_only(camera.pos),
        rotation=read_only(np.stack([np.cross(forward, up), up, forward])),
        scale=float(scale),
        centre=(width / 2 - scale * aside, height / 2 + scale * middle),
        near=float(camera.frustum_near),
    )
