"""Files that are replayed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

MOTORS = ["joint_1_motor", "joint_2_motor", "joint_3_motor"]
JOINTS = ["joint_1", "joint_2", "joint_3"]


def table(file: Path, names: list[str], rows: Any) -> Path:
    lines = [",".join(names), *(",".join(repr(float(value)) for value in row) for row in rows)]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


def run(file: Path, *, every: int = 1, rollouts: int = 7, records: int = 20, **attributes: object) -> xr.Dataset:
    source = np.random.default_rng(4)
    ctrl, qpos = source.normal(size=(rollouts, records, 3)), source.normal(size=(rollouts, records + 1, 3))
    time = np.arange(records + 1) * 0.002 * every
    dataset = xr.Dataset(
        {
            "ctrl": (("rollout", "interval", "actuator"), ctrl),
            "qpos": (("rollout", "step", "joint"), qpos),
        },
        coords={
            "time": ("step", time),
            "interval_time": ("interval", time[:-1]),
            "joint": np.array(JOINTS, dtype=object),
            "actuator": np.array(MOTORS, dtype=object),
        },
        attrs={"dh2sim_run": 1, **attributes},
    )
    dataset.to_zarr(file, zarr_format=3, consolidated=False)
    return dataset
