"""Runs in memory, made with nothing but MuJoCo: what pictures are drawn from."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import xarray as xr

from dh2sim.draw.rollout_data import RolloutData, select_rollout
from dh2sim.formats.mjcf.scene import to_scene
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.model.build import build_model
from dh2sim.robot.read import load_robot
from dh2sim.simulate.dataset_layout import POSE, STATUS

STEPS, EVERY = 60, 2


@dataclass(frozen=True)
class Arm:
    """A robot as it is simulated."""

    mjcf: str
    scene: str
    model: mujoco.MjModel


@functools.cache
def arm(robot: str) -> Arm:
    built = build_model(load_robot(robot))
    mjcf = to_mjcf(built)
    return Arm(mjcf=mjcf, scene=to_scene(built), model=mujoco.MjModel.from_xml_string(mjcf))


@functools.cache
def _simulated(robot: str) -> dict[str, Any]:
    """Two rollouts in which every position actuator goes along a sine."""
    model = arm(robot).model
    n, records = model.nq, STEPS // EVERY
    data = mujoco.MjData(model)
    found: dict[str, list[Any]] = {
        name: [] for name in ("qpos", "qvel", "qpos_ref", "tool", "ctrl", "torque", "energy")
    }
    for rollout in range(2):
        mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
        home = data.qpos.copy()
        rows: dict[str, list[Any]] = {name: [] for name in found}
        for k in range(STEPS + 1):
            mujoco.mj_forward(model, data)
            reference = home + 0.1 * np.sin(40.0 * k * model.opt.timestep * (1 + 0.2 * rollout)) * np.cos(
                np.arange(n)
            )
            if k % EVERY == 0:
                quaternion = np.zeros(4)
                mujoco.mju_mat2Quat(quaternion, data.site("tool0").xmat)
                rows["qpos"].append(data.qpos.copy())
                rows["qvel"].append(data.qvel.copy())
                rows["qpos_ref"].append(reference)
                rows["tool"].append(np.concatenate([data.site("tool0").xpos, quaternion]))
                kinetic = 0.5 * data.qvel @ _mass_matrix(model, data) @ data.qvel
                rows["energy"].append([-5.0 - 0.1 * k, kinetic])
            data.ctrl[:] = np.clip(reference, model.actuator_ctrlrange[:, 0], model.actuator_ctrlrange[:, 1])
            if k % EVERY == 0 and k < STEPS:
                rows["ctrl"].append(data.ctrl.copy())
                mujoco.mj_forward(model, data)
                rows["torque"].append(data.qfrc_actuator.copy())
            mujoco.mj_step(model, data)
        for name, row in rows.items():
            found[name].append(row)
    assert len(found["qpos"][0]) == records + 1
    return {name: np.array(values) for name, values in found.items()}


def _mass_matrix(model: mujoco.MjModel, data: mujoco.MjData) -> Any:
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    return full


def swinging(robot: str = "rpr", *, without: tuple[str, ...] = ()) -> xr.Dataset:
    """A run of two rollouts, both finished, less some variables."""
    model, found = arm(robot).model, _simulated(robot)
    time = np.arange(STEPS // EVERY + 1) * model.opt.timestep * EVERY
    hinges = model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
    unit = np.where(hinges, "rad", "m")
    steps, intervals = ("rollout", "step"), ("rollout", "interval")
    variables = {
        "qpos": ((*steps, "joint"), found["qpos"]),
        "qvel": ((*steps, "joint"), found["qvel"]),
        "qpos_ref": ((*steps, "joint"), found["qpos_ref"]),
        "tool_pose": ((*steps, "pose"), found["tool"]),
        "energy": ((*steps, "form"), found["energy"]),
        "ctrl": ((*intervals, "actuator"), found["ctrl"]),
        "torque": ((*intervals, "joint"), found["torque"]),
        "status": (("rollout",), np.zeros(2, dtype=np.int8)),
        "stop_step": (("rollout",), np.full(2, -1)),
    }
    coordinates = {
        "rollout": np.arange(2),
        "time": ("step", time),
        "interval_time": ("interval", time[:-1]),
        "joint": [model.joint(i).name for i in range(model.njnt)],
        "joint_unit": ("joint", unit),
        "joint_lower": ("joint", np.where(model.jnt_limited, model.jnt_range[:, 0], -np.inf)),
        "joint_upper": ("joint", np.where(model.jnt_limited, model.jnt_range[:, 1], np.inf)),
        "joint_velocity_limit": ("joint", np.full(model.nq, 9.0)),
        "actuator": [model.actuator(i).name for i in range(model.nu)],
        "actuator_unit": ("actuator", unit),
        "pose": list(POSE),
    }
    attributes = {
        "dh2sim_run": 1,
        "robot": robot,
        "controller": "pd:kp=10",
        "mjcf": arm(robot).mjcf,
        "scene": arm(robot).scene,
    }
    kept = {name: value for name, value in variables.items() if name not in without}
    return xr.Dataset(kept, coordinates, attributes)


def stopped(run: xr.Dataset, rollout: int, record: int) -> xr.Dataset:
    """The run with a rollout that stopped for a bad acceleration: ``record`` holds its last state."""
    run = run.copy(deep=True)
    for name, variable in run.data_vars.items():
        if "step" in variable.dims:
            run[name][rollout, record + 1 :] = np.nan
        elif "interval" in variable.dims:
            run[name][rollout, record:] = np.nan
    run["status"][rollout] = STATUS["bad_qacc"]
    run["stop_step"][rollout] = record * EVERY + 1
    return run


def rollout(run: xr.Dataset | None = None, number: int = 0) -> RolloutData:
    """One rollout of a run, by default the first one of ``swinging()``."""
    return select_rollout(swinging() if run is None else run, number, "run.zarr")
