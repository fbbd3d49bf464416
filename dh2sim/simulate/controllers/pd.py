"""Motors as springs and dampers towards a reference."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from dh2sim.robot.spec import ActuatorType
from dh2sim.simulate.controllers.gains import steady_gains
from dh2sim.simulate.controllers.options import Within
from dh2sim.simulate.controllers.protocol import Lanes, Observation
from dh2sim.simulate.controllers.references import Amplitude, Period, SmoothReference
from dh2sim.typing import Array


class PD:
    """Motors pull as springs and dampers towards smooth random references, gravity balanced."""

    actuation = ActuatorType.MOTOR

    def __init__(
        self,
        lanes: Lanes,
        *,
        kp: Annotated[float | None, Within(at_least=0.0)] = None,
        kd: Annotated[float | None, Within(at_least=0.0)] = None,
        gravity: bool = True,
        period: Period = 1.0,
        amplitude: Amplitude = 0.5,
    ) -> None:
        """Draw the references.

        Args:
            lanes: the rollouts.
            kp: stiffness of every joint, N·m/rad or N/m; None: the robot's own, softened as
                the time step requires.
            kd: damping of every joint, N·m·s/rad or N·s/m; None: likewise.
            gravity: whether gravity is balanced.
            period: duration of a motion between waypoints, s.
            amplitude: share of the joints' range that the waypoints are in.
        """
        own_kp, own_kd = steady_gains(lanes.plant)
        self._kp = own_kp if kp is None else np.full(lanes.plant.n, kp)
        self._kd = own_kd if kd is None else np.full(lanes.plant.n, kd)
        self._gravity = gravity
        self._smooth = SmoothReference(lanes, period=period, amplitude=amplitude)

    def control(self, observation: Observation) -> Array:
        """Return torques or forces, N·m or N, shape (batch, n)."""
        q, v, _ = self._smooth.at(observation.step)
        torque = self._kp * (q - observation.q) + self._kd * (v - observation.v)
        return torque + observation.gravity if self._gravity else torque

    def reference(self, first: int, count: int) -> tuple[Array, Array]:
        """Return the reference's positions and velocities."""
        motion = self._smooth.motion(first, count)
        return motion.q, motion.v
