"""Runs: block after block simulated, and each put where it is safe while the next one is on its way.

A run in memory.
"""

from __future__ import annotations

import operator
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, SupportsIndex

import numpy as np

from dh2sim.errors import SettingsError
from dh2sim.extras import require_extra
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.read import load_robot
from dh2sim.simulate.block import Block, simulate_block
from dh2sim.simulate.dataset_layout import Layout
from dh2sim.simulate.options import Wish, names_of
from dh2sim.simulate.prepare import Job, prepare
from dh2sim.simulate.settings import DEFAULT_RECORD

if TYPE_CHECKING:
    import xarray as xr

    from dh2sim.simulate.store.writer import RunWriter


def to_dataset(layout: Layout, arrays: Block) -> xr.Dataset:
    """Put the variables of a whole run together; the same dataset as one that was written and opened."""
    import xarray as xr

    coordinates: dict[str, Any] = {
        item.name: (item.dimension, np.asarray(item.values), dict(item.attributes)) for item in layout.coordinates
    }
    variables = {
        variable.name: (variable.dimensions, arrays[variable.name], dict(variable.attributes))
        for variable in layout.variables
    }
    return xr.Dataset(variables, coordinates, dict(layout.attributes))


Advance = Callable[[int], None]
"""Told how many rollouts are done since it was last called."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far a run has come."""

    finished: bool
    """Whether all blocks are safe; False if it was asked to stop before."""
    rollouts: int
    """Simulated this time, and safe."""
    seconds: float
    """Wall time from the first block's beginning until the last was safe."""


def rollout(
    model: RobotModel | str | Path,
    *,
    out: str | Path | None = None,
    rollouts: int = 256,
    steps: int | None = None,
    duration: float | None = None,
    timestep: float = 0.002,
    integrator: str = "implicitfast",
    controller: str = "sine",
    start: str = "home",
    seed: int = 0,
    record: Sequence[str] = DEFAULT_RECORD,
    every: int = 1,
    randomize: Mapping[str, float] = MappingProxyType({}),
    floating_base: bool = False,
    threads: int = 0,
    resume: bool = False,
    overwrite: bool = False,
    advance: Advance | None = None,
) -> xr.Dataset:
    """Simulate many rollouts of a robot.

    Args:
        model: the robot, or its file or name.
        out: where to write the run, a folder by convention named ``….zarr``; None to keep it in memory.
        rollouts: how many.
        steps: time steps of each; by default as many as ``duration`` takes.
        duration: s; by default 2.
        timestep: s.
        integrator: 'Euler', 'RK4', 'implicit' or 'implicitfast'.
        controller: ``NAME`` or ``NAME:key=value,…``, or ``module:name`` of one's own.
        start: 'home', 'zero', 'random', a configuration of the robot file, or a .csv or .npy file of states.
        seed: of all random numbers. The same seed gives the same bits, whatever the number of threads.
        record: of 'qpos', 'qvel', 'ctrl', 'tool_pose', 'reference', 'qacc', 'torque', 'energy', 'contacts'; also as
            one text with commas.
        every: a state in so many is recorded.
        randomize: greatest relative change, by rollout, of 'mass', 'friction', 'damping', 'armature', 'gain'.
        floating_base: whether base_link floats.
        threads: 0 for one a processor.
        resume: carry on with what stands at ``out``, if anything does.
        overwrite: replace a run that stands at ``out``.
        advance: told how many rollouts are done.

    Returns:
        The dataset, as ``docs/dataset.md`` describes it; read lazily from ``out`` if that is given.

    Raises:
        SettingsError: the settings cannot be met.
        ControllerError: there is no such controller, or it does what it must not.
        RunExistsError: something stands at ``out`` already, and neither ``resume`` nor ``overwrite`` is given.
        RunDiffersError: the run to be resumed has other settings.
        OutputError: the run cannot be written; what was written before is safe.
        MissingExtraError: xarray is not installed.
    """
    require_extra("data", "xarray", what="a run as an xarray dataset")
    if not isinstance(model, RobotModel):
        model = build_model(load_robot(model))
    wish = Wish(
        rollouts=_whole("rollouts", rollouts),
        steps=None if steps is None else _whole("steps", steps),
        duration=duration,
        timestep=timestep,
        integrator=integrator,
        controller=controller,
        start=start,
        seed=_whole("seed", seed),
        record=names_of(record),
        every=_whole("every", every),
        randomize=MappingProxyType(dict(randomize)),
        floating_base=floating_base,
    )
    job = prepare(model, wish)
    if out is None:
        try:
            whole = range(job.settings.rollouts)
            arrays = simulate_block(job.mjcf, job.settings, whole, threads=threads, advance=advance)
        except MemoryError as error:
            raise SettingsError("the run does not fit into memory; give 'out' to write it block by block") from error
        return to_dataset(job.layout, arrays)
    from dh2sim.simulate.store.reader import open_dataset

    with open_run(job, Path(out), resume=resume, overwrite=overwrite) as writer:
        fill(writer, job, threads=threads, advance=advance)
    return open_dataset(Path(out))


def _whole(name: str, value: SupportsIndex) -> int:
    try:
        return operator.index(value)
    except TypeError:
        raise SettingsError(f"--{name} {value!r}: is not a whole number") from None


def open_run(job: Job, path: Path, *, resume: bool = False, overwrite: bool = False) -> RunWriter:
    """Make a run on disk, or open one that is to be carried on with.

    Raises:
        SettingsError: both ``resume`` and ``overwrite`` are given.
        RunError: something else stands there, or it does not fit.
        OutputError: it cannot be written.
    """
    from dh2sim.simulate.store.writer import RunWriter

    if resume and overwrite:
        raise SettingsError("--resume and --overwrite: give one of them, not both")
    if resume:
        return RunWriter.resume(path, job.layout)
    return RunWriter.create(path, job.layout, overwrite=overwrite)


def fill(
    writer: RunWriter,
    job: Job,
    *,
    threads: int = 0,
    advance: Advance | None = None,
    stopping: Callable[[], bool] = lambda: False,
) -> Progress:
    """Simulate every block that a run lacks.

    Args:
        writer: of the run.
        job: what the run was made from.
        threads: 0 for one a processor.
        advance: told how many rollouts are done; those that the run holds already count at once.
        stopping: asked before every block whether to stop there; the block at hand is always finished.

    Raises:
        ControllerError: the controller does what it must not.
        OutputError: a block cannot be written; those before it are safe.
    """
    tell = advance or (lambda _: None)
    pending = writer.pending()
    tell(job.settings.rollouts - sum(len(writer.layout.rollouts(block)) for block in pending))
    done = 0
    begun = time.perf_counter()
    with ThreadPoolExecutor(max_workers=1) as pool:
        written: Future[None] | None = None
        for block in pending:
            if stopping():
                break
            rollouts = writer.layout.rollouts(block)
            started = time.perf_counter()
            arrays = simulate_block(job.mjcf, job.settings, rollouts, threads=threads, advance=tell)
            seconds = time.perf_counter() - started
            if written is not None:
                written.result()
            written = pool.submit(writer.write, block, arrays, seconds)
            del arrays
            done += len(rollouts)
        if written is not None:
            written.result()
    return Progress(
        finished=done == sum(len(writer.layout.rollouts(block)) for block in pending),
        rollouts=done,
        seconds=time.perf_counter() - begun,
    )
