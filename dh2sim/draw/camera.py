"""The camera of a picture: far enough away that nothing of a motion is cut off."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from dh2sim.draw.motion import Motion
from dh2sim.errors import PictureError
from dh2sim.formats.mjcf.scene import FIELD_OF_VIEW, VIEW_DIRECTION
from dh2sim.messages import did_you_mean, listed, shown
from dh2sim.typing import Array

MARGIN = 0.07
"""Share of the picture's width and height that stays free on each side."""
FURTHEST = 20.0
"""Extents of the scene: what is further from its centre is not framed, since the robot has come apart."""
FOLLOWED = 4.0
"""Extents of the scene: a camera follows a floating base that goes further."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraChoice:
    """A camera of the model by name, or a direction in which to look; by default that of the scene's overview."""

    name: str | None = None
    azimuth: float | None = None
    """Azimuth of the direction in which the camera looks, degrees, from x to y."""
    elevation: float | None = None
    """Elevation of that direction, degrees; negative looks down."""
    distance: float | None = None
    """From the middle of what is shown, m; None: the nearest from which everything is seen."""


def parse_camera(text: str | None) -> CameraChoice:
    """Read ``NAME`` or ``azimuth,elevation[,distance]``, degrees and m.

    Raises:
        PictureError: they are not numbers, or out of range.
    """
    if text is None:
        return CameraChoice()
    parts = text.split(",")
    if len(parts) == 1:
        return CameraChoice(name=text)
    allowed = "allowed: a camera's name, or azimuth,elevation[,distance] in degrees and m, such as 120,-20"
    try:
        numbers = [float(part) for part in parts]
    except ValueError:
        raise PictureError(f"camera {shown(text)}: not all of these are numbers; {allowed}") from None
    if len(numbers) not in (2, 3) or not all(math.isfinite(number) for number in numbers):
        raise PictureError(f"camera {shown(text)}: two or three finite numbers are needed; {allowed}")
    if not -90.0 <= numbers[1] <= 90.0:
        raise PictureError(f"camera {shown(text)}: the elevation must be from -90 to 90 degrees")
    if len(numbers) == 3 and not 0.0 < numbers[2] <= 1e6:
        raise PictureError(f"camera {shown(text)}: the distance must be above 0, and at most a million metres")
    return CameraChoice(azimuth=numbers[0], elevation=numbers[1], distance=numbers[2] if len(numbers) == 3 else None)


def make_camera(choice: CameraChoice, model: Any, points: Array, aspect: float) -> Any:
    """Return a ``mujoco.MjvCamera``; the model's field of view and far clipping plane are adapted to it.

    Args:
        choice: a name, or a direction.
        model: ``mujoco.MjModel``, changed in place.
        points: that must be in the picture, shape (count, 3), m.
        aspect: width of the picture over its height.

    Raises:
        PictureError: the model has no camera of that name.
    """
    camera = mujoco.MjvCamera()
    if choice.name is not None:
        names = [model.camera(i).name for i in range(model.ncam)]
        if choice.name not in names:
            hint = did_you_mean(choice.name, names)
            raise PictureError(
                f"unknown camera {shown(choice.name)}.{hint} Cameras: {listed(names)}; or azimuth,elevation"
                "[,distance] in degrees and m, such as 120,-20"
            )
        camera.type = mujoco.mjtCamera.mjCAMERA_FIXED.value
        camera.fixedcamid = names.index(choice.name)
        return camera
    x, y, z = (-component for component in VIEW_DIRECTION)
    azimuth = math.degrees(math.atan2(y, x)) if choice.azimuth is None else choice.azimuth
    elevation = math.degrees(math.atan2(z, math.hypot(x, y))) if choice.elevation is None else choice.elevation
    model.vis.global_.fovy = FIELD_OF_VIEW
    lookat, distance = fit(points, azimuth, elevation, aspect)
    distance = distance if choice.distance is None else choice.distance
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE.value
    camera.azimuth, camera.elevation, camera.distance = azimuth, elevation, distance
    camera.lookat[:] = lookat
    away = distance + float(np.linalg.norm(lookat - model.stat.center))
    model.vis.map.zfar = max(model.vis.map.zfar, 3.0 * away / model.stat.extent)
    return camera


def fit(points: Array, azimuth: float, elevation: float, aspect: float) -> tuple[Array, float]:
    """Return where to look, shape (3,), and from how far, so that all points are in the picture and fill it.

    A point at right r, up u, back b is seen by a camera at (R, U, B) if |r - R| <= h (B - b) and
    |u - U| <= v (B - b), with h and v the tangents of half the fields of choice. So r + h b <= R + h B and
    -r + h b <= -R + h B for all points: the sum of both greatest left sides is at most 2 h B. Likewise for u.

    Args:
        points: shape (count, 3), m.
        azimuth: of the direction in which the camera looks, degrees.
        elevation: of that direction, degrees.
        aspect: width over height.
    """
    a, e = math.radians(azimuth), math.radians(elevation)
    forward = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
    right = np.array([math.sin(a), -math.cos(a), 0.0])
    up = np.cross(right, forward)
    vertical = math.tan(math.radians(FIELD_OF_VIEW / 2)) * (1.0 - 2.0 * MARGIN)
    b = -points @ forward
    place, back = np.zeros(3), -math.inf
    for axis, tangent in ((right, vertical * aspect), (up, vertical)):
        along = points @ axis
        high, low = float((along + tangent * b).max()), float((-along + tangent * b).max())
        place += axis * (high - low) / 2.0
        back = max(back, (high + low) / (2.0 * tangent))
    middle = float(b.min() + b.max()) / 2.0
    return place - middle * forward, back - middle


def follows_base(choice: CameraChoice, motion: Motion) -> bool:
    """Whether the camera follows the base: where that floats far away, the robot would be too small to see."""
    furthest = float(np.abs(motion.travel).max())
    return choice.name is None and furthest > FOLLOWED * motion.model.stat.extent


def extreme_points(motion: Motion, *, follows: bool) -> Array:
    """Return corners of boxes around all parts of the robot in all its positions, shape (count, 3), m.

    Args:
        motion: what moves.
        follows: whether the camera follows the base.
    """
    model = motion.model
    data = mujoco.MjData(model)
    planes = model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE.value
    geoms = np.flatnonzero(~planes & (model.geom_bodyid > 0))
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=float)
    boxes = model.geom_aabb[geoms]
    corners = boxes[:, None, :3] + signs * boxes[:, None, 3:]
    travel = motion.travel if follows else np.zeros((len(motion.time), 3))
    found = []
    for number in motion.sampled():
        motion.place(data, number)
        rotations = data.geom_xmat[geoms].reshape(-1, 3, 3)
        seen = np.einsum("gij,gkj->gki", rotations, corners) + data.geom_xpos[geoms][:, None]
        found.append(np.concatenate([seen.reshape(-1, 3), data.site_xpos]) - travel[number])
    points = np.concatenate(found)
    near = np.abs(points - model.stat.center).max(axis=1) <= FURTHEST * model.stat.extent
    return points[near] if near.any() else points
