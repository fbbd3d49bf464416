"""Where rollouts start."""

from __future__ import annotations

import math

import numpy as np
from mujoco.batch import Batch

from dh2sim.errors import ConfigurationError
from dh2sim.simulate.engine import forward
from dh2sim.simulate.plant import Plant
from dh2sim.simulate.seeds import Generators, Purpose
from dh2sim.simulate.settings import Settings
from dh2sim.typing import Array

TRIES = 50
"""Draws of a random configuration before one in which links touch is taken."""
FREE_RANGE = {True: math.pi, False: 1.0}
"""Half the range, rad or m, of random positions of a joint without limits that turns or slides."""


def starts(plant: Plant, settings: Settings, rollouts: range) -> tuple[Array, Array]:
    """Return joint positions and velocities at the start of some rollouts, each of shape (batch, n).

    Random configurations lie inside the limits, uniformly, and no links touch in them if that can be had.
    """
    shape = (len(rollouts), plant.n)
    if settings.start_states is not None:
        states = settings.start_states
        if len(states) == 1:
            states = np.broadcast_to(states, (len(rollouts), 2, plant.n))
        else:
            states = states[rollouts.start : rollouts.stop]
        return states[:, 0].copy(), states[:, 1].copy()
    if settings.start == "random":
        return _random(plant, settings.seed, rollouts), np.zeros(shape)
    q = plant.home if settings.start == "home" else np.zeros(plant.n)
    return np.broadcast_to(q, shape).copy(), np.zeros(shape)


def check_start(plant: Plant, q: Array, what: str) -> None:
    """Require joint positions, shape (count, n), to be inside the limits.

    Raises:
        ConfigurationError: they are not; the error names the first that is not.
    """
    outside = (q < plant.lower) | (q > plant.upper)
    if outside.any():
        row, joint = (int(k) for k in np.argwhere(outside)[0])
        unit = "rad" if plant.turns[joint] else "m"
        where = f" of rollout {row}" if len(q) > 1 else ""
        raise ConfigurationError(
            f"start {what}: {plant.joints[joint]}{where} would start at {q[row, joint]:g} {unit}, outside its limits "
            f"{plant.lower[joint]:g} to {plant.upper[joint]:g} {unit}"
        )


def _random(plant: Plant, seed: int, rollouts: range) -> Array:
    half = np.array([FREE_RANGE[turns] for turns in plant.turns])
    lower = np.where(np.isfinite(plant.lower), plant.lower, -half)
    upper = np.where(np.isfinite(plant.upper), plant.upper, half)
    sources = Generators(seed, rollouts, Purpose.START)
    batch = Batch(plant.model, len(rollouts), nthread=1)
    first = 7 if plant.floating else 0
    qpos, contacts = batch.bind("qpos"), batch.bind("ncon")
    q = np.zeros((len(rollouts), plant.n))
    left = np.arange(len(rollouts))
    for _ in range(TRIES):
        for i in left.tolist():
            q[i] = sources[i].uniform(lower, upper)
        qpos[left, first:] = q[left]
        forward(batch, left)
        left = left[contacts[left] > 0]
        if not len(left):
            break
    return q
