"""Where the mouse has grabbed a link, and the arrow that shows how it pulls."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.kinematics.forward import joint_poses
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.view.extent import triad_length
from dh2sim.view.items import Arrow, Color, Vector
from dh2sim.view.state import Pull

_COLOR: Final[Color] = (0.75, 0.10, 0.70)
_THICKNESS: Final = 0.12
"""Of the arrow, as a share of the length of frames' axes."""


def grabbed_point(model: RobotModel, q: ArrayLike, link: str, place: ArrayLike) -> Vector:
    """Return which point of a link is at a place.

    Args:
        model: The robot.
        q: Joint vector, rad and m, shape (n,).
        link: Name of one of the links that move.
        place: In base_link, m, shape (3,).

    Returns:
        The point in the link's frame, m.
    """
    T = _link_pose(model, q, link)
    return _vector(T[:3, :3].T @ (np.asarray(place, dtype=np.float64) - T[:3, 3]))


def pull_arrow(model: RobotModel, q: ArrayLike, pull: Pull) -> Arrow:
    """Return the arrow from the point that is pulled at to the mouse, with the joints at ``q``, shape (n,)."""
    T = _link_pose(model, q, pull.link)
    start = T[:3, :3] @ np.array(pull.point_in_link) + T[:3, 3]
    return Arrow(start=_vector(start), end=pull.target, color=_COLOR, thickness=_THICKNESS * triad_length(model))


def _link_pose(model: RobotModel, q: ArrayLike, link: str) -> Array:
    place = [known.name for known in model.links].index(link)
    return np.asarray(joint_poses(model.chain, q)[place])


def _vector(point: Array) -> Vector:
    x, y, z = (float(component) for component in point)
    return x, y, z
