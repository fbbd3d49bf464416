"""Inverse kinematics of the tool's handle: the nearest configuration downhill from where the robot is.

The solver is that of :mod:`dh2sim.inverse.numeric`; a robot of six joints and more weighs position and orientation
against each other, one with fewer gives up the orientation where it cannot reach both.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.inverse.numeric import LEVER, NumericSolver
from dh2sim.kinematics.chain import joint_vector
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array, read_only

SMALL_LEVER = 0.03
"""What 1 rad counts as, in sizes of the robot, with fewer than six joints: they seldom have the orientation."""
CLOSE = 1e-6
"""Error, m and rad, up to which a handle's goal counts as reached: what a browser sends is rounded."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HandleSolution:
    """Where the robot goes for a goal of the handle."""

    q: Array
    """Joint positions inside the limits, rad or m, read-only, shape (n,)."""
    position_error: float
    """Distance of tool0 from the goal, m."""
    rotation_error: float
    """Angle between tool0's orientation and the goal's, rad, from 0 to pi."""
    reached: bool
    """Whether tool0 is at the goal; the orientation counts for robots of six joints and more."""


class HandleKinematics:
    """The solver of one robot."""

    def __init__(self, model: RobotModel) -> None:
        """Prepare a robot."""
        ranges = [joint.position_range or (-math.inf, math.inf) for joint in model.moving_joints]
        lower, upper = np.array(ranges, dtype=np.float64).reshape(-1, 2).T
        self._chain = model.chain
        self._solver = NumericSolver(model.chain, lower, upper)
        self._whole_pose = model.chain.n >= 6

    def solve(self, q_start: ArrayLike, T_base_tool: Array, *, steps: int = 100) -> HandleSolution:
        """Bring tool0 to a pose, or as near as possible.

        Args:
            q_start: Joint positions, rad or m, shape (n,), moved inside the limits; the solution is near.
            T_base_tool: Pose of tool0 in base_link, shape (4, 4), its rotation orthonormal.
            steps: Most steps.

        Returns:
            The solution; if ``reached`` is False, the nearest that was found.

        Raises:
            ConfigurationError: ``q_start`` has a wrong shape or is not finite.
        """
        goal, q = T_base_tool[None], joint_vector(self._chain, q_start)[None]
        found = self._solver.descend(goal, q, lever=LEVER if self._whole_pose else SMALL_LEVER, steps=steps)
        if not self._whole_pose and not found.reached[0]:
            point = self._solver.descend(goal, found.q, free="rotation", steps=steps)
            found = self._solver.errors(point.q, goal)
        close = CLOSE * min(self._solver.size, 1.0)
        turned = bool(found.rotation_error[0] <= CLOSE) or not self._whole_pose
        return HandleSolution(
            q=read_only(found.q[0]),
            position_error=float(found.position_error[0]),
            rotation_error=float(found.rotation_error[0]),
            reached=bool(found.position_error[0] <= close) and turned,
        )
