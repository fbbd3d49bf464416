"""The folder of a run: made beside its place and renamed into it, so that no run is ever seen half made."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from dh2sim.errors import RunBusyError, RunError, RunExistsError, RunOutputError
from dh2sim.files import PARTIAL, make_folders, remove_empty, signals_deferred, sync
from dh2sim.locks import FolderLock, hidden_path, leftovers, lock_folder, make_hidden
from dh2sim.simulate.store.local import LocalStore
from dh2sim.simulate.store.manifest import BLOCKS, is_run
from dh2sim.simulate.store.storage import Store

_OLD: Final = ".old"
"""Suffix of a run that is being replaced."""
_PUTTING_IN_PLACE: Final = 5.0
"""s that whoever wants to write to a run waits for the one who makes it."""
_POLL: Final = 0.02
"""s."""


def is_vacant(path: Path) -> bool:
    """Return whether a run can be made at a path without a loss: there is nothing, or an empty folder."""
    target = Path(os.path.realpath(path))
    if not os.path.lexists(target):
        return True
    try:
        return target.is_dir() and not any(target.iterdir())
    except OSError:
        return False


class RunLock:
    """Locks that a writer of a run holds: one shared by all, and one that others who work alone must not have.

    The first keeps the run from being replaced while anybody writes to it. Where the file system has no locks, all
    are granted.
    """

    def __init__(self, folder: FolderLock, alone: FolderLock | None) -> None:
        """Keep the locks; use ``lock_run`` or ``create_run`` instead."""
        self._locks = [folder] if alone is None else [alone, folder]

    def release(self) -> None:
        """Give them back."""
        for lock in self._locks:
            lock.release()


def lock_run(path: Path, *, alone: bool) -> RunLock:
    """Lock an existing run against being replaced, and if asked to, against others that ask for the same.

    Raises:
        RunBusyError: Another process replaces it, or has it alone.
        RunError: It cannot be opened.
    """
    try:
        folder = _share(path)
        try:
            return RunLock(folder, lock_folder(path / BLOCKS) if alone and (path / BLOCKS).is_dir() else None)
        except BaseException:
            folder.release()
            raise
    except BlockingIOError as error:
        raise _busy(path) from error
    except FileNotFoundError as error:
        raise RunError(f"there is no '{path}'") from error
    except OSError as error:
        raise RunError(f"cannot read '{path}': {error.strerror or error}") from error


def _share(path: Path) -> FolderLock:
    """Take the shared lock on a run; whoever has just made it holds it alone for a moment."""
    end = time.monotonic() + _PUTTING_IN_PLACE
    while True:
        try:
            return lock_folder(path, shared=True)
        except BlockingIOError:
            if time.monotonic() > end:
                raise
            time.sleep(_POLL)


def _busy(path: Path) -> RunBusyError:
    return RunBusyError(f"another process is writing to '{path}'")


def create_run(path: Path, files: Mapping[str, bytes], *, overwrite: bool, alone: bool) -> RunLock:
    """Put a new run in place, whole or not at all, and return its lock.

    Args:
        path: Where to make it; missing folders above it are made.
        files: Its contents, by relative path.
        overwrite: Whether an existing run is replaced. It is moved aside first, and deleted in the end.
        alone: Whether others are kept out who want to write to it alone, too.

    Raises:
        RunExistsError: There is something.
        RunBusyError: Another process is writing to the run that is to be replaced.
        RunOutputError: The run cannot be written; nothing was changed.
    """
    target = Path(os.path.realpath(path))  # a symbolic link stays one
    made: list[Path] = []
    new: tuple[Path, FolderLock] | None = None
    try:
        if not is_vacant(target):
            check_replaceable(LocalStore(path), overwrite=overwrite)
        made = make_folders(target.parent)
        for leftover, lock in leftovers(target, PARTIAL, _OLD):
            shutil.rmtree(leftover, ignore_errors=True)
            lock.release()
        new = make_hidden(target, PARTIAL)
        _write_all(new[0], files)
        inner = FolderLock(new[0] / BLOCKS) if alone else None
        _put_in_place(path, target, new[0], overwrite=overwrite)
        for folder in made:
            sync(folder.parent)
        new[1].share()
        return RunLock(new[1], inner)
    except BaseException as error:
        if new is not None:
            shutil.rmtree(new[0], ignore_errors=True)
            new[1].release()
        remove_empty(made)
        if isinstance(error, OSError):
            raise RunOutputError(
                f"cannot write to '{path}': {error.strerror or error}; nothing was changed"
            ) from error
        raise


def check_replaceable(store: Store, *, overwrite: bool) -> None:
    """Check that what is at a place is a run, and may be replaced.

    Raises:
        RunExistsError: It is not, or may not.
    """
    if not is_run(store):
        raise RunExistsError(f"'{store.name}' is not a run of dh2sim; remove it yourself, or choose another folder")
    if not overwrite:
        raise RunExistsError(f"'{store.name}' already exists; resume it, overwrite it, or choose another folder")


def _write_all(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files by relative path into a folder that nobody else knows, and bring them to the disk."""
    for relative, data in files.items():
        (folder / relative).parent.mkdir(parents=True, exist_ok=True)
        (folder / relative).write_bytes(data)
        sync(folder / relative)
    for inner in {folder, *((folder / relative).parent for relative in files)}:
        sync(inner)


def _put_in_place(path: Path, target: Path, new: Path, *, overwrite: bool) -> None:
    """Rename a new run into place, and delete the run that was there if that is to be replaced."""
    if is_vacant(target) or not overwrite:
        _rename(path, target, new)
        return
    try:
        old, lock = hidden_path(target, _OLD), lock_folder(target)
    except BlockingIOError as error:
        raise _busy(path) from error
    try:
        with signals_deferred():
            os.rename(target, old)
            try:
                _rename(path, target, new)
            except BaseException:
                os.rename(old, target)
                raise
        shutil.rmtree(old, ignore_errors=True)
    finally:
        lock.release()


def _rename(path: Path, target: Path, new: Path) -> None:
    try:
        if os.name == "nt" and target.is_dir():
            target.rmdir()
        os.rename(new, target)
    except OSError as error:
        if isinstance(error, FileExistsError) or not is_vacant(target):
            raise RunExistsError(
                f"'{path}' was made by another process meanwhile; resume it, overwrite it, or choose another folder"
            ) from error
        raise
    sync(target.parent)
