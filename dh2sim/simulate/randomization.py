"""Random numbers of each rollout, and models that differ from rollout to rollout.

Every rollout has a generator of its own for each purpose, so that its numbers depend on no other rollout.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import overload

import mujoco
import numpy as np
from mujoco.batch import Batch

from dh2sim.simulate.options import RANDOMIZABLE, RolloutOptions
from dh2sim.simulate.plant import Plant
from dh2sim.typing import Array


class Purpose(IntEnum):
    """What random numbers are drawn for; each purpose has its own stream."""

    START = 0
    RANDOMIZE = 1
    CONTROLLER = 2
    # 16: the numbers of designs (``designs.STREAM``), which have streams by name


def generator(seed: int, rollout: int, purpose: Purpose) -> np.random.Generator:
    """Return a rollout's own generator: child number ``purpose`` of child number ``rollout`` of the seed.

    It is what ``SeedSequence(seed).spawn(…)[rollout].spawn(…)[purpose]`` gives, made without the others.
    """
    sequence = np.random.SeedSequence(seed, spawn_key=(rollout, int(purpose)))
    return np.random.Generator(np.random.PCG64(sequence))


class Generators(Sequence[np.random.Generator]):
    """The generators of some rollouts, each made when it is first used, since that takes longer than a time step."""

    def __init__(self, seed: int, rollouts: Sequence[int], purpose: Purpose) -> None:
        """Make none yet."""
        self._seed, self._rollouts, self._purpose = seed, rollouts, purpose
        self._made: dict[int, np.random.Generator] = {}

    def __len__(self) -> int:
        """Return the number of rollouts."""
        return len(self._rollouts)

    @overload
    def __getitem__(self, index: int) -> np.random.Generator: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[np.random.Generator]: ...
    def __getitem__(self, index: int | slice) -> np.random.Generator | Sequence[np.random.Generator]:
        """Return the generator of the ``index``-th of the rollouts, the same one every time."""
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        rollout = self._rollouts[index]
        if rollout not in self._made:
            self._made[rollout] = generator(self._seed, rollout, self._purpose)
        return self._made[rollout]


FIELDS = {
    "mass": ("body_mass", "body_inertia"),
    "friction": ("dof_frictionloss",),
    "damping": ("dof_damping",),
    "armature": ("dof_armature",),
    "gain": ("actuator_gainprm", "actuator_biasprm"),
}
"""Which fields of an MjModel each quantity multiplies."""


def scales(plant: Plant, options: RolloutOptions, rollouts: Sequence[int]) -> dict[str, Array]:
    """Draw the factors of every randomized quantity, uniformly from 1 - x to 1 + x.

    Returns:
        By quantity, shape (batch, links with mass, joints or actuators); the gain of a motor is left alone.
    """
    if not options.randomize:
        return {}
    counts = {"mass": len(links(plant)), "gain": len(plant.actuators)}
    drawn: dict[str, list[Array]] = {name: [] for name in options.randomize}
    for source in Generators(options.seed, rollouts, Purpose.RANDOMIZE):
        for name in RANDOMIZABLE:  # always all of them, so that one does not depend on which others are randomized
            values = source.uniform(-1.0, 1.0, counts.get(name, plant.n))
            if name in drawn:
                drawn[name].append(1.0 + options.randomize[name] * values)
    factors = {name: np.array(values) for name, values in drawn.items()}
    if "gain" in factors:
        factors["gain"][:, plant.model.actuator_biastype == mujoco.mjtBias.mjBIAS_NONE] = 1.0  # motors have none
    return factors


def links(plant: Plant) -> list[int]:
    """Return the links that have mass."""
    bodies = range(1, plant.model.nbody)
    return [i for i in bodies if plant.model.body_mass[i] > 0.0 and i not in plant.helpers]


def apply_scales(batch: Batch, plant: Plant, factors: dict[str, Array]) -> None:
    """Give every simulation of a batch its own model."""
    if not factors:
        return
    columns = {"mass": links(plant), "gain": list(range(len(plant.actuators)))}
    for name, values in factors.items():
        which = columns.get(name, plant.velocities)
        for field in FIELDS[name]:
            expanded = batch.expand(field)
            expanded[:, which] *= values.reshape(values.shape + (1,) * (expanded.ndim - 2))
    batch.set_const()
