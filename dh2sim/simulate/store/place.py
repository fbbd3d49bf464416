"""Where a run stands: made beside it and renamed into place, so that none is ever seen half made."""

from __future__ import annotations

import errno
import os
import re
import secrets
import shutil
from concurrent.futures import Executor
from contextlib import suppress
from pathlib import Path
from typing import Final

from dh2sim.errors import RunBusyError, RunError, RunExistsError, RunOutputError
from dh2sim.files import signals_deferred
from dh2sim.simulate.store.files import PARTIAL, lock_folder, locks, sync_folder, unlock, write_tree
from dh2sim.simulate.store.seal import seals, stored_attributes

_OLD: Final = ".old"
_MOST_TRIES: Final = 100


def is_run(path: Path) -> bool:
    """Tell whether a folder is a run of dh2sim, be it damaged.

    Raises:
        RunError: its files may not be read.
    """
    try:
        return "dh2sim_run" in (stored_attributes(path) or {}) or any(True for _ in seals(path))
    except PermissionError as error:
        raise RunError(f"cannot read '{error.filename}': {error.strerror}") from error


def not_a_run(path: Path) -> str:
    """Return the words for something that is in the way."""
    return f"'{path}' is not a run of dh2sim; remove it yourself or choose another --out"


def is_vacant(path: Path) -> bool:
    """Tell whether a run can be made at a path with nothing lost: there is nothing, or an empty folder."""
    if not os.path.lexists(path):
        return True
    try:
        return path.is_dir() and not any(path.iterdir())
    except OSError:
        return False


def lock_run(path: Path) -> int | None:
    """Lock a run that stands.

    Raises:
        RunBusyError: another process is writing to it.
        OSError: it cannot be opened.
    """
    for _ in range(_MOST_TRIES):
        try:
            handle = lock_folder(path)
        except BlockingIOError as error:
            raise RunBusyError(f"another process is writing to '{path}'") from error
        if locks(handle, path):
            return handle
        unlock(handle)  # another run was put in its place meanwhile
    raise RunBusyError(f"another process is writing to '{path}'")


def make_run(path: Path, files: dict[str, bytes], pool: Executor, *, overwrite: bool) -> int | None:
    """Put a new run in place, whole or not at all, and return its lock.

    Args:
        path: where it will stand; folders above it are made.
        files: its contents, by relative path.
        pool: writes them.
        overwrite: whether a run that stands there is replaced. It is moved aside first, and deleted when the new one
            stands.

    Raises:
        RunExistsError: something stands there.
        RunBusyError: another process is writing to the run that stands there.
        RunOutputError: it cannot be written; nothing was changed.
    """
    target = Path(os.path.realpath(path))  # a symbolic link stays one
    staging: tuple[Path, int | None] | None = None
    made: list[Path] = []
    try:
        if not is_vacant(target):
            _check_replaceable(path, overwrite=overwrite)
        made = _make_folder(target.parent)
        _remove_leftovers(target)
        staging = _staging(target)
        write_tree(staging[0], files, pool)
        _swap(path, target, staging[0])
        for folder in made:
            sync_folder(folder.parent)
        return staging[1]
    except BaseException as error:
        if staging is not None:
            shutil.rmtree(staging[0], ignore_errors=True)
            unlock(staging[1])
        for folder in reversed(made):
            with suppress(OSError):
                folder.rmdir()
        if isinstance(error, OSError):
            raise RunOutputError(
                f"cannot write to '{path}': {error.strerror or error}; nothing was changed"
            ) from error
        raise


def _check_replaceable(path: Path, *, overwrite: bool) -> None:
    if not is_run(path):
        raise RunExistsError(not_a_run(path))
    if not overwrite:
        raise RunExistsError(f"'{path}' exists already; --resume carries on with it, --overwrite replaces it")


def _swap(path: Path, target: Path, new: Path) -> None:
    """Rename a new run into place, and delete the run that stood there."""
    if is_vacant(target):
        _take(path, target, new)
        return
    old, held = _aside(target, _OLD), lock_run(target)
    try:
        with signals_deferred():
            os.rename(target, old)
            try:
                _take(path, target, new)
            except BaseException:
                os.rename(old, target)
                raise
        shutil.rmtree(old, ignore_errors=True)
    finally:
        unlock(held)


def _take(path: Path, target: Path, new: Path) -> None:
    try:
        if os.name == "nt" and target.is_dir():
            target.rmdir()
        os.rename(new, target)
    except FileExistsError as error:
        raise RunExistsError(_made_meanwhile(path)) from error
    except OSError as error:
        if not is_vacant(target):
            raise RunExistsError(_made_meanwhile(path)) from error
        raise
    sync_folder(target.parent)


def _made_meanwhile(path: Path) -> str:
    return f"'{path}' was made by another process meanwhile; --resume carries on with it, --overwrite replaces it"


def _staging(target: Path) -> tuple[Path, int | None]:
    """Make a locked folder beside a path; one that is not locked may be taken for a leftover."""
    while True:
        folder = _aside(target, PARTIAL)
        folder.mkdir()
        with suppress(FileNotFoundError, BlockingIOError):
            handle = lock_folder(folder)
            if locks(handle, folder):
                return folder, handle
            unlock(handle)


def _aside(target: Path, ending: str) -> Path:
    return target.with_name(f".{target.name}-{secrets.token_hex(4)}{ending}")


def _remove_leftovers(target: Path) -> None:
    """Remove what processes left beside a path that were killed as they made or replaced a run there."""
    ours = re.compile(rf"\.{re.escape(target.name)}-[0-9a-f]{{8}}({re.escape(PARTIAL)}|{re.escape(_OLD)})")
    with suppress(OSError):
        for name in filter(ours.fullmatch, os.listdir(target.parent)):
            _remove_leftover(target.with_name(name))


def _remove_leftover(folder: Path) -> None:
    with suppress(BlockingIOError):  # whoever is making it holds the lock
        handle = lock_folder(folder)
        if handle is not None:
            shutil.rmtree(folder, ignore_errors=True)
        unlock(handle)


def _make_folder(folder: Path) -> list[Path]:
    """Make a folder and those above it; return those that were missing, innermost last."""
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    stands = next(path for path in (folder, *folder.parents) if path not in missing)
    if not stands.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(stands))
    folder.mkdir(parents=True, exist_ok=True)
    return missing[::-1]
