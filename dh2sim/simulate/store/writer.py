"""The one who writes to a run: makes or resumes it, locks it, and commits block after block."""

from __future__ import annotations

import errno
import os
from collections.abc import Mapping
from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import Any, Final

from numpy.typing import NDArray

from dh2sim.errors import RunError, RunOutputError
from dh2sim.simulate.dataset_layout import Layout
from dh2sim.simulate.store.blocks import Blocks
from dh2sim.simulate.store.files import all_of, unlock
from dh2sim.simulate.store.place import is_vacant, lock_run, make_run
from dh2sim.simulate.store.recover import adopt, mend
from dh2sim.simulate.store.seal import make_seal
from dh2sim.simulate.store.skeleton import make_skeleton

_MOST_THREADS: Final = 4
_FULL: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class RunWriter:
    """Writes blocks of rollouts to a run on disk; holds an exclusive lock on it until closed.

    A block is committed whole or not at all, and is on the disk when ``write`` returns.
    """

    layout: Layout
    """That of the run; a resumed one keeps its size of blocks and its attributes."""

    def __init__(self, path: Path, layout: Layout, *, lock: int | None, pool: Executor) -> None:
        """Not to be called from outside; ``create`` and ``resume`` are."""
        self.layout = layout
        self._path = path
        self._lock = lock
        self._pool = pool
        self._blocks = Blocks(path=path, seal=make_seal(layout, layout.attributes))
        self._committed: set[int] = set()

    @classmethod
    def create(cls, path: Path, layout: Layout, *, overwrite: bool = False) -> RunWriter:
        """Make a new run.

        Args:
            path: the run's folder; folders above it are made.
            layout: what it will hold.
            overwrite: whether it replaces a run that stands there, which is deleted when the new one stands.

        Raises:
            RunExistsError: something stands there already.
            RunBusyError: another process is writing to the run that stands there.
            RunError: a block is too large.
            RunOutputError: it cannot be written; nothing was changed.
        """
        path, pool = Path(path), _pool()
        try:
            lock = make_run(path, make_skeleton(layout), pool, overwrite=overwrite)
            return cls(path, layout, lock=lock, pool=pool)
        except BaseException:
            pool.shutdown()
            raise

    @classmethod
    def resume(cls, path: Path, layout: Layout) -> RunWriter:
        """Carry on with a run, having read all of it and mended its metadata; or make it, if there is none.

        Raises:
            RunDiffersError: the run was made with other settings.
            RunDamagedError: its attributes cannot be read.
            RunBusyError: another process is writing to it.
            RunError: what stands there is no run, or cannot be read.
            RunOutputError: it cannot be written.
        """
        path = Path(path)
        if is_vacant(Path(os.path.realpath(path))):
            return cls.create(path, layout)
        try:
            lock = lock_run(path)
        except OSError as error:
            raise RunError(f"cannot read '{path}': {error.strerror or error}") from error
        pool = _pool()
        try:
            writer = cls(path, adopt(path, layout), lock=lock, pool=pool)
            writer._recover()
        except BaseException:
            pool.shutdown()
            unlock(lock)
            raise
        return writer

    def pending(self) -> tuple[int, ...]:
        """Return the blocks that are not committed, or were found damaged when the run was opened."""
        return tuple(block for block in range(self.layout.blocks) if block not in self._committed)

    def write(self, block: int, arrays: Mapping[str, NDArray[Any]], seconds: float) -> None:
        """Commit a block, whole or not at all.

        Args:
            block: its number.
            arrays: every variable of the layout, for the block's rollouts.
            seconds: how long the block took.

        Raises:
            RunOutputError: it cannot be written; what was committed before is safe.
        """
        self._check(block, arrays)
        self._committed.discard(block)
        try:
            self._blocks.write(self.layout, block, arrays, seconds, self._pool)
        except OSError as error:
            raise self._cannot_write(error) from error
        self._committed.add(block)

    def close(self) -> None:
        """Give back the lock."""
        self._pool.shutdown()
        unlock(self._lock)
        self._lock = None

    def __enter__(self) -> RunWriter:
        """Return the writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give back the lock."""
        self.close()

    def _recover(self) -> None:
        """Read every chunk, and mend what does not depend on the simulation."""
        blocks = range(self.layout.blocks)
        sound = all_of(self._pool, self._blocks.sound, blocks)
        self._committed.update(block for block in blocks if sound[block])
        try:
            mend(self._path, make_skeleton(self.layout))
            for block in blocks:
                if block not in self._committed:
                    self._blocks.discard(block)
                elif self._blocks.seconds(block) is None:
                    self._blocks.forget_seconds(block)
        except OSError as error:
            raise self._cannot_write(error) from error

    def _check(self, block: int, arrays: Mapping[str, NDArray[Any]]) -> None:
        length = len(self.layout.rollouts(block))
        for variable in self.layout.variables:
            shape = (length, *self.layout.shape(variable)[1:])
            if arrays[variable.name].shape != shape:
                raise ValueError(f"'{variable.name}' has shape {arrays[variable.name].shape}, and not {shape}")

    def _cannot_write(self, error: OSError) -> RunOutputError:
        safe = sum(len(self.layout.rollouts(block)) for block in self._committed)
        advice = "Make room, then carry on" if error.errno in _FULL else "Mend that, then carry on"
        return RunOutputError(
            f"cannot write to '{self._path}': {error.strerror or error}; {safe} of {self.layout.sizes['rollout']} "
            f"rollouts are safe. {advice} with --resume"
        )


def _pool() -> Executor:
    return ThreadPoolExecutor(min(_MOST_THREADS, os.cpu_count() or 1), thread_name_prefix="run-writer")
