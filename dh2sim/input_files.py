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
import zipfile
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Final, NoReturn

from dh2sim.messages import shown

if TYPE_CHECKING:
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


def csv_lines(data: bytes) -> list[tuple[int, list[str]]]:
    """Return the lines of a CSV file that are not empty, each with its number, from 1; the first names columns."""
    try:
        reader = csv.reader(io.StringIO(utf8_text(data), newline=""))
        lines = [(reader.line_num, row) for row in reader if row]
    except (ValueError, csv.Error) as error:
        raise ValueError(f"is not a CSV file: {error}") from None
    check_columns(len(lines[0][1]) if lines else 0)
    return lines


def check_columns(count: int) -> None:
    """Refuse a table of more columns than one can have."""
    if count > _MOST_COLUMNS:
        raise ValueError(f"has {count} columns; at most {_MOST_COLUMNS} are allowed")


def npy_array(path: Path) -> NDArray[Any]:
    """Return the array in a .npy file, which is read from the file when it is used; not one of Python objects."""
    import numpy as np

    with path.open("rb") as file:
        shape, order, dtype = _array_header(file, path.stat().st_size)
        if 0 in shape:
            return np.empty(shape, dtype)
        return np.memmap(path, dtype, mode="r", offset=file.tell(), shape=shape, order=order)


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


def _array_header(file: BinaryIO, size: int) -> tuple[tuple[int, ...], Any, Any]:
    """Return shape, order and type of the array in a file of ``size`` bytes, and leave it at the array's values."""
    import math

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
