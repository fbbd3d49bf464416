"""The camera of a page, as its browser describes it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dh2sim.draw.projection import Pinhole
from dh2sim.typing import Array
from dh2sim.view.scene.items import Vector, vector

if TYPE_CHECKING:
    import viser


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
