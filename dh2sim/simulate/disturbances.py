"""What disturbs the control of a rollout: encoders that err, delays, and pushes at the tool."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from dh2sim.simulate.batch import BatchObservation
from dh2sim.simulate.controllers.protocol import ClosedLoop, Observation, OpenLoop
from dh2sim.simulate.loops import control_of, controls_of
from dh2sim.simulate.plant import Plant
from dh2sim.typing import Array

SENSING: Final = frozenset({"encoder_bias", "encoder_noise", "sensor_delay"})
"""Variables of what controllers see otherwise than it is."""
_NOISE_STEPS: Final = 64
"""Time steps of noise that are drawn together."""


def delay_steps(delay: Array, timestep: float) -> NDArray[np.int64]:
    """Return delays in whole time steps, shape (batch,)."""
    return np.asarray(np.round(delay / timestep), dtype=np.int64)


class SensedObservation:
    """States as sensors report them; inertia and forces are those of the true state.

    Positions are those of some time ago, with a constant error and white noise; velocities are as late.
    """

    def __init__(
        self,
        observation: BatchObservation,
        drawn: Mapping[str, Array],
        generators: Sequence[np.random.Generator],
        timestep: float,
    ) -> None:
        """Observe through sensors.

        Args:
            observation: The true states, at the start.
            drawn: What was drawn for the rollouts.
            generators: One for each rollout, used here alone.
            timestep: s.
        """
        self._true, self._generators = observation, generators
        q, v = observation.q, observation.v
        self._bias = drawn.get("encoder_bias", np.zeros(q.shape))
        self._deviation = drawn.get("encoder_noise")
        self._noise = np.zeros((len(q), 0, q.shape[1]))
        self._noise_block = -1
        self._delay = delay_steps(drawn.get("sensor_delay", np.zeros(len(q))), timestep)
        size = int(self._delay.max(initial=0)) + 1
        self._history = np.repeat(np.stack([q, v])[None], size, axis=0)
        """Of the last steps, by step modulo their number: before the start the robot was there, too."""
        self._rows = np.arange(len(q))

    def advance(self) -> None:
        """Note that the batch has taken a step."""
        self._true.advance()
        self._history[self.step % len(self._history)] = self._true.q, self._true.v

    @property
    def step(self) -> int:
        """Time steps since the start."""
        return self._true.step

    @property
    def time(self) -> float:
        """Time since the start, s."""
        return self._true.time

    @property
    def q(self) -> Array:
        """Joint positions as encoders report them, shape (batch, n)."""
        seen = self._seen(0) + self._bias
        if self._deviation is None:
            return seen
        while self._noise_block < self.step // _NOISE_STEPS:
            self._noise_block += 1
            shape = (_NOISE_STEPS, seen.shape[1])
            self._noise = np.stack([source.standard_normal(shape) for source in self._generators])
        return seen + self._deviation * self._noise[:, self.step % _NOISE_STEPS]

    @property
    def v(self) -> Array:
        """Joint velocities, shape (batch, n)."""
        return self._seen(1)

    @property
    def mass_matrix(self) -> Array:
        """Joint-space inertia of the true state."""
        return self._true.mass_matrix

    @property
    def bias(self) -> Array:
        """Coriolis, centrifugal and gravity forces of the true state."""
        return self._true.bias

    @property
    def passive(self) -> Array:
        """Forces of springs and viscous damping of the true state."""
        return self._true.passive

    @property
    def gravity(self) -> Array:
        """Forces that balance gravity in the true state."""
        return self._true.gravity

    def _seen(self, which: int) -> Array:
        size = len(self._history)
        return np.array(self._history[(self.step - self._delay) % size, which, self._rows])


class DelayedOpenLoop:
    """Controls of an open loop that arrive late; before the first one, those that hold the start."""

    def __init__(self, controller: OpenLoop, delay: NDArray[np.int64], held: Array, name: str) -> None:
        """Delay a controller.

        Args:
            controller: The controller.
            delay: Time steps, shape (batch,).
            held: Controls before the first one arrives, shape (batch, actuators).
            name: Of the controller, for errors.
        """
        self._controller, self._delay, self._held, self._name = controller, delay, held, name

    def controls(self, first: int, count: int) -> Array:
        """Return controls, shape (batch, count, actuators)."""
        begin = max(0, first - int(self._delay.max(initial=0)))
        given = controls_of(self._controller, begin, first + count - begin, self._held.shape, self._name)
        wanted = np.arange(first, first + count) - self._delay[:, None]
        index = np.zeros_like(wanted) if given.shape[1] == 1 else np.maximum(wanted - begin, 0)
        late = np.take_along_axis(given, index[:, :, None], axis=1)
        return np.where((wanted < 0)[:, :, None], self._held[:, None], late)


class DelayedClosedLoop:
    """Controls of a closed loop that arrive late; before the first one, those that hold the start."""

    def __init__(self, controller: ClosedLoop, delay: NDArray[np.int64], held: Array, name: str) -> None:
        """Delay a controller; arguments as of :class:`DelayedOpenLoop`."""
        self._controller, self._delay, self._name = controller, delay, name
        self._given = np.repeat(held[None], int(delay.max(initial=0)) + 1, axis=0)
        self._rows = np.arange(len(held))

    def control(self, observation: Observation) -> Array:
        """Return the controls of this time step, shape (batch, actuators)."""
        size = len(self._given)
        self._given[observation.step % size] = control_of(
            self._controller, observation, self._given.shape[1:], self._name
        )
        return np.array(self._given[(observation.step - self._delay) % size, self._rows])


class Pushes:
    """Forces at the tool that come and go."""

    def __init__(
        self, plant: Plant, batch: Batch, drawn: Mapping[str, Array], interval: float, duration: float
    ) -> None:
        """Prepare pushes of a batch.

        Args:
            plant: The robot.
            batch: Its simulations.
            drawn: What was drawn for them.
            interval: From push to push, s.
            duration: Of each push, s.
        """
        self._timestep = plant.timestep
        self._force, self._start = drawn["push_force"], drawn["push_start"]
        self._interval, self._duration = interval, duration
        tool = plant.model.site("tool0").id
        self._body = int(plant.model.site_bodyid[tool])
        self._applied, self._wrench = batch.bind("xfrc_applied"), np.zeros((batch.nsim, 6))
        self._tool, self._com = batch.bind("site_xpos"), batch.bind("xipos")
        self._tool_id = tool

    def apply(self, step: int) -> None:
        """Apply the forces of a time step, whose poses are computed already."""
        time = step * self._timestep
        # a push begins in the interval of its number: the last ones alone can be going on
        these = slice(
            max(0, math.floor((time - self._duration) / self._interval) - 1), math.floor(time / self._interval) + 1
        )
        start = self._start[:, these]
        on = (start <= time) & (time < start + self._duration)
        force = np.zeros((len(start), 3))
        for k in range(start.shape[1]):  # one by one: the same order of additions for any batch
            force += np.where(on[:, k, None], self._force[:, these][:, k], 0.0)
        arm = self._tool[:, self._tool_id] - self._com[:, self._body]
        self._wrench = np.hstack([force, np.cross(arm, force)])
        self._applied[:, self._body] = self._wrench

    def apply_again(self, simulations: NDArray[np.intp]) -> None:
        """Apply the forces of the same time step to simulations that are put back to its beginning."""
        self._applied[simulations, self._body] = self._wrench[simulations]
