"""How large a robot is to the eye, and where the eye should stand."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.kinematics.transforms import compose
from dh2sim.model.meshes import MeshAsset
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.view.scene.items import Vector
from dh2sim.view.scene.link_poses import stance_of
from dh2sim.view.scene.solids import mesh_triangles

FIELD: Final = math.radians(45.0)
"""Angle that the camera sees from top to bottom, rad."""
_TRIAD: Final = 0.13
"""Length of a frame's axes, as a share of the robot's size."""
_NARROWEST: Final = 0.2
"""Aspect of pictures that the robot still fits into."""
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


def eye_of(model: RobotModel, aspect: float = 1.0) -> Eye:
    """Return where the whole robot at home is seen from, with room around it.

    Args:
        model: The robot.
        aspect: Width of the picture over its height; in a narrow one the eye stands farther away.
    """
    corners = np.vstack([_corners(model), _ends(model)])
    low, high = corners.min(axis=0), corners.max(axis=0)
    centre = 0.5 * (low + high)
    radius = max(0.55 * float(np.linalg.norm(high - low)), 0.5 * size_of(model))
    way = np.array(_DIRECTION) / np.linalg.norm(_DIRECTION)
    half = math.atan(math.tan(0.5 * FIELD) * min(max(aspect, _NARROWEST), 1.0))
    position = centre + radius / math.sin(half) * way
    return Eye(position=_vector(position), look_at=_vector(centre))


def _corners(model: RobotModel) -> Array:
    """Return the origins of base_link and of all frames at home, m, shape (count, 3)."""
    stance = stance_of(model, model.home)
    return np.vstack([np.zeros(3), stance.frames[:, :3, 3], stance.tool0[:3, 3]])


def _ends(model: RobotModel) -> Array:
    """Return points around what shows the links at home, m, shape (count, 3)."""
    stance = stance_of(model, model.home)
    points = [np.empty((0, 3))]
    for link, T_base_link, T_base_dh in zip(model.all_links, stance.links, stance.frames, strict=True):
        if link.mesh is None:
            points += [_placed(T_base_link, shape.ends) for shape in link.shapes]
        else:
            points.append(_placed(compose(T_base_dh, link.mesh.T_dh_mesh), _box(link.mesh)))
    return np.vstack(points)


@lru_cache(maxsize=64)
def _box(mesh: MeshAsset) -> Array:
    """Return the corners of the box around a mesh in its own frame, m, shape (8, 3)."""
    vertices = np.array(mesh_triangles(mesh)[0])
    return np.array(list(product(*np.stack([vertices.min(axis=0), vertices.max(axis=0)], axis=1))))


def _placed(T: Array, points: ArrayLike) -> Array:
    """Return points, shape (count, 3), that are given in a frame."""
    return np.asarray(points) @ T[:3, :3].T + T[:3, 3]


def _vector(values: Array) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
