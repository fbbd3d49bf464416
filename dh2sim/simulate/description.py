"""What a run contains and where it comes from, in a few numbers and words."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike, fspath
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.simulate.contacts import NO_CONTACT
from dh2sim.simulate.dataset_layout import FINISHED, NOT_RUN, STATUS
from dh2sim.simulate.store.reader import StoredRun, open_run, reading

_OF_A_PART: Final = re.compile(r"--(share|blocks)(=|$)")
"""Options that choose a part of a run's blocks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedVariable:
    """A variable of a run."""

    units: str
    dimensions: tuple[str, ...]
    shape: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class EarlyStop:
    """A rollout that stopped early."""

    rollout: int
    reason: str
    """Name of its status."""
    step: int
    """Time step in which it stopped."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FirstContact:
    """Where links of the robot first touch in a rollout."""

    rollout: int
    step: int
    """Time step at whose beginning they touch."""
    time: float
    """s."""
    links: tuple[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopGap:
    """How far the loops of a mechanism are open at most."""

    closure: str
    gap: float
    """m"""
    share: float
    """Of the mechanism's size."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunDescription:
    """A description of a run. Rollouts of a block that is not committed count as not run."""

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
    """Number of rollouts that stopped early for each reason."""
    touched: int | None
    """Rollouts in which links of the robot touch at least once; None for a run that does not contain it."""
    first_contact: FirstContact | None
    """Of the first of these rollouts."""
    loop_gap: LoopGap | None
    """Of all rollouts and time steps; None without closed loops."""
    saturated: int
    """Rollouts in which the controller wanted a control outside its range at least once."""
    saturated_joints: Mapping[str, int]
    """The same for each joint that there were any of."""
    steps: int
    """Time steps of a rollout."""
    timestep: float
    """s."""
    every: int
    """Every N-th state is recorded."""
    duration: float
    """Simulated time of a rollout, s."""
    variables: tuple[str, ...]
    bytes_on_disk: int
    blocks: int
    blocks_done: int
    blocks_missing: tuple[int, ...]
    """Those that are not committed."""
    seconds: float
    """Wall time of all committed blocks, s."""
    steps_per_second: float | None
    """Time steps of all rollouts of the committed blocks per second; None without any."""
    seed: int
    created: str
    """ISO time, UTC."""
    versions: Mapping[str, str]
    complete: bool
    """Whether every block is committed."""
    integrator: str
    engine: str
    """'mujoco' or 'warp'."""
    device: str
    """What Warp computed on; empty for MuJoCo."""
    start: str
    randomize: Mapping[str, float | str]
    vary: Mapping[str, str]
    """How numbers of the robot file are drawn, by name."""
    designs: str | None
    """File of designs, or None."""
    per_design: int
    """Successive rollouts that have one design."""
    recorded: Mapping[str, RecordedVariable]
    stopped: tuple[EarlyStop, ...]
    """Every rollout that stopped early."""
    bytes_in_memory: int
    """Of the numbers of committed blocks."""
    command: str
    """As it was typed; empty for a run made by the library."""
    resume_command: str | None
    """The command that completes the run; None if it is complete, or was made by the library."""

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        return {name: _json(getattr(self, name)) for name in self.__dataclass_fields__}


def describe(path: str | PathLike[str]) -> RunDescription:
    """Describe a run; of its numbers only a few per rollout are read.

    Raises:
        RunError: There is no run.
        RunDamagedError: What is read is damaged, or a chunk is missing.
    """
    run = open_run(path)
    run.check_coordinates()
    run.check_chunks()
    manifest, attributes = run.manifest, run.manifest.attributes
    settings, timestep, command = attributes["settings"], attributes["timestep"], str(attributes["command"])
    status, stop_step, saturation = (run.values(name) for name in ("status", "stop_step", "saturation"))
    done = np.zeros(manifest.rollouts, dtype=bool)
    with reading(path):
        committed = run.committed(run.recorded_blocks())
    for block in committed:
        done[manifest.part(block)] = True
    seconds = [record.seconds for record in committed.values()]
    status = np.where(done, status, NOT_RUN)
    contact_step = None
    if "contact_step" in manifest.variables:
        contact_step = np.where(done, run.values("contact_step"), NO_CONTACT)
    complete = bool(done.all())
    steps = int(np.where(stop_step >= 0, stop_step, settings["steps"])[done].sum())
    counts = {name: int((status == value).sum()) for name, value in STATUS.items() if value > FINISHED}
    names = {value: name for name, value in STATUS.items()}
    sizes = [math.prod(stored.shape) * np.dtype(stored.dtype).itemsize for stored in manifest.variables.values()]
    return RunDescription(
        path=fspath(path),
        robot=attributes["robot"],
        controller=settings["controller"],
        rollouts=manifest.rollouts,
        finished=int((status == FINISHED).sum()),
        unstable=int((status > FINISHED).sum()),
        not_run=int((status == NOT_RUN).sum()),
        reasons=MappingProxyType({name: count for name, count in counts.items() if count}),
        touched=None if contact_step is None else int((contact_step >= 0).sum()),
        first_contact=None if contact_step is None else _first_contact(run, contact_step, timestep),
        loop_gap=_loop_gap(run, done),
        saturated=int((saturation[done] > 0).any(axis=1).sum()),
        saturated_joints=MappingProxyType(_by_joint(run, saturation[done] > 0)),
        steps=settings["steps"],
        timestep=timestep,
        every=settings["every"],
        duration=settings["steps"] * timestep,
        variables=tuple(manifest.variables),
        bytes_on_disk=run.bytes_stored(),
        blocks=manifest.blocks,
        blocks_done=len(seconds),
        blocks_missing=tuple(block for block in range(manifest.blocks) if block not in committed),
        seconds=sum(seconds),
        steps_per_second=steps / sum(seconds) if sum(seconds) else None,
        seed=settings["seed"],
        created=attributes["created"],
        versions=MappingProxyType(dict(attributes["versions"])),
        complete=complete,
        integrator=attributes["integrator"],
        engine=settings.get("engine", "mujoco"),
        device=str(attributes.get("device", "")),
        start=settings["start"],
        randomize=MappingProxyType(dict(attributes["randomize"])),
        vary=MappingProxyType(dict(settings.get("vary", {}))),
        designs=settings.get("designs"),
        per_design=settings.get("per_design", 1),
        recorded=MappingProxyType(
            {
                name: RecordedVariable(
                    units=str(stored.attributes.get("units", "")), dimensions=stored.dimensions, shape=stored.shape
                )
                for name, stored in manifest.variables.items()
            }
        ),
        stopped=tuple(
            EarlyStop(rollout=int(i), reason=names.get(int(status[i]), "unknown"), step=int(stop_step[i]))
            for i in np.flatnonzero(status > FINISHED)
        ),
        bytes_in_memory=sum(sizes) * int(done.sum()) // manifest.rollouts,
        command=command,
        resume_command=None if complete or not command else resumed(command),
    )


def _first_contact(run: StoredRun, contact_step: NDArray[Any], timestep: float) -> FirstContact | None:
    touched = np.flatnonzero(contact_step >= 0)
    if not len(touched):
        return None
    rollout = int(touched[0])
    step = int(contact_step[rollout])
    links = []
    for name in ("contact_link_a", "contact_link_b"):
        flags = run.manifest.variables[name].attributes
        names = dict(zip(flags["flag_values"], flags["flag_meanings"].split(), strict=True))
        links.append(names.get(int(run.values(name)[rollout]), "unknown"))
    return FirstContact(rollout=rollout, step=step, time=step * timestep, links=(links[0], links[1]))


def _loop_gap(run: StoredRun, done: NDArray[np.bool_]) -> LoopGap | None:
    if "loop_gap" not in run.manifest.variables or not done.any():
        return None
    gaps = run.values("loop_gap")[done].max(axis=0)
    widest = int(np.argmax(gaps))
    gap, size = float(gaps[widest]), float(run.manifest.variables["loop_gap"].attributes["size"])
    return LoopGap(closure=str(run.values("closure")[widest]), gap=gap, share=gap / size)


def _by_joint(run: StoredRun, clipped: NDArray[np.bool_]) -> dict[str, int]:
    """Return the number of rollouts for each joint, from where its actuator was clipped, shape (rollouts, actuators).

    An actuator is named after its joint and its type.
    """
    if not clipped.any():
        return {}
    names = [str(actuator).rpartition("_")[0] for actuator in run.values("actuator")]
    counts = {name: int(count) for name, count in zip(names, clipped.sum(axis=0), strict=True) if count}
    return dict(sorted(counts.items(), key=lambda item: -item[1]))


def resumed(command: str) -> str:
    """Return the command that resumes a run which another command began, all of it."""
    try:
        words = shlex.split(command)
    except ValueError:
        return f"{command} --resume"
    kept, skipped = [], False
    for word in words:
        if not skipped and word not in ("--overwrite", "--resume") and not _OF_A_PART.match(word):
            kept.append(word)
        skipped = not skipped and word in ("--share", "--blocks")
    return shlex.join([*kept, "--resume"])


def _json(value: Any) -> Any:
    match value:
        case RecordedVariable() | EarlyStop() | FirstContact() | LoopGap():
            return {name: _json(getattr(value, name)) for name in value.__dataclass_fields__}
        case Mapping():
            return {name: _json(item) for name, item in value.items()}
        case tuple():
            return [_json(item) for item in value]
        case _:
            return value
