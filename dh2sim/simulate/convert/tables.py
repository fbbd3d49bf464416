"""Parquet tables of a run: which variable goes into which table, and the columns of a part of the run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
import pyarrow as pa
import xarray as xr
from numpy.typing import NDArray

from dh2sim.errors import Dh2simError

LABEL = pa.dictionary(pa.int32(), pa.string())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Column:
    """A column of a table."""

    name: str
    type: pa.DataType
    values: Callable[[xr.Dataset], NDArray[Any]] = field(repr=False)
    """Returns the values of a part of the run, one for each row and in their order."""
    missing: int | None = None
    """Integer that means that nothing was recorded; floating-point numbers are NaN."""
    labels: Sequence[str] | None = None
    """Labels that the values are indices of, if the column contains labels."""
    metadata: Mapping[str, str] = field(default_factory=dict)

    def array(self, part: xr.Dataset) -> pa.Array:
        """Return the column of a part of the run, null where nothing was recorded."""
        values = self.values(part).reshape(-1)
        if self.labels is not None:
            return pa.DictionaryArray.from_arrays(pa.array(values.astype(np.int32)), pa.array(self.labels))
        mask = np.isnan(values) if values.dtype.kind == "f" else values == self.missing
        return pa.array(values, type=self.type, mask=mask if np.any(mask) else None)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Table:
    """A table: the keys of its rows, and its columns."""

    steps: NDArray[np.float64] | None = None
    """Times of the steps that a rollout has rows for, s; None: it has a single row."""
    joints: Sequence[str] | None = None
    """Names of the joints that a step has rows for; None: it has a single row."""
    columns: tuple[Column, ...]

    @property
    def rows(self) -> int:
        """Number of rows of a rollout."""
        return (1 if self.steps is None else len(self.steps)) * (1 if self.joints is None else len(self.joints))

    def schema(self) -> pa.Schema:
        """Return names and types of the columns, with units and descriptions as metadata of the fields."""
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


ORDER = (
    *("qpos", "qvel", "qpos_ref", "qvel_ref", "ctrl", "qacc", "torque"),
    *("tool_pose", "energy", "contacts", "base_pose", "base_twist"),
    *("status", "stop_step", "contact_step", "contact_link_a", "contact_link_b", "saturation", "loop_gap"),
)
"""Order of columns; others follow by name."""
NO_INTEGER = -1
"""Integer of a run that means that nothing was recorded."""


def make_tables(dataset: xr.Dataset) -> tuple[Table, Table, Table]:
    """Return the tables of joints, of steps and of rollouts.

    Raises:
        Dh2simError: A variable has dimensions that fit no table.
    """
    joints: list[Column] = []
    steps: list[Column] = []
    rollouts: list[Column] = []
    names = sorted(map(str, dataset.data_vars))
    for name in sorted(names, key=lambda name: ORDER.index(name) if name in ORDER else len(ORDER)):
        match tuple(map(str, dataset[name].dims)):
            case ("rollout", "step" | "interval", "joint" | "actuator"):
                joints.append(_of_joints(dataset, name))
            case ("rollout", "step" | "interval", *other):
                steps += _wide(dataset, name, other)
            case ("rollout",) if "flag_meanings" in dataset[name].attrs:
                rollouts.append(_of_flags(dataset, name))
            case ("rollout", *other):
                rollouts += _wide(dataset, name, other)
            case dims:
                raise Dh2simError(f"variable '{name}' has the dimensions {', '.join(dims)}, which fit no table")
    times = np.asarray(dataset["time"].values)
    return (
        Table(steps=times, joints=_labels(dataset, "joint"), columns=tuple(joints)),
        Table(steps=times, columns=tuple(steps)),
        Table(columns=tuple(rollouts)),
    )


def _of_joints(dataset: xr.Dataset, name: str) -> Column:
    """Return a column of the table of joints; values of an actuator are in the row of the joint that it drives."""
    last = _labels(dataset, str(dataset[name].dims[2]))
    if dataset[name].dims[2] == "actuator":
        last = [label.rpartition("_")[0] for label in last]  # an actuator is named after its joint and its type
    source = np.array([last.index(joint) if joint in last else -1 for joint in _labels(dataset, "joint")], dtype=int)

    def values(part: xr.Dataset) -> NDArray[Any]:
        full = _every_step(part, name)
        missing = np.full((*full.shape[:2], 1), np.nan, dtype=full.dtype)
        return np.concatenate([full, missing], axis=2)[:, :, source]

    return Column(name=name, type=_type(dataset[name]), values=values, metadata=_metadata(dataset[name]))


def _wide(dataset: xr.Dataset, name: str, dimensions: list[str]) -> Iterator[Column]:
    """Yield a column for every label of the last dimension, or labels of the last ones; or the only one."""
    variable = dataset[name]
    recorded = variable.dims[1:2] in (("step",), ("interval",))

    def column(title: str, index: tuple[int, ...]) -> Column:
        where: tuple[Any, ...] = (..., *index)

        def values(part: xr.Dataset) -> NDArray[Any]:
            full = _every_step(part, name) if recorded else np.asarray(part[name].values)
            chosen: NDArray[Any] = full[where]
            return chosen

        return Column(
            name=title,
            type=_type(variable),
            values=values,
            missing=NO_INTEGER if variable.dtype.kind == "i" else None,
            metadata=_metadata(variable),
        )

    if not dimensions:
        yield column(name, ())
        return
    prefix = name.removesuffix("_pose").removesuffix("_twist")
    for labels in product(*(enumerate(_labels(dataset, dimension)) for dimension in dimensions)):
        title = "_".join([prefix, *(label for _, label in labels)])
        yield column(title, tuple(index for index, _ in labels))


def _of_flags(dataset: xr.Dataset, name: str) -> Column:
    """Return a column of the names of a variable's flags."""
    attributes = dataset[name].attrs
    labels = attributes["flag_meanings"].split()
    numbers = np.asarray(attributes["flag_values"])
    order = np.argsort(numbers)

    def values(part: xr.Dataset) -> NDArray[Any]:
        found: NDArray[Any] = order[np.searchsorted(numbers[order], part[name].values)]
        return found

    return Column(name=name, type=LABEL, values=values, labels=labels, metadata=_metadata(dataset[name]))


def _every_step(part: xr.Dataset, name: str) -> NDArray[Any]:
    """Return the records of a variable for every step; interval variables have none for the last one."""
    values = np.asarray(part[name].values)
    if part[name].dims[1] == "step":
        return values
    nothing = np.nan if values.dtype.kind == "f" else NO_INTEGER
    return np.concatenate([values, np.full((len(values), 1, *values.shape[2:]), nothing, dtype=values.dtype)], axis=1)


def _labels(dataset: xr.Dataset, dimension: str) -> list[str]:
    return [str(label) for label in dataset[dimension].values]


def _type(variable: xr.DataArray) -> pa.DataType:
    return pa.from_numpy_dtype(variable.dtype)


def _metadata(variable: xr.DataArray) -> Mapping[str, str]:
    return {key: str(variable.attrs[key]) for key in ("units", "long_name") if key in variable.attrs}
