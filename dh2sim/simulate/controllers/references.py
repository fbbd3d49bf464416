"""Smooth random references: what controllers with motors follow."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Final, TypeAlias

import numpy as np

from dh2sim.errors import ControllerError
from dh2sim.simulate.controllers.curves import MINIMUM_JERK_PEAK, minimum_jerk, pieces, runs_of, weighted_sum
from dh2sim.simulate.controllers.options import Within
from dh2sim.simulate.controllers.protocol import Lanes
from dh2sim.simulate.controllers.windows import (
    INSIDE,
    centers,
    follow,
    free_ranges,
    half_ranges,
    uniform,
    widened,
)
from dh2sim.typing import Array

Period: TypeAlias = Annotated[float, Within(above=0.0, unit="s")]
"""Duration of a motion from waypoint to waypoint."""
Amplitude: TypeAlias = Annotated[float, Within(at_least=0.0, at_most=1.0)]
"""Share of the joint's range."""

_FEWEST: Final = 10
"""Time steps of a motion between waypoints."""
_AHEAD: Final = 64
"""Time steps that are computed together when they are asked for one by one."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """Positions, velocities and accelerations, rad or m and their rates, each of shape (batch, count, n)."""

    q: Array
    v: Array
    a: Array


class SmoothReference:
    """Minimum-jerk motions from one random waypoint to the next, at rest in each.

    The first waypoint is where the rollout starts. The others are uniform in a window around it, ``amplitude`` times
    the joint's range wide, or as near to it as the limits allow. A waypoint that could not be reached within the
    velocity limit is moved closer. Every motion stays between its two waypoints, so that nothing leaves the limits.
    """

    def __init__(self, lanes: Lanes, *, period: float, amplitude: float) -> None:
        """Draw the waypoints.

        Args:
            lanes: the rollouts.
            period: duration of a motion from waypoint to waypoint, s.
            amplitude: width of the window as a share of the joint's range, 0 to 1; of joints without limits, as a
                share of 2 pi rad or 2 m.

        Raises:
            ControllerError: a motion would be shorter than ten time steps.
        """
        plant = lanes.plant
        self._timestep = plant.timestep
        if period < _FEWEST * plant.timestep:
            raise ControllerError(
                f"option 'period' is {period} s; a motion needs at least {_FEWEST} time steps, "
                f"{_FEWEST * plant.timestep:g} s"
            )
        self._period = period
        self._motions = math.floor(lanes.steps * plant.timestep / period) + 1
        self._lower, self._upper = widened(lanes)
        reach = INSIDE * amplitude * half_ranges(plant.lower, plant.upper, free_ranges(plant))
        center = centers(lanes.q0, reach, plant.lower, plant.upper)
        targets = center + reach * uniform(lanes.generators, self._motions, plant.n)
        # nobody is quicker than the velocity limit, even where a start outside the limits makes the way longer
        most = INSIDE * plant.velocity * period / MINIMUM_JERK_PEAK
        self._waypoints = follow(lanes.q0, targets, most)
        self._ahead = Motion(q=np.empty((0, 0, 0)), v=np.empty((0, 0, 0)), a=np.empty((0, 0, 0)))
        self._ahead_first = -1

    def motion(self, first: int, count: int) -> Motion:
        """Return the motion at the beginning of time steps ``first`` to ``first + count - 1``."""
        piece, s = pieces(first, count, self._timestep, self._period, self._motions)
        position, speed, acceleration = minimum_jerk(s)
        speed, acceleration = speed / self._period, acceleration / (self._period * self._period)
        weights = np.stack((1.0 - position, position))
        q, v, a = np.empty((3, self._waypoints.shape[1], count, self._waypoints.shape[2]))
        for i, part in runs_of(piece):
            start, end = self._waypoints[i], self._waypoints[i + 1]
            weighted_sum(weights[:, part], [start, end], q[:, part])
            weighted_sum(speed[None, part], [end - start], v[:, part])
            weighted_sum(acceleration[None, part], [end - start], a[:, part])
        return Motion(q=np.clip(q, self._lower[:, None], self._upper[:, None], out=q), v=v, a=a)

    def at(self, step: int) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration at the beginning of one time step, each of shape (batch, n)."""
        k = step % _AHEAD
        if step - k != self._ahead_first:
            self._ahead_first = step - k
            self._ahead = self.motion(self._ahead_first, _AHEAD)
        return self._ahead.q[:, k], self._ahead.v[:, k], self._ahead.a[:, k]
