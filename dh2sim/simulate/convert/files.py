"""The files of a conversion: whole or not at all, and never over others unless that is wanted."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from dh2sim.errors import OutputError
from dh2sim.export.transaction import put_in_place, staged


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
