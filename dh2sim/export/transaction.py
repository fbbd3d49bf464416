"""Putting files in place all together or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from dh2sim.errors import OutputError
from dh2sim.export.signals import signals_deferred


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
