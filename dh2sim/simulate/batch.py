"""A batch of rollouts in MuJoCo: what a controller sees of it, which rollouts still run, and why others stopped."""

from __future__ import annotations

import copy
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError
from numpy.typing import NDArray

from dh2sim.errors import ControllerError
from dh2sim.simulate.closed_loops import ClosedLoops, Kinematics, joint_inertia
from dh2sim.simulate.contacts import FirstContacts
from dh2sim.simulate.dataset_layout import FINISHED, STATUS
from dh2sim.simulate.mujoco_runtime import VELOCITY_STAGE, forward, set_models
from dh2sim.simulate.plant import Plant
from dh2sim.simulate.randomization import Draws
from dh2sim.simulate.randomized_models import apply_draws, motors
from dh2sim.simulate.records import Recorder
from dh2sim.simulate.turns import Turns
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
        M = _dense(mass, self._index)
        if not self._floating:
            return M
        follows = np.linalg.solve(_of_base(M), M[:, :BASE, BASE:])
        reduced = M[:, BASE:, BASE:].copy()
        for k in range(BASE):  # one by one: the same order of additions for any batch
            reduced -= M[:, BASE:, k, None] * follows[:, None, k, :]
        return reduced

    def forget(self) -> None:
        """Do nothing: nothing is kept."""

    def bias(self, mass: Array, force: Array) -> Array:
        """Return what ``force`` does: velocities are in it already."""
        return self.force(mass, force)

    def holding(self, mass: Array, force: Array) -> Array:
        """Return the joints' forces that balance those of all degrees of freedom."""
        return self.force(mass, force)

    def force(self, mass: Array, force: Array) -> Array:
        """Return the joints' forces, shape (batch, n), from those of all degrees of freedom, shape (batch, nv)."""
        if not self._floating:
            return np.array(force, order="F")
        M = _dense(mass, self._index)
        follows = np.linalg.solve(_of_base(M), force[:, :BASE, None])[:, :, 0]
        reduced = force[:, BASE:].copy()
        for k in range(BASE):
            reduced -= M[:, BASE:, k] * follows[:, k, None]
        return reduced


class LoopSpace:
    """Reduces them to those of a mechanism's driven joints, which all others follow; see ``closed_loops``."""

    def __init__(self, plant: Plant, loops: ClosedLoops, batch: Batch) -> None:
        """Describe a plant; what MuJoCo computes of the batch afterwards is used."""
        self._loops, self._at, self._v = loops, Kinematics.of(batch), batch.bind("qvel")
        self._now: tuple[Array, Array] | None = None
        self._index = _dense_index(plant.model)
        carried = loops.carries(plant.model.dof_bodyid)
        self._related = carried | carried.T  # joints of different branches have no inertia in common

    def _dense(self, mass: Array) -> Array:
        return np.where(self._related, np.take(mass, self._index, axis=1), 0.0)

    def inertia(self, mass: Array) -> Array:
        """Return the inertia, shape (batch, driven, driven).

        Raises:
            ControllerError: The driven joints do not determine the others.
        """
        return joint_inertia(self._dense(mass), self._motions()[0])

    def force(self, mass: Array, force: Array) -> Array:  # noqa: ARG002 - a base that floats needs the mass
        """Return the driven joints' forces, shape (batch, driven), that do what those of all joints do.

        Raises:
            ControllerError: The driven joints do not determine the others.
        """
        return np.asarray((self._motions()[0].transpose(0, 2, 1) @ force[:, :, None])[:, :, 0])

    def bias(self, mass: Array, force: Array) -> Array:
        """Return ``force`` with what the velocities of the loops require in addition.

        Raises:
            ControllerError: The driven joints do not determine the others.
        """
        _, drift = self._motions()
        return self.force(mass, force + (self._dense(mass) @ drift[:, :, None])[:, :, 0])

    def holding(self, mass: Array, force: Array) -> Array:
        """Return the driven joints' forces that balance those of all joints, the least where there are several."""
        if self._loops.determined:
            return self.force(mass, force)
        return self._loops.balancing(self._at, force)

    def forget(self) -> None:
        """Note that the batch has other states now."""
        self._now = None

    def _motions(self) -> tuple[Array, Array]:
        """Return how all joints follow the driven ones, and their accelerations while these have none."""
        if not self._loops.determined:
            driven, free = len(self._loops.driven), self._loops.freedoms
            raise ControllerError(
                f"{driven} driven joint{'s' * (driven != 1)} and {free} freedom{'s' * (free != 1)} at the assembly: "
                "forces of the driven joints follow from a motion only where they are as many as the freedoms, and "
                "determine all other joints; say in 'actuated' which are driven"
            )
        if self._now is None:
            self._now = self._loops.motions_and_drift(self._at, self._v)
        return self._now


def _dense(mass: Array, index: NDArray[np.intp]) -> Array:
    """Return dense matrices, shape (batch, nv, nv), from MuJoCo's sparse ones; rollouts next to each other."""
    return np.take(np.array(mass.T, order="C"), index, axis=0).transpose(2, 0, 1)


def _of_base(M: Array) -> Array:
    """Return the floating base's own inertia, or the identity where a simulation failed before it was computed."""
    own = M[:, :BASE, :BASE].copy()
    own[~own.any(axis=(1, 2))] = np.eye(BASE)
    return own


def _joint_space(plant: Plant, batch: Batch) -> JointSpace | LoopSpace:
    return JointSpace(plant) if plant.loops is None else LoopSpace(plant, plant.loops, batch)


def _dense_index(model: mujoco.MjModel) -> NDArray[np.intp]:
    """Return where MuJoCo's sparse lower triangle has each entry of the dense mass matrix; a chain has all."""
    index = np.zeros((model.nv, model.nv), dtype=np.intp)
    for row in range(model.nv):
        start = model.M_rowadr[row]
        for k in range(start, start + model.M_rownnz[row]):
            index[row, model.M_colind[k]] = index[model.M_colind[k], row] = k
    return index


class BatchObservation:
    """The current states of a persistent batch; see ``Observation``.

    Arrays are copies, in memory with the rollouts next to each other: NumPy computes with all of them in one go, and
    with what is computed of them, while the few joints of each would be a loop of their own.
    """

    def __init__(self, plant: Plant, batch: Batch, gravity_forces: GravityForces) -> None:
        """Observe a batch that is at its start; ``plant`` is the robot as its controller sees it."""
        self._plant, self._batch, self._gravity_forces = plant, batch, gravity_forces
        self._qpos, self._qvel = batch.bind("qpos"), batch.bind("qvel")
        self._made: JointSpace | LoopSpace | None = None
        self._gravity: Array | None = None
        self._fields: dict[str, Array] = {}
        self.step = 0

    def advance(self) -> None:
        """Note that the batch has taken a step."""
        self.step += 1
        self._gravity = None
        if self._made is not None:
            self._made.forget()

    @property
    def time(self) -> float:
        """Time since the start, s."""
        return self.step * self._plant.timestep

    @property
    def q(self) -> Array:
        """Joint positions, shape (batch, n)."""
        return np.array(self._qpos[:, self._plant.positions], order="F")

    @property
    def v(self) -> Array:
        """Joint velocities, shape (batch, n)."""
        return np.array(self._qvel[:, self._plant.velocities], order="F")

    @property
    def mass_matrix(self) -> Array:
        """Joint-space inertia, shape (batch, n, n); on a floating base, what the joints feel of it."""
        return self._space.inertia(self._field("M"))

    @property
    def bias(self) -> Array:
        """Coriolis, centrifugal and gravity forces, shape (batch, n)."""
        return self._space.bias(self._field("M"), self._field("qfrc_bias"))

    @property
    def passive(self) -> Array:
        """Forces of springs and viscous damping, shape (batch, n)."""
        passive = self._field("qfrc_passive")
        if self._plant.loops is not None:
            return self._space.force(self._field("M"), passive)
        return np.array(passive[:, self._plant.velocities], order="F")

    @property
    def gravity(self) -> Array:
        """Forces that balance gravity, shape (batch, n)."""
        if self._gravity is None:
            self._gravity = self._gravity_forces.forces(self._qpos)
        return self._gravity.copy(order="F")

    @property
    def _space(self) -> JointSpace | LoopSpace:
        if self._made is None:
            self._made = _joint_space(self._plant, self._batch)
            forward(self._batch)  # as in ``_field``
        return self._made

    def _field(self, name: str) -> Array:
        if name not in self._fields:  # a field has what is computed after it was bound
            self._fields[name] = self._batch.bind(name)
            forward(self._batch)
        return self._fields[name]


_UNFELT = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT) | int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
"""What MuJoCo need not compute for forces of gravity: contacts and limits, and sensors."""


class GravityForces:
    """Forces of gravity alone, computed by the same models at rest."""

    def __init__(self, plant: Plant, simulations: int, threads: int, drawn: Draws) -> None:
        """Describe the models, which are made when they are first needed."""
        self._plant, self._simulations, self._threads, self._drawn = plant, simulations, threads, drawn
        self._batch: Batch | None = None

    def forces(self, qpos: Array) -> Array:
        """Return the joint forces, N·m or N, that balance gravity at the given positions, shape (batch, n)."""
        if self._batch is None:
            model = copy.copy(self._plant.model)  # where designs have models of their own, they are used as they are
            if self._plant.loops is None:
                model.opt.disableflags |= _UNFELT
            self._batch = Batch(model, self._simulations, self._threads)
            set_models(self._batch, self._plant, as_fields=bool(self._drawn))
            apply_draws(self._batch, self._plant, self._drawn)
            self._space = _joint_space(self._plant, self._batch)
        mass, force = self._batch.bind("M"), self._batch.bind("qfrc_bias")
        self._batch.bind("qpos")[:] = qpos
        forward(self._batch)
        self._space.forget()
        return self._space.holding(mass, force)


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

    def __init__(
        self, plant: Plant, batch: Batch, recorder: Recorder, steps: int, turns: Turns, effort: Array | None = None
    ) -> None:
        """Take over a batch at its start.

        Args:
            plant: The robot.
            batch: Simulations of it.
            recorder: Takes what is recorded.
            steps: Time steps of the run.
            turns: Those of the threads that simulate such batches.
            effort: Factors of actuators' limits, shape (batch, actuators).
        """
        self.plant = plant
        self._lower, self._upper = plant.control_lower, plant.control_upper
        if effort is not None:
            scale = np.where(motors(plant), effort, 1.0)
            self._lower, self._upper = self._lower * scale, self._upper * scale
        self._limited = bool(np.isfinite(self._lower).any() or np.isfinite(self._upper).any())
        self.batch = batch
        self.recorder = recorder
        self.steps = steps
        self._turns = turns
        self.alive: NDArray[np.bool_] = np.ones(batch.nsim, dtype=bool)
        self.ids: NDArray[np.int32] | None = None
        """The simulations that still run, or None if all do."""
        self._none = np.zeros(0, dtype=np.intp)
        self.status = np.full(batch.nsim, FINISHED, dtype=np.int8)
        self.stop_step = np.full(batch.nsim, -1, dtype=np.int64)
        self.saturation = np.zeros((batch.nsim, len(plant.actuators)), dtype=np.int64)
        self.gaps = np.zeros((batch.nsim, len(plant.gaps)))
        """The greatest of each closure so far, m."""
        self.contacts = FirstContacts(plant, batch.nsim, substeps=recorder.substeps)

    @property
    def shape(self) -> tuple[int, int]:
        """Of the controls of a time step: (batch, actuators)."""
        return self.batch.nsim, len(self.plant.actuators)

    @property
    def running(self) -> bool:
        """Whether any simulation still runs."""
        return self.ids is None or bool(len(self.ids))

    @property
    def rows(self) -> Any:
        """The simulations that still run, to index arrays with."""
        return slice(None) if self.ids is None else self.ids

    def clipped(self, wanted: Array) -> tuple[Array, NDArray[np.bool_] | None]:
        """Return controls moved inside their ranges, and where they were outside: None if nowhere.

        Args:
            wanted: Controls, shape (batch, …, actuators).
        """
        lower, upper = self._lower, self._upper
        if not self._limited:
            return wanted, None
        if wanted.ndim > lower.ndim > 1:
            lower, upper = lower[:, None], upper[:, None]
        outside = (wanted < lower) | (wanted > upper)
        if not np.count_nonzero(outside):
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
        raised = self._none
        try:
            with self._turns:
                function(*args, **kwargs)
        except SimulationError as error:
            raised = error.ids
        if not len(raised) and not np.count_nonzero(self.batch.warning):
            return self._none
        failed = self.batch.warning[:, :, 1].any(axis=1)
        failed[raised] = True
        return np.flatnonzero(failed & self.alive)

    def see_gaps(self, simulations: Any, sensors: Array) -> None:
        """Note how far closures are open.

        Args:
            simulations: Which simulations.
            sensors: Their sensor data at some time steps, shape (simulations, steps, sensors).
        """
        for k, sensor in enumerate(self.plant.gaps):
            now = sensor.gap(sensors).max(axis=1, initial=0.0)
            self.gaps[simulations, k] = np.fmax(self.gaps[simulations, k], now)

    def put_back(self, simulations: NDArray[np.intp], before: Array) -> None:
        """Give simulations the states they had, of which ``before`` has those of all, and no warnings.

        Args:
            simulations: Which of them.
            before: Rows of states or their beginnings, shape (batch, …).
        """
        self.batch.state[simulations, : before.shape[1]] = before[simulations]
        self.batch.warning[simulations] = 0

    def look(self, step: int, simulations: NDArray[np.intp] | None = None) -> None:
        """Compute what MuJoCo derives from the states at the beginning of a time step, or at the end of the run.

        Args:
            step: The time step, in which those that fail are stopped.
            simulations: Which of those that still run; by default all.
        """
        ids = self.ids if simulations is None else simulations.astype(np.int32)
        if self.running and (ids is None or len(ids)):
            self.stop(self.call(self.batch.forward, ids, stage=VELOCITY_STAGE), step)

    def stop(self, simulations: NDArray[np.intp], step: int) -> None:
        """Stop simulations that failed in a time step."""
        for i in simulations:
            self.alive[i] = False
            self.stop_step[i] = step
            self.status[i] = STATUS[self._reason(int(i))]
        if len(simulations):
            self.ids = np.flatnonzero(self.alive).astype(np.int32)

    def _reason(self, i: int) -> str:
        for kind, reason in WARNINGS.items():
            if self.batch.warning[i, int(getattr(mujoco.mjtWarning, kind)), 1]:
                return reason
        return "error" if self.batch.status[i] else "other_warning"
