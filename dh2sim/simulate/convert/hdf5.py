"""Conversion of a run to one HDF5 file in the netCDF-4 layout, which xarray reads as the same dataset."""

from __future__ import annotations

import io
import math
import os
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dh2sim.extras import require_extra
from dh2sim.files import signals_deferred
from dh2sim.progress import Advance, no_progress
from dh2sim.simulate.convert.blocks import RunBlocks, attribute_text, open_blocks, output_files, plain
from dh2sim.simulate.store.storage import Place

if TYPE_CHECKING:
    import h5netcdf
    import xarray as xr
    from _typeshed import ReadableBuffer, WriteableBuffer

CHUNK_BYTES = 4 << 20
"""Largest chunk: HDF5 reads and unpacks whole chunks, and a single rollout is often read."""
LEVEL = 1
"""Of gzip; higher levels are much slower and save a few per cent."""


def to_hdf5(
    path: Place,
    out: Path,
    *,
    overwrite: bool = False,
    advance: Advance = no_progress,
) -> tuple[Path, ...]:
    """Write a run as an HDF5 file.

    Args:
        path: The run.
        out: The file.
        overwrite: Whether an existing file is replaced.
        advance: Called with the number of rollouts that were written.

    Returns:
        The file written.

    Raises:
        MissingExtraError: h5netcdf or h5py is not installed.
        RunError: There is no run, or it is damaged.
        OutputError: The file exists, or cannot be written.
    """
    require_extra("data", "xarray", "h5netcdf", "h5py", what="HDF5")
    run = open_blocks(path)
    with output_files([out], run=path, overwrite=overwrite) as [staged], _opened(staged) as (file, sink):
        with signals_deferred():  # HDF5 calls Python for every write, and does not survive an exception there
            _define(file, run)
        for rollouts, block in run:
            for name in block.data_vars:
                with signals_deferred():
                    file.variables[str(name)][rollouts.start : rollouts.stop] = block[name].values
                sink.check()
            advance(len(rollouts))
    return (out,)


@contextmanager
def _opened(path: Path) -> Iterator[tuple[h5netcdf.File, _Sink]]:
    import h5netcdf

    with closing(_Sink(path)) as sink:
        file = h5netcdf.File(sink, "w")
        try:
            yield file, sink
        except Exception:
            sink.check()  # the cause, if there is one, says more
            raise
        finally:
            with signals_deferred():
                file.close()
        sink.check()


def chunk_shape(shape: tuple[int, ...], itemsize: int, block: int) -> tuple[int, ...]:
    """Return the shape of the chunks of a variable.

    A chunk holds whole rollouts, as many as fit into ``CHUNK_BYTES`` and divide a block. If not even one fits, it
    holds as many of its records as do.

    Args:
        shape: Of the variable, rollouts first.
        itemsize: Bytes of a number.
        block: Rollouts in a block.
    """
    one = itemsize * math.prod(shape[1:])
    if one > CHUNK_BYTES and len(shape) > 1:
        records = max(1, CHUNK_BYTES * shape[1] // one)
        return (1, records, *shape[2:])
    block = min(block, shape[0])
    fitting = max(1, min(block, CHUNK_BYTES // max(1, one)))
    rollouts = max(count for count in range(1, fitting + 1) if block % count == 0)
    return (rollouts, *shape[1:])


class _Sink(io.RawIOBase):
    """A new file that HDF5 reads and writes without learning of an error.

    When a write fails, HDF5 cannot close its file: it keeps trying, prints, and may crash at exit. So this file keeps
    its first error until ``check`` raises it, and drops what is written after it.
    """

    def __init__(self, path: Path) -> None:
        """Create the file.

        Raises:
            OSError: It cannot be created.
        """
        self._file = open(path, "xb+", buffering=0)  # noqa: SIM115
        self._error: OSError | None = None

    def check(self) -> None:
        """Raise the first error, if any.

        Raises:
            OSError: Something could not be written.
        """
        if self._error is not None:
            raise self._error

    def write(self, data: ReadableBuffer, /) -> int:
        """Write all of the data, unless there was an error."""
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
        """Change the position."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """Return the position."""
        return self._file.tell()

    def truncate(self, size: int | None = None, /) -> int:
        """Change the length of the file."""
        try:
            return self._file.truncate(size)
        except OSError as error:
            self._error = self._error or error
            return self._file.tell() if size is None else size

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        super().close()


def _define(file: h5netcdf.File, run: RunBlocks) -> None:
    """Write everything except the numbers of variables."""
    dataset = run.dataset
    file.dimensions = {str(name): size for name, size in dataset.sizes.items()}
    for key, value in dataset.attrs.items():
        file.attrs[str(key)] = _attribute(value)
    for name, coordinate in dataset.coords.items():
        _write_coordinate(file, str(name), coordinate)
    for name, variable in dataset.data_vars.items():
        stored: dict[str, Any] = {}
        if variable.size:
            chunks = chunk_shape(variable.shape, variable.dtype.itemsize, run.stored.manifest.block)
            stored = {"chunks": chunks, "compression": "gzip", "compression_opts": LEVEL, "shuffle": True}
        made = file.create_variable(str(name), tuple(map(str, variable.dims)), variable.dtype, **stored)
        for key, value in _attributes(variable).items():
            made.attrs[key] = value
        others = [
            str(label)
            for label, coordinate in dataset.coords.items()
            if label not in dataset.sizes and set(coordinate.dims) <= set(variable.dims)
        ]
        if others:
            made.attrs["coordinates"] = " ".join(others)


def _write_coordinate(file: h5netcdf.File, name: str, coordinate: xr.DataArray) -> None:
    import h5py

    text = coordinate.dtype.kind in "OUT"
    values = np.array([str(label) for label in coordinate.values], dtype=object) if text else coordinate.values
    made = file.create_variable(
        name, tuple(map(str, coordinate.dims)), h5py.string_dtype() if text else coordinate.dtype
    )
    made[...] = values
    for key, value in _attributes(coordinate).items():
        made.attrs[key] = value


def _attributes(variable: xr.DataArray) -> Mapping[str, Any]:
    """Return a variable's attributes; flags have the type of the variable, as the CF conventions require."""
    return {
        str(key): np.asarray(value, dtype=variable.dtype) if key == "flag_values" else _attribute(value)
        for key, value in variable.attrs.items()
    }


def _attribute(value: object) -> str | int | float:
    """Return an attribute for HDF5: text and numbers as they are, anything else as JSON."""
    value = plain(value)
    if isinstance(value, str | float) or (isinstance(value, int) and not isinstance(value, bool) and value < 2**63):
        return value
    return attribute_text(value)
