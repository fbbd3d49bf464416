"""Where a robot's links and frames are at a configuration: worked out once for all that is drawn of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.kinematics.forward import joint_poses
from dh2sim.kinematics.transforms import compose, identity
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array, read_only

_KEPT = 8
"""The robot and its ghost, at this configuration and the last, for a few pages."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stance:
    """Poses in base_link."""

    links: Array
    """Of base_link and of each row's link, shape (number of rows + 1, 4, 4)."""
    frames: Array
    """Of DH frames 0 … number of rows, shape (number of rows + 1, 4, 4)."""
    tool0: Array
    """Shape (4, 4)."""


def stance_of(model: RobotModel, q: ArrayLike) -> Stance:
    """Return where everything is.

    Args:
        model: The robot.
        q: Joint vector, rad and m, shape (n,).

    Raises:
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """
    return _stance(model, tuple(np.asarray(q, dtype=np.float64).ravel().tolist()))


@lru_cache(maxsize=_KEPT)
def _stance(model: RobotModel, q: tuple[float, ...]) -> Stance:
    chain = model.chain
    links = np.concatenate([identity()[None], joint_poses(chain, q)])
    T_link_dh = np.stack([chain.T_base_link_dh0, *(joint.T_joint_dh for joint in chain.joints)])
    frames = links @ T_link_dh
    tool0 = compose(frames[-1], chain.T_dhn_tool0)
    return Stance(links=read_only(links), frames=read_only(frames), tool0=read_only(tool0))
