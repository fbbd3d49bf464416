"""Poses of a robot's links and frames, computed once for everything that is drawn; and lengths to draw them with."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.kinematics.forward import joint_poses
from dh2sim.kinematics.transforms import compose, identity
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array, read_only

_CACHED: Final = 8
"""Enough for the robot and its ghost, now and one configuration ago, on a few pages."""
_TRIAD: Final = 0.13
"""Length of a frame's axes, as a share of the robot's size."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkPoses:
    """Poses in base_link."""

    links: Array
    """Of the robot's ``all_links``: base_link, each row's link and the tool, shape (links, 4, 4)."""
    frames: Array
    """Of DH frames 0 … number of rows, shape (number of rows + 1, 4, 4)."""
    tool0: Array
    """Shape (4, 4)."""


def poses_at(model: RobotModel, q: ArrayLike) -> LinkPoses:
    """Return the poses of all links and frames.

    Args:
        model: The robot.
        q: Joint vector, rad and m, shape (n,).

    Raises:
        ConfigurationError: ``q`` has the wrong shape or is not finite.
    """
    return _poses_at(model, tuple(np.asarray(q, dtype=np.float64).ravel().tolist()))


@lru_cache(maxsize=_CACHED)
def _poses_at(model: RobotModel, q: tuple[float, ...]) -> LinkPoses:
    chain = model.chain
    links = np.concatenate([identity()[None], joint_poses(chain, q)])
    T_link_dh = np.stack([chain.T_base_link_dh0, *(joint.T_joint_dh for joint in chain.joints)])
    frames = links @ T_link_dh
    if model.tool is not None:
        links = np.concatenate([links, frames[-1:]])
    tool0 = compose(frames[-1], chain.T_dhn_tool0)
    return LinkPoses(links=read_only(links), frames=read_only(frames), tool0=read_only(tool0))


@lru_cache(maxsize=_CACHED)
def robot_size(model: RobotModel) -> float:
    """Return the diagonal of the box around base_link and all frames at home, m; positive."""
    size = float(np.linalg.norm(np.ptp(frame_origins(model), axis=0)))
    return size if size > 1e-9 else model.reach or 1.0


def frame_origins(model: RobotModel) -> Array:
    """Return the origins of base_link and of all frames at home, m, shape (count, 3)."""
    poses = poses_at(model, model.home)
    return np.vstack([np.zeros(3), poses.frames[:, :3, 3], poses.tool0[:3, 3]])


def triad_length(model: RobotModel) -> float:
    """Return the length of the axes that frames are drawn with, m."""
    return _TRIAD * robot_size(model)


def round_length(length: float) -> float:
    """Return the least length that is not shorter and is 1, 2 or 5 times a power of ten."""
    unit = 10.0 ** math.floor(math.log10(length))
    return next(step * unit for step in (1.0, 2.0, 5.0, 10.0) if length <= step * unit * 1.000001)
