"""Reading a run, finished or not: its dataset, and which of its blocks are committed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from os import fspath
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import Dh2simError, RunDamagedError, RunDiffersError
from dh2sim.extras import require_extra
from dh2sim.simulate.store.codec import CHECKSUM_BYTES, ITEM_SIZES, decode_text, stored_checksum, verified_checksum
from dh2sim.simulate.store.manifest import (
    BLOCKS,
    METADATA,
    MOST_METADATA,
    RECORD,
    BlockRecord,
    Manifest,
    StoredArray,
    damaged_metadata,
    read_manifest,
    read_node,
)
from dh2sim.simulate.store.objects import reading_error
from dh2sim.simulate.store.places import open_store
from dh2sim.simulate.store.storage import Place, Store, run_all

if TYPE_CHECKING:
    import xarray

_MOST_RECORD = 2**20
"""Bytes of a record."""
_READERS = 16
"""Threads that read small files, most of which wait."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredRun:
    """A run as it is stored: its manifest, and the files of its blocks."""

    store: Store
    manifest: Manifest

    def chunk(self, variable: str, block: int) -> str:
        """Return the key of a variable's chunk."""
        return f"{variable}/{self.manifest.variables[variable].chunk_name(block)}"

    def record_file(self, block: int) -> str:
        """Return the key of the record that commits a block."""
        return f"{BLOCKS}/{RECORD}/c.{block}"

    def record(self, block: int) -> BlockRecord | None:
        """Return the record of a block, or None if there is no valid one."""
        try:
            text = decode_text(self.store.get(self.record_file(block), most=_MOST_RECORD))
        except OSError:
            return None
        record = None if text is None else BlockRecord.from_text(text)
        if record is None or (record.block, record.run) != (block, self.manifest.digest):
            return None
        return record

    def records(self, blocks: Iterable[int]) -> dict[int, BlockRecord]:
        """Return the valid records of some blocks; their chunks are not looked at."""
        wanted = list(blocks)
        return _found(wanted, run_all(self.record, wanted, threads=_READERS))

    def committed(self, blocks: Iterable[int]) -> dict[int, BlockRecord]:
        """Return the records of the blocks whose chunks are there; they are not read."""
        wanted = list(blocks)
        return _found(wanted, run_all(lambda block: self._matching(block, stored_checksum), wanted, threads=_READERS))

    def verified(self, blocks: Iterable[int]) -> dict[int, BlockRecord]:
        """Return the records of the blocks whose chunks are what was written; reads all of them."""
        wanted = list(blocks)
        return _found(wanted, run_all(lambda block: self._matching(block, verified_checksum), wanted))

    def _matching(self, block: int, checksum_of: Callable[[Store, str], int | None]) -> BlockRecord | None:
        record = self.record(block)
        written = {name for name, variable in self.manifest.variables.items() if not variable.empty}
        if record is None or {*record.checksums} != written:
            return None
        for name, checksum in record.checksums.items():
            if checksum_of(self.store, self.chunk(name, block)) != checksum:
                return None
        return record

    def check_coordinates(self) -> None:
        """Check that the coordinates are what was written.

        Raises:
            RunDamagedError: A file is missing or damaged.
        """
        for name, coordinate in self.manifest.coordinates.items():
            file = f"{name}/{coordinate.chunk_name(0)}"
            if not coordinate.empty and verified_checksum(self.store, file) is None:
                raise damaged_metadata(self.store.file(file))

    def check_files(self) -> None:
        """Check that arrays have folders, and that coordinates have as many bytes as their sizes ask for.

        So no size is believed that nothing stored stands for.

        Raises:
            RunDamagedError: A file or folder is missing or differs.
        """
        arrays = (*self.manifest.coordinates, *self.manifest.variables, BLOCKS, f"{BLOCKS}/{RECORD}")

        def files_of(name: str) -> dict[str, int]:
            try:
                return self.store.list(name)
            except OSError as error:
                raise damaged_metadata(self.store.file(f"{name}/{METADATA}")) from error

        folders = dict(zip(arrays, run_all(files_of, arrays, threads=_READERS), strict=True))
        for name, coordinate in self.manifest.coordinates.items():
            file = coordinate.chunk_name(0)
            if not coordinate.empty and not _has_size(folders[name].get(file, -1), coordinate):
                raise damaged_metadata(self.store.file(f"{name}/{file}"))

    def check_unchanged(self) -> None:
        """Check that the run has not been replaced by another one since it was opened.

        Raises:
            RunDiffersError: It has, or is gone.
        """
        if (read_node(self.store, f"{BLOCKS}/{METADATA}") or {}).get("attributes", {}).get("digest") != (
            self.manifest.digest
        ):
            raise RunDiffersError(f"'{self.store.name}' was replaced or removed while it was written to")

    def check_array_metadata(self) -> None:
        """Check that the metadata in the folder of every array are those in the root.

        Raises:
            RunDamagedError: A file is missing or damaged.
        """
        for name, expected in self.manifest.nodes.items():
            file = f"{name}/{METADATA}"
            if read_node(self.store, file) != expected:
                raise damaged_metadata(self.store.file(file))

    def check_chunks(self) -> None:
        """Check that no chunk of a committed block is missing, without opening any; zarr would read it as blank.

        None is larger than a chunk can be, either: zarr reads files whole.

        Raises:
            RunDamagedError: A chunk or a folder is missing, or too large.
        """
        with reading(self.store.name):
            blocks = self.recorded_blocks()
            for name, variable in self.manifest.variables.items():
                files = self.store.list(name)
                missing = any(variable.chunk_name(block) not in files for block in blocks)
                strange = any(not 0 <= size <= max(variable.largest_file, MOST_METADATA) for size in files.values())
                if (missing and not variable.empty) or strange:
                    raise RunDamagedError(damaged_run(self.store.name))

    def recorded_blocks(self) -> list[int]:
        """Return the blocks that have a record, which is not read.

        Raises:
            OSError, ValueError: The folder cannot be listed, or contains something else.
        """
        records = self.store.list(f"{BLOCKS}/{RECORD}")
        found = sorted(int(name.removeprefix("c.")) for name in records if name.startswith("c."))
        return [block for block in found if block < self.manifest.blocks]

    def values(self, variable: str) -> NDArray[Any]:
        """Read a whole variable, without xarray.

        Raises:
            RunDamagedError: A chunk is damaged.
        """
        import zarr

        with reading(self.store.name):
            group = zarr.open_group(self.store.zarr, mode="r", zarr_format=3)  # consolidated: as in the manifest
            return np.asarray(group[variable][...])  # type: ignore[index]

    def bytes_stored(self) -> int:
        """Return the size of all files of the run."""
        folders = ("", *self.manifest.coordinates, *self.manifest.variables, BLOCKS, f"{BLOCKS}/{RECORD}")
        with reading(self.store.name):
            return sum(size for folder in folders for size in self.store.list(folder).values() if size > 0)


def open_run(place: Place) -> StoredRun:
    """Open a run for reading.

    Raises:
        RunError: There is no run.
        RunDamagedError: Its metadata are damaged.
    """
    store = open_store(place)
    run = StoredRun(store=store, manifest=read_manifest(store))
    run.check_files()
    return run


def damaged_blocks(path: Place) -> list[int]:
    """Return the blocks of a run that have a record, but whose files are not what was written; reads all of them.

    Raises:
        RunError: There is no run.
        RunDamagedError: Its metadata or coordinates are damaged.
    """
    run = open_run(path)
    run.check_array_metadata()
    run.check_coordinates()
    with reading(path):
        blocks = run.recorded_blocks()
    return sorted({*blocks} - {*run.verified(blocks)})


def open_dataset(path: Place) -> xarray.Dataset:
    """Open the dataset of a run; numbers are read when they are used.

    Rollouts that are not simulated yet have the ``status`` -1, and NaN for numbers. Use numbers inside ``reading``.

    Args:
        path: Its folder, or ``s3://BUCKET/NAME`` with the usual variables ``AWS_…`` of the environment.

    Raises:
        RunError: There is no run.
        RunDamagedError: Metadata or coordinates are damaged, or committed chunks are missing.
        MissingExtraError: xarray is not installed, or for an object store obstore is not.
    """
    require_extra("data", "xarray", what="a run as an xarray dataset")
    import xarray

    run = open_run(path)
    run.check_coordinates()
    run.check_chunks()
    with reading(path):
        return xarray.open_dataset(run.store.zarr, engine="zarr", chunks=None, consolidated=True, zarr_format=3)


def _found(blocks: list[int], records: list[BlockRecord | None]) -> dict[int, BlockRecord]:
    return {block: record for block, record in zip(blocks, records, strict=True) if record is not None}


def _has_size(size: int, coordinate: StoredArray) -> bool:
    """Whether a plain file of this size is that of a coordinate, or for text at least as large as it must be."""
    [count], text = coordinate.shape, coordinate.dtype == "string"
    least = count * (CHECKSUM_BYTES if text else ITEM_SIZES[coordinate.dtype]) + CHECKSUM_BYTES
    return size > least if text else size == least


@contextmanager
def reading(path: Place) -> Iterator[None]:
    """Turn what zarr raises for a damaged chunk into an error for users; only read in this block.

    Raises:
        RunDamagedError: A chunk is damaged.
        RunError: The object store cannot be read.
    """
    try:
        yield
    except Dh2simError:
        raise
    except (OSError, ValueError, RuntimeError, KeyError, TypeError) as error:
        raise RunDamagedError(damaged_run(path)) from error
    except Exception as error:
        if told := reading_error(fspath(path), error):
            raise told from error
        raise


def damaged_run(path: Place) -> str:
    """Return the message for a run with damaged chunks."""
    return f"'{fspath(path)}' is damaged; resume it with the same options to compute the damaged blocks again"
