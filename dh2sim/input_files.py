"""Files that the user names, to be read: what JSON, CSV and NumPy files hold, or why they hold nothing.

Whatever is in a file, the functions for content raise nothing but ValueError, whose text completes a sentence about
it, and take no more time and memory than its size warrants.
"""

from __future__ import annotations

import codecs
import csv
import errno
import io
import json
import math
import os
import zipfile
from array import array
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Final, Literal, NoReturn

from dh2sim.messages import shown

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


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


_LONGEST_INTEGER: Final = 400
"""Digits; Python converts no more than some thousands, and no double holds more than 309."""
_MOST_COLUMNS: Final = 2000
"""Of a table; a robot has up to 494 joints."""
_LONGEST_LINE: Final = 200_000
"""Characters of a CSV file."""
_MOST_REPORTED: Final = 5
"""Problems of a CSV file."""


def json_content(data: bytes) -> Any:
    """Return what a JSON text holds; strictly JSON, so no NaN, and no key twice."""
    try:
        return json.loads(
            utf8_text(data), parse_int=_integer, parse_constant=_no_number, object_pairs_hook=_with_different_keys
        )
    except RecursionError:
        problem = "it is nested too deeply"
    except json.JSONDecodeError as error:
        what = error.msg.removesuffix(" at")
        problem = f"line {error.lineno}, column {error.colno}: {what[:1].lower()}{what[1:]}"
    except ValueError as error:
        problem = str(error)
    raise ValueError(f"is not a JSON file: {problem}")


def _integer(digits: str) -> int:
    if len(digits) > _LONGEST_INTEGER:
        raise ValueError(f"it contains a number of {len(digits)} digits")
    return int(digits)


def _no_number(name: str) -> NoReturn:
    raise ValueError(f"it contains {name}")


def _with_different_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError(f"it contains the key {shown(repeated(key for key, _ in pairs)[0])} twice in one object")
    return found


def utf8_text(data: bytes) -> str:
    """Return a text; a mark of the byte order at its beginning is left out."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        byte = f"0x{data[error.start]:02x}"
        raise ValueError(f"line {line} is not UTF-8: byte {byte}{utf16_hint(data)}") from None


def utf16_hint(data: bytes) -> str:
    """Return what to do with a text that begins as UTF-16 does, as Windows' PowerShell writes it; else nothing."""
    is_utf16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return "; it seems to be UTF-16: save it as UTF-8" if is_utf16 else ""


def repeated(names: Iterable[str]) -> list[str]:
    """Return the names that occur more than once, sorted."""
    return sorted(name for name, count in Counter(names).items() if count > 1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NumberTable:
    """A CSV file of numbers, whose first line names the columns."""

    header: tuple[str, ...]
    """The names; none where the file has no lines."""
    values: NDArray[np.float64]
    """Shape (rows, columns); lines that are empty are passed over. Without meaning where there are problems."""
    problems: tuple[str, ...]
    """What is wrong with the numbers, with lines and columns; at most some of it."""


def csv_numbers(data: bytes) -> NumberTable:
    """Return the numbers of a CSV file; they take no more memory than eight bytes each, whatever the lines hold."""
    import numpy as np

    rows = _csv_rows(data)
    _, names = next(rows, (0, []))
    header = tuple(cell.strip() for cell in names)
    values, problems, count = array("d"), list[str](), 0
    for line, row in rows:
        if len(row) != len(header):
            found = [f"line {line} has {len(row)} values; the first line names {len(header)} columns"]
        else:
            numbers = [*map(_number, row)]
            values.extend(numbers)
            found = [
                f"line {line}, column '{name}': {shown(cell)} is not a finite number"
                for name, cell, number in zip(header, row, numbers, strict=True)
                if not math.isfinite(number)
            ]
        count += len(found)
        problems += found[: _MOST_REPORTED - len(problems)]
    if not values and not count:
        problems.append("there are no values below the first line")
    if count > _MOST_REPORTED:
        problems.append(f"and {count - _MOST_REPORTED} more")
    table = np.frombuffer(values, dtype=np.float64).reshape(-1, len(header) or 1)
    return NumberTable(header=header, values=table, problems=tuple(problems))


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _csv_rows(data: bytes) -> Iterator[tuple[int, list[str]]]:
    """Yield the lines of a CSV file that are not blank, each with its number, from 1."""
    first = True
    reader = csv.reader(_lines(data))
    try:
        for row in reader:
            if first and row:
                check_columns(len(row))
            if any(map(str.strip, row)):
                first = False
                yield reader.line_num, row
    except csv.Error as error:
        raise ValueError(f"is not a CSV file: {error}") from None
    except UnicodeDecodeError:
        try:
            utf8_text(data)
        except ValueError as error:
            raise ValueError(f"is not a CSV file: {error}") from None
        raise


def _lines(data: bytes) -> Iterator[str]:
    """Yield the lines of a text, with their ends."""
    stream = io.TextIOWrapper(io.BytesIO(data), "utf-8-sig", newline="")
    number = 0
    while line := stream.readline(_LONGEST_LINE + 1):
        number += 1
        if len(line) > _LONGEST_LINE:
            raise ValueError(f"is not a CSV file: line {number} has more than {_LONGEST_LINE} characters")
        yield line


def check_columns(count: int) -> None:
    """Refuse a table of more columns than one can have."""
    if count > _MOST_COLUMNS:
        raise ValueError(f"has {count} columns; at most {_MOST_COLUMNS} are allowed")


class NpyFile:
    """The array in a .npy file, which is not one of Python objects; its numbers are read when they are needed.

    It is not mapped into memory: a file that shrinks would end the process.
    """

    def __init__(self, path: Path) -> None:
        """Read what the array is.

        Raises:
            ValueError: It is none.
            OSError: The file cannot be read.
        """
        with path.open("rb") as file:
            self.shape, self._order, self.dtype = _array_header(file, os.fstat(file.fileno()).st_size)
            self._begin = file.tell()
        self._path = path

    def rows(self, start: int, stop: int) -> NDArray[Any]:
        """Return some rows, shape (stop - start, ...); all are read to return some where columns are in order.

        Raises:
            ValueError: The file is shorter than it was.
            OSError: It cannot be read.
        """
        if self._order == "F":
            return self.all()[start:stop]
        row = math.prod(self.shape[1:]) * self.dtype.itemsize
        return self._read((stop - start, *self.shape[1:]), start * row)

    def all(self) -> NDArray[Any]:
        """Return the whole array; raises as ``rows`` does."""
        return self._read(self.shape, 0)

    def _read(self, shape: tuple[int, ...], skipped: int) -> NDArray[Any]:
        import numpy as np

        size = math.prod(shape) * self.dtype.itemsize
        with self._path.open("rb") as file:
            file.seek(self._begin + skipped)
            data = file.read(size)
        if len(data) < size:
            raise ValueError("became shorter while it was read")
        return np.ndarray(shape, self.dtype, data, order=self._order)


def npz_arrays(data: bytes, most: int) -> dict[str, NDArray[Any]]:
    """Return the arrays of a .npz file by name; they may have ``most`` bytes in all."""
    import numpy as np

    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            size = sum(info.file_size for info in archive.infolist())
            members = {name: archive.read(name) for name in archive.namelist() if size <= most}
    except Exception as error:  # of many kinds: encrypted, of an unknown method, cut off …
        raise ValueError("is not a NumPy archive, or damaged") from error
    if size > most:
        raise ValueError(f"holds more than {most // 2**20} MB")
    arrays: dict[str, NDArray[Any]] = {}
    for name, content in members.items():
        file = io.BytesIO(content)
        try:
            shape, order, dtype = _array_header(file, len(content))
        except ValueError as error:
            raise ValueError(f"is not a NumPy archive: '{name}' {error}") from None
        arrays[name.removesuffix(".npy")] = np.ndarray(shape, dtype, content, file.tell(), order=order)
    return arrays


def _array_header(file: BinaryIO, size: int) -> tuple[tuple[int, ...], Literal["C", "F"], np.dtype[Any]]:
    """Return shape, order and type of the array in a file of ``size`` bytes, and leave it at the array's values."""
    import numpy as np

    try:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, fortran, dtype = read(file)
    except Exception as error:  # NumPy evaluates the header, which fails in many ways
        raise ValueError("is not a NumPy array: it does not begin as one") from error
    if dtype.hasobject:
        raise ValueError("is not a NumPy array: it contains Python objects, which are not read")
    there = size - file.tell()
    if any(length < 0 for length in shape) or math.prod(shape) * dtype.itemsize > there:
        raise ValueError("is not a NumPy array: it is shorter than it says")
    return shape, "F" if fortran else "C", dtype
