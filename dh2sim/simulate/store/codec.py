"""Chunk files: compressed, with a checksum at the end, so that every reader notices damage."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Sequence
from typing import Any, BinaryIO, Final

import google_crc32c
import numpy as np
from numcodecs.blosc import Blosc  # type: ignore[import-untyped]
from numpy.typing import NDArray
from zarr.codecs import BloscCodec, Crc32cCodec

from dh2sim.simulate.store.storage import Store

CODECS: Final = (BloscCodec(cname="lz4", clevel=3, shuffle="shuffle"), Crc32cCodec())
"""The codecs of variables in zarr's terms; ``encode`` writes the same bytes."""
LARGEST_CHUNK: Final = 2**31 - 2**16
"""Bytes that Blosc can compress at once, rounded down."""
CHECKSUM_BYTES: Final = 4
_BLOSC: Final = Blosc(cname="lz4", clevel=3, shuffle=Blosc.SHUFFLE)
ITEM_SIZES: Final = {"int8": 1, "int32": 4, "int64": 8, "float32": 4, "float64": 8, "string": 8}
"""Bytes of an item of every type that arrays of a run have; of text those that lengths take, twice."""
READABLE_CODECS: Final = frozenset(("bytes", "blosc", "zstd", "gzip", "crc32c", "vlen-utf8"))
"""Codecs of arrays that others may have written, such as xarray; none of them executes anything."""


_COMPRESSORS: Final = frozenset(("blosc", "zstd", "gzip"))
MOST_TEXT: Final = 2**24
"""Bytes of the texts in a chunk."""


def largest_chunk_file(chunk: Sequence[int], kind: str) -> int:
    """Return the bytes that a chunk's file may have: what cannot be compressed becomes a little larger."""
    size = MOST_TEXT if kind == "string" else math.prod(chunk) * ITEM_SIZES[kind]
    return size + size // 64 + 2**12


def chunk_problem(head: bytes, rest: BinaryIO, codecs: Sequence[str], most: int) -> str | None:
    """Return why a chunk that somebody else wrote is not given to its codecs, or None.

    Args:
        head: The first bytes of its file, 18 or more if it has them.
        rest: Reads the file from its beginning.
        codecs: Names of its codecs, in the order in which they were applied.
        most: Bytes that it may have once it is decompressed.
    """
    compressors = [name for name in codecs if name in _COMPRESSORS]
    if len(compressors) > 1:
        return "it is compressed more than once"
    match compressors:
        case ["blosc"]:
            size: int | None = int.from_bytes(head[4:8], "little")
        case ["zstd"]:
            size = _zstd_size(head)
        case ["gzip"]:
            size = _gzip_size(rest, most)
        case _:
            size = 0
    return "it becomes larger than a chunk" if size is None or size > most else None


def _zstd_size(head: bytes) -> int | None:
    """Return the size that a frame of Zstandard says it has (RFC 8878, section 3.1.1); None if it does not say."""
    if head[:4] != b"\x28\xb5\x2f\xfd" or len(head) < 5:
        return None
    kind, single, dictionary = head[4] >> 6, head[4] >> 5 & 1, (0, 1, 2, 4)[head[4] & 3]
    length = (single, 2, 4, 8)[kind]
    begin = 5 + (1 - single) + dictionary
    found = head[begin : begin + length]
    return int.from_bytes(found, "little") + 256 * (kind == 1) if found else None


def _gzip_size(file: BinaryIO, most: int) -> int | None:
    """Return the size of what is compressed with gzip; None if it is more than ``most`` bytes, or damaged."""
    total, stream = 0, zlib.decompressobj(31)
    try:
        while data := stream.unconsumed_tail or file.read(2**16):
            total += len(stream.decompress(data, 2**20))
            if total > most or stream.unused_data:
                return None
    except zlib.error:
        return None
    return total


def is_known(kind: str, codecs: object) -> bool:
    """Whether zarr's metadata name codecs that arrays of a run of this type have; no others are ever called."""
    if kind not in ITEM_SIZES or not isinstance(codecs, list):
        return False
    crc32c = {"name": "crc32c"}
    if kind == "string":
        return codecs == [{"name": "vlen-utf8", "configuration": {}}, crc32c]
    size = ITEM_SIZES[kind]
    plain = {"name": "bytes"} if size == 1 else {"name": "bytes", "configuration": {"endian": "little"}}
    blosc = {"cname": "lz4", "clevel": 3, "shuffle": "shuffle", "typesize": size, "blocksize": 0}
    return codecs in ([plain, crc32c], [plain, {"name": "blosc", "configuration": blosc}, crc32c])


def encode(values: NDArray[Any], *, dtype: np.dtype[Any], length: int, fill: float | int) -> tuple[bytes, int]:
    """Return the compressed bytes of a chunk and their CRC-32C, which follows them in the file.

    Call it from a thread other than the main one: there Blosc uses one thread, and its output is always the same.

    Args:
        values: Rollouts of a block; at most ``length`` along the first axis.
        dtype: Type in the file, where it is little-endian.
        length: Rollouts in a chunk; the chunk of a smaller last block is padded.
        fill: The padding.
    """
    whole = np.ascontiguousarray(values, dtype=dtype.newbyteorder("<"))
    if len(whole) < length:
        rest = np.full((length - len(whole), *whole.shape[1:]), fill, dtype=whole.dtype)
        whole = np.concatenate([whole, rest])
    data: bytes = _BLOSC.encode(whole)
    return data, google_crc32c.value(data)


def checksum_bytes(checksum: int) -> bytes:
    """Return a CRC-32C as zarr's codec of that name appends it."""
    return checksum.to_bytes(CHECKSUM_BYTES, "little")


def encode_text(text: str) -> bytes:
    """Return the chunk of one text: zarr's codecs vlen-utf8 and crc32c."""
    data = text.encode()
    data = struct.pack("<II", 1, len(data)) + data
    return data + checksum_bytes(google_crc32c.value(data))


def decode_text(chunk: bytes) -> str | None:
    """Return the text of a chunk, or None if it is not what ``encode_text`` returned."""
    data, checksum = chunk[:-CHECKSUM_BYTES], chunk[-CHECKSUM_BYTES:]
    if checksum != checksum_bytes(google_crc32c.value(data)) or data[:8] != struct.pack("<II", 1, len(data) - 8):
        return None
    return data[8:].decode()


def stored_checksum(store: Store, key: str) -> int | None:
    """Return the checksum at the end of a chunk, unverified; None if the chunk is missing or too short."""
    try:
        found = store.get(key, most=CHECKSUM_BYTES, last=CHECKSUM_BYTES)
    except OSError:
        return None
    return int.from_bytes(found, "little") if len(found) == CHECKSUM_BYTES else None


def verified_checksum(store: Store, key: str) -> int | None:
    """Return the checksum at the end of a chunk; None if the chunk is missing or differs from its checksum."""
    checksum, held = 0, b""
    try:
        for piece in store.pieces(key):
            whole = held + piece if len(piece) < CHECKSUM_BYTES else piece
            if whole is piece:
                checksum = google_crc32c.extend(checksum, held)
            checksum = google_crc32c.extend(checksum, whole[:-CHECKSUM_BYTES])
            held = whole[-CHECKSUM_BYTES:]
    except OSError:
        return None
    return checksum if held == checksum_bytes(checksum) else None
