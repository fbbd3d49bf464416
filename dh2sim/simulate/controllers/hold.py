"""Position actuators that keep a robot where it starts."""

from __future__ import annotations

from dh2sim.robot.spec import ActuatorType
from dh2sim.simulate.controllers.actuators import holding_controls
from dh2sim.simulate.controllers.protocol import Lanes
from dh2sim.typing import Array


class Hold:
    """Position actuators hold the start, asked for as much more as balances gravity there."""

    actuation = ActuatorType.POSITION

    def __init__(self, lanes: Lanes) -> None:
        """Compute the setpoints, which never change."""
        self._controls = holding_controls(lanes, against_gravity=True)[:, None]

    def controls(self, first: int, count: int) -> Array:  # noqa: ARG002 - the same at every step
        """Return the setpoints, rad or m, shape (batch, 1, actuators)."""
        return self._controls
