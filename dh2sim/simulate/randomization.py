"""Models that differ from rollout to rollout."""

from __future__ import annotations

import mujoco
import numpy as np
from mujoco.batch import Batch

from dh2sim.simulate.plant import Plant
from dh2sim.simulate.seeds import Generators, Purpose
from dh2sim.simulate.settings import RANDOMIZABLE, Settings
from dh2sim.typing import Array

FIELDS = {
    "mass": ("body_mass", "body_inertia"),
    "friction": ("dof_frictionloss",),
    "damping": ("dof_damping",),
    "armature": ("dof_armature",),
    "gain": ("actuator_gainprm", "actuator_biasprm"),
}
"""Which fields of an MjModel each quantity multiplies."""


def scales(plant: Plant, settings: Settings, rollouts: range) -> dict[str, Array]:
    """Draw the factors of every randomised quantity, uniformly from 1 - x to 1 + x.

    Returns:
        By quantity, shape (batch, links with mass, joints or actuators); the gain of a motor is left alone.
    """
    if not settings.randomize:
        return {}
    counts = {"mass": len(links(plant)), "gain": len(plant.actuators)}
    drawn: dict[str, list[Array]] = {name: [] for name in settings.randomize}
    for source in Generators(settings.seed, rollouts, Purpose.RANDOMIZE):
        for name in RANDOMIZABLE:  # always all of them, so that one does not depend on which others are wanted
            values = source.uniform(-1.0, 1.0, counts.get(name, plant.n))
            if name in drawn:
                drawn[name].append(1.0 + settings.randomize[name] * values)
    factors = {name: np.array(values) for name, values in drawn.items()}
    if "gain" in factors:
        factors["gain"][:, plant.model.actuator_biastype == mujoco.mjtBias.mjBIAS_NONE] = 1.0  # motors have none
    return factors


def links(plant: Plant) -> list[int]:
    """Return the bodies that have mass."""
    return [i for i in range(1, plant.model.nbody) if plant.model.body_mass[i] > 0.0]


def apply_scales(batch: Batch, plant: Plant, factors: dict[str, Array]) -> None:
    """Give every simulation of a batch its own model."""
    if not factors:
        return
    first = 6 if plant.floating else 0
    columns = {"mass": links(plant), "gain": list(range(len(plant.actuators)))}
    for name, values in factors.items():
        which = columns.get(name, list(range(first, first + plant.n)))
        for field in FIELDS[name]:
            expanded = batch.expand(field)
            expanded[:, which] *= values.reshape(values.shape + (1,) * (expanded.ndim - 2))
    batch.set_const()
