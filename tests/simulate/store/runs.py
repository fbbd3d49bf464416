"""Small runs with made-up numbers, for the tests of the store."""

from __future__ import annotations

import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dh2sim.simulate.dataset_layout import POSE, STATUS, Coordinate, Layout, Variable
from dh2sim.simulate.store.writer import RunWriter
from tests.program import contents

JOINTS = ("shoulder", "ellbow_ü")
SECONDS = 0.25
"""What a block took, if nothing else is said."""


def layout(*, rollouts: int = 7, block: int = 3, steps: int = 4, **attributes: Any) -> Layout:
    """A run of two joints; ``attributes`` replace those of the run, and 'settings' changes single settings."""
    n, every, timestep = len(JOINTS), 2, 0.002
    settings = {
        "rollouts": rollouts,
        "steps": steps * every,
        "every": every,
        "seed": 0,
        "controller": "hold",
        "controller_digest": "",
        "start": "home",
        "start_digest": "",
        "home": [0.0, 0.5],
        "record": ["qpos", "ctrl"],
        "randomize": {},
        "velocity_limits": [1.0, 2.0],
        "kp": [100.0, 50.0],
        "kv": [10.0, 5.0],
        **attributes.pop("settings", {}),
    }
    time = np.arange(steps + 1) * timestep * every
    return Layout(
        sizes={"rollout": rollouts, "step": steps + 1, "interval": steps, "joint": n, "actuator": n, "pose": 7},
        coordinates=(
            Coordinate(name="rollout", dimension="rollout", values=np.arange(rollouts)),
            Coordinate(name="time", dimension="step", values=time, attributes={"units": "s", "long_name": "time"}),
            Coordinate(name="interval_time", dimension="interval", values=time[:-1], attributes={"units": "s"}),
            Coordinate(name="joint", dimension="joint", values=JOINTS),
            Coordinate(name="joint_unit", dimension="joint", values=("rad", "m")),
            Coordinate(name="joint_upper", dimension="joint", values=np.array([1.5, np.inf])),
            Coordinate(name="actuator", dimension="actuator", values=[f"{name}_motor" for name in JOINTS]),
            Coordinate(name="pose", dimension="pose", values=POSE),
        ),
        variables=(
            _variable("qpos", ("rollout", "step", "joint"), units="rad or m"),
            _variable("ctrl", ("rollout", "interval", "actuator"), units="N*m or N"),
            _variable("tool_pose", ("rollout", "step", "pose"), units="m, 1"),
            _variable("contacts", ("rollout", "interval"), "int32", -1, units="1"),
            _variable("status", ("rollout",), "int8", -1, flag_values=[0, 1], flag_meanings="finished other"),
            _variable("stop_step", ("rollout",), "int64", -1, units="1"),
            _variable("saturation", ("rollout", "actuator"), "int64", 0, units="1"),
        ),
        attributes={
            "dh2sim_run": 1,
            "robot": "small",
            "robot_file": "name: small\n",
            "robot_file_sha256": "5" * 64,
            "mjcf": '<mujoco model="small"/>',
            "scene": "<mujoco/>",
            "command": "dh2sim rollout small",
            "seed": settings["seed"],
            "controller": settings["controller"],
            "randomize": settings["randomize"],
            "settings": settings,
            "timestep": timestep,
            "integrator": "Euler",
            "versions": {"dh2sim": "0.1.0", "mujoco": "3.17.0", "numpy": "2.4.0", "python": "3.11.0"},
            "created": "2026-11-22T10:00:00+00:00",
            **attributes,
        },
        block=block,
    )


def _variable(
    name: str, dimensions: tuple[str, ...], dtype: str = "float64", fill: float = np.nan, **attributes: Any
) -> Variable:
    return Variable(
        name=name,
        dimensions=dimensions,
        dtype=np.dtype(dtype),
        fill=fill,
        attributes={"long_name": name, **attributes},
    )


def whole(of: Layout) -> dict[str, NDArray[Any]]:
    """The numbers of a whole run; every rollout has its own, whatever block it is in."""
    made: dict[str, NDArray[Any]] = {}
    for number, variable in enumerate(of.variables):
        rng = np.random.default_rng(number)
        shape = of.shape(variable)
        if variable.dtype.kind == "f":
            made[variable.name] = rng.normal(size=shape)
        else:
            made[variable.name] = rng.integers(0, 3, size=shape).astype(variable.dtype)
    made["contacts"][:] = -1  # nothing but what fills an array that nobody wrote to
    made["status"][:] = np.where(np.arange(len(made["status"])) % 5 == 4, STATUS["bad_qacc"], 0)
    made["stop_step"][:] = np.where(made["status"] > 0, 3, -1)
    made["qpos"][made["status"] > 0, 2:] = np.nan
    return made


def block_of(of: Layout, block: int, numbers: Mapping[str, NDArray[Any]] | None = None) -> dict[str, NDArray[Any]]:
    """The numbers of one block."""
    rollouts = of.rollouts(block)
    return {name: values[rollouts.start : rollouts.stop] for name, values in (numbers or whole(of)).items()}


def finish(writer: RunWriter) -> tuple[int, ...]:
    """Write what is pending, and return which blocks that were."""
    pending = writer.pending()
    numbers = whole(writer.layout)
    for block in pending:
        writer.write(block, block_of(writer.layout, block, numbers), SECONDS)
    return pending


def make(path: Path, of: Layout) -> Path:
    """A finished run."""
    with RunWriter.create(path, of) as writer:
        finish(writer)
    return path


def resume(path: Path, of: Layout) -> tuple[int, ...]:
    """Resume and finish a run; return the blocks that were pending."""
    with RunWriter.resume(path, of) as writer:
        return finish(writer)


def copy(run: Path, path: Path) -> Path:
    """A copy of a run."""
    return Path(shutil.copytree(run, path))


def lasting(run: Path) -> dict[str, bytes]:
    """Files of a run, and its records without the time that the blocks took."""
    files = contents(run)
    for name, data in files.items():
        if name.startswith("blocks/record/c."):
            files[name] = re.sub(rb'"seconds": [^,]*', b"", data[8:-4])
    return files
