"""Controllers as a user writes them, for the tests."""

# ruff: noqa: ARG002 - they need not look at all that they are reported

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dh2sim.simulate import Observation, RolloutBatch
from dh2sim.typing import Array


class Wave:
    """Open loop, the robot's own actuators; by the scalar sine, so that a loop can do the same."""

    def __init__(self, batch: RolloutBatch) -> None:
        self._rollouts, self._count = batch.rollouts, len(batch.plant.actuators)

    def controls(self, first: int, count: int) -> Array:
        values = [
            [
                [1.1 * math.sin(0.05 * step + rollout + i) for i in range(self._count)]
                for step in range(first, first + count)
            ]
            for rollout in self._rollouts
        ]
        return np.array(values).reshape(len(self._rollouts), count, self._count)


class MotorWave(Wave):
    """The same with motors."""

    actuation = "motor"


class Spring:
    """Closed loop, motors at every joint; half the weight is balanced, where the base does not float."""

    actuation = "motor"

    def __init__(self, batch: RolloutBatch) -> None:
        self._joints = list(batch.plant.driven)
        self._floating = batch.plant.floating

    def control(self, observation: Observation) -> Array:
        wanted = 30.0 * (0.1 - observation.q) - 3.0 * observation.v
        if not self._floating:
            wanted += 0.5 * observation.gravity
        driven: Array = wanted[:, self._joints]
        return driven


class Seen:
    """Closed loop, motors at every joint: the forces are the positions that are seen."""

    actuation = "motor"

    def __init__(self, batch: RolloutBatch) -> None:
        self._joints = list(batch.plant.driven)

    def control(self, observation: Observation) -> Array:
        seen: Array = observation.q[:, self._joints]
        return seen


class Strong:
    """Open loop, motors at every joint, to and fro with more force than there is."""

    actuation = "motor"

    def __init__(self, batch: RolloutBatch) -> None:
        self._shape = len(batch.rollouts), len(batch.plant.actuators)

    def controls(self, first: int, count: int) -> Array:
        signs = np.where(np.arange(first, first + count) % 2, 1e3, -1e3)
        return np.tile(signs[None, :, None], (self._shape[0], 1, self._shape[1]))


class _Bad:
    """Gives one rollout of its run something bad from a time step on."""

    actuation = "motor"

    def __init__(
        self, batch: RolloutBatch, *, rollout: int = 3, step: int = 10, value: str = "nan", before: str = "0.2"
    ) -> None:
        self._batch, self._step, self._value, self._before = batch, step, float(value), float(before)
        self._row = list(batch.rollouts).index(rollout) if rollout in batch.rollouts else None

    def _at(self, step: int) -> Array:
        controls = np.full((len(self._batch.rollouts), len(self._batch.plant.actuators)), 0.2)
        if self._row is not None:
            controls[self._row] = self._value if step >= self._step else self._before
        return controls


class BadClosed(_Bad):
    """Closed loop."""

    def control(self, observation: Observation) -> Array:
        return self._at(observation.step)


class BadOpen(_Bad):
    """Open loop."""

    def controls(self, first: int, count: int) -> Array:
        return np.stack([self._at(step) for step in range(first, first + count)], axis=1)


class Nothing:
    """Returns nothing."""

    actuation = "motor"

    def __init__(self, batch: RolloutBatch) -> None: ...

    def control(self, observation: Observation) -> Any:
        """Forgets to return."""


class Flat(Nothing):
    """As if there were one rollout."""

    def control(self, observation: Observation) -> Array:
        one: Array = observation.q[0]
        return one


class Late(Flat):
    """Likewise, but from the fourth step on."""

    def control(self, observation: Observation) -> Array:
        return super().control(observation) if observation.step >= 3 else observation.q


class LateOpen:
    """Forgets how many steps it was asked for, if they are many."""

    def __init__(self, batch: RolloutBatch) -> None:
        self._q = batch.q0

    def controls(self, first: int, count: int) -> Array:
        return np.repeat(self._q[:, None], count if count == 1 else 0, axis=1)


class Words(Nothing):
    """No numbers."""

    def control(self, observation: Observation) -> list[str]:
        return ["left", "right"]


class Complex(Nothing):
    """Numbers that no motor can follow."""

    def control(self, observation: Observation) -> object:
        return observation.q * 1j


class Ragged(Nothing):
    """Rows of different lengths."""

    def control(self, observation: Observation) -> list[list[float]]:
        return [[1.0], [1.0, 2.0]]


class Lists(Nothing):
    """Nested lists are as good as arrays."""

    def control(self, observation: Observation) -> list[list[float]]:
        values: list[list[float]] = (-observation.v).tolist()
        return values


class Narrow:
    """Open loop with an actuator too few."""

    def __init__(self, batch: RolloutBatch) -> None:
        self._batch = len(batch.rollouts)

    def controls(self, first: int, count: int) -> Array:
        return np.zeros((self._batch, count, 1))


class Still:
    """Open loop, the same at every step, in single precision and not contiguous."""

    def __init__(self, batch: RolloutBatch) -> None:
        self._q: Any = batch.q0.astype(np.float32)

    def controls(self, first: int, count: int) -> Array:
        shown: Array = np.broadcast_to(self._q[:, None], (len(self._q), count, self._q.shape[1]))
        return shown


class Single(Still):
    """Likewise, said once for all steps."""

    def reference(self, first: int, count: int) -> object:
        return self._q, self._q

    def controls(self, first: int, count: int) -> Array:
        once: Array = self._q[:, None]
        return once


class Half(Single):
    """A reference of positions alone."""

    def reference(self, first: int, count: int) -> object:
        return np.zeros((3, count, 2))


class Greedy(Nothing):
    """Changes what it sees, and looks again."""

    def control(self, observation: Observation) -> Array:
        wanted = -observation.v
        for name in ("q", "v", "gravity", "bias", "passive", "mass_matrix"):
            before = getattr(observation, name).copy()
            seen = getattr(observation, name)
            seen += 5.0
            assert np.array_equal(getattr(observation, name), before), name
        return wanted


class Damper(Nothing):
    """What ``Greedy`` does, without looking."""

    def control(self, observation: Observation) -> Array:
        return -observation.v


class Drawn:
    """Keeps the first numbers that it draws."""

    actuation = "motor"

    def __init__(self, batch: RolloutBatch) -> None:
        count = len(batch.plant.actuators)
        self._drawn = np.stack([source.random(count) for source in batch.generators])

    def controls(self, first: int, count: int) -> Array:
        return self._drawn[:, None]
