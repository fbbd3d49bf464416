"""Files and folders that are on the disk when a function returns, whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import Executor, wait
from contextlib import suppress
from pathlib import Path
from typing import Final, TypeVar

try:
    import fcntl
except ImportError:  # on Windows
    _HAS_LOCKS = False
else:
    _HAS_LOCKS = True

PARTIAL: Final = ".partial"
"""End of the names of files and folders that are not finished; they begin with a dot."""

_In = TypeVar("_In")
_Out = TypeVar("_Out")


def partial_of(path: Path) -> Path:
    """Return the name that a file has until it is whole; such a file is always the lock's holder's."""
    return path.with_name(f".{path.name}{PARTIAL}")


def write_partial(path: Path, *parts: bytes) -> None:
    """Write a file under its partial name, and through to the disk."""
    with open(partial_of(path), "wb", buffering=0) as file:
        for part in parts:
            left = memoryview(part)
            while left:  # a file near a limit takes a part of what it is given before it refuses
                left = left[file.write(left) :]
        os.fsync(file.fileno())


def put(path: Path, *parts: bytes) -> None:
    """Write a file and give it its name at one blow; what stood there before is replaced."""
    write_partial(path, *parts)
    os.replace(partial_of(path), path)
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Bring the names in a folder to the disk, where folders can be opened for that."""
    if os.name == "nt":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def write_tree(folder: Path, files: dict[str, bytes], pool: Executor) -> None:
    """Write files by relative path into a folder that nobody else knows of, and through to the disk."""
    folders = {folder, *((folder / relative).parent for relative in files)}
    for inner in sorted(folders):
        inner.mkdir(parents=True, exist_ok=True)
    all_of(pool, lambda item: _write(folder / item[0], item[1]), files.items())
    all_of(pool, sync_folder, folders)


def all_of(pool: Executor, function: Callable[[_In], _Out], items: Iterable[_In]) -> list[_Out]:
    """Return what a function makes of each item; if it fails for one, the others have ended before that is raised."""
    futures = [pool.submit(function, item) for item in items]
    try:
        wait(futures)
    except BaseException:  # a signal
        for future in futures:
            future.cancel()
        wait(futures)
        raise
    return [future.result() for future in futures]


def remove(path: Path) -> None:
    """Remove a file if it is there and that is possible."""
    with suppress(OSError):
        path.unlink()


def lock_folder(folder: Path) -> int | None:
    """Lock a folder against others who call this, until the result is given to ``unlock`` or the process ends.

    Returns:
        None where there are no such locks.

    Raises:
        BlockingIOError: somebody holds the lock.
        OSError: the folder cannot be opened.
    """
    if not _HAS_LOCKS:
        return None
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(handle)
        raise
    except OSError:  # some network file systems have no locks
        os.close(handle)
        return None
    return handle


def unlock(handle: int | None) -> None:
    """Give back a lock."""
    if handle is not None:
        os.close(handle)


def locks(handle: int | None, folder: Path) -> bool:
    """Tell whether it is still this folder that a lock holds, and none that was put in its place meanwhile."""
    try:
        return handle is None or os.path.samestat(os.fstat(handle), os.stat(folder))
    except FileNotFoundError:
        return False


def _write(path: Path, data: bytes) -> None:
    with path.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
