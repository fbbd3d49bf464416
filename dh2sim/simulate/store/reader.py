"""Reading a run, finished or not: its dataset, and which of its blocks are committed."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import RunDamagedError, RunError
from dh2sim.extras import require_extra
from dh2sim.files import read_plain_file
from dh2sim.simulate.store.codec import CHECKSUM_BYTES, ITEM_SIZES, decode_text, stored_checksum, verified_checksum
from dh2sim.simulate.store.manifest import (
    BLOCKS,
    METADATA,
    RECORD,
    BlockRecord,
    Manifest,
    StoredArray,
    damaged_metadata,
    read_manifest,
    read_node,
)

if TYPE_CHECKING:
    import xarray

_MOST_RECORD = 2**20
"""Bytes of a record."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredRun:
    """A run on disk: its manifest, and the files of its blocks."""

    path: Path
    manifest: Manifest

    def chunk(self, variable: str, block: int) -> Path:
        """Return the file of a variable's chunk."""
        return self.path / variable / self.manifest.variables[variable].chunk_name(block)

    def record_file(self, block: int) -> Path:
        """Return the file of the record that commits a block."""
        return self.path / BLOCKS / RECORD / f"c.{block}"

    def record(self, block: int) -> BlockRecord | None:
        """Return the record of a block, or None if there is no valid one."""
        try:
            text = decode_text(read_plain_file(self.record_file(block), _MOST_RECORD))
        except OSError:
            return None
        record = None if text is None else BlockRecord.from_text(text)
        if record is None or (record.block, record.run) != (block, self.manifest.digest):
            return None
        return record

    def committed(self, block: int) -> BlockRecord | None:
        """Return the record of a block if its chunks are there, else None; they are not read."""
        return self._matching(block, stored_checksum)

    def verified(self, block: int) -> BlockRecord | None:
        """Return the record of a block if its chunks are what was written, else None; reads all of them."""
        return self._matching(block, verified_checksum)

    def _matching(self, block: int, checksum_of: Callable[[Path], int | None]) -> BlockRecord | None:
        record = self.record(block)
        written = {name for name, variable in self.manifest.variables.items() if not variable.empty}
        if record is None or {*record.checksums} != written:
            return None
        if any(checksum_of(self.chunk(name, block)) != checksum for name, checksum in record.checksums.items()):
            return None
        return record

    def check_coordinates(self) -> None:
        """Check that the coordinates are what was written.

        Raises:
            RunDamagedError: A file is missing or damaged.
        """
        for name, coordinate in self.manifest.coordinates.items():
            file = self.path / name / coordinate.chunk_name(0)
            if not coordinate.empty and verified_checksum(file) is None:
                raise damaged_metadata(file)

    def check_files(self) -> None:
        """Check that arrays have folders, and that coordinates have as many bytes as their sizes ask for.

        So no size is believed that nothing on the disk stands for.

        Raises:
            RunDamagedError: A file or folder is missing or differs.
        """
        arrays = {**self.manifest.coordinates, **self.manifest.variables}
        for folder in (*(self.path / name for name in arrays), self.path / BLOCKS, self.path / BLOCKS / RECORD):
            if folder.is_symlink() or not folder.is_dir():
                raise damaged_metadata(folder / METADATA)
        for name, coordinate in self.manifest.coordinates.items():
            file = self.path / name / coordinate.chunk_name(0)
            if not coordinate.empty and not _has_size(file, coordinate):
                raise damaged_metadata(file)

    def check_array_metadata(self) -> None:
        """Check that the metadata in the folder of every array are those in the root.

        Raises:
            RunDamagedError: A file is missing or damaged.
        """
        for name, expected in self.manifest.nodes.items():
            file = self.path / name / METADATA
            if read_node(file) != expected:
                raise damaged_metadata(file)

    def check_chunks(self) -> None:
        """Check that no chunk of a committed block is missing, without opening any; zarr would read it as blank.

        Raises:
            RunDamagedError: A chunk or a folder is missing.
        """
        with reading(self.path):
            blocks = self.recorded_blocks()
            for name, variable in self.manifest.variables.items():
                with os.scandir(self.path / name) as entries:
                    files = {entry.name: entry.is_file(follow_symlinks=False) for entry in entries}
                missing = any(variable.chunk_name(block) not in files for block in blocks)
                if (missing and not variable.empty) or not all(files.values()):
                    raise RunDamagedError(damaged_run(self.path))

    def recorded_blocks(self) -> list[int]:
        """Return the blocks that have a record, which is not read.

        Raises:
            OSError, ValueError: The folder cannot be listed, or contains something else.
        """
        records = os.listdir(self.path / BLOCKS / RECORD)
        found = sorted(int(name.removeprefix("c.")) for name in records if name.startswith("c."))
        return [block for block in found if block < self.manifest.blocks]

    def values(self, variable: str) -> NDArray[Any]:
        """Read a whole variable, without xarray.

        Raises:
            RunDamagedError: A chunk is damaged.
        """
        import zarr

        with reading(self.path):
            group = zarr.open_group(
                self.path, mode="r", zarr_format=3
            )  # its consolidated metadata are those of the manifest
            return np.asarray(group[variable][...])  # type: ignore[index]


def open_run(path: Path) -> StoredRun:
    """Open a run for reading.

    Raises:
        RunError: There is no run.
        RunDamagedError: Its metadata are damaged.
    """
    run = StoredRun(path=path, manifest=read_manifest(path))
    run.check_files()
    return run


def open_dataset(path: str | PathLike[str]) -> xarray.Dataset:
    """Open the dataset of a run; numbers are read when they are used.

    Rollouts that are not simulated yet have the ``status`` -1, and NaN for numbers. Use numbers inside ``reading``.

    Raises:
        RunError: There is no run.
        RunDamagedError: Metadata or coordinates are damaged, or committed chunks are missing.
        MissingExtraError: xarray is not installed.
    """
    require_extra("data", "xarray", what="a run as an xarray dataset")
    import xarray

    run = open_run(Path(path))
    run.check_coordinates()
    run.check_chunks()
    with reading(run.path):
        return xarray.open_dataset(run.path, engine="zarr", chunks=None, consolidated=True, zarr_format=3)


def _has_size(file: Path, coordinate: StoredArray) -> bool:
    """Whether a file is a plain one with as many bytes as a coordinate takes; of text, at least as many."""
    try:
        found = file.lstat()
    except OSError:
        return False
    [count], text = coordinate.shape, coordinate.dtype == "string"
    least = count * (CHECKSUM_BYTES if text else ITEM_SIZES[coordinate.dtype]) + CHECKSUM_BYTES
    return stat.S_ISREG(found.st_mode) and (found.st_size > least if text else found.st_size == least)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn what zarr raises for a damaged chunk into an error for users; only read in this block.

    Raises:
        RunDamagedError: A chunk is damaged.
    """
    try:
        yield
    except RunError:
        raise
    except (OSError, ValueError, RuntimeError, KeyError, TypeError) as error:
        raise RunDamagedError(damaged_run(path)) from error


def damaged_run(path: Path) -> str:
    """Return the message for a run with damaged chunks."""
    return f"'{path}' is damaged; resume it with the same options to compute the damaged blocks again"
