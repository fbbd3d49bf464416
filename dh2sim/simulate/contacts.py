"""The first contact between links of each rollout: in which time step, and of which links."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from dh2sim.simulate.plant import Plant
from dh2sim.typing import Array

NO_CONTACT = -1
"""Time step or link of a rollout without contact."""


def links_with_shapes(model: mujoco.MjModel) -> dict[int, str]:
    """Return names of the bodies that have shapes, by their number."""
    return {int(body): model.body(int(body)).name for body in sorted(set(model.geom_bodyid.tolist()))}


class FirstContacts:
    """Looks at the number of contacts that MuJoCo counts in any case, and finds the links where it is not zero."""

    def __init__(self, plant: Plant, simulations: int, *, substeps: bool) -> None:
        """Watch simulations of a plant.

        Args:
            plant: The robot.
            simulations: Number of simulations.
            substeps: Whether what MuJoCo counts in a time step is that of a substep near its end, as with RK4.
        """
        self._models = plant.models
        self._data = mujoco.MjData(plant.model)
        self._substeps = substeps
        self.number_as(plant.model)
        self.step = np.full(simulations, NO_CONTACT, dtype=np.int64)
        self.links = np.full((simulations, 2), NO_CONTACT, dtype=np.int32)
        """Numbers of the bodies, in ascending order."""

    def number_as(self, model: mujoco.MjModel) -> None:
        """Count bodies as a model does whose bodies of these names may have other numbers."""
        self._numbers = {name: number for number, name in links_with_shapes(model).items()}

    def see(self, simulations: NDArray[np.intp], step: int, contacts: NDArray[Any], qpos: Array) -> None:
        """Look at simulations at the beginning of a time step.

        Args:
            simulations: Which of them.
            step: The time step.
            contacts: How many contacts they have, shape (simulations,).
            qpos: Their positions, shape (simulations, nq).
        """
        for k in np.flatnonzero((contacts > 0) & (self.step[simulations] < 0)):
            self._note(int(simulations[k]), step, qpos[k])

    def see_many(
        self, simulations: NDArray[np.intp], first: int, contacts: NDArray[Any], before: Array, after: Array
    ) -> None:
        """Look at simulations at the beginnings of several time steps.

        Args:
            simulations: Which of them.
            first: The first time step.
            contacts: How many contacts MuJoCo counted in each time step, shape (simulations, steps).
            before: Positions of all simulations at the beginning of the first step, shape (batch, nq).
            after: Positions at the end of each step, shape (simulations, steps, nq).
        """
        if not contacts.any():
            return
        for k in np.flatnonzero((contacts > 0).any(axis=1) & (self.step[simulations] < 0)):
            i = int(simulations[k])
            for j in np.flatnonzero(contacts[k]).tolist():
                if self._note(i, first + j, before[i] if j == 0 else after[k, j - 1]):
                    break
                if self._substeps and self._note(i, first + j + 1, after[k, j]):
                    break

    def forget_after(self, stop_step: NDArray[np.int64]) -> None:
        """Drop contacts that a simulation cannot have had, as it stopped before; -1 for those that did not stop."""
        beyond = (stop_step >= 0) & (self.step >= stop_step)
        self.step[beyond], self.links[beyond] = NO_CONTACT, NO_CONTACT

    def _note(self, simulation: int, step: int, qpos: Array) -> bool:
        """Note the links that overlap most at given positions; return whether there are any."""
        model = self._models[simulation % len(self._models)]
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(model, self._data)
        mujoco.mj_collision(model, self._data)
        if not self._data.ncon:
            return False
        contact = self._data.contact
        bodies = model.geom_bodyid[contact.geom[int(np.argmin(contact.dist))]]
        self.step[simulation], self.links[simulation] = (
            step,
            sorted(self._numbers[model.body(int(body)).name] for body in bodies),
        )
        return True
