"""The journal beside the table of a sweep, from which one that was interrupted is continued.

A line of settings, then a line for each chunk of designs, in any order. Each line begins with the SHA-256 of itself
and of the settings, so that lines that were damaged, or come from another sweep, are not taken for measures. Whatever
is in the file, no more than a line of it is in memory, and numbers are read as doubles and nothing else.
"""

from __future__ import annotations

import base64
import binascii
import errno
import hashlib
import json
import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, Final, NoReturn

import numpy as np

from dh2sim.errors import OutputError, RunDamagedError, RunDiffersError
from dh2sim.locks import lock_handle
from dh2sim.messages import listed

FORMAT: Final = 2
"""Version of the journal."""
MOST_LINE: Final = 2**24
"""Bytes of a line: 32 designs of 49 000 numbers."""
MOST_CHUNKS: Final = 2**22
_DIGEST: Final = 64
"""Hexadecimal digits."""


def journal_path(out: Path) -> Path:
    """Return the file beside a table that has what was measured."""
    return out.with_name(f"{out.name}.journal")


class Journal:
    """What was measured so far, by chunk."""

    def __init__(
        self,
        settings: Mapping[str, Any],
        path: Path | None,
        stream: BinaryIO | None,
        refusal: OSError | None = None,
    ) -> None:
        """Begin with nothing; without a stream it is kept in memory, with a refusal it can only be read."""
        self.settings = dict(settings)
        self.columns: list[str] = []
        self._path = path
        self._stream = stream
        self._refusal = refusal
        self._settings_digest = ""
        self._kept: dict[int, list[list[float]]] = {}
        self._places: dict[int, tuple[int, int]] = {}

    @classmethod
    @contextmanager
    def open(cls, out: Path | None, settings: Mapping[str, Any], *, overwrite: bool) -> Iterator[Journal]:
        """Continue the journal beside a table, or begin one; nobody else can until it is closed.

        Raises:
            RunDiffersError: It has other settings.
            RunDamagedError: It is not a journal, or was changed.
            OutputError: It cannot be written, or another process measures.
        """
        settings = json.loads(json.dumps(settings))
        if out is None:
            yield cls(settings, None, None)
            return
        path = journal_path(out)
        try:
            with _opened(path) as (stream, refusal):
                try:
                    lock_handle(stream.fileno())
                except BlockingIOError:
                    raise OutputError(f"another process is measuring '{out}'") from None
                journal = cls(settings, path, stream, refusal)
                if overwrite:
                    journal._require_writable()
                    stream.truncate(0)
                journal._read(out)
                yield journal
        except OSError as error:
            raise OutputError(f"cannot write '{error.filename or path}': {error.strerror or error}") from error

    def length(self, chunk: int) -> int:
        """Return of how many designs of a chunk there is something."""
        if self._stream is None:
            return len(self._kept.get(chunk, ()))
        return self._places.get(chunk, (0, 0))[1]

    def rows(self, chunk: int) -> list[list[float]]:
        """Return what there is of a chunk.

        Raises:
            RunDamagedError: The file was changed since it was opened.
        """
        if self._stream is None:
            return self._kept[chunk]
        self._stream.seek(self._places[chunk][0])
        try:
            found = self._content(self._stream.readline(MOST_LINE + 1))
            rows: list[list[float]] = _numbers(found).tolist()
        except (ValueError, KeyError, TypeError, RecursionError):
            self.damaged()
        return rows

    def add(self, chunk: int, columns: list[str], rows: list[list[float]]) -> None:
        """Add what was measured of a chunk; it is on the disk when this returns.

        Raises:
            RunDiffersError: Its columns are not those of the chunks before.
            OutputError: It is too long for a line.
        """
        self._require_columns(columns)
        if self._stream is None:
            self._kept[chunk] = rows
            return
        numbers = np.array(rows, dtype="<f8")
        text = base64.b64encode(numbers.tobytes()).decode()
        place = self._stream.seek(0, os.SEEK_END)
        self._write({"chunk": chunk, "columns": columns, "designs": len(rows), "numbers": text})
        self._places[chunk] = place, len(rows)

    def damaged(self) -> NoReturn:
        """Refuse the journal.

        Raises:
            RunDamagedError: Always.
        """
        raise RunDamagedError(f"'{self._path}' is damaged, or no journal of a sweep; --overwrite starts again")

    def _require_columns(self, columns: list[str]) -> None:
        if self.columns and columns != self.columns:
            raise RunDiffersError(
                f"designs have different measures: {listed(self.columns)}, and {listed(columns)} of others"
            )
        self.columns = columns

    def _require_writable(self) -> None:
        if self._refusal is not None:
            raise self._refusal

    def _write(self, value: Mapping[str, Any]) -> None:
        assert self._stream is not None
        self._require_writable()
        line = self._line(json.dumps(value).encode())
        if len(line) > MOST_LINE:
            raise OutputError(f"cannot write '{self._path}': designs have too many measures")
        self._stream.write(line)
        self._stream.flush()
        os.fsync(self._stream.fileno())

    def _line(self, content: bytes) -> bytes:
        digest = hashlib.sha256(self._settings_digest.encode() + content).hexdigest()
        return digest.encode() + b" " + content + b"\n"

    def _content(self, line: bytes) -> dict[str, Any]:
        """Return what is in a whole line.

        Raises:
            ValueError, RecursionError: The line is not as it was written.
        """
        content = line[_DIGEST + 1 : -1]
        if len(line) > MOST_LINE or line != self._line(content):
            raise ValueError("not a line as it was written")
        value = json.loads(content)
        if not isinstance(value, dict):
            raise ValueError("not an object")
        return value

    def _read(self, out: Path) -> None:
        """Note where chunks are; a last line that was cut off is dropped."""
        stream = self._stream
        assert stream is not None
        stream.seek(0)
        first = self._line(json.dumps({"dh2sim_sweep": FORMAT, "settings": self.settings}).encode())
        line = stream.readline(MOST_LINE + 1)
        if first.startswith(line) and line != first:  # nothing, or cut off
            self._require_writable()
            stream.truncate(0)
            stream.write(first)
            stream.flush()
            os.fsync(stream.fileno())
            line = first
        try:
            value = self._content(line)
            if value["dh2sim_sweep"] != FORMAT or not isinstance(value["settings"], dict):
                self.damaged()
            _compare(out, value["settings"], self.settings)
            self._settings_digest = line[:_DIGEST].decode()
            place = len(line)
            while line := stream.readline(MOST_LINE + 1):
                if not line.endswith(b"\n") and len(line) <= MOST_LINE:
                    break
                value = self._content(line)
                chunk, columns, found = value["chunk"], value["columns"], _numbers(value)
                if type(chunk) is not int or not 0 <= chunk < MOST_CHUNKS or not _are_names(columns):
                    self.damaged()
                self._require_columns(columns)
                self._places[chunk] = place, len(found)
                place += len(line)
        except (ValueError, KeyError, TypeError, RecursionError):
            self.damaged()
        if self._refusal is None:
            stream.truncate(place)


@contextmanager
def _opened(path: Path) -> Iterator[tuple[BinaryIO, OSError | None]]:
    """Open a file to be read and appended to, which is made if it is missing; no link, pipe or device.

    One that may only be read is opened for that, and the reason returned: a sweep that is complete adds nothing.
    """
    flags = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    if path.is_symlink():
        raise OSError(errno.EINVAL, "is a link, not a file", str(path))
    refusal = None
    try:
        handle = os.open(path, flags | os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
    except OSError as error:
        if not path.is_file():
            raise
        handle, refusal = os.open(path, flags | os.O_RDONLY), error
    with open(handle, "a+b" if refusal is None else "rb") as stream:
        if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
            raise OSError(errno.EINVAL, "is not a plain file", str(path))
        yield stream, refusal


def _are_names(columns: object) -> bool:
    return isinstance(columns, list) and all(isinstance(name, str) for name in columns)


def _numbers(found: Mapping[str, Any]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the numbers in a line, shape (designs, parameters and measures).

    Raises:
        ValueError, KeyError, TypeError: They are not as they were written.
    """
    designs = found["designs"]
    if type(designs) is not int or designs < 1:
        raise ValueError("no designs")
    try:
        numbers = np.frombuffer(base64.b64decode(found["numbers"], validate=True), dtype="<f8")
    except binascii.Error as error:
        raise ValueError(str(error)) from None
    return numbers.reshape(designs, -1)


def _compare(out: Path, old: Mapping[str, Any], new: Mapping[str, Any]) -> None:
    """Refuse other settings.

    Raises:
        RunDiffersError: They are others.
    """
    changed = [name for name in {**old, **new} if old.get(name) != new.get(name)]
    if not changed:
        return
    phrases = [
        f"the {name.removesuffix('_sha256')} has changed"
        if isinstance(new.get(name), str) and len(str(new.get(name))) == 64
        else f"{name} was {_text(old.get(name))} and is now {_text(new.get(name))}"
        for name in changed
    ]
    raise RunDiffersError(
        f"'{out}' was measured with other settings: {'; '.join(phrases)}. Choose another name, or --overwrite"
    )


def _text(value: object) -> str:
    match value:
        case dict():
            return ",".join(f"{key}={inner}" for key, inner in value.items()) or "none"
        case list():
            return ",".join(map(str, value)) or "none"
        case None:
            return "none"
        case _:
            return str(value)
