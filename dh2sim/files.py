"""Files that appear whole or not at all, and signals deferred while files change places.

Three primitives write files: ``atomic_file`` one that somebody else fills (a library, an encoder), ``atomic_files``
several that belong together, and ``write_file`` bytes that must survive a power cut once the call returns.
"""

from __future__ import annotations

import errno
import filecmp
import json
import os
import secrets
import shutil
import signal
import stat
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from io import BufferedReader
from pathlib import Path, PurePath, PureWindowsPath
from types import FrameType
from typing import Final

from dh2sim.errors import OutputError
from dh2sim.locks import FolderLock, leftovers, lock_folder, make_hidden
from dh2sim.messages import shown

PARTIAL: Final = ".partial"
"""Suffix of files and folders that are being written; their names begin with a dot."""
_JOURNAL: Final = "journal"
"""File in a folder of files that are being moved: what is moved, so that another process can finish the work."""
_MOST_JOURNAL: Final = 2**20


def open_plain_file(path: Path) -> BufferedReader:
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


def require_folder(path: Path) -> None:
    """Check that a file can be written somewhere: its folder exists, as no command makes folders for single files.

    Raises:
        OutputError: It does not, or there is a folder, a device or a pipe in the file's place.
    """
    if path.is_dir():
        raise OutputError(f"cannot write '{path}': that is a folder")
    if path.exists() and not path.is_file():
        raise OutputError(f"cannot write '{path}': that is a device or a pipe, not a file")
    if not path.parent.is_dir():
        raise OutputError(f"cannot write '{path}': there is no folder '{path.parent}'")


@contextmanager
def atomic_file(path: Path) -> Iterator[Path]:
    """Yield a temporary file to write to; it replaces ``path`` when the block ends well, and is removed otherwise.

    Args:
        path: The file to write, or a link to it, which stays. Its folder must exist.

    Yields:
        The path of an empty file beside the one that is written, with the suffix of ``path``.

    Raises:
        OutputError: The file cannot be written; what was at ``path`` is unchanged.
    """
    target = Path(os.path.realpath(path)) if path.is_symlink() else path
    require_folder(target)
    temporary = target.with_name(f".{path.stem[:80]}-{secrets.token_hex(4)}{path.suffix}")
    try:
        try:
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
            yield temporary
            sync(temporary)
            with signals_deferred():
                os.replace(temporary, target)
        except OSError as error:
            raise OutputError(f"cannot write '{path}': {_reason(error)}") from error
    finally:
        with suppress(OSError):  # of a read-only file system, on which there is none
            temporary.unlink()


@contextmanager
def atomic_files(
    out: Path, name: str = "", *, wait: bool = True, waiting: Callable[[Path], None] | None = None
) -> Iterator[Path]:
    """Yield an empty folder to write to; when the block ends well, all of its files are moved to ``out``/``name``.

    They are moved all or none, one rename right after the other, with signals deferred and with the folder locked
    against other writers. A file that is the same already stays. If the process is killed between two renames, the
    next one that writes or reads there finishes the work (``finish_interrupted``). Missing folders are made.

    Args:
        out: The folder that receives the files, or the folder named ``name`` that does. The temporary folder is made
            here, on the same file system.
        name: Folder in ``out``; empty for ``out`` itself.
        wait: Whether to wait while another process writes there, or to raise an error.
        waiting: Called once with the folder if that takes longer than a moment.

    Raises:
        OutputError: A file cannot be written or moved, or another process is writing; what was there is unchanged.
    """
    made: list[Path] = []
    hidden: tuple[Path, FolderLock] | None = None
    try:
        try:
            with signals_deferred():
                made += make_folders(out)
                hidden = make_hidden(out / (name or _SEVERAL), PARTIAL)
            staging = hidden[0] / "new"
            staging.mkdir()
            yield staging
            files = sorted(path.relative_to(staging) for path in staging.rglob("*") if not path.is_dir())
            for file in files:
                sync(staging / file)
        except OSError as error:
            raise OutputError(f"cannot write to '{out}': {_reason(error)}; nothing was changed") from error
        with _target(out / name, made, wait=wait, waiting=waiting):
            _finish(out, name)
            changed = [file for file in files if not _same(staging / file, out / name / file)]
            _move_all(changed, hidden[0], out / name)
    finally:
        with signals_deferred():
            if hidden is not None:
                shutil.rmtree(hidden[0], ignore_errors=True)
                hidden[1].release()
            remove_empty(made)


def finish_interrupted(out: Path, name: str) -> None:
    """Move the rest of the files that a process which was killed was moving to ``out``/``name``.

    Raises:
        OutputError: There are such files, and they cannot be moved.
    """
    found = [lock for _, lock in leftovers(out / name, PARTIAL)]
    for lock in found:
        lock.release()
    if not found:
        return
    with _target(out / name, [], wait=True, waiting=None):
        _finish(out, name)


_SEVERAL: Final = "files"
"""Stands for the name of a folder whose files are moved, where that is the folder given."""


@contextmanager
def _target(folder: Path, made: list[Path], *, wait: bool, waiting: Callable[[Path], None] | None) -> Iterator[None]:
    """Lock the folder that receives files, which is made if it is missing."""
    try:
        while True:
            made += make_folders(folder)
            with suppress(FileNotFoundError):  # another process removed the empty folder that it had made
                lock = lock_folder(folder, wait=wait, waiting=waiting)
                break
    except BlockingIOError as error:
        raise OutputError(f"another process is writing to '{folder}'; nothing was changed") from error
    except OSError as error:
        raise OutputError(f"cannot write '{folder}': {_reason(error)}; the existing files are unchanged") from error
    try:
        yield
    finally:
        lock.release()


def _finish(out: Path, name: str) -> None:
    """Finish what dead writers began, and remove what they left."""
    for folder, lock in leftovers(out / (name or _SEVERAL), PARTIAL):
        try:
            if os.path.lexists(folder / _JOURNAL):
                _follow(folder, out / name, *_read_journal(folder / _JOURNAL))
        except (OSError, ValueError, RecursionError) as error:
            raise OutputError(
                f"'{out / name}' contains files of two exports, since a process was killed while it wrote them; "
                f"the rest in '{folder}' cannot be moved: {error}"
            ) from error
        finally:
            lock.release()
        shutil.rmtree(folder, ignore_errors=True)


def _read_journal(path: Path) -> tuple[str, list[str]]:
    """Return what is to be moved; the folder may be a stranger's.

    Raises:
        OSError: It cannot be read.
        ValueError, RecursionError: It is none, or names files elsewhere.
    """
    match json.loads(read_plain_file(path, _MOST_JOURNAL)):
        case {"take": "new" | "old" as take, "files": [*files], **more} if not more:
            for file in files:
                if not isinstance(file, str) or not _is_below(PurePath(file)):
                    raise ValueError(f"its journal names {shown(file)}")
            return take, files
    raise ValueError("its journal is damaged")


def _is_below(path: PurePath) -> bool:
    parts = path.parts
    return bool(parts) and not path.is_absolute() and not PureWindowsPath(path).anchor and ".." not in parts


def _require_no_links(folder: Path, file: str) -> None:
    """Raise an OSError if a file is reached through a link in a folder."""
    for parent in PurePath(file).parents:
        if (folder / parent).is_symlink() and parent.parts:
            raise OSError(errno.EINVAL, "is a link, not a folder", str(folder / parent))


def _follow(folder: Path, target: Path, take: str, files: list[str]) -> None:
    """Move files that are still to be moved: new ones, or old ones if the move had failed."""
    for file in files:
        _require_no_links(folder, f"{take}/{file}")
        _require_no_links(target, file)
        source = folder / take / file
        if os.path.lexists(source):
            (target / file).parent.mkdir(parents=True, exist_ok=True)
            os.replace(source, target / file)
        elif take == "old":
            (target / file).unlink(missing_ok=True)
    sync(target)


def _same(one: Path, other: Path) -> bool:
    try:
        return not other.is_symlink() and filecmp.cmp(one, other, shallow=False)
    except OSError:
        return False


def _move_all(files: list[Path], hidden: Path, target: Path) -> None:
    """Rename files from ``hidden``/new to ``target``; if one fails, restore those before it from ``hidden``/old.

    A journal in ``hidden`` says what is being done, from before the first rename until after the last.
    """
    made: list[Path] = []
    moved: list[Path] = []
    if not files:
        return
    with signals_deferred():
        try:
            for file in files:
                made += make_folders((target / file).parent)
                if os.path.lexists(target / file):
                    _keep(target / file, hidden / "old" / file)
            _write_journal(hidden, "new", files)
            for file in files:
                os.replace(hidden / "new" / file, target / file)
                moved.append(file)
            sync(target)
            (hidden / _JOURNAL).unlink()
        except OSError as error:
            if moved:
                _write_journal(hidden, "old", moved)
            for file in reversed(moved):
                _restore(hidden / "old" / file, target / file)
            (hidden / _JOURNAL).unlink(missing_ok=True)
            remove_empty(made)
            raise OutputError(
                f"cannot write '{error.filename2 or error.filename or target}': {_reason(error)}; "
                "the existing files are unchanged"
            ) from error


def _write_journal(hidden: Path, take: str, files: list[Path]) -> None:
    text = json.dumps({"take": take, "files": [file.as_posix() for file in files]})
    write_file(hidden / _JOURNAL, text.encode())


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


def _reason(error: OSError) -> str:
    """Return what the system said, without the words that libraries add."""
    return os.strerror(error.errno) if error.errno else str(error)
