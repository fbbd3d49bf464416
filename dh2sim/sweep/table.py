"""The table of a sweep, in Parquet or CSV."""

from __future__ import annotations

import csv
import filecmp
import json
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from dh2sim.errors import OutputError
from dh2sim.extras import require_extra
from dh2sim.files import atomic_file, require_folder
from dh2sim.messages import listed, shown
from dh2sim.sweep.journal import journal_path

ENDINGS: Final = (".parquet", ".csv")
GROUP_ROWS: Final = 2**14
"""Of a row group of Parquet, the most that is in memory."""


def require_table(out: Path) -> None:
    """Check that a table can be written, before anything is measured.

    Raises:
        OutputError: It cannot be.
        MissingExtraError: pyarrow is not installed.
    """
    if out.suffix.lower() not in ENDINGS:
        raise OutputError(f"cannot write {shown(out.name)}: allowed endings: {listed(ENDINGS)}")
    require_folder(out)
    if out.suffix.lower() == ".parquet":
        require_extra("data", "pyarrow", what="a table in Parquet")
    if out.exists() and not journal_path(out).exists():
        raise OutputError(f"'{out}' exists, and is not of a sweep that can be continued; choose another name")


def write_table(
    out: Path,
    columns: Sequence[str],
    units: Mapping[str, str],
    rows: Iterable[list[float]],
    settings: Mapping[str, Any],
) -> None:
    """Write the whole table: the number of each design, its values and its measures.

    Raises:
        OutputError: It cannot be written; what was there is unchanged.
    """
    with atomic_file(out) as draft:
        if out.suffix.lower() == ".csv":
            with draft.open("w", newline="", encoding="utf-8") as stream:
                writer = csv.writer(stream, lineterminator="\n")
                writer.writerow(["design", *columns])
                for design, row in enumerate(rows):
                    writer.writerow([design, *map(repr, row)])
            return
        _write_parquet(draft, columns, units, rows, settings)


def is_table(
    out: Path,
    columns: Sequence[str],
    units: Mapping[str, str],
    rows: Iterable[list[float]],
    settings: Mapping[str, Any],
) -> bool:
    """Whether a file is, byte for byte, the table that ``write_table`` would write.

    Raises:
        OutputError: There is no room for temporary files.
    """
    with tempfile.TemporaryDirectory() as folder:
        other = Path(folder, out.name)
        write_table(other, columns, units, rows, settings)
        return out.is_file() and filecmp.cmp(out, other, shallow=False)


def _write_parquet(
    draft: Path,
    columns: Sequence[str],
    units: Mapping[str, str],
    rows: Iterable[list[float]],
    settings: Mapping[str, Any],
) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = [pa.field("design", pa.int64())]
    fields += [
        pa.field(name, pa.float64(), metadata={"units": units[name]} if units.get(name) else None) for name in columns
    ]
    schema = pa.schema(fields, metadata={"dh2sim_sweep": json.dumps(settings)})
    with pq.ParquetWriter(draft, schema, compression="zstd") as writer:
        group: list[list[float]] = []
        written = 0

        def flush() -> None:
            nonlocal written
            numbers = [range(written, written + len(group)), *zip(*group, strict=True)]
            arrays = [pa.array(column, each.type) for column, each in zip(numbers, schema, strict=True)]
            writer.write_table(pa.table(arrays, schema=schema), row_group_size=GROUP_ROWS)
            written += len(group)
            group.clear()

        for row in rows:
            group.append(row)
            if len(group) == GROUP_ROWS:
                flush()
        if group:
            flush()
