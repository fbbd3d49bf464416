"""A small run with everything that a run can hold; its numbers are random, its places for nothing are filled."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dh2sim.simulate.dataset_layout import POSE, STATUS, TWIST, Coordinate, Layout, Variable
from dh2sim.simulate.store.writer import RunWriter

ROLLOUTS, BLOCK, RECORDS = 7, 3, 4
JOINTS, ACTUATORS = ("shoulder", "elbow_2", "slide"), ("shoulder_position", "slide_motor")
LINKS = ("link_1", "link_2", "link_3")
AXES = ("x", "y", "z")
STOPPED, STOP_RECORD = 4, 2
"""A rollout that stopped early, and the last record that it has."""
TOUCHED = 2
"""A rollout in which links touched."""

Arrays = dict[str, NDArray[Any]]


def make_layout(*, rollouts: int = ROLLOUTS, block: int = BLOCK, actuators: Sequence[str] = ACTUATORS) -> Layout:
    """A run of a robot with three joints, of which two are driven."""
    times = 0.004 * np.arange(RECORDS + 1)
    return Layout(
        sizes={
            "rollout": rollouts,
            "step": RECORDS + 1,
            "interval": RECORDS,
            "joint": len(JOINTS),
            "actuator": len(actuators),
            "pose": 7,
            "energy_kind": 2,
            "twist": 6,
            "link": len(LINKS),
            "axis": len(AXES),
        },
        coordinates=(
            Coordinate(name="rollout", dimension="rollout", values=np.arange(rollouts)),
            Coordinate(name="time", dimension="step", values=times, attributes={"units": "s"}),
            Coordinate(name="interval_time", dimension="interval", values=times[:-1], attributes={"units": "s"}),
            Coordinate(name="joint", dimension="joint", values=JOINTS),
            Coordinate(name="joint_unit", dimension="joint", values=("rad", "rad", "m")),
            Coordinate(name="joint_lower", dimension="joint", values=np.array([-2.0, -np.inf, 0.0])),
            Coordinate(name="actuator", dimension="actuator", values=tuple(actuators)),
            Coordinate(name="actuator_unit", dimension="actuator", values=("rad", "N")[: len(actuators)]),
            Coordinate(name="pose", dimension="pose", values=POSE),
            Coordinate(name="energy_kind", dimension="energy_kind", values=("potential", "kinetic")),
            Coordinate(name="twist", dimension="twist", values=TWIST),
            Coordinate(name="link", dimension="link", values=LINKS),
            Coordinate(name="axis", dimension="axis", values=AXES),
        ),
        variables=tuple(_variables()),
        attributes={
            "dh2sim_run": 1,
            "robot": "sample",
            "robot_file": "name: sample\n# θ\n",
            "robot_file_sha256": "",
            "mjcf": f"<mujoco>{'<!-- long -->' * 8000}</mujoco>",
            "scene": "<mujoco/>",
            "command": "dh2sim rollout sample.yaml --out run.zarr",
            "seed": 0,
            "controller": "pd:kp=10",
            "randomize": {"mass": 0.1},
            "settings": {
                "rollouts": rollouts,
                "steps": 2 * RECORDS,
                "every": 2,
                "seed": 0,
                "controller": "pd:kp=10",
                "start": "home",
                "record": ["qpos"],
            },
            "timestep": 0.002,
            "integrator": "implicitfast",
            "versions": {"dh2sim": "0.1.0", "mujoco": "3.17.0", "numpy": "2.4.1", "python": "3.11.9"},
            "created": "2026-11-22T01:02:03+00:00",
        },
        block=block,
    )


def _variables() -> list[Variable]:
    steps, intervals = ("rollout", "step"), ("rollout", "interval")
    real = np.dtype(np.float64)
    recorded = {
        "qpos": ((*steps, "joint"), "rad or m"),
        "qvel": ((*steps, "joint"), "rad/s or m/s"),
        "ctrl": ((*intervals, "actuator"), "see actuator_unit"),
        "qpos_ref": ((*steps, "joint"), "rad or m"),
        "torque": ((*intervals, "joint"), "N*m or N"),
        "tool_pose": ((*steps, "pose"), "m, 1"),
        "base_pose": ((*steps, "pose"), "m, 1"),
        "base_twist": ((*steps, "twist"), "m/s, rad/s"),
        "energy": ((*steps, "energy_kind"), "J"),
        "mass_scale": (("rollout", "link"), "1"),
        "gain_scale": (("rollout", "actuator"), "1"),
        "com_offset": (("rollout", "link", "axis"), "m"),
    }
    reported = {"flag_values": list(STATUS.values()), "flag_meanings": " ".join(STATUS)}
    touching = {"flag_values": [-1, 1, 2, 4], "flag_meanings": "none base_link link_1 link_3"}
    return [
        *(
            Variable(
                name=name,
                dimensions=dimensions,
                dtype=real,
                fill=np.nan,
                attributes={"units": units, "long_name": f"{name} of the run"},
            )
            for name, (dimensions, units) in recorded.items()
        ),
        Variable(name="contacts", dimensions=intervals, dtype=np.dtype(np.int32), fill=-1, attributes={"units": "1"}),
        Variable(name="status", dimensions=("rollout",), dtype=np.dtype(np.int8), fill=-1, attributes=reported),
        Variable(name="stop_step", dimensions=("rollout",), dtype=np.dtype(np.int64), fill=-1),
        Variable(name="saturation", dimensions=("rollout", "actuator"), dtype=np.dtype(np.int64), fill=0),
        Variable(name="contact_step", dimensions=("rollout",), dtype=np.dtype(np.int64), fill=-1),
        *(
            Variable(name=name, dimensions=("rollout",), dtype=np.dtype(np.int32), fill=-1, attributes=touching)
            for name in ("contact_link_a", "contact_link_b")
        ),
    ]


def make_arrays(layout: Layout, *, seed: int = 0) -> Arrays:
    """Random numbers for the whole run; one rollout stops early."""
    rng = np.random.default_rng(seed)
    arrays: Arrays = {}
    for variable in layout.variables:
        shape = layout.shape(variable)
        if variable.dtype.kind == "f":
            arrays[variable.name] = rng.normal(size=shape)
        else:
            arrays[variable.name] = rng.integers(0, 5, size=shape).astype(variable.dtype)
        if variable.dimensions[1:2] in (("step",), ("interval",)) and layout.sizes["rollout"] > STOPPED:
            arrays[variable.name][STOPPED, STOP_RECORD + 1 :] = variable.fill
    arrays["status"][:] = 0
    arrays["stop_step"][:] = -1
    for name, value in {"contact_step": 3, "contact_link_a": 1, "contact_link_b": 4}.items():
        if name in arrays:
            arrays[name][:] = np.where(np.arange(len(arrays[name])) == TOUCHED, value, -1)
    if layout.sizes["rollout"] > STOPPED:
        arrays["status"][STOPPED], arrays["stop_step"][STOPPED] = STATUS["bad_qacc"], 5
    return arrays


def write_run(path: Path, layout: Layout, arrays: Arrays, *, blocks: int | None = None) -> Path:
    """Write the first blocks of a run, by default all of them."""
    with RunWriter.create(path, layout) as writer:
        for block in range(layout.blocks if blocks is None else blocks):
            part = layout.rollouts(block)
            writer.write(block, {name: array[part.start : part.stop] for name, array in arrays.items()}, 0.25)
    return path
