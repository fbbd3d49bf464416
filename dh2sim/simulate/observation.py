"""What a controller sees of a group of rollouts, computed when it is first asked for."""

from __future__ import annotations

import numpy as np
from mujoco.batch import Batch

from dh2sim.simulate.engine import forward
from dh2sim.simulate.joint_space import JointSpace
from dh2sim.simulate.plant import Plant
from dh2sim.simulate.randomization import apply_scales
from dh2sim.typing import Array


class BatchObservation:
    """The states of a persistent batch at the present instant; see ``Observation``. Arrays are the caller's own."""

    def __init__(self, plant: Plant, batch: Batch, weights: Weights) -> None:
        """Observe a batch whose simulations have just been given their start."""
        self._plant, self._batch, self._weights = plant, batch, weights
        self._first_q, self._first_v = (7, 6) if plant.floating else (0, 0)
        self._space = JointSpace(plant)
        self._gravity: Array | None = None
        self._fields: dict[str, Array] = {}
        self.step = 0

    def advance(self) -> None:
        """The batch has moved on by one step."""
        self.step += 1
        self._gravity = None

    @property
    def time(self) -> float:
        """Time since the start, s."""
        return self.step * self._plant.timestep

    @property
    def q(self) -> Array:
        """Joint positions, shape (batch, n)."""
        return np.array(self._batch.bind("qpos")[:, self._first_q :])

    @property
    def v(self) -> Array:
        """Joint velocities, shape (batch, n)."""
        return np.array(self._batch.bind("qvel")[:, self._first_v :])

    @property
    def mass_matrix(self) -> Array:
        """Joint-space inertia, shape (batch, n, n); on a floating base, what the joints feel of it."""
        return self._space.inertia(self._field("M"))

    @property
    def bias(self) -> Array:
        """Coriolis, centrifugal and gravity forces, shape (batch, n)."""
        return self._space.force(self._field("M"), self._field("qfrc_bias"))

    @property
    def passive(self) -> Array:
        """Forces of springs and viscous damping, shape (batch, n)."""
        return np.array(self._field("qfrc_passive")[:, self._first_v :])

    @property
    def gravity(self) -> Array:
        """Forces that balance gravity, shape (batch, n)."""
        if self._gravity is None:
            self._gravity = self._weights.forces(self._batch.bind("qpos"))
        return self._gravity.copy()

    def _field(self, name: str) -> Array:
        if name not in self._fields:  # a field shows what is computed after it was bound
            self._fields[name] = self._batch.bind(name)
            forward(self._batch)
        return self._fields[name]


class Weights:
    """The same models at rest, which tell the forces of gravity alone."""

    def __init__(self, plant: Plant, simulations: int, threads: int, factors: dict[str, Array]) -> None:
        """Describe the models; nothing is made before it is needed."""
        self._plant, self._simulations, self._threads, self._factors = plant, simulations, threads, factors
        self._space = JointSpace(plant)
        self._batch: Batch | None = None

    def forces(self, qpos: Array) -> Array:
        """Return the joint forces, N·m or N, that balance gravity at the given positions, shape (batch, n)."""
        if self._batch is None:
            self._batch = Batch(self._plant.model, self._simulations, self._threads)
            apply_scales(self._batch, self._plant, self._factors)
        mass, force = self._batch.bind("M"), self._batch.bind("qfrc_bias")
        self._batch.bind("qpos")[:] = qpos
        forward(self._batch)
        return self._space.force(mass, force)
