"""Controllers that are a little wrong, as a user's own would be given."""

from __future__ import annotations

from dh2sim.robot.row import ActuatorType
from dh2sim.simulate.controllers.protocol import Observation, RolloutBatch
from dh2sim.simulate.controllers.torque import ComputedTorque
from dh2sim.typing import Array


class Weak:
    """Balances all but a millionth of gravity."""

    actuation = ActuatorType.MOTOR

    def __init__(self, batch: RolloutBatch) -> None:
        pass

    def control(self, observation: Observation) -> Array:
        return (1.0 - 1e-6) * observation.gravity


class Forgetful(ComputedTorque):
    """Knows gravity, and forgets Coriolis and centrifugal forces."""

    def control(self, observation: Observation) -> Array:
        return super().control(observation) - observation.bias + observation.gravity
