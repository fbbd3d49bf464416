"""One rollout of a run, up to where it stopped."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import PictureError
from dh2sim.simulate.dataset_layout import FINISHED, NOT_RUN, STATUS

if TYPE_CHECKING:
    from xarray import Dataset

RECORDED_BY = {"qpos_ref": "reference", "qvel_ref": "reference"}
"""The name to record a variable by, where it is not its own."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RolloutData:
    """One rollout, in memory."""

    run: str
    """The run as messages name it."""
    number: int
    """Of the rollout."""
    data: Dataset = field(repr=False)
    """Without the dimension ``rollout`` and the records after the rollout stopped."""
    reason: str
    """Why it stopped early, a name of ``STATUS``; empty if it did not."""
    stop_step: int
    """Time step at which it stopped early, or -1."""

    @property
    def attributes(self) -> Mapping[str, Any]:
        """The run's attributes."""
        return {str(name): value for name, value in self.data.attrs.items()}

    @property
    def design(self) -> dict[str, float]:
        """The numbers of the robot file that this rollout has of its own; empty for a run of one robot."""
        variables = self.data.data_vars.values()
        return {each.attrs["parameter"]: float(each) for each in variables if "parameter" in each.attrs}

    @property
    def label(self) -> str:
        """The run and the rollout, for titles."""
        return f"{self.run}, rollout {self.number}"

    def values(self, name: str) -> NDArray[Any]:
        """Return the numbers of a variable or coordinate."""
        return np.asarray(self.data[name].values)

    def names(self, coordinate: str) -> list[str]:
        """Return the labels of a coordinate."""
        return [str(name) for name in self.data[coordinate].values]

    def require(self, *names: str, what: str) -> None:
        """Check that variables were recorded.

        Args:
            names: of the variables.
            what: what needs them, for the message.

        Raises:
            PictureError: one was not; the text says how to record it.
        """
        missing = [name for name in names if name not in self.data]
        if missing:
            recorded = [str(name) for name in self.data.data_vars if "step" in self.data[name].dims]
            recorded += [str(name) for name in self.data.data_vars if "interval" in self.data[name].dims]
            wanted = ",".join(dict.fromkeys(RECORDED_BY.get(name, name) for name in missing))
            raise PictureError(
                f"{self.run}: {what} needs {' and '.join(missing)}, which the run does not contain; record again "
                f"with {wanted} (recorded: {', '.join(recorded) or 'nothing'})"
            )


def open_rollout(path: Path, number: int) -> RolloutData:
    """Read one rollout of a run.

    Args:
        path: of the run.
        number: of the rollout, from 0.

    Raises:
        RunError: there is no run, or it is damaged.
        PictureError: the run has no such rollout, or it has not been run.
    """
    from dh2sim.simulate.store.reader import open_dataset, reading

    with open_dataset(path) as run, reading(path):
        return select_rollout(run, number, path.absolute().name)


def select_rollout(run: Dataset, number: int, name: str) -> RolloutData:
    """Take one rollout out of a run.

    Args:
        run: the dataset.
        number: of the rollout, from 0.
        name: of the run, for messages.

    Raises:
        PictureError: the run has no such rollout, or it has not been run.
    """
    count = int(run.sizes["rollout"])
    if not 0 <= number < count:
        allowed = "rollout 0 only" if count == 1 else f"rollouts 0 to {count - 1}"
        raise PictureError(f"{name} has no rollout {number}; it contains {allowed}")
    data = run.isel(rollout=number).load()
    status = int(data["status"]) if "status" in data else FINISHED
    if status == NOT_RUN:
        raise PictureError(
            f"{name}: rollout {number} has not been run yet; resume the run, or choose another rollout"
        )
    if status == FINISHED:
        return RolloutData(run=name, number=number, data=data, reason="", stop_step=-1)
    reasons = {value: reason for reason, value in STATUS.items()}
    states = _records(data)
    data = data.isel(step=slice(states), interval=slice(max(states - 1, 0)))
    if states == 0:
        raise PictureError(f"{name}: rollout {number} stopped before anything was recorded")
    return RolloutData(
        run=name,
        number=number,
        data=data,
        reason=reasons.get(status, f"status {status}"),
        stop_step=int(data["stop_step"]) if "stop_step" in data else -1,
    )


def _records(data: Dataset) -> int:
    """Return the number of states before the first with a NaN."""
    count = int(data.sizes["step"])
    for variable in data.data_vars.values():
        if variable.dims[:1] == ("step",):
            whole = np.isfinite(variable.values[:count].reshape(count, -1)).all(axis=1)
            count = count if whole.all() else int(np.argmin(whole))
    return count
