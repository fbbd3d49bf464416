"""What inverse kinematics wants of tool0, as mink's tasks: position and orientation apart, each measured plainly."""

from __future__ import annotations

import mink
import mujoco
import numpy as np

from dh2sim.typing import Array

TOOL = "tool0"
"""The site."""


class PositionTask(mink.Task):  # type: ignore[misc, unused-ignore]
    """Bring tool0's origin to a point.

    mink's ``FrameTask`` measures along a screw motion, in which the way to a point depends on how far the
    orientations differ: for a goal that cannot be reached, the nearest by that measure is not the nearest in space.
    """

    def __init__(self, model: mujoco.MjModel, cost: float) -> None:
        """Weigh the distance; ``cost`` is that of 1 m."""
        super().__init__(cost=np.full(3, cost))
        self.target: Array = np.zeros(3)
        """The point, m, shape (3,)."""
        self._site = model.site(TOOL).id

    def compute_error(self, configuration: mink.Configuration) -> Array:
        """Return tool0's origin less the point, m, shape (3,)."""
        return np.asarray(configuration.data.site_xpos[self._site] - self.target)

    def compute_jacobian(self, configuration: mink.Configuration) -> Array:
        """Return its derivative by the joint positions, shape (3, nv)."""
        jacobian = np.empty((3, configuration.model.nv))
        mujoco.mj_jacSite(configuration.model, configuration.data, jacobian, None, self._site)
        return jacobian


def orientation_task(cost: float) -> mink.FrameTask:
    """Turn tool0 to a goal's orientation; ``cost`` is that of 1 rad."""
    return mink.FrameTask(TOOL, "site", position_cost=0.0, orientation_cost=cost)
