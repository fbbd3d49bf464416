"""Putting files in place all together or not at all."""

from __future__ import annotations

import os
import shutil
import signal
import tempfile
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from dh2sim.errors import OutputError


@contextmanager
def staged(out: Path, name: str, files: Mapping[str, bytes]) -> Iterator[Path]:
    """Write files into a temporary folder beside where they will stand, and remove it in the end.

    Args:
        out: the folder that holds the robots' folders; made where it is missing.
        name: the robot's name.
        files: contents by relative path.

    Yields:
        The temporary folder, on the same file system as ``out``.

    Raises:
        OutputError: the files cannot be written.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(prefix=f".{name}-", dir=out))
    except OSError as error:
        raise OutputError(f"cannot write to '{out}': {error.strerror or error}") from error
    try:
        try:
            for relative, data in files.items():
                path = folder / "new" / relative
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(data)
        except OSError as error:
            raise OutputError(f"cannot write to '{out}': {error.strerror or error}; nothing was changed") from error
        yield folder / "new"
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def put_in_place(staging: Path, target: Path, files: Mapping[str, bytes]) -> None:
    """Rename staged files into ``target``; if one cannot be, those before it are put back as they were.

    A signal that arrives meanwhile is dealt with afterwards.

    Raises:
        OutputError: a file cannot be put in place; the old ones stand.
    """
    backup = staging.parent / "old"
    moved: list[tuple[Path, Path | None]] = []
    with _signals_deferred():
        try:
            for relative in files:
                final = target / relative
                final.parent.mkdir(parents=True, exist_ok=True)
                saved = None
                if final.exists():
                    saved = backup / relative
                    saved.parent.mkdir(parents=True, exist_ok=True)
                    _keep(final, saved)
                os.replace(staging / relative, final)
                moved.append((final, saved))
        except OSError as error:
            for final, saved in reversed(moved):
                if saved is None:
                    final.unlink(missing_ok=True)
                else:
                    os.replace(saved, final)
            raise OutputError(
                f"cannot write '{error.filename2 or error.filename or target}': {error.strerror or error}; "
                "the files that stood there are unchanged"
            ) from error


def _keep(final: Path, saved: Path) -> None:
    """Keep what stands at ``final``, without moving it away, so that at no moment it is missing."""
    try:
        os.link(final, saved)
    except OSError:
        shutil.copy2(final, saved)


@contextmanager
def _signals_deferred() -> Iterator[None]:
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
            signal.signal(kind, handler)
        for number in arrived:
            signal.raise_signal(number)
