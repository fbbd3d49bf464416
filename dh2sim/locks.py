"""Locks on folders and files, and hidden folders of processes; the locks tell live processes from dead ones."""

from __future__ import annotations

import os
import re
import secrets
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

try:
    import fcntl
except ImportError:  # on Windows
    _HAS_LOCKS = False
else:
    _HAS_LOCKS = True

_A_MOMENT: Final = 0.5
"""s; waiting that takes longer is reported."""
_POLL: Final = 0.02
"""s between two attempts to lock a folder."""


def lock_handle(handle: int, *, shared: bool = False) -> bool:
    """Lock what a handle has opened, as long as it is open; return whether there are such locks here.

    Raises:
        BlockingIOError: It is locked.
    """
    if not _HAS_LOCKS:
        return False
    try:
        fcntl.flock(handle, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:
        return False
    return True


class FolderLock:
    """A lock on a folder among processes that use this class; the system drops it when a process ends.

    Where the system or the file system has no such locks, every lock is granted.
    """

    def __init__(self, folder: Path, *, shared: bool = False) -> None:
        """Lock a folder.

        Args:
            folder: The folder.
            shared: Whether others may hold it as well who ask for no more than that.

        Raises:
            BlockingIOError: It is locked.
            OSError: It cannot be opened.
        """
        self._handle: int | None = None
        if not _HAS_LOCKS:
            return
        handle = os.open(folder, os.O_RDONLY)
        try:
            effective = lock_handle(handle, shared=shared)
        except BlockingIOError:
            os.close(handle)
            raise
        if effective:
            self._handle = handle
        else:
            os.close(handle)

    def share(self) -> None:
        """Let others hold the lock as well who ask for no more than that."""
        if self._handle is not None:
            lock_handle(self._handle, shared=True)

    @property
    def effective(self) -> bool:
        """Whether the lock keeps others out."""
        return self._handle is not None

    def holds(self, folder: Path) -> bool:
        """Return whether the locked folder is still the one at this path, and no other was put in its place."""
        try:
            return self._handle is None or os.path.samestat(os.fstat(self._handle), os.stat(folder))
        except FileNotFoundError:
            return False

    def release(self) -> None:
        """Give the lock back."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None


def lock_folder(
    folder: Path, *, shared: bool = False, wait: bool = False, waiting: Callable[[Path], None] | None = None
) -> FolderLock:
    """Lock the folder that is at a path.

    Args:
        folder: The folder; it may be replaced by another meanwhile.
        shared: Whether others may hold it as well who ask for no more than that.
        wait: Whether to wait until it is free.
        waiting: Called once with the folder if that takes longer than a moment.

    Raises:
        BlockingIOError: It is locked, and ``wait`` is False.
        OSError: It cannot be opened.
    """
    begin, reported = time.monotonic(), False
    while True:
        with suppress(*((BlockingIOError,) if wait else ())):
            lock = FolderLock(folder, shared=shared)
            if lock.holds(folder):
                return lock
            lock.release()
            continue
        if not reported and waiting is not None and time.monotonic() - begin > _A_MOMENT:
            reported = True
            waiting(folder)
        time.sleep(_POLL)


def make_hidden(target: Path, suffix: str) -> tuple[Path, FolderLock]:
    """Make a hidden folder beside a path, locked as long as its process lives or until the lock is released.

    Raises:
        OSError: It cannot be made.
    """
    while True:
        folder = hidden_path(target, suffix)
        folder.mkdir(mode=0o777)
        with suppress(FileNotFoundError, BlockingIOError):  # another process took it for a leftover
            lock = FolderLock(folder)
            if lock.holds(folder):
                return folder, lock
            lock.release()


def hidden_path(target: Path, suffix: str) -> Path:
    """Return a new name for a hidden folder beside a path."""
    return target.with_name(f".{target.name}-{secrets.token_hex(4)}{suffix}")


def leftovers(target: Path, *suffixes: str) -> Iterator[tuple[Path, FolderLock]]:
    """Yield the hidden folders beside a path that dead processes left, each locked; release the locks."""
    endings = "|".join(map(re.escape, suffixes))
    ours = re.compile(rf"\.{re.escape(target.name)}-[0-9a-f]{{8}}({endings})")
    with suppress(OSError):
        for name in sorted(filter(ours.fullmatch, os.listdir(target.parent))):
            folder = target.with_name(name)
            if folder.is_symlink():
                continue
            with suppress(OSError):  # in use, or gone
                lock = FolderLock(folder)
                if lock.effective and lock.holds(folder):
                    yield folder, lock
                else:
                    lock.release()
