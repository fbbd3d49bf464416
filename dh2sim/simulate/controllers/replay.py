"""The controller ``replay``: controls or positions of joints from a file."""

from __future__ import annotations

import functools
from typing import Annotated, Literal

import numpy as np

from dh2sim.errors import ControllerError
from dh2sim.messages import listed
from dh2sim.simulate.controllers.options import Within
from dh2sim.simulate.controllers.protocol import Prepared, RolloutBatch
from dh2sim.simulate.controllers.recording import Recording, read_recording
from dh2sim.typing import Array

_EARLY = 1e-6
"""Share of a time step by which a row may be late and still count for it, since times are rounded."""


class Replay:
    """Controls, or positions that position actuators follow, come from a CSV or NumPy file or another run."""

    @staticmethod
    def prepare(
        *,
        file: str,
        as_: Literal["auto", "ctrl", "reference"] = "auto",
        rollout: Annotated[int | None, Within(at_least=0)] = None,
    ) -> Prepared:
        """Read the file; the numbers of a large one are read when they are needed.

        Args:
            file: A ``.csv``, ``.npy`` or ``.npz`` file, or a run; ``replay:FILE`` names it alone.
            as_: Whether the numbers are controls or positions of joints; 'auto': as the columns are named, and
                controls for a run.
            rollout: Which of the file's rollouts every rollout replays; None: the one of its own index.

        Raises:
            ControllerError: The file cannot be used.
        """
        recording = read_recording(file, as_)
        if rollout is not None:
            recording = recording.only(rollout)
        follows = recording.positions
        return Prepared(
            make=functools.partial(ReplayedPositions if follows else ReplayedControls, recording=recording),
            actuation=recording.actuation,
            digest=recording.digest,
            follows=follows,
            first=recording.first,
        )


class ReplayedControls:
    """Controls from a file, each held until the next."""

    def __init__(self, batch: RolloutBatch, *, recording: Recording) -> None:
        """Read what the rollouts need.

        Raises:
            ControllerError: The file's columns are not the robot's actuators, or it has too few rollouts.
        """
        self._data = _rows(batch, recording, batch.plant.actuators, "actuators")
        self._times = recording.times_at(batch.plant.timestep)
        self._timestep = batch.plant.timestep
        self._batch = len(batch.rollouts)

    def controls(self, first: int, count: int) -> Array:
        """Return controls, shape (batch, count, actuators)."""
        times = (np.arange(first, first + count) + _EARLY) * self._timestep
        rows = np.searchsorted(self._times, times, side="right") - 1
        return _for_all(self._data[:, rows], self._batch)


class ReplayedPositions:
    """Positions from a file, interpolated linearly between its instants; the last is held."""

    def __init__(self, batch: RolloutBatch, *, recording: Recording) -> None:
        """Read what the rollouts need.

        Raises:
            ControllerError: The file's columns are not the robot's joints, or it has too few rollouts.
        """
        self._data = _rows(batch, recording, batch.plant.joints, "joints")
        self._times = recording.times_at(batch.plant.timestep)
        self._timestep = batch.plant.timestep
        self._batch = len(batch.rollouts)

    def controls(self, first: int, count: int) -> Array:
        """Return setpoints, rad or m, shape (batch, count, n)."""
        return self.reference(first, count)[0]

    def reference(self, first: int, count: int) -> tuple[Array, Array]:
        """Return the setpoints, and the rates of the straight lines that start there."""
        last = len(self._times) - 1
        times = np.arange(first, first + count) * self._timestep
        before = np.minimum(np.searchsorted(self._times, times, side="right") - 1, last)
        after = np.minimum(before + 1, last)
        start, end = self._data[:, before], self._data[:, after]
        duration = np.where(after > before, self._times[after] - self._times[before], 1.0)
        share = (np.where(after > before, times - self._times[before], 0.0) / duration)[:, None]
        q = (1.0 - share) * start + share * end
        return _for_all(q, self._batch), _for_all((end - start) / duration[:, None], self._batch)


def _rows(batch: RolloutBatch, recording: Recording, names: tuple[str, ...], what: str) -> Array:
    """Return the numbers of a batch in the order of ``names``, shape (batch or 1, K, names)."""
    columns = recording.columns(names, what, joints=batch.plant.joints, besides=batch.plant.following)
    if recording.rollouts is None:
        return recording.read(range(1))[:, :, columns]
    first, last = min(batch.rollouts), max(batch.rollouts)
    if last >= recording.rollouts:
        raise ControllerError(
            f"{recording.file} has {recording.rollouts} rollouts, 0 to {recording.rollouts - 1}; "
            f"rollout {last} of this run has none to replay. "
            "Simulate fewer rollouts, or let all replay one with rollout=NUMBER"
        )
    data = recording.read(range(first, last + 1))[[i - first for i in batch.rollouts]][:, :, columns]
    stopped = [i for i, rows in zip(batch.rollouts, data, strict=True) if not np.isfinite(rows).all()]
    if stopped:
        raise ControllerError(
            f"{recording.file} does not contain all of rollouts {listed(map(str, stopped))}: "
            "they stopped early, or the run is not finished"
        )
    return data


def _for_all(rows: Array, batch: int) -> Array:
    """Repeat rows that are one for all rollouts."""
    return rows if rows.shape[0] == batch else np.repeat(rows, batch, axis=0)
