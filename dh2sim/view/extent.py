"""How large a robot is to the eye, and where the eye should stand."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from dh2sim.kinematics.forward import forward_kinematics, frame_poses, joint_poses
from dh2sim.kinematics.transforms import identity
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.view.items import Vector

FIELD: Final = math.radians(45.0)
"""Angle that the camera sees from top to bottom, rad."""
_TRIAD: Final = 0.13
"""Length of a frame's axes, as a share of the robot's size."""
_DIRECTION: Final = (0.62, -0.68, 0.42)
"""From the robot to the eye."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Eye:
    """Where a camera stands, and what it looks at; m, in base_link."""

    position: Vector
    look_at: Vector


@lru_cache(maxsize=8)  # every scene asks, and a model never changes
def size_of(model: RobotModel) -> float:
    """Return the diagonal of the box around base_link and all frames at home, m; positive, the same at every q."""
    size = float(np.linalg.norm(np.ptp(_corners(model), axis=0)))
    return size if size > 1e-9 else model.reach or 1.0


def triad_length(model: RobotModel) -> float:
    """Return how long the axes of frames are drawn, m."""
    return _TRIAD * size_of(model)


def eye_of(model: RobotModel) -> Eye:
    """Return where the whole robot at home is seen from, with room around it."""
    corners = np.vstack([_corners(model), _ends(model)])
    low, high = corners.min(axis=0), corners.max(axis=0)
    centre = 0.5 * (low + high)
    radius = max(0.55 * float(np.linalg.norm(high - low)), 0.5 * size_of(model))
    way = np.array(_DIRECTION) / np.linalg.norm(_DIRECTION)
    position = centre + radius / math.sin(0.5 * FIELD) * way
    return Eye(position=_vector(position), look_at=_vector(centre))


def _corners(model: RobotModel) -> Array:
    """Return the origins of base_link and of all frames at home, m, shape (count, 3)."""
    frames = frame_poses(model.chain, model.home)[:, :3, 3]
    tool = forward_kinematics(model.chain, model.home)[:3, 3]
    return np.vstack([np.zeros(3), frames, tool])


def _ends(model: RobotModel) -> Array:
    """Return the ends of all links' shapes at home, m, shape (count, 3)."""
    poses = [identity(), *joint_poses(model.chain, model.home)]
    return np.array(
        [
            T[:3, :3] @ end + T[:3, 3]
            for link, T in zip(model.all_links, poses, strict=True)
            for shape in link.shapes
            for end in shape.ends
        ]
    ).reshape(-1, 3)


def _vector(values: Array) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
