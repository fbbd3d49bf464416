"""Where the mouse has grabbed a link, and the arrow that shows how it pulls.

A goal that tool0 has not reached: told, and shown.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.kinematics.forward import forward_kinematics, joint_poses
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.view.panel.readings import difference
from dh2sim.view.scene.ghost import Gap
from dh2sim.view.scene.items import Arrow, Color, Polyline, Vector
from dh2sim.view.scene.robot_size import triad_length
from dh2sim.view.scene.solids import position_of
from dh2sim.view.state import Goal, Part, Pull, ViewState

_GOAL_COLOR: Final[Color] = (0.85, 0.20, 0.10)


def told_unreached(state: ViewState) -> str:
    """Return how far tool0 is from where the user has dragged it, a sentence; empty if it is there."""
    goal = _unreached(state)
    if goal is None:
        return ""
    distance, angle = difference(forward_kinematics(state.model.chain, state.q), np.array(goal.T_base_link_tool0))
    gap = Gap(distance=distance, angle=angle)
    return f"The handle is out of reach, or too far for one step: tool0 is {gap.text}."


def line_to_unreached(state: ViewState) -> Polyline | None:
    """Return a line in base_link from tool0 to where the user has dragged it; None if it is there."""
    goal = _unreached(state)
    if goal is None:
        return None
    tool = position_of(forward_kinematics(state.model.chain, state.q))
    return Polyline(points=(tool, position_of(np.array(goal.T_base_link_tool0))), color=_GOAL_COLOR, width=3.0)


def _unreached(state: ViewState) -> Goal | None:
    shown = Part.HANDLE in state.shown and state.goal is not None and not state.goal.reached
    return state.goal if shown else None


_PULL_COLOR: Final[Color] = (0.75, 0.10, 0.70)
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
    return Arrow(start=_vector(start), end=pull.target, color=_PULL_COLOR, thickness=_THICKNESS * triad_length(model))


def _link_pose(model: RobotModel, q: ArrayLike, link: str) -> Array:
    place = [known.name for known in model.links].index(link)
    return np.asarray(joint_poses(model.chain, q)[place])


def _vector(point: Array) -> Vector:
    x, y, z = (float(component) for component in point)
    return x, y, z
