"""Writing a run: make it, continue it or join others that write to it, and commit block after block."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from types import TracebackType
from typing import Any, Final

from numpy.typing import NDArray

from dh2sim.errors import RunDiffersError, RunExistsError, RunOutputError, RunUnreachableError
from dh2sim.simulate.dataset_layout import Layout
from dh2sim.simulate.store.codec import checksum_bytes, encode, encode_text
from dh2sim.simulate.store.compatibility import differences
from dh2sim.simulate.store.directory import RunLock, create_run, is_vacant, lock_run
from dh2sim.simulate.store.local import LocalStore
from dh2sim.simulate.store.manifest import BlockRecord
from dh2sim.simulate.store.metadata import make_metadata
from dh2sim.simulate.store.objects import complete_objects, create_objects
from dh2sim.simulate.store.places import open_store
from dh2sim.simulate.store.reader import StoredRun, open_run
from dh2sim.simulate.store.storage import Place, run_all

_LAST: Final = "status"
"""The variable whose chunk appears last: where a plain reader finds a status, the rest of the block is there."""
_FULL: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class RunWriter:
    """Writes blocks of rollouts to a run, beside any number of others that do so.

    A block is committed whole or not at all, and is safe when ``write`` returns. Nothing that was committed is ever
    removed: chunks are replaced by the same bytes at most, and a record is removed only where the chunks are not
    those that it names.
    """

    layout: Layout
    """Of the run; one that existed keeps its size of blocks and its attributes."""

    def __init__(self, run: StoredRun, layout: Layout, lock: RunLock | None) -> None:
        """Use ``create``, ``resume`` or ``join`` instead."""
        self.layout = layout
        self._run = run
        self._lock = lock
        self._variables = {variable.name: variable for variable in layout.variables}
        self._committed: set[int] = set()

    @classmethod
    def create(cls, path: Place, layout: Layout, *, overwrite: bool = False, alone: bool = True) -> RunWriter:
        """Make a new run.

        Args:
            path: Its folder, or its place in an object store; missing folders above it are made.
            layout: What it will contain.
            overwrite: Whether an existing run is replaced; it is deleted when the new one is in place.
            alone: Whether to keep out others who resume it; who joins it is never kept out.

        Raises:
            RunExistsError: There is something at the path.
            RunBusyError: Another process is writing to the run that is to be replaced.
            RunError: A block is too large.
            RunOutputError: The run cannot be written; nothing was changed.
        """
        store, files = open_store(path), make_metadata(layout)
        lock: RunLock | None = None
        if isinstance(store, LocalStore):
            lock = create_run(store.path, files, overwrite=overwrite, alone=alone)
        else:
            create_objects(store, files, overwrite=overwrite)
        try:
            return cls(open_run(path), layout, lock)
        except BaseException:
            if lock is not None:
                lock.release()
            raise

    @classmethod
    def resume(cls, path: Place, layout: Layout) -> RunWriter:
        """Open a run to compute the blocks that are missing or damaged, or make it if there is none.

        Every chunk is read. Others may join it meanwhile, but not resume it as well.

        Raises:
            RunDiffersError: The run has other settings.
            RunDamagedError: Its metadata are damaged.
            RunBusyError: Another process is writing to it.
            RunError: It is not a run, or cannot be read.
            RunOutputError: It cannot be written.
        """
        if _is_vacant(path):
            return cls.create(path, layout)
        writer = cls._open(path, layout, alone=True)
        try:
            writer._run.check_array_metadata()
            writer._run.check_coordinates()
            writer._find_committed()
        except BaseException:
            writer.close()
            raise
        return writer

    @classmethod
    def join(cls, path: Place, layout: Layout, *, create: bool = True) -> RunWriter:
        """Open a run that others may be writing to, trusting the records of the blocks that are committed.

        Little is read, whatever the size of the run.

        Args:
            path: Its place.
            layout: What it contains.
            create: Whether to make the run if there is none.

        Raises:
            RunDiffersError: The run has other settings.
            RunDamagedError: Its metadata are damaged.
            RunError: It is not a run, or cannot be read.
            RunOutputError: It cannot be written.
        """
        if create and _is_vacant(path):
            with suppress(RunExistsError):  # another process was quicker
                return cls.create(path, layout, alone=False)
        return cls._open(path, layout, alone=False)

    @classmethod
    def _open(cls, path: Place, layout: Layout, *, alone: bool) -> RunWriter:
        store, lock = open_store(path), None
        if isinstance(store, LocalStore):
            lock = lock_run(store.path, alone=alone)
        try:
            if not isinstance(store, LocalStore):
                complete_objects(store, layout)
            run = open_run(path)
            changes = differences(run.manifest, layout)
            if changes:
                raise RunDiffersError(
                    f"'{store.name}' was made with other settings: {'; '.join(changes)}. "
                    "Use the same options, or choose another folder"
                )
            return cls(run, replace(layout, attributes=run.manifest.attributes, block=run.manifest.block), lock)
        except BaseException:
            if lock is not None:
                lock.release()
            raise

    @property
    def digest(self) -> str:
        """Of the run's manifest; another run has another one."""
        return self._run.manifest.digest

    @property
    def place(self) -> str:
        """Where the run is, from whatever folder one looks."""
        store = self._run.store
        return os.path.abspath(store.path) if isinstance(store, LocalStore) else store.name

    def pending(self, blocks: Iterable[int] | None = None) -> tuple[int, ...]:
        """Return the blocks, of all or of some, that are not committed, or were found damaged by ``resume``.

        Raises:
            RunError: The run cannot be read.
            RunOutputError: Its server does not answer.
        """
        wanted = range(self.layout.blocks) if blocks is None else list(blocks)
        unknown = [block for block in wanted if block not in self._committed]
        try:
            self._committed.update(self._run.records(unknown))
        except RunUnreachableError as error:
            raise self._unreachable(error) from error
        return tuple(block for block in wanted if block not in self._committed)

    def write(self, block: int, arrays: Mapping[str, NDArray[Any]], seconds: float) -> None:
        """Commit a block: its chunks first, then the record that makes them count.

        Nothing is written if another process has committed it.

        Args:
            block: Its number.
            arrays: Every variable of the layout, for the rollouts of the block.
            seconds: Wall time that the block took.

        Raises:
            RunOutputError: The block cannot be written; blocks that were committed before are safe.
            RunDiffersError: Another process has committed other numbers meanwhile, or replaced the run.
        """
        self._check(block, arrays)
        try:
            self._write(block, arrays, seconds)
        except RunUnreachableError as error:
            raise self._unreachable(error) from error
        except OSError as error:
            raise self._cannot_write(error) from error
        self._committed.add(block)

    def close(self) -> None:
        """Release the locks."""
        if self._lock is not None:
            self._lock.release()

    def __enter__(self) -> RunWriter:
        """Return the writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Release the locks."""
        self.close()

    def _write(self, block: int, arrays: Mapping[str, NDArray[Any]], seconds: float) -> None:
        """Write the files of a block; each is safe before its record is written."""
        names = [name for name, stored in self._run.manifest.variables.items() if not stored.empty]
        names.sort(key=lambda name: name == _LAST)

        def encoded(name: str) -> tuple[bytes, int]:
            variable = self._variables[name]
            return encode(arrays[name], dtype=variable.dtype, length=self.layout.block, fill=variable.fill)

        made = dict(zip(names, run_all(encoded, names), strict=True))
        checksums = {name: checksum for name, (_, checksum) in made.items()}
        record = BlockRecord(block=block, run=self._run.manifest.digest, seconds=float(seconds), checksums=checksums)
        self._run.check_unchanged()
        if not self.pending([block]):
            return
        self._run.store.put(
            {self._run.chunk(name, block): (data, checksum_bytes(number)) for name, (data, number) in made.items()}
        )
        file, data = self._run.record_file(block), encode_text(record.to_text())
        if not self._run.store.put_new(file, data):
            other = self._run.record(block)
            if other is None:  # damaged
                self._run.store.put({file: (data,)})
            elif other.checksums != checksums:
                raise RunDiffersError(
                    f"block {block} of '{self._run.store.name}' was committed by another process with other numbers: "
                    "the controller is not a function of its rollout, or the machines differ. Resume the run on one "
                    "of them"
                )

    def _find_committed(self) -> None:
        """Read every chunk, and remove the records that name others, and what dead processes left."""
        blocks = range(self.layout.blocks)
        verified = self._run.verified(blocks)
        self._committed.update(verified)
        with suppress(OSError, ValueError):
            for block in {*self._run.recorded_blocks()} - {*verified}:
                self._run.store.delete(self._run.record_file(block))
        if isinstance(self._run.store, LocalStore):
            self._run.store.remove_partials()

    def _check(self, block: int, arrays: Mapping[str, NDArray[Any]]) -> None:
        length = len(self.layout.rollouts(block))
        for variable in self.layout.variables:
            shape, expected = arrays[variable.name].shape, (length, *self.layout.shape(variable)[1:])
            if shape != expected:
                raise ValueError(f"'{variable.name}' must have the shape {expected}, got {shape}")

    def _cannot_write(self, error: OSError) -> RunOutputError:
        problem = f"cannot write to '{self._run.store.name}': {error.strerror or error}"
        try:
            blocks = self._run.recorded_blocks()
        except RunUnreachableError:
            return self._unreachable(problem)
        except (OSError, ValueError):
            blocks = list(self._committed)
        advice = "Make room, then resume" if error.errno in _FULL else "Resume when it can be written to"
        return RunOutputError(f"{problem}; {self._safe(blocks)} are safe. {advice}")

    def _unreachable(self, problem: object) -> RunOutputError:
        """Return the error for a server that does not answer; nor is it asked what others have committed."""
        safe = f"at least {self._safe(self._committed)} are" if self._committed else "what was committed is"
        return RunOutputError(f"{problem}; {safe} safe. Resume when it answers")

    def _safe(self, blocks: Iterable[int]) -> str:
        count = sum(len(self.layout.rollouts(block)) for block in blocks)
        return f"{count} of {self.layout.sizes['rollout']} rollouts"


def _is_vacant(path: Place) -> bool:
    """Return whether a run can be made at a place without a loss."""
    store = open_store(path)
    return is_vacant(store.path) if isinstance(store, LocalStore) else not store.exists()
