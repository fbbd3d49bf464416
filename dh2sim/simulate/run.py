"""Runs in memory and in stores, where each block is written while the next one is simulated."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from os import PathLike
from typing import TYPE_CHECKING, Any, Final, Unpack

import numpy as np

from dh2sim.arguments import flag, whole_numbers
from dh2sim.errors import SettingsError
from dh2sim.extras import require_extra
from dh2sim.model.mechanism import written_model
from dh2sim.robot.read import loaded
from dh2sim.robot.spec import SpecLike
from dh2sim.simulate.block import Block, Job, simulate_block
from dh2sim.simulate.dataset_layout import Layout
from dh2sim.simulate.options import WARP, RolloutKeywords
from dh2sim.simulate.prepare import options_for, prepare

if TYPE_CHECKING:
    import xarray as xr
    from distributed import Client

    from dh2sim.simulate.store.storage import Place
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
    """Whether all blocks that were asked for are written; False if the run was stopped before."""
    rollouts: int
    """Number of rollouts simulated and written this time."""
    seconds: float
    """Wall time, from the start of the first block until the last was written."""


def rollout(
    robot: SpecLike | str | PathLike[str],
    *,
    out: str | PathLike[str] | None = None,
    threads: int = 0,
    resume: bool = False,
    overwrite: bool = False,
    share: tuple[int, int] | None = None,
    blocks: Sequence[int] | None = None,
    block_size: int | None = None,
    executor: Executor | Client | str | None = None,
    advance: Advance | None = None,
    **options: Unpack[RolloutKeywords],
) -> xr.Dataset:
    """Simulate many rollouts of a robot.

    Args:
        robot: The robot, or its file or name.
        out: Folder to write the run to, by convention named ``….zarr``, or ``s3://BUCKET/NAME.zarr``; None to keep
            it in memory.
        threads: Number of threads; 0: one for each processor of this process. The result does not depend on it.
        resume: Whether to continue the run at ``out``, if there is one.
        overwrite: Whether to replace the run at ``out``.
        share: ``(i, n)``: simulate only the i-th of n shares of the run's blocks, i from 1 to n, beside any number of
            other processes that do so with the same options. Who comes first makes the run.
        blocks: The same for these blocks, from 0.
        block_size: Rollouts in a block, which is written as a whole; by default some seconds' work, at most 64 MB.
            A run that exists keeps its own.
        executor: Simulates the blocks instead of this process: an executor of ``concurrent.futures``, a client of
            Dask, 'local', 'local:N' or 'dask://HOST:PORT'. Its workers must see ``out``; without it they send back
            what they simulated. ``threads`` is the number in each task then, 0 for one.
        advance: Called with the number of rollouts that are done since the last call.
        **options: What is simulated and recorded, the fields of ``RolloutOptions``: ``rollouts`` (256), ``steps`` or
            ``duration`` (2 s), ``timestep`` (0.002 s), ``integrator``, ``controller`` ('sine'), ``start`` ('home'),
            ``seed`` (0), ``record``, ``every`` (1), ``randomize``, ``floating_base``, ``vary``, ``designs``,
            ``per_design`` (1), ``engine`` ('mujoco').

    Returns:
        The dataset, as ``docs/dataset.md`` describes it; read lazily from ``out`` if that is given.

    Raises:
        SettingsError: Options are wrong, or do not fit the robot.
        ControllerError: The controller fails.
        RunExistsError: There is something at ``out``, and neither ``resume`` nor ``overwrite`` is given.
        RunDiffersError: The run to be resumed has other options.
        OutputError: The run cannot be written; what was written before is safe.
        ExecutorError: The executor fails, or its workers do.
        MissingExtraError: xarray is not installed, or what a place or an executor needs.
    """
    require_extra("data", "xarray", what="a run as an xarray dataset")
    if blocks is not None:
        blocks = whole_numbers("blocks", blocks)
    model = written_model(loaded(robot))
    job = with_block_size(prepare(model, options_for(model, **options)), block_size)
    if out is None:
        if share is not None or blocks is not None:
            raise SettingsError([("share" if blocks is None else "blocks", "must be given together with out")])
        try:
            arrays = _in_memory(job, threads=threads, executor=executor, advance=advance)
        except MemoryError as error:
            raise SettingsError(
                [("", "the run does not fit into memory; give 'out' to write it block by block")]
            ) from error
        return to_dataset(job.layout, arrays)
    from dh2sim.simulate.store.reader import open_dataset

    check_share(share, alone=blocks is None)
    part = share is not None or blocks is not None
    with (
        workers_of(executor, job) as workers,
        open_run(job, out, resume=resume, overwrite=overwrite, join=part) as writer,
    ):
        chosen = choose_blocks(writer.layout.blocks, share=share, blocks=blocks)
        fill(writer, job, blocks=chosen, threads=threads, workers=workers, advance=advance)
    return open_dataset(out)


_ONE_PROCESS: Final = (
    "its numbers differ in last bits from one time to the next, so that one process must make them all"
)


def workers_of(executor: Executor | Client | str | None, job: Job) -> AbstractContextManager[Executor | None]:
    """Return a context with what simulates a job's blocks in place of this process; with None if nothing is to.

    Raises:
        SettingsError: One process must simulate them.

    Raises, when it is entered:
        SettingsError: It is none of what ``rollout`` takes.
        ExecutorError: It cannot be reached.
        MissingExtraError: Dask is not installed.
    """
    if executor is None:
        return nullcontext()
    if job.options.engine == WARP:
        raise SettingsError([("engine", f"must not be '{WARP}' together with executor: {_ONE_PROCESS}")])
    from dh2sim.simulate.cluster import opened

    return opened(executor)


def _in_memory(job: Job, *, threads: int, executor: Executor | Client | str | None, advance: Advance | None) -> Block:
    with workers_of(executor, job) as workers:
        if workers is None:
            return simulate_block(job, range(job.options.rollouts), threads=threads, advance=advance)
        from dh2sim.simulate.cluster import simulate_on

        return simulate_on(workers, job, threads=threads, done=advance or _no_report)


def _no_report(_rollouts: int) -> None:
    pass


def with_block_size(job: Job, block_size: int | None) -> Job:
    """Return a job with other blocks, which do not change its numbers; None: with the same.

    Raises:
        SettingsError: Blocks would be empty, or too large to be kept in memory.
    """
    if block_size is None:
        return job
    most = job.layout.block
    if isinstance(block_size, bool) or not isinstance(block_size, int) or not 1 <= block_size <= most:
        problem = f"must be a whole number from 1 to {most:,} (some seconds' work, or 64 MB), got {block_size!r}"
        raise SettingsError([("block_size", problem)])
    return replace(job, layout=replace(job.layout, block=block_size))


def check_share(share: tuple[int, int] | None, *, alone: bool) -> None:
    """Check that there is such a share, before a run is made.

    Args:
        share: ``(i, n)``, or None.
        alone: Whether no blocks are named besides.

    Raises:
        SettingsError: There is none, or blocks are named as well.
    """
    if share is None:
        return
    if not alone:
        raise SettingsError([("share", "must not be given together with blocks")])
    index, shares = whole_numbers("share", share, count=2)
    if not 1 <= index <= shares:
        allowed = "1/1" if shares <= 1 else f"one of 1/{shares} to {shares}/{shares}"
        raise SettingsError([("share", f"must be {allowed}, got {index}/{shares}")])


def choose_blocks(
    count: int, *, share: tuple[int, int] | None = None, blocks: Sequence[int] | None = None
) -> Sequence[int]:
    """Return the blocks of a share of a run of ``count`` blocks, those that are named, or all.

    Raises:
        SettingsError: Both are given, there is no such share, or the run has no such block.
    """
    check_share(share, alone=blocks is None)
    if share is not None:
        return range(share[0] - 1, count, share[1])
    if blocks is None:
        return range(count)
    wrong = [block for block in blocks if not 0 <= block < count]
    if wrong:
        allowed = f"from 0 to {count - 1}" if count > 1 else "0, the only block of this run"
        raise SettingsError([("blocks", f"must be {allowed}, got {wrong[0]}")])
    return blocks


def open_run(
    job: Job, path: Place, *, resume: bool = False, overwrite: bool = False, join: bool = False
) -> RunWriter:
    """Create a run, open one to continue it, or join others that write to it.

    Args:
        job: The run.
        path: Its folder, or its place in an object store.
        resume: Whether to continue it, every block verified.
        overwrite: Whether to replace it.
        join: Whether to write to it beside others, who may have made it.

    Raises:
        ArgumentError: An argument is of a wrong kind.
        SettingsError: Options are given that exclude each other.
        RunError: There is something else, or a run with other options.
        OutputError: It cannot be written.
    """
    from dh2sim.simulate.store.writer import RunWriter

    resume, overwrite = flag("resume", resume), flag("overwrite", overwrite)
    if resume and overwrite:
        raise SettingsError([("resume", "must not be given together with overwrite")])
    if join and overwrite:
        problem = "must not be given with a part of the blocks: each part would remove what the others have written"
        raise SettingsError([("overwrite", problem)])
    if join and job.options.engine == WARP:
        raise SettingsError([("engine", f"must not be '{WARP}' together with share or blocks: {_ONE_PROCESS}")])
    if join:
        return RunWriter.join(path, job.layout)
    if resume:
        return RunWriter.resume(path, job.layout)
    return RunWriter.create(path, job.layout, overwrite=overwrite)


def fill(
    writer: RunWriter,
    job: Job,
    *,
    blocks: Sequence[int] | None = None,
    threads: int = 0,
    workers: Executor | None = None,
    advance: Advance | None = None,
    stopping: Callable[[], bool] = lambda: False,
) -> Progress:
    """Simulate every block that is missing from a run, or from some of its blocks.

    Args:
        writer: Writes to the run.
        job: The run.
        blocks: Those to look at; None: all.
        threads: Number of threads; 0: one for each processor.
        workers: Simulate and commit the blocks in place of this process; see ``rollout``.
        advance: Called with the number of rollouts that are done; those of an earlier run count at once.
        stopping: Called before every block; the run stops there if it returns True.

    Raises:
        ControllerError: The controller fails.
        OutputError: A block cannot be written; those before it are safe.
        ExecutorError: The executor fails, or its workers do; what was committed is safe.
    """
    report = advance or _no_report
    chosen = range(writer.layout.blocks) if blocks is None else blocks
    pending = writer.pending(chosen)
    report(sum(len(writer.layout.rollouts(block)) for block in {*chosen} - {*pending}))
    done, finished = 0, True
    start = time.perf_counter()
    if workers is not None:
        from dh2sim.simulate.cluster import fill_on

        def committed(block: int) -> None:
            nonlocal done
            done += len(writer.layout.rollouts(block))
            report(len(writer.layout.rollouts(block)))

        finished = fill_on(workers, writer, job, blocks=pending, threads=threads, done=committed, stopping=stopping)
        return Progress(finished=finished, rollouts=done, seconds=time.perf_counter() - start)
    with ThreadPoolExecutor(max_workers=1) as pool:
        written: Future[None] | None = None
        for block in pending:
            if stopping():
                finished = False
                break
            if written is not None and written.done():
                written.result()  # raises its error before another block is begun
            rollouts = writer.layout.rollouts(block)
            if not writer.pending([block]):  # another process was quicker
                report(len(rollouts))
                continue
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
    return Progress(finished=finished, rollouts=done, seconds=time.perf_counter() - start)
