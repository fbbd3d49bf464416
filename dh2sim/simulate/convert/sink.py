"""A file that the HDF5 library writes to without ever being told of an error.

When a write fails, HDF5 cannot close its file: it keeps trying, prints, and may crash at exit. So the file remembers
the error and takes the rest without writing it; whoever asks for the writing looks after the error.
"""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer, WriteableBuffer


class Sink(io.RawIOBase):
    """A new file, read and written, that keeps its first error to itself until ``check``."""

    def __init__(self, path: Path) -> None:
        """Make the file.

        Raises:
            OSError: it cannot be made.
        """
        self._file = open(path, "xb+", buffering=0)  # noqa: SIM115
        self._error: OSError | None = None

    def check(self) -> None:
        """Raise the error that there was.

        Raises:
            OSError: something could not be written.
        """
        if self._error is not None:
            raise self._error

    def write(self, data: ReadableBuffer, /) -> int:
        """Write all of the data, if nothing went wrong before."""
        view = memoryview(data).cast("B")
        done = 0
        while done < len(view) and self._error is None:
            try:
                done += os.write(self._file.fileno(), view[done:])
            except OSError as error:
                self._error = error
        return len(view)

    def readinto(self, buffer: WriteableBuffer, /) -> int:
        """Read; what was never written is zero."""
        view = memoryview(buffer).cast("B")
        count = self._file.readinto(view)
        view[count:] = bytes(len(view) - count)
        return len(view)

    def seek(self, offset: int, whence: int = os.SEEK_SET, /) -> int:
        """Move to a place."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """Return the place."""
        return self._file.tell()

    def truncate(self, size: int | None = None, /) -> int:
        """Make the file as long as that."""
        try:
            return self._file.truncate(size)
        except OSError as error:
            self._error = self._error or error
            return self._file.tell() if size is None else size

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        super().close()
