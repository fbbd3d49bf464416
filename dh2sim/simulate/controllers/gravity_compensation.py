"""Motors that balance gravity."""

from __future__ import annotations

from typing import Annotated

from dh2sim.robot.spec import ActuatorType
from dh2sim.simulate.controllers.options import Within
from dh2sim.simulate.controllers.protocol import Lanes, Observation
from dh2sim.typing import Array


class GravityCompensation:
    """Motors balance gravity, so that the robot floats where it is put."""

    actuation = ActuatorType.MOTOR

    def __init__(self, lanes: Lanes, *, damping: Annotated[float, Within(at_least=0.0)] = 0.0) -> None:  # noqa: ARG002
        """Keep the damping.

        Args:
            lanes: the rollouts.
            damping: torque against motion per velocity, N·m·s/rad or N·s/m.
        """
        self._damping = damping

    def control(self, observation: Observation) -> Array:
        """Return torques or forces, N·m or N, shape (batch, n)."""
        if self._damping == 0.0:
            return observation.gravity
        return observation.gravity - self._damping * observation.v
