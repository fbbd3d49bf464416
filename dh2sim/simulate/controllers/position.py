"""Controllers of setpoints: holding the start, smooth random splines, and sums of sines."""

from __future__ import annotations

import math
from typing import Annotated

import mujoco
import numpy as np

from dh2sim.errors import ControllerError
from dh2sim.robot.row import ActuatorType
from dh2sim.simulate.controllers.options import Within
from dh2sim.simulate.controllers.protocol import RolloutBatch
from dh2sim.simulate.controllers.trajectories import (
    INSIDE,
    MINIMUM_JERK_PEAK,
    centers,
    cubic_spline_weights,
    follow,
    followed_by_loops,
    half_ranges,
    minimum_jerk,
    pieces,
    runs_of,
    uniform,
    weighted_sum,
    widened,
)
from dh2sim.simulate.plant import Plant
from dh2sim.typing import Array

HALVINGS = 6
"""Times that a motion is made smaller if a mechanism's loops do not let its driven joints follow it."""


def actuator_types(plant: Plant) -> tuple[ActuatorType, ...]:
    """Return what each actuator takes for its control: a position, a velocity, or a force."""
    model = plant.model
    types = []
    for i in range(model.nu):
        if model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_NONE:
            types.append(ActuatorType.MOTOR)
        elif model.actuator_biasprm[i, 1] != 0.0:
            types.append(ActuatorType.POSITION)
        elif model.actuator_gainprm[i, 0] == -model.actuator_biasprm[i, 2]:
            types.append(ActuatorType.VELOCITY)
        else:  # a position actuator of zero stiffness
            types.append(ActuatorType.POSITION)
    return tuple(types)


def of_type(plant: Plant, kind: ActuatorType) -> Array:
    """Return which actuators are of a type, as a boolean array of shape (actuators,)."""
    return np.array([found is kind for found in actuator_types(plant)], dtype=bool)


def driven_joints(plant: Plant) -> list[int]:
    """Return the number of each actuator's joint, to index the last axis of an array with."""
    return list(plant.driven)


def holding_controls(batch: RolloutBatch, *, against_gravity: bool) -> Array:
    """Return the controls that keep a robot near its start, inside their ranges, shape (batch, actuators).

    Positions: the start, and with ``against_gravity`` as much more as makes the actuator's pull, kp times the
    difference, balance gravity. Velocities and forces: 0, and for forces with ``against_gravity`` that of gravity.
    """
    plant = batch.plant
    joints = driven_joints(plant)
    position, motor = of_type(plant, ActuatorType.POSITION), of_type(plant, ActuatorType.MOTOR)
    start, load = batch.q0[:, joints], batch.gravity0[:, joints]
    controls = np.where(position, start, 0.0)
    if against_gravity:
        kp = np.stack([model.actuator_gainprm[:, 0] for model in plant.models])
        pulls = np.logical_and(position, kp > 0.0)
        controls = controls + np.where(pulls, load / np.where(pulls, kp, 1.0), np.where(motor, load, 0.0))
    return np.clip(controls, plant.control_lower, plant.control_upper)


class Hold:
    """Position actuators hold the start, with setpoints that balance gravity there."""

    actuation = ActuatorType.POSITION

    def __init__(self, batch: RolloutBatch) -> None:
        """Compute the setpoints, which never change."""
        self._controls = holding_controls(batch, against_gravity=True)[:, None]

    def controls(self, first: int, count: int) -> Array:  # noqa: ARG002 - the same at every step
        """Return the setpoints, rad or m, shape (batch, 1, actuators)."""
        return self._controls


class RandomSpline:
    """The robot's own actuators follow smooth random curves.

    Controls are uniform cubic B-splines through the neighbourhood of random points, twice continuously differentiable
    and between their least and greatest points. They start at rest, with what the actuators do at the start: its
    position, no velocity, no force. Setpoints of positions respect the velocity limits.
    """

    actuation = None

    def __init__(
        self,
        batch: RolloutBatch,
        *,
        rate: Annotated[float, Within(above=0.0, unit="Hz")] = 5.0,
        amplitude: Annotated[float, Within(at_least=0.0, at_most=1.0)] = 0.3,
    ) -> None:
        """Draw the points.

        Args:
            batch: The rollouts.
            rate: Random points per second, Hz.
            amplitude: Share of half the control's range that they are in, on either side of the start, or as near to
                it as the range allows.

        Raises:
            ControllerError: There is more than one point per time step.
        """
        plant = batch.plant
        if rate * plant.timestep > 1.0:
            raise ControllerError(
                f"option 'rate' must be at most that of the time steps, {1 / plant.timestep:g} Hz, got {rate:g} Hz"
            )
        self._timestep, self._interval = plant.timestep, 1.0 / rate
        self._lower, self._upper = plant.control_lower, plant.control_upper
        joints = driven_joints(plant)
        position, velocity = of_type(plant, ActuatorType.POSITION), of_type(plant, ActuatorType.VELOCITY)
        fastest = plant.velocity[..., joints]
        free = np.where(position, plant.free_half_ranges[joints], np.where(velocity, fastest, 1.0))
        reach = INSIDE * amplitude * half_ranges(self._lower, self._upper, free)
        start = holding_controls(batch, against_gravity=False)
        center = centers(start, reach, self._lower, self._upper)
        self._pieces = math.floor(batch.steps * plant.timestep * rate) + 1
        drawn, share = uniform(batch.generators, self._pieces, len(joints)), np.ones((len(start), 1))
        # a spline is nowhere faster than its points are apart
        most = np.where(position, INSIDE * fastest / rate, np.inf)
        for _ in range(HALVINGS):
            targets = center + share * reach * drawn
            self._points = follow(start, [start, start, *targets], most)
            followed = followed_by_loops(batch, self.controls) if position.all() else np.ones(len(start), dtype=bool)
            if followed.all():
                break
            share = np.where(followed[:, None], share, 0.5 * share)

    def controls(self, first: int, count: int) -> Array:
        """Return controls, shape (batch, count, actuators)."""
        piece, u = pieces(first, count, self._timestep, self._interval, self._pieces)
        weights = cubic_spline_weights(u)
        controls = np.empty((self._points.shape[1], count, self._points.shape[2]))
        for i, part in runs_of(piece):
            weighted_sum(weights[:, part], list(self._points[i : i + 4]), controls[:, part])
        return np.clip(controls, self._lower[..., None, :], self._upper[..., None, :], out=controls)


class Sine:
    """Position actuators follow sums of sines with random amplitudes and phases, as used for identification.

    q(t) = center + sum over h = 1 … harmonics of a_h sin(2 pi h f t) + b_h cos(2 pi h f t), a finite Fourier series.
    Source: J. Swevers et al., Optimal robot excitation and identification, IEEE Transactions on Robotics and
    Automation 13 (1997). The amplitudes add up to no more than the limits of position and of velocity allow. A
    minimum-jerk weight leads from the start to the series within the first seconds.
    """

    actuation = ActuatorType.POSITION

    def __init__(
        self,
        batch: RolloutBatch,
        *,
        harmonics: Annotated[int, Within(at_least=1, at_most=100)] = 5,
        frequency: Annotated[float, Within(above=0.0, unit="Hz")] = 0.1,
        amplitude: Annotated[float, Within(at_least=0.0, at_most=1.0)] = 0.3,
        fade: Annotated[float, Within(above=0.0, unit="s")] = 1.0,
    ) -> None:
        """Draw amplitudes and phases.

        Args:
            batch: The rollouts.
            harmonics: Number of sines.
            frequency: Frequency of the first, Hz; the others are its multiples.
            amplitude: Sum of the sines' amplitudes as a share of half the joint's range, before the velocity limit.
            fade: Duration of the transition from the start to the series, s.

        Raises:
            ControllerError: The highest frequency is above half the rate of the time steps.
        """
        plant = batch.plant
        self._timestep, self._fade, self._start = plant.timestep, fade, batch.q0
        if harmonics * frequency * plant.timestep > 0.5:
            raise ControllerError(
                f"the highest frequency, harmonics x frequency, must be at most half the rate of the time steps, "
                f"{0.5 / plant.timestep:g} Hz, got {harmonics * frequency:g} Hz"
            )
        self._rates = [2.0 * math.pi * frequency * h for h in range(1, harmonics + 1)]
        drawn = np.stack([g.standard_normal((2 * harmonics, plant.n)) for g in batch.generators], axis=1)
        sizes = np.sqrt(drawn[:harmonics] * drawn[:harmonics] + drawn[harmonics:] * drawn[harmonics:])
        total, speed = np.zeros(sizes.shape[1:]), np.zeros(sizes.shape[1:])
        for rate, size in zip(self._rates, sizes, strict=True):
            total, speed = total + size, speed + rate * size
        reach = INSIDE * amplitude * half_ranges(plant.lower, plant.upper, plant.free_half_ranges)
        # on the way to the series: rate of the weight times the distance, and the series' own velocity
        away = np.abs(centers(batch.q0, reach, plant.lower, plant.upper) - batch.q0)
        fastest = MINIMUM_JERK_PEAK / fade * (away + reach) + reach * speed / total
        limit = INSIDE * plant.velocity
        reach = reach * np.where(fastest > limit, limit / np.where(fastest > limit, fastest, 1.0), 1.0)
        self._lower, self._upper = widened(batch)
        for _ in range(HALVINGS):
            self._center = centers(batch.q0, reach, plant.lower, plant.upper)
            self._terms = [*(drawn * (reach / total)), self._center]
            followed = followed_by_loops(batch, self.controls)
            if followed.all():
                break
            reach = np.where(followed[:, None], reach, 0.5 * reach)

    def controls(self, first: int, count: int) -> Array:
        """Return setpoints, rad or m, shape (batch, count, n)."""
        return self._positions(first, count, self._tables(first, count)[0])

    def reference(self, first: int, count: int) -> tuple[Array, Array]:
        """Return the setpoints and their rates."""
        values, rates = self._tables(first, count)
        series = weighted_sum(values, self._terms)
        weight, change, _ = minimum_jerk(self._since(first, count))
        v = weighted_sum(rates, self._terms[:-1]) * weight[:, None]
        v += (change / self._fade)[:, None] * (series - self._start[:, None])
        return self._positions(first, count, values), v

    def _since(self, first: int, count: int) -> Array:
        """Return the progress of the transition to the series at time steps, 0 to 1."""
        since: Array = np.minimum(np.arange(first, first + count) * self._timestep / self._fade, 1.0)
        return since

    def _tables(self, first: int, count: int) -> tuple[Array, Array]:
        """Return sines, cosines and ones at time steps, and the rates of change of the sines and cosines.

        By the C library, one by one: the last bit of NumPy's sines may depend on the length of the array.
        """
        times = [k * self._timestep for k in range(first, first + count)]
        sines = np.array([[math.sin(rate * t) for t in times] for rate in self._rates])
        cosines = np.array([[math.cos(rate * t) for t in times] for rate in self._rates])
        rates = np.array(self._rates)[:, None]
        return np.concatenate((sines, cosines, np.ones((1, count)))), np.concatenate(
            (rates * cosines, -rates * sines)
        )

    def _positions(self, first: int, count: int, values: Array) -> Array:
        series = weighted_sum(values, self._terms)
        since = self._since(first, count)
        fading = int(np.count_nonzero(since < 1.0))
        if fading:
            weight = minimum_jerk(since[:fading])[0][:, None]
            blend = (1.0 - weight) * self._start[:, None] + weight * series[:, :fading]
            series[:, :fading] = np.clip(blend, self._lower[:, None], self._upper[:, None])
        return series
