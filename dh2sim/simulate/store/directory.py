"""The folder of a run: made beside its place and renamed into it, so that no run is ever seen half made."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from dh2sim.errors import RunBusyError, RunError, RunExistsError, RunOutputError
from dh2sim.files import PARTIAL, make_folders, remove_empty, signals_deferred, sync
from dh2sim.locks import FolderLock, hidden_path, leftovers, lock_folder, make_hidden
from dh2sim.simulate.store.manifest import is_run

_OLD: Final = ".old"
"""Suffix of a run that is being replaced."""


def is_vacant(path: Path) -> bool:
    """Return whether a run can be made at a path without a loss: there is nothing, or an empty folder."""
    target = Path(os.path.realpath(path))
    if not os.path.lexists(target):
        return True
    try:
        return target.is_dir() and not any(target.iterdir())
    except OSError:
        return False


def lock_run(path: Path) -> FolderLock:
    """Lock an existing run against other writers.

    Raises:
        RunBusyError: Another process is writing to it.
        RunError: It cannot be opened.
    """
    try:
        return lock_folder(path)
    except BlockingIOError as error:
        raise RunBusyError(f"another process is writing to '{path}'") from error
    except OSError as error:
        raise RunError(f"cannot read '{path}': {error.strerror or error}") from error


def create_run(path: Path, files: Mapping[str, bytes], *, overwrite: bool) -> FolderLock:
    """Put a new run in place, whole or not at all, and return its lock.

    Args:
        path: Where to make it; missing folders above it are made.
        files: Its contents, by relative path.
        overwrite: Whether an existing run is replaced. It is moved aside first, and deleted in the end.

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
            _check_replaceable(path, overwrite=overwrite)
        made = make_folders(target.parent)
        for leftover, lock in leftovers(target, PARTIAL, _OLD):
            shutil.rmtree(leftover, ignore_errors=True)
            lock.release()
        new = make_hidden(target, PARTIAL)
        _write_all(new[0], files)
        _put_in_place(path, target, new[0])
        for folder in made:
            sync(folder.parent)
        return new[1]
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


def _check_replaceable(path: Path, *, overwrite: bool) -> None:
    if not is_run(path):
        raise RunExistsError(f"'{path}' is not a run of dh2sim; remove it yourself, or choose another folder")
    if not overwrite:
        raise RunExistsError(f"'{path}' already exists; resume it, overwrite it, or choose another folder")


def _write_all(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files by relative path into a folder that nobody else knows, and bring them to the disk."""
    for relative, data in files.items():
        (folder / relative).parent.mkdir(parents=True, exist_ok=True)
        (folder / relative).write_bytes(data)
        sync(folder / relative)
    for inner in {folder, *((folder / relative).parent for relative in files)}:
        sync(inner)


def _put_in_place(path: Path, target: Path, new: Path) -> None:
    """Rename a new run into place, and delete the run that was there."""
    if is_vacant(target):
        _rename(path, target, new)
        return
    old, lock = hidden_path(target, _OLD), lock_run(target)
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
