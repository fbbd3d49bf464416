"""Recording: which fields of MuJoCo a variable comes from, and where it goes in a block's arrays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from dh2sim.simulate.plant import Plant

STATES = ("qpos", "qvel", "base_pose", "base_twist", "qpos_ref", "qvel_ref")
"""Known at every instant from the start to the end."""
DERIVED = ("tool_pose", "energy")
"""Likewise, but computed from the state by MuJoCo."""
INTERVALS = ("ctrl", "qacc", "torque", "contacts")
"""Known at the beginning of every interval."""
SENSED = frozenset({"tool_pose", "torque"})
"""Read from the model's sensors."""

Arrays = Mapping[str, NDArray[Any]]


class Recorder:
    """Copies what a simulation yields, one or many time steps at a time, into a block's arrays."""

    def __init__(self, plant: Plant, arrays: Arrays, every: int) -> None:
        """Record every ``every``-th time step into ``arrays``, each with the batch's rollouts first."""
        self._arrays = arrays
        self._every = every
        self._plant = plant
        self._base_q, self._base_v = (7, 6) if plant.floating else (0, 0)
        self.substeps = plant.model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4
        n = plant.n
        self._torque = slice(2 * n, 3 * n)  # sensors are in the order of ``add_sensors``
        self._tool = slice(3 * n, 3 * n + 7)

    def wants(self, name: str) -> bool:
        """Whether a variable is recorded."""
        return name in self._arrays

    @property
    def looks_between_steps(self) -> bool:
        """Whether something is recorded that the substeps of RK4 overwrite."""
        return self.substeps and any(map(self.wants, ("energy", "contacts")))

    @property
    def state_fields(self) -> tuple[str, ...]:
        """Fields of the state that are recorded."""
        wanted = {"qpos": ("qpos", "base_pose"), "qvel": ("qvel", "base_twist")}
        return tuple(field for field, names in wanted.items() if any(map(self.wants, names)))

    @property
    def derived_fields(self) -> tuple[str, ...]:
        """Other fields of MjData that are recorded."""
        wanted = {
            "sensordata": ("tool_pose", "torque"),
            "qacc": ("qacc",),
            "energy": ("energy",),
            "ncon": ("contacts",),
        }
        return tuple(field for field, names in wanted.items() if any(map(self.wants, names)))

    def put(self, name: str, first: int, values: NDArray[Any], rows: Any = slice(None)) -> None:
        """Record a variable at time steps ``first``, ``first + 1``, …; values have shape (rows, steps, …)."""
        if name not in self._arrays:
            return
        array = self._arrays[name]
        skipped = -first % self._every
        chosen = values[:, skipped :: self._every]
        k = (first + skipped) // self._every
        chosen = chosen[:, : array.shape[1] - k]
        if chosen.shape[1]:
            array[rows, k : k + chosen.shape[1]] = chosen

    def put_field(
        self, field: str, first: int, values: NDArray[Any], rows: Any = slice(None), only: Iterable[str] | None = None
    ) -> None:
        """Record a field of MjData at time steps ``first``, …; with ``only``, these variables of it."""
        parts: dict[str, NDArray[Any]]
        match field:
            case "qpos":
                parts = {"base_pose": values[..., : self._base_q], "qpos": values[..., self._plant.positions]}
            case "qvel":
                parts = {"base_twist": values[..., : self._base_v], "qvel": values[..., self._plant.velocities]}
            case "sensordata":
                parts = {"tool_pose": values[..., self._tool], "torque": values[..., self._torque]}
            case "qacc":
                parts = {"qacc": values[..., self._plant.velocities]}
            case "energy":
                parts = {"energy": values}
            case _:
                parts = {"contacts": values}
        for name, part in parts.items():
            if only is None or name in only:
                self.put(name, first, part, rows)

    def end(self, stop_step: NDArray[np.int64]) -> None:
        """Blank what rollouts that stopped early recorded afterwards; ``stop_step`` is -1 for those that did not."""
        for row in np.flatnonzero(stop_step >= 0):
            step = int(stop_step[row])
            for name, array in self._arrays.items():
                if name in STATES:
                    array[row, step // self._every + 1 :] = np.nan
                elif name in DERIVED or name in INTERVALS:
                    array[row, -(-step // self._every) :] = -1 if name == "contacts" else np.nan
