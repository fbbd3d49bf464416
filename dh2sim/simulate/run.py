"""Runs in memory and on disk; on disk each block is written while the next one is simulated."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from dh2sim.errors import SettingsError
from dh2sim.extras import require_extra
from dh2sim.kinematics.chain import spec_of
from dh2sim.model.build import ModelLike, model_of
from dh2sim.model.mechanism import MechanismModel, build_mechanism
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.read import load_robot
from dh2sim.simulate.block import Block, Job, simulate_block
from dh2sim.simulate.dataset_layout import Layout
from dh2sim.simulate.options import RolloutKeywords, RolloutOptions
from dh2sim.simulate.prepare import prepare

if TYPE_CHECKING:
    import xarray as xr

    from dh2sim.simulate.store.writer import RunWriter


def to_dataset(layout: Layout, arrays: Block) -> xr.Dataset:
    """Return a whole run as a dataset, equal to one that was written and opened."""
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
"""Called with the number of rollouts that are done since the last call."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far a run has come."""

    finished: bool
    """Whether all blocks are written; False if the run was stopped before."""
    rollouts: int
    """Number of rollouts simulated and written this time."""
    seconds: float
    """Wall time, from the start of the first block until the last was written."""


def rollout(
    robot: ModelLike | MechanismModel | str | PathLike[str],
    *,
    out: str | PathLike[str] | None = None,
    threads: int = 0,
    resume: bool = False,
    overwrite: bool = False,
    advance: Advance | None = None,
    **options: Unpack[RolloutKeywords],
) -> xr.Dataset:
    """Simulate many rollouts of a robot.

    Args:
        robot: The robot, or its file or name.
        out: Folder to write the run to, by convention named ``….zarr``; None to keep it in memory.
        threads: Number of threads, 0 for one a processor. The result does not depend on it.
        resume: Whether to continue the run at ``out``, if there is one.
        overwrite: Whether to replace the run at ``out``.
        advance: Called with the number of rollouts that are done since the last call.
        **options: What is simulated and recorded, the fields of ``RolloutOptions``: ``rollouts`` (256), ``steps`` or
            ``duration`` (2 s), ``timestep`` (0.002 s), ``integrator``, ``controller`` ('sine'), ``start`` ('home'),
            ``seed`` (0), ``record``, ``every`` (1), ``randomize``, ``floating_base``.

    Returns:
        The dataset, as ``docs/dataset.md`` describes it; read lazily from ``out`` if that is given.

    Raises:
        SettingsError: Options are wrong, or do not fit the robot.
        ControllerError: The controller fails.
        RunExistsError: There is something at ``out``, and neither ``resume`` nor ``overwrite`` is given.
        RunDiffersError: The run to be resumed has other options.
        OutputError: The run cannot be written; what was written before is safe.
        MissingExtraError: xarray is not installed.
    """
    require_extra("data", "xarray", what="a run as an xarray dataset")
    checked = RolloutOptions(**options)
    job = prepare(_model_of(robot), checked)
    if out is None:
        try:
            arrays = simulate_block(job, range(job.options.rollouts), threads=threads, advance=advance)
        except MemoryError as error:
            raise SettingsError(
                [("", "the run does not fit into memory; give 'out' to write it block by block")]
            ) from error
        return to_dataset(job.layout, arrays)
    from dh2sim.simulate.store.reader import open_dataset

    with open_run(job, Path(out), resume=resume, overwrite=overwrite) as writer:
        fill(writer, job, threads=threads, advance=advance)
    return open_dataset(Path(out))


def _model_of(robot: ModelLike | MechanismModel | str | PathLike[str]) -> RobotModel | MechanismModel:
    if isinstance(robot, MechanismModel):
        return robot
    given = load_robot(robot) if isinstance(robot, str | PathLike) else robot
    spec = spec_of(given)
    return build_mechanism(spec) if spec.is_mechanism else model_of(given)


def open_run(job: Job, path: Path, *, resume: bool = False, overwrite: bool = False) -> RunWriter:
    """Create a run on disk, or open one to continue it.

    Raises:
        SettingsError: Both ``resume`` and ``overwrite`` are given.
        RunError: There is something else, or a run with other options.
        OutputError: It cannot be written.
    """
    from dh2sim.simulate.store.writer import RunWriter

    if resume and overwrite:
        raise SettingsError([("resume", "must not be given together with overwrite")])
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
    """Simulate every block that is missing from a run.

    Args:
        writer: Writes to the run.
        job: The run.
        threads: Number of threads, 0 for one a processor.
        advance: Called with the number of rollouts that are done; those of an earlier run count at once.
        stopping: Called before every block; the run stops there if it returns True.

    Raises:
        ControllerError: The controller fails.
        OutputError: A block cannot be written; those before it are safe.
    """
    report = advance or (lambda _: None)
    pending = writer.pending()
    report(job.options.rollouts - sum(len(writer.layout.rollouts(block)) for block in pending))
    done = 0
    start = time.perf_counter()
    with ThreadPoolExecutor(max_workers=1) as pool:
        written: Future[None] | None = None
        for block in pending:
            if stopping():
                break
            rollouts = writer.layout.rollouts(block)
            started = time.perf_counter()
            arrays = simulate_block(job, rollouts, threads=threads, advance=report)
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
        seconds=time.perf_counter() - start,
    )
