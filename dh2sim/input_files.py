"""Files that the user names, to be read."""

from __future__ import annotations

import errno
from pathlib import Path


def read_input(path: Path, most: int) -> bytes:
    """Return what is in a file that the user names; one byte more than ``most`` where it is larger.

    A pipe of the shell, as ``<(command)`` makes, is read to its end; one that has a name in a folder is refused, for
    nobody may ever write to it.

    Raises:
        OSError: It cannot be read.
    """
    refuse_named_pipe(path)
    with path.open("rb") as file:
        return file.read(most + 1)


def refuse_named_pipe(path: Path) -> None:
    """Refuse a pipe that has a name in a folder, as ``read_input`` does.

    Raises:
        OSError: It is one.
    """
    if path.is_fifo() and not path.is_relative_to("/dev") and path.resolve().exists():
        raise OSError(errno.EINVAL, "is a named pipe, not a file", str(path))
