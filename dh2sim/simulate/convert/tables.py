"""Which variable of a run goes into which Parquet table, and how its columns are named. Needs pyarrow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pyarrow as pa
import xarray as xr
from numpy.typing import NDArray

from dh2sim.errors import Dh2simError
from dh2sim.simulate.convert.columns import LABEL, Column, Table

ORDER = (
    *("qpos", "qvel", "qpos_ref", "qvel_ref", "ctrl", "qacc", "torque"),
    *("tool_pose", "energy", "contacts", "base_pose", "base_twist"),
    *("status", "stop_step", "saturation"),
)
"""Of columns; others follow by name."""
NO_INTEGER = -1
"""Stands in a run's integers where nothing was recorded."""


def make_tables(dataset: xr.Dataset) -> tuple[Table, Table, Table]:
    """Return the tables of joints, of steps and of rollouts.

    Raises:
        Dh2simError: a variable has dimensions that no table has a place for.
    """
    joints: list[Column] = []
    steps: list[Column] = []
    rollouts: list[Column] = []
    names = sorted(map(str, dataset.data_vars))
    for name in sorted(names, key=lambda name: ORDER.index(name) if name in ORDER else len(ORDER)):
        match tuple(map(str, dataset[name].dims)):
            case ("rollout", "step" | "interval", "joint" | "actuator"):
                joints.append(_of_joints(dataset, name))
            case ("rollout", "step" | "interval", *other) if len(other) <= 1:
                steps += _wide(dataset, name, other)
            case ("rollout",) if "flag_meanings" in dataset[name].attrs:
                rollouts.append(_of_words(dataset, name))
            case ("rollout", *other) if len(other) <= 1:
                rollouts += _wide(dataset, name, other)
            case dims:
                raise Dh2simError(f"variable '{name}' has the dimensions {', '.join(dims)}, which no table has")
    times = np.asarray(dataset["time"].values)
    return (
        Table(steps=times, joints=_labels(dataset, "joint"), columns=tuple(joints)),
        Table(steps=times, columns=tuple(steps)),
        Table(columns=tuple(rollouts)),
    )


def _of_joints(dataset: xr.Dataset, name: str) -> Column:
    """A column of the table of joints. What belongs to an actuator stands at the joint that it drives."""
    last = _labels(dataset, str(dataset[name].dims[2]))
    if dataset[name].dims[2] == "actuator":
        last = [label.rpartition("_")[0] for label in last]  # an actuator is named after its joint and its type
    source = np.array([last.index(joint) if joint in last else -1 for joint in _labels(dataset, "joint")], dtype=int)

    def values(part: xr.Dataset) -> NDArray[Any]:
        full = _every_step(part, name)
        missing = np.full((*full.shape[:2], 1), np.nan, dtype=full.dtype)
        return np.concatenate([full, missing], axis=2)[:, :, source]

    return Column(name=name, type=_type(dataset[name]), values=values, metadata=_metadata(dataset[name]))


def _wide(dataset: xr.Dataset, name: str, dimension: list[str]) -> Iterator[Column]:
    """Yield a column for every label of the last dimension, or the only one."""
    variable = dataset[name]
    recorded = variable.dims[1:2] in (("step",), ("interval",))

    def column(title: str, index: int | None) -> Column:
        def values(part: xr.Dataset) -> NDArray[Any]:
            full = _every_step(part, name) if recorded else np.asarray(part[name].values)
            return full if index is None else full[..., index]

        return Column(
            name=title,
            type=_type(variable),
            values=values,
            missing=NO_INTEGER if variable.dtype.kind == "i" else None,
            metadata=_metadata(variable),
        )

    if not dimension:
        yield column(name, None)
        return
    prefix = name.removesuffix("_pose").removesuffix("_twist")
    for index, label in enumerate(_labels(dataset, dimension[0])):
        yield column(f"{prefix}_{label}", index)


def _of_words(dataset: xr.Dataset, name: str) -> Column:
    """A column that holds the words that a variable's numbers stand for."""
    attributes = dataset[name].attrs
    words = attributes["flag_meanings"].split()
    numbers = np.asarray(attributes["flag_values"])
    order = np.argsort(numbers)

    def values(part: xr.Dataset) -> NDArray[Any]:
        found: NDArray[Any] = order[np.searchsorted(numbers[order], part[name].values)]
        return found

    return Column(name=name, type=LABEL, values=values, words=words, metadata=_metadata(dataset[name]))


def _every_step(part: xr.Dataset, name: str) -> NDArray[Any]:
    """Return a variable's records; those of intervals with nothing for the last step."""
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
