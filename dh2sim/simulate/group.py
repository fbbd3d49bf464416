"""A group of rollouts in the engine: its states, which of them still run, and why others do not."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError
from numpy.typing import NDArray

from dh2sim.simulate.engine import VELOCITY_STAGE
from dh2sim.simulate.layout import FINISHED, STATUS
from dh2sim.simulate.plant import Plant
from dh2sim.simulate.records import Recorder
from dh2sim.typing import Array

WARNINGS = {
    "mjWARN_INERTIA": "warning_inertia",
    "mjWARN_CONTACTFULL": "warning_contacts_full",
    "mjWARN_CNSTRFULL": "warning_constraints_full",
    "mjWARN_BADQPOS": "bad_qpos",
    "mjWARN_BADQVEL": "bad_qvel",
    "mjWARN_BADQACC": "bad_qacc",
    "mjWARN_BADCTRL": "bad_ctrl",
}


class Group:
    """Simulations that run together; each that MuJoCo warns of or fails on stops alone."""

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

    @property
    def ids(self) -> NDArray[np.int32] | None:
        """The simulations that still run, or None if all do."""
        return None if self.alive.all() else np.flatnonzero(self.alive).astype(np.int32)

    @property
    def rows(self) -> Any:
        """The same, to index arrays with."""
        ids = self.ids
        return slice(None) if ids is None else ids

    def clipped(self, wanted: Array) -> tuple[Array, NDArray[np.bool_] | None]:
        """Return controls inside their ranges, and where they were not: None if nowhere.

        Args:
            wanted: shape (batch, …, actuators).
        """
        lower, upper = self.plant.control_lower, self.plant.control_upper
        outside = (wanted < lower) | (wanted > upper)
        if not outside.any():
            return wanted, None
        return np.clip(wanted, lower, upper), outside

    def count(self, outside: NDArray[np.bool_] | None, first: int, count: int) -> None:
        """Count the controls that were clipped, before the step in which a simulation stopped.

        Args:
            outside: where they were, shape (batch, count or 1, actuators).
            first: the time step that they begin with; all of ``count`` steps have been simulated.
            count: number of time steps that they were for.
        """
        if outside is None:
            return
        ran = np.where(self.stop_step < 0, count, np.clip(self.stop_step - first, 0, count))
        if outside.shape[1] == count:
            meant = np.arange(count) < ran[:, None]
            self.saturation += np.count_nonzero(outside & meant[:, :, None], axis=1)
        else:
            self.saturation += outside[:, 0] * ran[:, None]

    def call(self, function: Any, *args: Any, **kwargs: Any) -> NDArray[np.intp]:
        """Call a method of the batch; return the simulations that MuJoCo warned of or failed on meanwhile."""
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
