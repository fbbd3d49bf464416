"""All that there is to tell of a run: the counts of its summary, and what a person asks next.

What a run holds, in a few numbers.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dh2sim.simulate.convert.blocks import open_run
from dh2sim.simulate.dataset_layout import FINISHED, NOT_RUN, STATUS
from dh2sim.simulate.store.blocks import Blocks
from dh2sim.simulate.store.reader import read_attributes, read_seal, reading


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSummary:
    """What a run holds. Rollouts of a block that is not committed count as not run."""

    path: str
    robot: str
    controller: str
    rollouts: int
    finished: int
    """Rollouts that ran to their end."""
    unstable: int
    """Rollouts that stopped early."""
    not_run: int
    reasons: Mapping[str, int]
    """Why rollouts stopped early, and how many for each reason."""
    saturated: int
    """Rollouts in which a wanted control was outside its range at least once."""
    steps: int
    """Time steps of a rollout."""
    timestep: float
    """s."""
    every: int
    """A state in so many is recorded."""
    duration: float
    """Simulated time of a rollout, s."""
    variables: tuple[str, ...]
    bytes_on_disk: int
    blocks: int
    blocks_done: int
    seconds: float
    """Time that the blocks took together, as far as it is known."""
    steps_per_second: float | None
    """Time steps of all rollouts of the blocks whose time is known, by that time."""
    seed: int
    created: str
    """ISO time, UTC."""
    versions: Mapping[str, str]

    @property
    def complete(self) -> bool:
        """Whether every block is committed."""
        return self.blocks_done == self.blocks

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        values = {name: getattr(self, name) for name in self.__dataclass_fields__}
        values |= {"reasons": dict(self.reasons), "versions": dict(self.versions), "variables": list(self.variables)}
        return {**values, "complete": self.complete}


def summarize(path: str | PathLike[str]) -> RunSummary:
    """Return what a run holds; of its numbers only a few per rollout are read, and chunks are not checked.

    Raises:
        RunError: there is no run.
        RunDamagedError: what is read is damaged.
    """
    path = Path(path)
    attributes = read_attributes(path)
    blocks = Blocks(path=path, seal=read_seal(path, attributes))
    settings = attributes["settings"]
    done = [block for block in range(blocks.seal.blocks) if blocks.committed(block)]
    status, stop_step, saturation = (_read(path, name) for name in ("status", "stop_step", "saturation"))
    run = np.zeros(blocks.seal.rollouts, dtype=bool)
    for block in done:
        run[_part(blocks, block)] = True
    status = np.where(run, status, NOT_RUN)
    steps = np.where(stop_step >= 0, stop_step, settings["steps"])
    times = {block: seconds for block in done if (seconds := blocks.seconds(block)) and np.isfinite(seconds)}
    timed = sum(int(steps[_part(blocks, block)].sum()) for block in times)
    seconds = sum(times.values())
    return RunSummary(
        path=str(path),
        robot=attributes["robot"],
        controller=settings["controller"],
        rollouts=blocks.seal.rollouts,
        finished=int((status == FINISHED).sum()),
        unstable=int((status > FINISHED).sum()),
        not_run=int((status == NOT_RUN).sum()),
        reasons=MappingProxyType(_reasons(status)),
        saturated=int((saturation[run] > 0).any(axis=1).sum()),
        steps=settings["steps"],
        timestep=attributes["timestep"],
        every=settings["every"],
        duration=settings["steps"] * attributes["timestep"],
        variables=tuple(blocks.seal.variables),
        bytes_on_disk=sum(file.stat().st_size for file in path.rglob("*") if file.is_file()),
        blocks=blocks.seal.blocks,
        blocks_done=len(done),
        seconds=seconds,
        steps_per_second=timed / seconds if seconds else None,
        seed=settings["seed"],
        created=attributes["created"],
        versions=MappingProxyType(dict(attributes["versions"])),
    )


def _read(path: Path, name: str) -> NDArray[Any]:
    import zarr

    with reading(path):
        return np.asarray(zarr.open_array(path / name, mode="r")[...])


def _part(blocks: Blocks, block: int) -> slice:
    first = block * blocks.seal.block
    return slice(first, first + blocks.seal.size(block))


def _reasons(status: NDArray[Any]) -> dict[str, int]:
    counts = {name: int((status == value).sum()) for name, value in STATUS.items() if value > FINISHED}
    return {name: count for name, count in counts.items() if count}


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
