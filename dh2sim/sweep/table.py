"""The table of a sweep, and the journal beside it that an interrupted sweep is continued from."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, Final

from dh2sim.errors import OutputError, RunDamagedError, RunDiffersError
from dh2sim.extras import require_extra
from dh2sim.files import atomic_file, require_folder
from dh2sim.messages import listed, shown

ENDINGS: Final = (".parquet", ".csv")
FORMAT: Final = 1
"""Version of the journal."""
GROUP_ROWS: Final = 2**14
"""Of a row group of Parquet, the most that is in memory."""


def journal_path(out: Path) -> Path:
    """Return the file beside a table that has what was measured."""
    return out.with_name(f"{out.name}.journal")


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


class Journal:
    """What was measured so far: a line of settings, then a line for each chunk of designs, in any order."""

    def __init__(self, settings: Mapping[str, Any], stream: BinaryIO | None) -> None:
        """Begin with nothing; without a stream it is kept in memory."""
        self.settings = dict(settings)
        self.columns: list[str] = []
        self._stream = stream
        self._kept: dict[int, list[list[float]]] = {}
        self._places: dict[int, tuple[int, int]] = {}

    @classmethod
    @contextmanager
    def open(cls, out: Path | None, settings: Mapping[str, Any], *, overwrite: bool) -> Iterator[Journal]:
        """Continue the journal beside a table, or begin one.

        Raises:
            RunDiffersError: It has other settings.
            RunDamagedError: It is not a journal.
            OutputError: It cannot be written.
        """
        settings = json.loads(json.dumps(settings))
        if out is None:
            yield cls(settings, None)
            return
        path = journal_path(out)
        try:
            if overwrite:
                path.unlink(missing_ok=True)
            with path.open("a+b") as stream:
                journal = cls(settings, stream)
                journal._read(out, path)
                yield journal
        except OSError as error:
            raise OutputError(f"cannot write '{error.filename or path}': {error.strerror or error}") from error

    def length(self, chunk: int) -> int:
        """Return of how many designs of a chunk there is something."""
        if self._stream is None:
            return len(self._kept.get(chunk, ()))
        return self._places.get(chunk, (0, 0))[1]

    def rows(self, chunk: int) -> list[list[float]]:
        """Return what there is of a chunk."""
        if self._stream is None:
            return self._kept[chunk]
        self._stream.seek(self._places[chunk][0])
        rows: list[list[float]] = json.loads(self._stream.readline())["rows"]
        return rows

    def add(self, chunk: int, columns: list[str], rows: list[list[float]]) -> None:
        """Add what was measured of a chunk; it is on the disk when this returns.

        Raises:
            RunDiffersError: Its columns are not those of the chunks before.
        """
        self._require_columns(columns)
        if self._stream is None:
            self._kept[chunk] = rows
            return
        place = self._stream.seek(0, os.SEEK_END)
        self._write({"chunk": chunk, "columns": columns, "rows": rows})
        self._places[chunk] = place, len(rows)

    def _require_columns(self, columns: list[str]) -> None:
        if self.columns and columns != self.columns:
            raise RunDiffersError(
                f"designs have different measures: {listed(self.columns)}, and {listed(columns)} of others"
            )
        self.columns = columns

    def _write(self, value: Mapping[str, Any]) -> None:
        assert self._stream is not None
        self._stream.write(json.dumps(value).encode() + b"\n")
        self._stream.flush()
        os.fsync(self._stream.fileno())

    def _read(self, out: Path, path: Path) -> None:
        """Note where chunks stand; a last line that was cut off is dropped."""
        stream = self._stream
        assert stream is not None
        stream.seek(0)
        whole, first = 0, True
        for line in iter(stream.readline, b""):
            if not line.endswith(b"\n"):
                break
            try:
                value = json.loads(line)
                if first:
                    if value["dh2sim_sweep"] != FORMAT:
                        raise ValueError("a journal of another version")
                    self._compare(out, value["settings"])
                else:
                    self._require_columns(value["columns"])
                    self._places[value["chunk"]] = whole, len(value["rows"])
            except (ValueError, KeyError, TypeError) as error:
                raise RunDamagedError(
                    f"'{path}' is damaged, or no journal of a sweep; --overwrite starts again"
                ) from error
            first = False
            whole += len(line)
        stream.truncate(whole)
        if first:
            stream.seek(0, os.SEEK_END)
            self._write({"dh2sim_sweep": FORMAT, "settings": self.settings})

    def _compare(self, out: Path, old: Mapping[str, Any]) -> None:
        """Refuse other settings.

        Raises:
            RunDiffersError: They are others.
        """
        new = self.settings
        changed = [name for name in {**old, **new} if old.get(name) != new.get(name)]
        if not changed:
            return
        phrases = [
            f"the {name.removesuffix('_sha256')} has changed"
            if isinstance(new.get(name), str) and len(str(new.get(name))) == 64
            else f"{name} was {_text(old.get(name))} and is now {_text(new.get(name))}"
            for name in changed
        ]
        raise RunDiffersError(
            f"'{out}' was measured with other settings: {'; '.join(phrases)}. Choose another name, or --overwrite"
        )


def _text(value: object) -> str:
    match value:
        case dict():
            return ",".join(f"{key}={inner}" for key, inner in value.items()) or "none"
        case list():
            return ",".join(map(str, value)) or "none"
        case None:
            return "none"
        case _:
            return str(value)


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
