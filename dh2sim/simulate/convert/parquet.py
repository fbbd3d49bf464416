"""Conversion of a run to Parquet tables, in the long form that data frames and databases use.

There are three files, one for each kind of row: ``RUN.parquet`` has a row for every rollout, step and joint,
``RUN.steps.parquet`` one for every rollout and step, ``RUN.rollouts.parquet`` one for every rollout. What was not
recorded is null: the last step of interval variables, all that follows an early stop, rollouts not yet simulated.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dh2sim.extras import require_extra
from dh2sim.progress import Advance, no_progress
from dh2sim.simulate.convert.blocks import (
    attribute_text,
    open_blocks,
    output_files,
    plain,
    refuse_folder,
)
from dh2sim.simulate.store.storage import Place

if TYPE_CHECKING:
    import pyarrow as pa
    import xarray as xr

    from dh2sim.simulate.convert.tables import Table

SUFFIX = ".parquet"
GROUP_ROWS = 1 << 20
"""Largest row group; it is held in memory beside a block."""
LEVEL = 3
"""Of zstd."""
UNLIMITED = (-math.inf, math.inf)
"""Limits that JSON cannot represent."""


def parquet_files(out: Path) -> tuple[Path, Path, Path]:
    """Return the files of a conversion to ``out``: those of joints (``out`` itself), of steps and of rollouts."""
    stem = out.name.removesuffix(SUFFIX)
    return out, out.with_name(f"{stem}.steps{SUFFIX}"), out.with_name(f"{stem}.rollouts{SUFFIX}")


def to_parquet(
    path: Place,
    out: Path,
    *,
    overwrite: bool = False,
    advance: Advance = no_progress,
) -> tuple[Path, ...]:
    """Write a run as Parquet tables.

    Args:
        path: The run.
        out: File of the table of joints; those of steps and rollouts are written beside it.
        overwrite: Whether existing files are replaced.
        advance: Called with the number of rollouts that were written.

    Returns:
        The files written.

    Raises:
        MissingExtraError: pyarrow is not installed.
        RunError: There is no run, or it is damaged.
        OutputError: A file exists, or cannot be written.
    """
    require_extra("data", "xarray", "pyarrow", what="Parquet")
    import pyarrow.parquet as pq

    from dh2sim.simulate.convert.tables import make_tables

    refuse_folder(out)
    run = open_blocks(path)
    tables = make_tables(run.dataset)
    metadata = _metadata(run.dataset)
    paths = parquet_files(out)
    with output_files(paths, run=path, overwrite=overwrite) as staged, ExitStack() as stack:
        writers = []
        for table, temporary in zip(tables, staged, strict=True):
            file = stack.enter_context(open(temporary, "wb"))
            schema = table.schema().with_metadata(metadata)
            writers.append(stack.enter_context(pq.ParquetWriter(file, schema, **_options(schema))))
        for rollouts, block in run:
            for table, writer in zip(tables, writers, strict=True):
                for batch in _batches(table, block, len(rollouts)):
                    writer.write_batch(batch)
            advance(len(rollouts))
    return paths


def _batches(table: Table, block: xr.Dataset, rollouts: int) -> Iterator[pa.RecordBatch]:
    """Yield the rows of a block, at most a row group at a time, but at least one rollout."""
    if not table.columns:
        return
    step = max(1, GROUP_ROWS // table.rows)
    for first in range(0, rollouts, step):
        yield table.batch(block.isel(rollout=slice(first, first + step)))


def _options(schema: pa.Schema) -> dict[str, Any]:
    """Return how columns are stored: floating-point numbers split into bytes, all else as a dictionary."""
    import pyarrow as pa

    floats = [field.name for field in schema if pa.types.is_floating(field.type) and field.name != "time"]
    return {
        "compression": "zstd",
        "compression_level": LEVEL,
        "use_dictionary": [field.name for field in schema if field.name not in floats],
        "use_byte_stream_split": floats,
    }


def _metadata(dataset: xr.Dataset) -> Mapping[str, str]:
    """Return the attributes of the run and the labels of joints and actuators, as text."""
    labels = {
        str(name): attribute_text([None if label in UNLIMITED else label for label in plain(coordinate.values)])
        for name, coordinate in dataset.coords.items()
        if coordinate.dims in (("joint",), ("actuator",))
    }
    return labels | {str(name): attribute_text(value) for name, value in dataset.attrs.items()}
