"""The files of a conversion: whole or not at all, and never over others unless that is wanted.

Signals that come at a bad time are dealt with a little later.

Single files are written beside where they will stand, and put there whole.

Putting files in place all together or not at all.
"""

from __future__ import annotations

import os
import secrets
import shutil
import signal
import tempfile
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType

from dh2sim.errors import OutputError


@contextmanager
def signals_deferred() -> Iterator[None]:
    """Hold back SIGINT and SIGTERM; Python lets only the main thread do so."""
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
            signal.signal(kind, signal.SIG_DFL if handler is None else handler)  # None: set by something not Python
        for number in arrived:
            signal.raise_signal(number)


@contextmanager
def written_whole(out: Path) -> Iterator[Path]:
    """Give a temporary file with the same ending; it is renamed to ``out`` if all goes well, and removed otherwise.

    Args:
        out: where the file will stand; one that stands there is replaced.

    Yields:
        The path of the temporary file, which exists and is empty.

    Raises:
        OutputError: the file cannot be written; what stood there before stands untouched.
    """
    if out.is_dir():
        raise OutputError(f"cannot write '{out}': that is a folder")
    if not out.parent.is_dir():
        raise OutputError(f"cannot write '{out}': there is no folder '{out.parent}'")
    draft = out.with_name(f".{out.stem[:80]}-{secrets.token_hex(4)}{out.suffix}")
    try:
        try:
            os.close(os.open(draft, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
            yield draft
            with signals_deferred():
                os.replace(draft, out)
        except OSError as error:
            raise OutputError(f"cannot write '{out}': {error.strerror or error}") from error
    finally:
        with suppress(FileNotFoundError):
            draft.unlink()


@contextmanager
def staged(out: Path, name: str, files: Mapping[str, bytes]) -> Iterator[Path]:
    """Write files into a temporary folder beside where they will stand, and remove it in the end.

    Args:
        out: the folder that holds the robots' folders; made where it is missing, and removed again if it stays empty.
        name: the robot's name.
        files: contents by relative path.

    Yields:
        The temporary folder, on the same file system as ``out``.

    Raises:
        OutputError: the files cannot be written.
    """
    made: list[Path] = []
    folder: Path | None = None
    try:
        try:
            with signals_deferred():
                made += _make_folder(out)
                folder = Path(tempfile.mkdtemp(prefix=f".{name}-", dir=out))
            for relative, data in files.items():
                path = folder / "new" / relative
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(data)
        except OSError as error:
            raise OutputError(f"cannot write to '{out}': {error.strerror or error}; nothing was changed") from error
        yield folder / "new"
    finally:
        with signals_deferred():
            if folder is not None:
                shutil.rmtree(folder, ignore_errors=True)
            _remove_empty(made)


def put_in_place(staging: Path, target: Path, files: Iterable[str]) -> None:
    """Rename staged files into ``target``; if one cannot be, those before it are put back as they were.

    A signal that arrives meanwhile is dealt with afterwards. The renames, each of them whole, follow each other at
    once: only a process that is killed outright between two of them leaves old files beside new ones.

    Args:
        staging: the folder that holds the new files; old ones are kept beside it meanwhile.
        target: the folder to put them in; made where it is missing.
        files: paths relative to both.

    Raises:
        OutputError: a file cannot be put in place; the old ones stand.
    """
    finals = {relative: target / relative for relative in files}
    made: list[Path] = []
    moved: list[str] = []
    with signals_deferred():
        try:
            for relative, final in finals.items():
                made += _make_folder(final.parent)
                if os.path.lexists(final):
                    _keep(final, _backup(staging, relative))
            for relative, final in finals.items():
                os.replace(staging / relative, final)
                moved.append(relative)
        except OSError as error:
            for relative in reversed(moved):
                _put_back(_backup(staging, relative), finals[relative])
            _remove_empty(made)
            raise OutputError(
                f"cannot write '{error.filename2 or error.filename or target}': {error.strerror or error}; "
                "the files that stood there are unchanged"
            ) from error


def _backup(staging: Path, relative: str) -> Path:
    return staging.parent / "old" / relative


def _keep(final: Path, saved: Path) -> None:
    """Keep what stands at ``final``, without moving it away, so that at no moment it is missing."""
    saved.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(final, saved, follow_symlinks=False)
    except (OSError, NotImplementedError):
        shutil.copy2(final, saved, follow_symlinks=False)


def _put_back(saved: Path, final: Path) -> None:
    with suppress(OSError):  # one that cannot be put back keeps no other from it
        if os.path.lexists(saved):
            os.replace(saved, final)
        else:
            final.unlink()


def _make_folder(folder: Path) -> list[Path]:
    """Make a folder and those above it; return those that were missing, innermost last."""
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    return missing[::-1]


def _remove_empty(folders: list[Path]) -> None:
    """Remove folders, innermost (last) first, as far as they are empty."""
    for folder in reversed(folders):
        with suppress(OSError):
            folder.rmdir()


@contextmanager
def new_files(paths: Sequence[Path], *, run: Path, overwrite: bool) -> Iterator[list[Path]]:
    """Lend temporary files; when the block ends well they are renamed to ``paths``, else removed.

    Args:
        paths: where the files will stand, all in one folder, which is made where it is missing.
        run: the run that they are made from, in which they have no place.
        overwrite: whether files that stand there are replaced.

    Yields:
        Paths to write to, on the same file system; one for each of ``paths``.

    Raises:
        OutputError: a file exists already, or cannot be written. What stood there is unchanged.
    """
    folder = paths[0].parent
    if folder.resolve().is_relative_to(run.resolve()):
        raise OutputError(f"'{paths[0]}' would be inside the run '{run}'; name a file elsewhere with --out")
    _refuse(paths, overwrite=overwrite)
    with staged(folder, paths[0].name, {}) as staging:
        try:
            staging.mkdir()
            yield [staging / path.name for path in paths]
            for path in paths:
                _sync(staging / path.name)
        except OSError as error:
            raise OutputError(f"cannot write to '{folder}': {_reason(error)}; nothing was changed") from error
        _refuse(paths, overwrite=overwrite)
        put_in_place(staging, folder, [path.name for path in paths])


def refuse_folder(path: Path) -> None:
    """Raise an OutputError if a folder stands where a file is to be written."""
    if path.is_dir():
        raise OutputError(f"'{path}' is a folder; name a file with --out")


def _refuse(paths: Sequence[Path], *, overwrite: bool) -> None:
    for path in paths:
        refuse_folder(path)
    standing = [f"'{path}'" for path in paths if os.path.lexists(path)]
    if standing and not overwrite:
        exist = "exists" if len(standing) == 1 else "exist"
        it = "it" if len(standing) == 1 else "them"
        raise OutputError(
            f"{' and '.join(standing)} {exist} already; --overwrite replaces {it}, --out names another file"
        )


def _sync(path: Path) -> None:
    with open(path, "rb") as file:
        os.fsync(file.fileno())


def _reason(error: OSError) -> str:
    """Return what the system said, without the words that libraries put around it."""
    return os.strerror(error.errno) if error.errno else str(error)
