"""Writing a run: make or resume it, lock it, and commit block after block."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Executor, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Final, TypeVar

from numpy.typing import NDArray

from dh2sim.errors import RunDiffersError, RunOutputError
from dh2sim.files import PARTIAL, partial_path, write_file
from dh2sim.locks import FolderLock
from dh2sim.simulate.dataset_layout import Layout
from dh2sim.simulate.store.codec import checksum_bytes, encode, encode_text
from dh2sim.simulate.store.compatibility import differences
from dh2sim.simulate.store.directory import create_run, is_vacant, lock_run
from dh2sim.simulate.store.manifest import BlockRecord
from dh2sim.simulate.store.metadata import make_metadata
from dh2sim.simulate.store.reader import StoredRun, open_run

_LAST: Final = "status"
"""The variable whose chunk is written last: where a plain reader finds a status, the rest of the block is there."""
_MOST_THREADS: Final = 4
_FULL: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)

_In = TypeVar("_In")
_Out = TypeVar("_Out")


class RunWriter:
    """Writes blocks of rollouts to a run on disk, and holds an exclusive lock on it until closed.

    A block is committed whole or not at all, and is on the disk when ``write`` returns.
    """

    layout: Layout
    """Of the run; a resumed one keeps its size of blocks and its attributes."""

    def __init__(self, run: StoredRun, layout: Layout, lock: FolderLock) -> None:
        """Use ``create`` or ``resume`` instead."""
        self.layout = layout
        self._run = run
        self._lock = lock
        self._variables = {variable.name: variable for variable in layout.variables}
        self._pool = ThreadPoolExecutor(min(_MOST_THREADS, os.cpu_count() or 1), thread_name_prefix="run-writer")
        self._committed: set[int] = set()

    @classmethod
    def create(cls, path: Path, layout: Layout, *, overwrite: bool = False) -> RunWriter:
        """Make a new run.

        Args:
            path: Its folder; missing folders above it are made.
            layout: What it will contain.
            overwrite: Whether an existing run is replaced; it is deleted when the new one is in place.

        Raises:
            RunExistsError: There is something at the path.
            RunBusyError: Another process is writing to the run that is to be replaced.
            RunError: A block is too large.
            RunOutputError: The run cannot be written; nothing was changed.
        """
        path = Path(path)
        lock = create_run(path, make_metadata(layout), overwrite=overwrite)
        try:
            return cls(open_run(path), layout, lock)
        except BaseException:
            lock.release()
            raise

    @classmethod
    def resume(cls, path: Path, layout: Layout) -> RunWriter:
        """Open a run to compute the blocks that are missing or damaged, or make it if there is none.

        Every chunk is read.

        Raises:
            RunDiffersError: The run has other settings.
            RunDamagedError: Its metadata are damaged.
            RunBusyError: Another process is writing to it.
            RunError: It is not a run, or cannot be read.
            RunOutputError: It cannot be written.
        """
        path = Path(path)
        if is_vacant(path):
            return cls.create(path, layout)
        lock = lock_run(path)
        try:
            run = open_run(path)
            changes = differences(run.manifest, layout)
            if changes:
                raise RunDiffersError(
                    f"'{path}' was made with other settings: {'; '.join(changes)}. "
                    "Use the same options, or choose another folder"
                )
            run.check_array_metadata()
            run.check_coordinates()
            writer = cls(run, replace(layout, attributes=run.manifest.attributes, block=run.manifest.block), lock)
        except BaseException:
            lock.release()
            raise
        try:
            writer._find_committed()
        except BaseException:
            writer.close()
            raise
        return writer

    def pending(self) -> tuple[int, ...]:
        """Return the blocks that are not committed, or were found damaged when the run was opened."""
        return tuple(block for block in range(self.layout.blocks) if block not in self._committed)

    def write(self, block: int, arrays: Mapping[str, NDArray[Any]], seconds: float) -> None:
        """Commit a block: its chunks first, then the record that makes them count.

        Args:
            block: Its number.
            arrays: Every variable of the layout, for the rollouts of the block.
            seconds: Wall time that the block took.

        Raises:
            RunOutputError: The block cannot be written; blocks that were committed before are safe.
        """
        self._check(block, arrays)
        self._committed.discard(block)
        try:
            self._write(block, arrays, seconds)
        except BaseException as error:
            self._discard(block)
            if isinstance(error, OSError):
                raise self._cannot_write(error) from error
            raise
        self._committed.add(block)

    def close(self) -> None:
        """Release the lock."""
        self._pool.shutdown()
        self._lock.release()

    def __enter__(self) -> RunWriter:
        """Return the writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Release the lock."""
        self.close()

    def _write(self, block: int, arrays: Mapping[str, NDArray[Any]], seconds: float) -> None:
        """Write the files of a block; each step is on the disk before the next one begins."""

        def write_chunk(name: str) -> int:
            variable = self._variables[name]
            data, checksum = encode(arrays[name], dtype=variable.dtype, length=self.layout.block, fill=variable.fill)
            write_file(self._run.chunk(name, block), data, checksum_bytes(checksum))
            return checksum

        names = [name for name, stored in self._run.manifest.variables.items() if not stored.empty]
        checksums: dict[str, int] = {}
        for step in ([name for name in names if name != _LAST], [name for name in names if name == _LAST]):
            checksums |= zip(step, _run_all(self._pool, write_chunk, step), strict=True)
        record = BlockRecord(block=block, run=self._run.manifest.digest, seconds=float(seconds), checksums=checksums)
        write_file(self._run.record_file(block), encode_text(record.to_text()))

    def _discard(self, block: int) -> None:
        """Remove the files of a block that is not committed, as far as possible; the record first."""
        chunks = [self._run.chunk(name, block) for name in self._variables]
        for path in (self._run.record_file(block), *chunks):
            _remove(path)
            _remove(partial_path(path))

    def _find_committed(self) -> None:
        """Read every chunk, and remove what does not belong to a committed block."""
        blocks = range(self.layout.blocks)
        records = _run_all(self._pool, self._run.verified, blocks)
        self._committed.update(block for block in blocks if records[block] is not None)
        for block in self.pending():
            self._discard(block)
        for file in self._run.path.rglob(f".*{PARTIAL}"):
            _remove(file)

    def _check(self, block: int, arrays: Mapping[str, NDArray[Any]]) -> None:
        length = len(self.layout.rollouts(block))
        for variable in self.layout.variables:
            shape, expected = arrays[variable.name].shape, (length, *self.layout.shape(variable)[1:])
            if shape != expected:
                raise ValueError(f"'{variable.name}' must have the shape {expected}, got {shape}")

    def _cannot_write(self, error: OSError) -> RunOutputError:
        safe = sum(len(self.layout.rollouts(block)) for block in self._committed)
        advice = "Make room, then resume" if error.errno in _FULL else "Resume when it can be written to"
        return RunOutputError(
            f"cannot write to '{self._run.path}': {error.strerror or error}; {safe} of "
            f"{self.layout.sizes['rollout']} rollouts are safe. {advice}"
        )


def _remove(file: Path) -> None:
    with suppress(OSError):
        file.unlink()


def _run_all(pool: Executor, function: Callable[[_In], _Out], items: Iterable[_In]) -> list[_Out]:
    """Call a function for each item and return the results; an error is raised when all calls have ended."""
    futures = [pool.submit(function, item) for item in items]
    try:
        wait(futures)
    except BaseException:  # a signal
        for future in futures:
            future.cancel()
        wait(futures)
        raise
    return [future.result() for future in futures]
