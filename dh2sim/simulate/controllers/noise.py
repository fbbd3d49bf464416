"""Smooth noise."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from dh2sim.errors import ControllerError
from dh2sim.robot.spec import ActuatorType
from dh2sim.simulate.controllers.actuators import driven_joints, holding_controls, of_type
from dh2sim.simulate.controllers.curves import cubic_spline_weights, pieces, runs_of, weighted_sum
from dh2sim.simulate.controllers.options import Within
from dh2sim.simulate.controllers.protocol import Lanes
from dh2sim.simulate.controllers.windows import INSIDE, centers, follow, free_ranges, half_ranges, uniform
from dh2sim.typing import Array


class Noise:
    """The robot's own actuators get smoothed noise.

    Controls are uniform cubic B-splines through the neighbourhood of random points, twice continuously differentiable
    and between their least and greatest points. They start at rest, with what the actuators do at the start: its
    position, no velocity, no force. Setpoints of positions keep the velocity limits.
    """

    actuation = None

    def __init__(
        self,
        lanes: Lanes,
        *,
        rate: Annotated[float, Within(above=0.0, unit="Hz")] = 5.0,
        amplitude: Annotated[float, Within(at_least=0.0, at_most=1.0)] = 0.3,
    ) -> None:
        """Draw the points.

        Args:
            lanes: the rollouts.
            rate: random points a second, Hz.
            amplitude: share of half the control's range that they are in, at either side of the start, or as near to
                it as the range allows.

        Raises:
            ControllerError: there is more than one point a time step.
        """
        plant = lanes.plant
        if rate * plant.timestep > 1.0:
            raise ControllerError(
                f"option 'rate' is {rate:g} Hz, above that of the time steps, {1 / plant.timestep:g} Hz"
            )
        self._timestep, self._interval = plant.timestep, 1.0 / rate
        self._lower, self._upper = plant.control_lower, plant.control_upper
        joints = driven_joints(plant)
        position, velocity = of_type(plant, ActuatorType.POSITION), of_type(plant, ActuatorType.VELOCITY)
        free = np.where(position, free_ranges(plant)[joints], np.where(velocity, plant.velocity[joints], 1.0))
        reach = INSIDE * amplitude * half_ranges(self._lower, self._upper, free)
        start = holding_controls(lanes, against_gravity=False)
        center = centers(start, reach, self._lower, self._upper)
        self._pieces = math.floor(lanes.steps * plant.timestep * rate) + 1
        targets = center + reach * uniform(lanes.generators, self._pieces, len(joints))
        # a spline is nowhere quicker than its points are apart
        most = np.where(position, INSIDE * plant.velocity[joints] / rate, np.inf)
        self._points = follow(start, [start, start, *targets], most)

    def controls(self, first: int, count: int) -> Array:
        """Return controls, shape (batch, count, actuators)."""
        piece, u = pieces(first, count, self._timestep, self._interval, self._pieces)
        weights = cubic_spline_weights(u)
        controls = np.empty((self._points.shape[1], count, self._points.shape[2]))
        for i, part in runs_of(piece):
            weighted_sum(weights[:, part], list(self._points[i : i + 4]), controls[:, part])
        return np.clip(controls, self._lower, self._upper, out=controls)
