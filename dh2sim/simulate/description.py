"""All that there is to tell of a run: the counts of its summary, and what a person asks next."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from dh2sim.simulate.convert.blocks import open_run
from dh2sim.simulate.layout import FINISHED, STATUS
from dh2sim.simulate.store.reader import reading
from dh2sim.simulate.store.summary import RunSummary, summarize


@dataclass(frozen=True, slots=True, kw_only=True)
class Recorded:
    """A variable of a run."""

    name: str
    units: str
    dimensions: tuple[str, ...]
    shape: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stopped:
    """A rollout that stopped early."""

    rollout: int
    reason: str
    """Name of its status."""
    step: int
    """Time step in which it stopped."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunDescription:
    """What a run holds and where it comes from."""

    summary: RunSummary
    integrator: str
    start: str
    randomize: Mapping[str, float]
    recorded: tuple[Recorded, ...]
    stopped: tuple[Stopped, ...]
    """Every rollout that stopped early."""
    bytes_in_memory: int
    """Of the numbers of blocks that are there."""
    command: str
    """As it was typed; empty for a run made by the library."""

    @property
    def resume_command(self) -> str | None:
        """What carries on with the run; None if it is complete, or was made by the library."""
        if self.summary.complete or not self.command:
            return None
        return resumed(self.command)

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        return {
            **self.summary.to_json(),
            "integrator": self.integrator,
            "start": self.start,
            "randomize": dict(self.randomize),
            "recorded": {
                each.name: {"units": each.units, "dimensions": list(each.dimensions), "shape": list(each.shape)}
                for each in self.recorded
            },
            "stopped": [{"rollout": each.rollout, "reason": each.reason, "step": each.step} for each in self.stopped],
            "bytes_in_memory": self.bytes_in_memory,
            "command": self.command,
            "resume_command": self.resume_command,
        }


def describe(path: Path) -> RunDescription:
    """Describe a run; of its numbers only a few per rollout are read.

    Raises:
        RunError: there is no run, or it is damaged.
    """
    summary = summarize(path)
    run = open_run(path)
    dataset, attributes = run.dataset, run.dataset.attrs
    there = np.repeat(run.committed, run.block)[: summary.rollouts]
    with reading(path):
        status, stop_step = dataset["status"].values, dataset["stop_step"].values
    numbers = sum(variable.nbytes for variable in dataset.data_vars.values())
    return RunDescription(
        summary=summary,
        integrator=str(attributes.get("integrator", "")),
        start=str(attributes["settings"].get("start", "")),
        randomize=MappingProxyType(dict(attributes.get("randomize", {}))),
        recorded=tuple(
            Recorded(
                name=name,
                units=str(dataset[name].attrs.get("units", "")),
                dimensions=tuple(map(str, dataset[name].dims)),
                shape=dataset[name].shape,
            )
            for name in summary.variables
        ),
        stopped=_stopped(np.where(there, status, FINISHED), stop_step),
        bytes_in_memory=numbers * int(there.sum()) // summary.rollouts,
        command=str(attributes.get("command", "")),
    )


def _stopped(status: Any, stop_step: Any) -> tuple[Stopped, ...]:
    reasons = {value: name for name, value in STATUS.items()}
    return tuple(
        Stopped(rollout=int(i), reason=reasons.get(int(status[i]), "unknown"), step=int(stop_step[i]))
        for i in np.flatnonzero(status > FINISHED)
    )


def resumed(command: str) -> str:
    """Return the command that carries on with a run which another command began."""
    try:
        words: Sequence[str] = shlex.split(command)
    except ValueError:
        return f"{command} --resume"
    kept = [word for word in words if word not in ("--overwrite", "--resume")]
    return shlex.join([*kept, "--resume"])
