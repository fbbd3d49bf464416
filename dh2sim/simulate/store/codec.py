"""Chunk files: compressed, with a checksum at the end, so that every reader notices damage."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Final

import google_crc32c
import numpy as np
from numcodecs.blosc import Blosc  # type: ignore[import-untyped]
from numpy.typing import NDArray
from zarr.codecs import BloscCodec, Crc32cCodec

CODECS: Final = (BloscCodec(cname="lz4", clevel=3, shuffle="shuffle"), Crc32cCodec())
"""What zarr is told of the chunks of variables; ``encode`` writes just that."""
LARGEST_CHUNK: Final = 2**31 - 2**16
"""Bytes that Blosc can compress at once, rounded down."""
CHECKSUM_BYTES: Final = 4
_BLOSC: Final = Blosc(cname="lz4", clevel=3, shuffle=Blosc.SHUFFLE)
_PIECE: Final = 4 * 2**20


def encode(values: NDArray[Any], *, dtype: np.dtype[Any], length: int, fill: float | int) -> tuple[bytes, bytes]:
    """Return a chunk's compressed bytes and the checksum that follows them.

    Call it from a thread that is not the main one: there Blosc uses one thread, whose output is always the same.

    Args:
        values: rollouts of a block, the first axis at most ``length`` long.
        dtype: type in the file; little-endian there.
        length: rollouts in a chunk; the chunk of a smaller last block is filled up.
        fill: what to fill it up with.
    """
    whole = np.ascontiguousarray(values, dtype=dtype.newbyteorder("<"))
    if len(whole) < length:
        rest = np.full((length - len(whole), *whole.shape[1:]), fill, dtype=whole.dtype)
        whole = np.concatenate([whole, rest])
    data: bytes = _BLOSC.encode(whole)
    return data, checksum_bytes(google_crc32c.value(data))


def plain(values: NDArray[Any]) -> bytes:
    """Return a chunk that is not compressed: little-endian numbers and their checksum."""
    data = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<")).tobytes()
    return data + checksum_bytes(google_crc32c.value(data))


def read_plain(path: Path, dtype: str, count: int) -> NDArray[Any] | None:
    """Return what ``plain`` made a file of, or None if that is not what stands there."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    kind = np.dtype(dtype).newbyteorder("<")
    numbers, tail = data[:-CHECKSUM_BYTES], data[-CHECKSUM_BYTES:]
    if len(numbers) != count * kind.itemsize or tail != checksum_bytes(google_crc32c.value(numbers)):
        return None
    return np.frombuffer(numbers, dtype=kind)


def sound_checksum(path: Path) -> int | None:
    """Return the checksum that ends a chunk file, or None if the file is missing or the checksum does not hold."""
    try:
        with path.open("rb") as file:
            left = os.fstat(file.fileno()).st_size - CHECKSUM_BYTES
            checksum = 0
            while left > 0:
                piece = file.read(min(left, _PIECE))
                if not piece:
                    return None
                checksum = google_crc32c.extend(checksum, piece)
                left -= len(piece)
            return checksum if file.read() == checksum_bytes(checksum) else None
    except OSError:
        return None


def last_checksum(path: Path) -> int | None:
    """Return the checksum that ends a chunk file, unchecked; None if the file is missing or too short."""
    try:
        with path.open("rb") as file:
            file.seek(-CHECKSUM_BYTES, os.SEEK_END)
            return int.from_bytes(file.read(CHECKSUM_BYTES), "little")
    except OSError:
        return None


def checksum_bytes(checksum: int) -> bytes:
    """Return a CRC-32C as the zarr codec of that name writes it."""
    return checksum.to_bytes(CHECKSUM_BYTES, "little")
