"""The bytes of an MJCF, or of a file that it includes."""

from __future__ import annotations

import stat
from pathlib import Path

from dh2sim.errors import Dh2simError, ImportedFileError, Problem
from dh2sim.formats.xml_tree import MAX_BYTES


def read_utf_8(path: Path, name: str, before: int) -> bytes:
    """Return the content of a file.

    Args:
        path: The file; a pipe or a device is not read.
        name: What messages call it.
        before: Number of bytes of the model that were read before; of all together there is a limit.

    Raises:
        ImportedFileError: The files are too large, or this one is not in UTF-8.
        Dh2simError: It cannot be read.
    """
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise Dh2simError(f"{name}: is not a file that can be read")
        with path.open("rb") as stream:
            data = stream.read(max(MAX_BYTES - before, 0) + 1)
    except (OSError, ValueError) as error:
        raise Dh2simError(f"{name}: cannot be read: {getattr(error, 'strerror', None) or error}") from error
    if before + len(data) > MAX_BYTES:
        raise refused(
            name, 1, f"the file is too large: at most {MAX_BYTES} bytes are read, with all that it includes"
        )
    _check_utf_8(data, name)
    return data


def _check_utf_8(data: bytes, name: str) -> None:
    try:
        data.decode()
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        message = f"not UTF-8: byte 0x{data[error.start]:02x}; MuJoCo reads no other encoding"
        raise refused(name, line, message) from None


def refused(file: str, line: int, message: str) -> ImportedFileError:
    """Return an error at a line of a file."""
    return ImportedFileError([Problem(file=file, line=line, column=1, path="", message=message)])
