"""Files that appear whole or not at all, folder locks, and signals deferred while files change places.

Three primitives write files: ``atomic_file`` one that somebody else fills (a library, an encoder), ``atomic_files``
several that belong together, and ``write_file`` bytes that must survive a power cut once the call returns.
"""

from __future__ import annotations

import errno
import os
import secrets
import shutil
import signal
import stat
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import BinaryIO, Final

from dh2sim.errors import OutputError

try:
    import fcntl
except ImportError:  # on Windows
    _HAS_LOCKS = False
else:
    _HAS_LOCKS = True

PARTIAL: Final = ".partial"
"""Suffix of files and folders that are being written; their names begin with a dot."""


def open_plain_file(path: Path) -> BinaryIO:
    """Open a file of a folder that may come from a stranger, for reading: no link, pipe or device, and no waiting.

    Raises:
        OSError: It cannot be opened, or is not a plain file.
    """
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    file = open(path, "rb", opener=lambda name, _: os.open(name, flags))  # noqa: SIM115
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise OSError(errno.EINVAL, "is not a plain file", str(path))
    return file


def read_plain_file(path: Path, most: int) -> bytes:
    """Return what is in a file, as ``open_plain_file`` opens it.

    Raises:
        OSError: It cannot be read, or has more than ``most`` bytes.
    """
    with open_plain_file(path) as file:
        size = os.fstat(file.fileno()).st_size
        data = file.read(min(size, most) + 1)
    if len(data) > most:
        raise OSError(errno.EFBIG, f"is larger than {most} bytes", str(path))
    return data


@contextmanager
def signals_deferred() -> Iterator[None]:
    """Hold back SIGINT and SIGTERM until the block ends; only the main thread can, elsewhere this does nothing."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    arrived: list[int] = []

    def note(number: int, _frame: FrameType | None) -> None:
        arrived.append(number)

    previous = {kind: signal.signal(kind, note) for kind in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for kind, handler in previous.items():
            signal.signal(kind, signal.SIG_DFL if handler is None else handler)  # None: not installed by Python
        for number in arrived:
            signal.raise_signal(number)


@contextmanager
def atomic_file(path: Path) -> Iterator[Path]:
    """Yield a temporary file to write to; it replaces ``path`` when the block ends well, and is removed otherwise.

    Args:
        path: The file to write. Its folder must exist.

    Yields:
        The path of an empty file beside ``path`` with the same suffix.

    Raises:
        OutputError: The file cannot be written; what was at ``path`` is unchanged.
    """
    if path.is_dir():
        raise OutputError(f"cannot write '{path}': that is a folder")
    if not path.parent.is_dir():
        raise OutputError(f"cannot write '{path}': there is no folder '{path.parent}'")
    temporary = path.with_name(f".{path.stem[:80]}-{secrets.token_hex(4)}{path.suffix}")
    try:
        try:
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
            yield temporary
            sync(temporary)
            with signals_deferred():
                os.replace(temporary, path)
        except OSError as error:
            raise OutputError(f"cannot write '{path}': {_reason(error)}") from error
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def atomic_files(out: Path, name: str = "") -> Iterator[Path]:
    """Yield an empty folder to write to; when the block ends well, all of its files are moved to ``out``/``name``.

    They are moved all or none, one rename right after the other and with signals deferred: only a process that is
    killed between two renames leaves old files beside new ones, each of them whole. Missing folders are made.

    Args:
        out: The folder that receives the files, or the folder named ``name`` that does. The temporary folder is made
            here, on the same file system.
        name: Folder in ``out``; empty for ``out`` itself.

    Raises:
        OutputError: A file cannot be written or moved; what was there is unchanged.
    """
    made: list[Path] = []
    temporary: Path | None = None
    try:
        try:
            with signals_deferred():
                made += make_folders(out)
                temporary = Path(tempfile.mkdtemp(prefix=f".{name}-", dir=out))
            staging = temporary / "new"
            staging.mkdir()
            yield staging
            files = sorted(path.relative_to(staging) for path in staging.rglob("*") if not path.is_dir())
            for file in files:
                sync(staging / file)
        except OSError as error:
            raise OutputError(f"cannot write to '{out}': {_reason(error)}; nothing was changed") from error
        _move_all(files, staging, out / name, kept=temporary / "old")
    finally:
        with signals_deferred():
            if temporary is not None:
                shutil.rmtree(temporary, ignore_errors=True)
            remove_empty(made)


def _move_all(files: list[Path], staging: Path, target: Path, *, kept: Path) -> None:
    """Rename files from ``staging`` to ``target``; if one fails, restore those before it from ``kept``."""
    made: list[Path] = []
    moved: list[Path] = []
    with signals_deferred():
        try:
            for file in files:
                made += make_folders((target / file).parent)
                if os.path.lexists(target / file):
                    _keep(target / file, kept / file)
            for file in files:
                os.replace(staging / file, target / file)
                moved.append(file)
        except OSError as error:
            for file in reversed(moved):
                _restore(kept / file, target / file)
            remove_empty(made)
            raise OutputError(
                f"cannot write '{error.filename2 or error.filename or target}': {_reason(error)}; "
                "the existing files are unchanged"
            ) from error


def _keep(path: Path, kept: Path) -> None:
    """Save a file without moving it away, so that it is missing at no moment."""
    kept.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(path, kept, follow_symlinks=False)
    except (OSError, NotImplementedError):
        shutil.copy2(path, kept, follow_symlinks=False)


def _restore(kept: Path, path: Path) -> None:
    with suppress(OSError):  # go on with the other files
        if os.path.lexists(kept):
            os.replace(kept, path)
        else:
            path.unlink()


def partial_path(path: Path) -> Path:
    """Return the name of a file while ``write_file`` is writing it."""
    return path.with_name(f".{path.name}{PARTIAL}")


def write_file(path: Path, *parts: bytes) -> None:
    """Write a file, replacing an existing one; it is on the disk, under its name, when this returns.

    Raises:
        OSError: It cannot be written. A partial file may be left behind (``partial_path``).
    """
    with open(partial_path(path), "wb", buffering=0) as file:
        for part in parts:
            left = memoryview(part)
            while left:  # near a limit of size, a file takes some of the bytes before it refuses
                left = left[file.write(left) :]
        os.fsync(file.fileno())
    os.replace(partial_path(path), path)
    sync(path.parent)


def sync(path: Path) -> None:
    """Bring a file, or the names in a folder, to the disk, where the system can do that."""
    windows = os.name == "nt"
    if windows and path.is_dir():
        return
    handle = os.open(path, os.O_RDWR if windows else os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def make_folders(folder: Path) -> list[Path]:
    """Make a folder and its parents; return those that were missing, outermost first."""
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    if folder.exists() and not folder.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(folder))
    folder.mkdir(parents=True, exist_ok=True)
    return missing[::-1]


def remove_empty(folders: list[Path]) -> None:
    """Remove the folders that are empty, the last one first."""
    for folder in reversed(folders):
        with suppress(OSError):
            folder.rmdir()


class FolderLock:
    """An exclusive lock on a folder among processes that use this class; the system drops it when a process ends.

    Where the system or the file system has no such locks, every lock is granted.
    """

    def __init__(self, folder: Path) -> None:
        """Lock a folder.

        Raises:
            BlockingIOError: It is locked.
            OSError: It cannot be opened.
        """
        self._handle: int | None = None
        if not _HAS_LOCKS:
            return
        handle = os.open(folder, os.O_RDONLY)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(handle)
            if isinstance(error, BlockingIOError):
                raise
        else:
            self._handle = handle

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


def _reason(error: OSError) -> str:
    """Return what the system said, without the words that libraries add."""
    return os.strerror(error.errno) if error.errno else str(error)
