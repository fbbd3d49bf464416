"""A batch of rollouts in MuJoCo: what a controller sees of it, which rollouts still run, and why others stopped."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError
from numpy.typing import NDArray

from dh2sim.simulate.contacts import FirstContacts
from dh2sim.simulate.dataset_layout import FINISHED, STATUS
from dh2sim.simulate.mujoco_runtime import VELOCITY_STAGE, forward, set_models
from dh2sim.simulate.plant import Plant
from dh2sim.simulate.randomization import apply_scales
from dh2sim.simulate.records import Recorder
from dh2sim.typing import Array

BASE = 6
"""Degrees of freedom of a floating base."""


class JointSpace:
    """Reduces MuJoCo's mass matrix and forces to those of the equation tau = M a + c of the n joints.

    No force acts on a floating base, so that its acceleration a_b follows from that of the joints:
    M_bb a_b + M_bj a + c_b = 0. Inserted into the joints' equation this leaves the inertia M_jj - M_jb M_bb⁻¹ M_bj
    and the force c_j - M_jb M_bb⁻¹ c_b. Source: Y. Umetani, K. Yoshida, Resolved motion rate control of space
    manipulators with generalized Jacobian matrix (1989), and R. Featherstone, Rigid Body Dynamics Algorithms (2008),
    section 9.3.
    """

    def __init__(self, plant: Plant) -> None:
        """Describe a plant."""
        self._floating = plant.floating
        self._index = _dense_index(plant.model)

    def inertia(self, mass: Array) -> Array:
        """Return the inertia, shape (batch, n, n), from MuJoCo's sparse ``M``, shape (batch, entries)."""
        M = np.take(mass, self._index, axis=1)
        if not self._floating:
            return M
        follows = np.linalg.solve(_of_base(M), M[:, :BASE, BASE:])
        reduced = M[:, BASE:, BASE:].copy()
        for k in range(BASE):  # one by one: the same order of additions for any batch
            reduced -= M[:, BASE:, k, None] * follows[:, None, k, :]
        return reduced

    def force(self, mass: Array, force: Array) -> Array:
        """Return the joints' forces, shape (batch, n), from those of all degrees of freedom, shape (batch, nv)."""
        if not self._floating:
            return np.array(force)
        M = np.take(mass, self._index, axis=1)
        follows = np.linalg.solve(_of_base(M), force[:, :BASE, None])[:, :, 0]
        reduced = force[:, BASE:].copy()
        for k in range(BASE):
            reduced -= M[:, BASE:, k] * follows[:, k, None]
        return reduced


def _of_base(M: Array) -> Array:
    """Return the floating base's own inertia, or the identity where a simulation failed before it was computed."""
    own = M[:, :BASE, :BASE].copy()
    own[~own.any(axis=(1, 2))] = np.eye(BASE)
    return own


def _dense_index(model: mujoco.MjModel) -> NDArray[np.intp]:
    """Return where MuJoCo's sparse lower triangle has each entry of the dense mass matrix; a chain has all."""
    index = np.zeros((model.nv, model.nv), dtype=np.intp)
    for row in range(model.nv):
        start = model.M_rowadr[row]
        for k in range(start, start + model.M_rownnz[row]):
            index[row, model.M_colind[k]] = index[model.M_colind[k], row] = k
    return index


class BatchObservation:
    """The current states of a persistent batch; see ``Observation``. Arrays are copies."""

    def __init__(self, plant: Plant, batch: Batch, gravity_forces: GravityForces) -> None:
        """Observe a batch that is at its start."""
        self._plant, self._batch, self._gravity_forces = plant, batch, gravity_forces
        self._first_q, self._first_v = (7, 6) if plant.floating else (0, 0)
        self._space = JointSpace(plant)
        self._gravity: Array | None = None
        self._fields: dict[str, Array] = {}
        self.step = 0

    def advance(self) -> None:
        """Note that the batch has taken a step."""
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
            self._gravity = self._gravity_forces.forces(self._batch.bind("qpos"))
        return self._gravity.copy()

    def _field(self, name: str) -> Array:
        if name not in self._fields:  # a field has what is computed after it was bound
            self._fields[name] = self._batch.bind(name)
            forward(self._batch)
        return self._fields[name]


class GravityForces:
    """Forces of gravity alone, computed by the same models at rest."""

    def __init__(self, plant: Plant, simulations: int, threads: int, factors: dict[str, Array]) -> None:
        """Describe the models, which are made when they are first needed."""
        self._plant, self._simulations, self._threads, self._factors = plant, simulations, threads, factors
        self._space = JointSpace(plant)
        self._batch: Batch | None = None

    def forces(self, qpos: Array) -> Array:
        """Return the joint forces, N·m or N, that balance gravity at the given positions, shape (batch, n)."""
        if self._batch is None:
            self._batch = Batch(self._plant.model, self._simulations, self._threads)
            set_models(self._batch, self._plant, as_fields=bool(self._factors))
            apply_scales(self._batch, self._plant, self._factors)
        mass, force = self._batch.bind("M"), self._batch.bind("qfrc_bias")
        self._batch.bind("qpos")[:] = qpos
        forward(self._batch)
        return self._space.force(mass, force)


WARNINGS = {
    "mjWARN_INERTIA": "warning_inertia",
    "mjWARN_CONTACTFULL": "warning_contacts_full",
    "mjWARN_CNSTRFULL": "warning_constraints_full",
    "mjWARN_BADQPOS": "bad_qpos",
    "mjWARN_BADQVEL": "bad_qvel",
    "mjWARN_BADQACC": "bad_qacc",
    "mjWARN_BADCTRL": "bad_ctrl",
}


class MonitoredBatch:
    """Simulations that run together; one that MuJoCo warns of or fails on stops alone."""

    def __init__(self, plant: Plant, batch: Batch, recorder: Recorder, steps: int) -> None:
        """Take over a batch at its start."""
        self.plant = plant
        self.batch = batch
        self.recorder = recorder
        self.steps = steps
        self.alive: NDArray[np.bool_] = np.ones(batch.nsim, dtype=bool)
        self.status = np.full(batch.nsim, FINISHED, dtype=np.int8)
        self.stop_step = np.full(batch.nsim, -1, dtype=np.int64)
        self.saturation = np.zeros((batch.nsim, len(plant.actuators)), dtype=np.int64)
        self.contacts = FirstContacts(plant, batch.nsim, substeps=recorder.substeps)

    @property
    def ids(self) -> NDArray[np.int32] | None:
        """The simulations that still run, or None if all do."""
        return None if self.alive.all() else np.flatnonzero(self.alive).astype(np.int32)

    @property
    def rows(self) -> Any:
        """The simulations that still run, to index arrays with."""
        ids = self.ids
        return slice(None) if ids is None else ids

    def clipped(self, wanted: Array) -> tuple[Array, NDArray[np.bool_] | None]:
        """Return controls moved inside their ranges, and where they were outside: None if nowhere.

        Args:
            wanted: Controls, shape (batch, …, actuators).
        """
        lower, upper = self.plant.control_lower, self.plant.control_upper
        if wanted.ndim > lower.ndim > 1:
            lower, upper = lower[:, None], upper[:, None]
        outside = (wanted < lower) | (wanted > upper)
        if not outside.any():
            return wanted, None
        return np.clip(wanted, lower, upper), outside

    def count(self, outside: NDArray[np.bool_] | None, first: int, count: int) -> None:
        """Count the controls that were clipped, before the step in which a simulation stopped.

        Args:
            outside: Where they were clipped, shape (batch, count or 1, actuators).
            first: First time step that they were for; all of ``count`` steps have been simulated.
            count: Number of time steps that they were for.
        """
        if outside is None:
            return
        ran = np.where(self.stop_step < 0, count, np.clip(self.stop_step - first, 0, count))
        if outside.shape[1] == count:
            simulated = np.arange(count) < ran[:, None]
            self.saturation += np.count_nonzero(outside & simulated[:, :, None], axis=1)
        else:
            self.saturation += outside[:, 0] * ran[:, None]

    def call(self, function: Any, *args: Any, **kwargs: Any) -> NDArray[np.intp]:
        """Call a method of the batch and return the simulations that MuJoCo warned of or failed on."""
        failed = np.zeros(self.batch.nsim, dtype=bool)
        try:
            function(*args, **kwargs)
        except SimulationError as error:
            failed[error.ids] = True
        if self.batch.warning.any():
            failed |= self.batch.warning[:, :, 1].any(axis=1)
        return np.flatnonzero(failed & self.alive)

    def look(self, step: int) -> None:
        """Compute what MuJoCo derives from the states at the beginning of a time step, or at the end of the run."""
        if self.alive.any():
            self.stop(self.call(self.batch.forward, self.ids, stage=VELOCITY_STAGE), step)

    def stop(self, simulations: NDArray[np.intp], step: int) -> None:
        """Stop simulations that failed in a time step."""
        for i in simulations:
            self.alive[i] = False
            self.stop_step[i] = step
            self.status[i] = STATUS[self._reason(int(i))]

    def _reason(self, i: int) -> str:
        for kind, reason in WARNINGS.items():
            if self.batch.warning[i, int(getattr(mujoco.mjtWarning, kind)), 1]:
                return reason
        return "error" if self.batch.status[i] else "other_warning"
