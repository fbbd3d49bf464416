"""Tables of a run's numbers: columns, keys, and the rows of a part of the run. Needs pyarrow."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyarrow as pa
import xarray as xr
from numpy.typing import NDArray

LABEL = pa.dictionary(pa.int32(), pa.string())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Column:
    """A column that holds numbers of the run."""

    name: str
    type: pa.DataType
    values: Callable[[xr.Dataset], NDArray[Any]] = field(repr=False)
    """Takes a part of the run; returns as many values as it has rows, in the order of the rows."""
    missing: int | None = None
    """What an integer is where nothing was recorded; a floating-point number is NaN there."""
    words: Sequence[str] | None = None
    """What the values are numbers of, if the column is to hold the words themselves."""
    metadata: Mapping[str, str] = field(default_factory=dict)

    def array(self, part: xr.Dataset) -> pa.Array:
        """Return the column of a part of the run, null where nothing was recorded."""
        values = self.values(part).reshape(-1)
        if self.words is not None:
            return pa.DictionaryArray.from_arrays(pa.array(values.astype(np.int32)), pa.array(self.words))
        mask = np.isnan(values) if values.dtype.kind == "f" else values == self.missing
        return pa.array(values, type=self.type, mask=mask if np.any(mask) else None)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Table:
    """A table: what tells its rows apart, and what they hold."""

    steps: NDArray[np.float64] | None = None
    """Times of the steps that a rollout has rows for, s; None: it has but one row."""
    joints: Sequence[str] | None = None
    """Names of the joints that a step has rows for; None: it has but one row."""
    columns: tuple[Column, ...]

    @property
    def rows(self) -> int:
        """Number of rows of a rollout."""
        return (1 if self.steps is None else len(self.steps)) * (1 if self.joints is None else len(self.joints))

    def schema(self) -> pa.Schema:
        """Return names and types; units and meanings are the fields' metadata."""
        keys = [pa.field("rollout", pa.int64(), nullable=False)]
        if self.steps is not None:
            keys.append(pa.field("step", pa.int64(), nullable=False))
            keys.append(pa.field("time", pa.float64(), nullable=False, metadata={"units": "s"}))
        if self.joints is not None:
            keys.append(pa.field("joint", LABEL, nullable=False))
        return pa.schema([*keys, *(pa.field(c.name, c.type, metadata=dict(c.metadata)) for c in self.columns)])

    def batch(self, part: xr.Dataset) -> pa.RecordBatch:
        """Return the rows of a part of the run, rollout by rollout, step by step, joint by joint."""
        arrays = [*self._keys(part["rollout"].values), *(column.array(part) for column in self.columns)]
        return pa.RecordBatch.from_arrays(arrays, schema=self.schema())

    def _keys(self, rollouts: NDArray[Any]) -> list[pa.Array]:
        keys = [pa.array(np.repeat(rollouts.astype(np.int64), self.rows))]
        if self.steps is not None:
            each = 1 if self.joints is None else len(self.joints)
            steps = np.repeat(np.arange(len(self.steps)), each)
            keys.append(pa.array(np.tile(steps, len(rollouts))))
            keys.append(pa.array(np.tile(self.steps[steps], len(rollouts))))
        if self.joints is not None:
            joints = np.tile(
                np.arange(len(self.joints), dtype=np.int32), len(rollouts) * self.rows // len(self.joints)
            )
            keys.append(pa.DictionaryArray.from_arrays(pa.array(joints), pa.array(self.joints)))
        return keys
