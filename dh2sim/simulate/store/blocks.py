"""The blocks of a run on disk: their chunks, and the record that commits them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dh2sim.simulate.dataset_layout import Layout
from dh2sim.simulate.store.codec import encode, last_checksum, plain, read_plain, sound_checksum
from dh2sim.simulate.store.files import all_of, partial_of, put, remove, sync_folder, write_partial
from dh2sim.simulate.store.seal import BLOCKS, CHECKSUM, SECONDS, Seal

LAST = "status"
"""The variable whose chunk appears last: where a reader finds a status, the rest of the block is there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Blocks:
    """Where the files of blocks are, and whether they hold what was committed."""

    path: Path
    seal: Seal

    def chunk(self, name: str, block: int) -> Path:
        """Return the file of a variable's chunk."""
        return self.path / name / self.seal.variables[name].chunk_key.format(block)

    def seconds(self, block: int) -> float | None:
        """Return how many seconds a block took (NaN: nobody knows), or None if the file is not sound."""
        read = read_plain(self._seconds(block), "f8", 1)
        return None if read is None else float(read[0])

    def committed(self, block: int) -> bool:
        """Tell whether a block was committed; its chunks are there, and are not read."""
        checksums = self._recorded(block)
        return checksums is not None and all(
            last_checksum(self.chunk(name, block)) == checksum for name, checksum in checksums.items()
        )

    def sound(self, block: int) -> bool:
        """Tell whether a block was committed, and every chunk is still what it was; reads all of them."""
        checksums = self._recorded(block)
        return checksums is not None and all(
            sound_checksum(self.chunk(name, block)) == checksum for name, checksum in checksums.items()
        )

    def write(
        self, layout: Layout, block: int, arrays: Mapping[str, NDArray[Any]], seconds: float, pool: Executor
    ) -> None:
        """Write a block: its chunks, the time it took, and last of all the record that commits it.

        Each of these is on the disk before the next is begun.

        Raises:
            OSError: something cannot be written; the block is not committed, and what it left is removed.
        """
        fills = {variable.name: variable for variable in layout.variables}
        checksums = dict.fromkeys(self.seal.variables, 0)
        names = [name for name, stored in self.seal.variables.items() if not stored.empty]

        def stage(name: str) -> None:
            variable = fills[name]
            data, checksum = encode(arrays[name], dtype=variable.dtype, length=self.seal.block, fill=variable.fill)
            write_partial(self.chunk(name, block), data, checksum)
            checksums[name] = int.from_bytes(checksum, "little")

        try:
            all_of(pool, stage, names)
            for name in sorted(names, key=lambda name: name == LAST):
                os.replace(partial_of(self.chunk(name, block)), self.chunk(name, block))
            all_of(pool, sync_folder, [self.path / name for name in names])
            put(self._seconds(block), plain(np.array([seconds], dtype=np.float64)))
            put(self._checksum(block), plain(np.array(list(checksums.values()), dtype=np.uint32)))
        except BaseException:
            self.discard(block)
            raise

    def forget_seconds(self, block: int) -> None:
        """Note that nobody knows how long a block took."""
        put(self._seconds(block), plain(np.array([np.nan])))

    def discard(self, block: int) -> None:
        """Remove what there is of a block that is not committed, as far as possible; the record first."""
        chunks = [self.chunk(name, block) for name in self.seal.variables]
        for path in (self._checksum(block), self._seconds(block), *chunks):
            remove(path)
            remove(partial_of(path))

    def _seconds(self, block: int) -> Path:
        return self.path / BLOCKS / SECONDS / f"c.{block}"

    def _checksum(self, block: int) -> Path:
        return self.path / BLOCKS / CHECKSUM / f"c.{block}.0"

    def _recorded(self, block: int) -> dict[str, int] | None:
        """Return the checksums of the chunks of a committed block."""
        read = read_plain(self._checksum(block), "u4", len(self.seal.variables))
        if read is None:
            return None
        recorded = zip(self.seal.variables, map(int, read), strict=True)
        return {name: checksum for name, checksum in recorded if not self.seal.variables[name].empty}
