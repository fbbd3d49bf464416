"""No actuation at all."""

from __future__ import annotations

import numpy as np

from dh2sim.robot.spec import ActuatorType
from dh2sim.simulate.controllers.protocol import Lanes
from dh2sim.typing import Array


class Passive:
    """No actuators: the robot moves as gravity, friction and its start make it."""

    actuation = ActuatorType.NONE

    def __init__(self, lanes: Lanes) -> None:
        """Note how many rollouts there are."""
        self._controls = np.zeros((len(lanes.rollouts), 1, 0))

    def controls(self, first: int, count: int) -> Array:  # noqa: ARG002 - the same at every step
        """Return no controls, shape (batch, 1, 0)."""
        return self._controls
