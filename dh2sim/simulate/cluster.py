"""Runs on many processes or machines, by executors of ``concurrent.futures`` or by Dask.

A task is a block of rollouts. Where a run is stored, the worker that simulates a block commits it, and only says so:
the place must be one that all workers see, a folder that they share or an object store. A task that an executor
starts again, because a worker died, finds its block committed or computes the same bits. A run in memory comes back
piece by piece, and needs no such place.
"""

from __future__ import annotations

import functools
import pickle
import signal
import socket
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import replace
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np

from dh2sim.errors import (
    Dh2simError,
    ExecutorError,
    RunDiffersError,
    RunError,
    RunOutputError,
    RunUnreachableError,
    SettingsError,
)
from dh2sim.extras import require_extra
from dh2sim.processors import available_processors, end_with_parent
from dh2sim.progress import Advance
from dh2sim.simulate.block import BATCH_SIZE, Block, Job, simulate_block
from dh2sim.simulate.initial_states import InitialStates
from dh2sim.simulate.store.places import open_store
from dh2sim.simulate.store.writer import RunWriter

if TYPE_CHECKING:
    from distributed import Client

MOST_WAITING: Final = 1024
"""Tasks that an executor is given before it has finished others: they take some 50 kB each."""
_A_MOMENT: Final = 0.2
"""s between two questions whether to stop."""
_HANDED_OVER: Final = 1.0
"""s in which a worker begins the tasks that it was given before anybody knew that one failed."""
_LOCAL: Final = "local"
_DASK: Final = "dask://"
_CONNECT: Final = 5
"""Seconds in which a scheduler must answer."""

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


@contextmanager
def opened(executor: Executor | Client | str) -> Iterator[Executor]:
    """Yield an executor, made if need be, and then closed.

    Args:
        executor: One of ``concurrent.futures``; a client of Dask; 'local' or 'local:N' for processes on this machine,
            one for each processor that this one may use or N; or 'dask://HOST:PORT' for the scheduler there.

    Raises:
        SettingsError: It is none of these.
        ExecutorError: The scheduler cannot be reached.
        MissingExtraError: Dask is not installed.
    """
    if isinstance(executor, Executor):
        yield executor
    elif hasattr(executor, "get_executor"):  # a client of Dask
        yield executor.get_executor(pure=False)
    elif not isinstance(executor, str):
        raise _unknown(executor)
    elif executor.startswith(_DASK):
        with _dask(executor) as client:
            yield client.get_executor(pure=False)
    else:
        with _processes(executor) as pool:
            yield pool


def _unknown(executor: object) -> SettingsError:
    words = "must be 'local', 'local:N', 'dask://HOST:PORT', an executor of concurrent.futures or a client of Dask"
    return SettingsError([("executor", f"{words}, got {executor!r}")])


@contextmanager
def _dask(address: str) -> Iterator[Client]:
    require_extra("cluster", "distributed", what="an executor of Dask")
    from distributed import Client

    try:
        client = Client(f"tcp://{address.removeprefix(_DASK)}", timeout=_CONNECT)
    except (OSError, ValueError) as error:
        raise ExecutorError(f"there is no scheduler of Dask at {address}: {error}") from error
    with client:
        yield client


@contextmanager
def _processes(text: str) -> Iterator[Executor]:
    """Yield a pool of new processes; forked ones would take over threads and locks in whatever state they are."""
    kind, colon, count = text.partition(":")
    if kind != _LOCAL or (colon and not (count.isascii() and count.isdigit() and 1 <= int(count) <= 1024)):
        raise _unknown(text)
    workers = int(count) if colon else available_processors()
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_begin) as pool:
        yield pool


def _begin() -> None:
    """Leave it to the process that has started this one to react to Ctrl-C: blocks in progress are finished."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()


def fill_on(
    executor: Executor,
    writer: RunWriter,
    job: Job,
    *,
    blocks: Sequence[int],
    threads: int,
    done: Advance,
    stopping: Callable[[], bool],
) -> bool:
    """Have the blocks of a stored run simulated and committed; return whether all were, or it was asked to stop.

    Args:
        executor: Starts the tasks.
        writer: Of the run.
        job: The run.
        blocks: Those that are missing.
        threads: Number of threads of each task, 0 for one.
        done: Called with each block that was committed.
        stopping: Whether to start no more tasks.

    Raises:
        ControllerError: The controller fails.
        RunError, OutputError: A worker cannot write to the run.
        ExecutorError: Workers fail otherwise; what was committed is safe.
    """
    sent = _Sent(replace(job, layout=writer.layout))

    def submit(block: int) -> Future[None]:
        rollouts = writer.layout.rollouts(block)
        return executor.submit(
            _commit, sent.common, sent.start(rollouts), writer.place, writer.digest, block, threads or 1
        )

    return _all_done(submit, blocks, lambda block, _: done(block), stopping)


def simulate_on(executor: Executor, job: Job, *, threads: int, done: Advance) -> Block:
    """Return the whole run, simulated by the workers of an executor.

    Args:
        executor: Starts the tasks.
        job: The run.
        threads: Number of threads of each task, 0 for one.
        done: Called with the number of rollouts that came back.

    Raises:
        ControllerError: The controller fails.
        ExecutorError: Workers fail otherwise.
    """
    sent, count = _Sent(job), job.options.rollouts
    size = min(job.layout.block, BATCH_SIZE)
    parts = [range(first, min(first + size, count)) for first in range(0, count, size)]
    whole: dict[str, Any] = {
        variable.name: np.empty(job.layout.shape(variable), dtype=variable.dtype) for variable in job.layout.variables
    }

    def submit(part: range) -> Future[Block]:
        return executor.submit(_simulate, sent.common, sent.start(part), part, threads or 1)

    def keep(part: range, block: Block) -> None:
        for name, values in block.items():
            whole[name][part.start : part.stop] = values
        done(len(part))

    _all_done(submit, parts, keep, lambda: False)
    return whole


def _all_done(
    submit: Callable[[_Item], Future[_Result]],
    items: Sequence[_Item],
    done: Callable[[_Item, _Result], None],
    stopping: Callable[[], bool],
) -> bool:
    """Submit tasks and take their results; those in progress are waited for whatever happens."""
    left, running = list(reversed(items)), dict[Future[_Result], _Item]()
    try:
        while left or running:
            while left and len(running) < MOST_WAITING and not stopping():
                item = left.pop()
                running[submit(item)] = item
            if stopping():
                left += [running.pop(future) for future in list(running) if future.cancel()]
                if not running:
                    break
            for future in wait(running, timeout=_A_MOMENT, return_when=FIRST_COMPLETED).done:
                done(running.pop(future), future.result())
    except Dh2simError:
        raise
    except Exception as error:
        text = str(error).partition("\n")[0]
        raise ExecutorError(
            f"the workers failed: {type(error).__name__}{f': {text}' if text else ''}. What was committed is safe: "
            "resume with the same options"
        ) from error
    finally:
        for future in running:
            future.cancel()
        wait([future for future in running if not future.cancelled()])
    return not left


class _Sent:
    """A job as it is sent to workers: what all tasks have in common, and where the rollouts of each of them start."""

    def __init__(self, job: Job) -> None:
        self._initial = job.initial
        self.common = pickle.dumps(replace(job, initial=job.initial.of(range(0))))

    def start(self, rollouts: range) -> InitialStates:
        """Return what ``initial`` has of some rollouts."""
        return self._initial.of(rollouts)


@functools.lru_cache(maxsize=2)
def _job(common: bytes) -> Job:
    """Return the job of a worker's tasks, which is made from its bytes once."""
    job = pickle.loads(common)  # sent by the process that started this one
    assert isinstance(job, Job)
    return job


def _simulate(common: bytes, initial: InitialStates, rollouts: range, threads: int) -> Block:
    return simulate_block(replace(_job(common), initial=initial), rollouts, threads=threads)


def _commit(common: bytes, initial: InitialStates, place: str, digest: str, block: int, threads: int) -> None:
    """Simulate a block and commit it, unless that was done before, or the worker's last one could not be written."""
    job = _job(common)
    when, failure = _failures.get(place, (0.0, None))
    if failure is not None and time.monotonic() - when < _HANDED_OVER:
        raise failure
    try:
        with _joined(place, job, digest) as writer:
            if writer.pending([block]):
                start = time.perf_counter()
                arrays = simulate_block(replace(job, initial=initial), job.layout.rollouts(block), threads=threads)
                writer.write(block, arrays, time.perf_counter() - start)
    except (RunOutputError, RunUnreachableError) as error:
        reading = isinstance(error, RunUnreachableError)  # before the block was begun
        advice = "; what was committed is safe. Resume when it answers" if reading else ""
        told = RunOutputError(f"{error}{advice}")
        _failures[place] = time.monotonic(), told
        raise told from error


_failures: dict[str, tuple[float, RunOutputError]] = {}
"""When and why this worker could not write to a run, by its place."""


@contextmanager
def _joined(place: str, job: Job, digest: str) -> Iterator[RunWriter]:
    """Open the run of the process that started this one, and no other that may have its name here."""
    if not open_store(place).exists():
        raise RunError(_not_shared(place, "is not there"))
    with RunWriter.join(place, job.layout, create=False) as writer:
        if writer.digest != digest:
            raise RunDiffersError(_not_shared(place, "is another run"))
        yield writer


def _not_shared(place: str, what: str) -> str:
    return (
        f"'{place}' {what} for the worker on {socket.gethostname()}: workers write to a folder that all machines "
        "share, or to an object store"
    )
