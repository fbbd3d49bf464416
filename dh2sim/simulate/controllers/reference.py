"""References from a trajectory file: the same for every rollout."""

from __future__ import annotations

import numpy as np

from dh2sim.errors import ControllerError, TrajectoryError
from dh2sim.simulate.controllers.protocol import RolloutBatch
from dh2sim.simulate.controllers.trajectories import Motion, StepByStep
from dh2sim.trajectory.files import SampledTrajectory, read_trajectory
from dh2sim.typing import Array


def read_reference(file: str) -> SampledTrajectory:
    """Read a trajectory file.

    Raises:
        ControllerError: It cannot be used.
    """
    try:
        return read_trajectory(file)
    except TrajectoryError as error:
        raise ControllerError(str(error)) from None


class SampledReference:
    """What a trajectory file prescribes at each time step; after its end, rest where it ends.

    Between its samples it is a curve through them: of fifth degree where the file has velocities and accelerations,
    else a cubic spline.
    """

    def __init__(self, batch: RolloutBatch, trajectory: SampledTrajectory) -> None:
        """Put its joints in the order of the robot's.

        Raises:
            ControllerError: They are not the robot's joints.
        """
        try:
            self._trajectory = trajectory.ordered(batch.plant.joints, besides=batch.plant.following)
        except TrajectoryError as error:
            raise ControllerError(f"reference: {error}") from None
        self._timestep, self._batch = batch.plant.timestep, len(batch.rollouts)
        self.at = StepByStep(self.motion)

    def motion(self, first: int, count: int) -> Motion:
        """Return the motion at the beginning of time steps ``first`` to ``first + count - 1``."""
        q, v, a, _ = self._trajectory.at(np.arange(first, first + count) * self._timestep)
        return Motion(q=self._for_all(q), v=self._for_all(v), a=self._for_all(a))

    def _for_all(self, rows: Array) -> Array:
        return np.broadcast_to(rows, (self._batch, *rows.shape))
