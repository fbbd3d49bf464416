"""A run as Parquet tables, in the long form that data frames and databases want.

Three files, one for each kind of row: ``RUN.parquet`` has a row for every rollout, step and joint,
``RUN.steps.parquet`` one for every rollout and step, ``RUN.rollouts.parquet`` one for every rollout. What was not
recorded is null: the last step of what belongs to intervals, all that follows an early stop, rollouts not yet run.

Tables of a run's numbers: columns, keys, and the rows of a part of the run. Needs pyarrow.

Which variable of a run goes into which Parquet table, and how its columns are named. Needs pyarrow.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dh2sim.extras import require_extra
from dh2sim.simulate.convert.blocks import (
    attribute_text,
    no_progress,
    open_blocks,
    output_files,
    plain,
    refuse_folder,
)

if TYPE_CHECKING:
    import pyarrow as pa
    import xarray as xr

    from dh2sim.simulate.convert.tables import Table

SUFFIX = ".parquet"
GROUP_ROWS = 1 << 20
"""Rows of a row group at most; what is held in memory beside a block."""
LEVEL = 3
"""Of zstd."""
UNLIMITED = (-math.inf, math.inf)
"""Which JSON knows nothing of."""


def parquet_files(out: Path) -> tuple[Path, Path, Path]:
    """Return the files of a conversion to ``out``: of joints, which is ``out`` itself, of steps, and of rollouts."""
    stem = out.name.removesuffix(SUFFIX)
    return out, out.with_name(f"{stem}.steps{SUFFIX}"), out.with_name(f"{stem}.rollouts{SUFFIX}")


def to_parquet(
    path: Path,
    out: Path,
    *,
    overwrite: bool = False,
    advance: Callable[[int], None] = no_progress,
) -> tuple[Path, ...]:
    """Write a run as Parquet tables.

    Args:
        path: the run.
        out: file of the table of joints; those of steps and rollouts come beside it.
        overwrite: whether files that stand there are replaced.
        advance: told of rollouts as they are written.

    Returns:
        The files written.

    Raises:
        Dh2simError: pyarrow is not installed, there is no run or a damaged one, a file exists already or cannot be
            written.
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
    """Yield a block's rows, no more at a time than a row group holds (but those of one rollout)."""
    if not table.columns:
        return
    step = max(1, GROUP_ROWS // table.rows)
    for first in range(0, rollouts, step):
        yield table.batch(block.isel(rollout=slice(first, first + step)))


def _options(schema: pa.Schema) -> dict[str, Any]:
    """Return how columns are stored: floating-point numbers byte by byte, what repeats itself as a dictionary."""
    import pyarrow as pa

    floats = [field.name for field in schema if pa.types.is_floating(field.type) and field.name != "time"]
    return {
        "compression": "zstd",
        "compression_level": LEVEL,
        "use_dictionary": [field.name for field in schema if field.name not in floats],
        "use_byte_stream_split": floats,
    }


def _metadata(dataset: xr.Dataset) -> Mapping[str, str]:
    """Return the run's attributes, and what it tells of joints and actuators."""
    labels = {
        str(name): attribute_text([None if label in UNLIMITED else label for label in plain(coordinate.values)])
        for name, coordinate in dataset.coords.items()
        if coordinate.dims in (("joint",), ("actuator",))
    }
    return labels | {str(name): attribute_text(value) for name, value in dataset.attrs.items()}
