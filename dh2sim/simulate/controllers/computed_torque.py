"""Motors that do what the robot's dynamics ask for."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from dh2sim.robot.spec import ActuatorType
from dh2sim.simulate.controllers.options import Within
from dh2sim.simulate.controllers.protocol import Lanes, Observation
from dh2sim.simulate.controllers.references import Amplitude, Period, SmoothReference
from dh2sim.typing import Array


class ComputedTorque:
    """Motors make the torques that the dynamics ask for to follow smooth random references.

    tau = M(q) (a_ref + kd (v_ref - v) + kp (q_ref - q)) + c(q, v) + g(q) - passive forces, which leaves the error
    e'' + kd e' + kp e = 0; kp = bandwidth², kd = 2 bandwidth damp it critically. Source: M. Spong, S. Hutchinson,
    M. Vidyasagar, Robot Modeling and Control (2006), section 8.3, inverse dynamics.
    """

    actuation = ActuatorType.MOTOR

    def __init__(
        self,
        lanes: Lanes,
        *,
        bandwidth: Annotated[float, Within(above=0.0, unit="rad/s")] = 20.0,
        period: Period = 1.0,
        amplitude: Amplitude = 0.5,
    ) -> None:
        """Draw the references.

        Args:
            lanes: the rollouts.
            bandwidth: how fast errors vanish, rad/s.
            period: duration of a motion between waypoints, s.
            amplitude: share of the joints' range that the waypoints are in.
        """
        self._kp, self._kd = bandwidth * bandwidth, 2.0 * bandwidth
        self._smooth = SmoothReference(lanes, period=period, amplitude=amplitude)

    def control(self, observation: Observation) -> Array:
        """Return torques or forces, N·m or N, shape (batch, n)."""
        q, v, a = self._smooth.at(observation.step)
        wanted = a + self._kd * (v - observation.v) + self._kp * (q - observation.q)
        torque = observation.bias - observation.passive
        inertia = observation.mass_matrix
        term = np.empty_like(torque)
        for j in range(wanted.shape[1]):  # column by column: the same order of additions for any batch
            np.multiply(inertia[:, :, j], wanted[:, j, None], out=term)
            torque += term
        return torque

    def reference(self, first: int, count: int) -> tuple[Array, Array]:
        """Return the reference's positions and velocities."""
        motion = self._smooth.motion(first, count)
        return motion.q, motion.v
