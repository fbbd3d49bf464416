"""Recordings of a run as measurements with noise, to try a calibration before there is a tracker."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dh2sim.calibrate.measurements import Kind, Measurements, measurements, noise_sigmas
from dh2sim.errors import CalibrationError
from dh2sim.kinematics.chain import serial_spec_of
from dh2sim.kinematics.rotations import rotations_of_quaternions, rotations_of_vectors
from dh2sim.messages import listed
from dh2sim.robot.spec import SpecLike
from dh2sim.simulate.store.reader import open_dataset, reading
from dh2sim.typing import Array

if TYPE_CHECKING:
    import xarray as xr

COUNT = 100
"""Rows that are taken from a run."""


def run_measurements(
    robot: SpecLike,
    run: xr.Dataset | str | os.PathLike[str],
    *,
    noise: float | tuple[float, float],
    kind: Kind = Kind.POSE,
    count: int = COUNT,
    seed: int = 0,
) -> Measurements:
    """Take recorded joint vectors and poses of tool0 from a run, and add noise.

    Args:
        robot: That is to be calibrated; the run may be of another one with joints of the same names.
        run: The dataset, or its folder.
        noise: Standard deviation of each component, m, or m and rad, normal and independent.
        kind: Poses or positions.
        count: Rows to take, evenly spread over all that were recorded; each rollout is a group.
        seed: Of the noise.

    Raises:
        RunError: There is no run, or it is damaged.
        CalibrationError: It does not have what is needed.
    """
    spec = serial_spec_of(robot)
    if kind not in (Kind.POSE, Kind.POSITION):
        raise CalibrationError(f"a run records poses of tool0, not what kind '{kind}' needs; use pose or position")
    length, angle = noise_sigmas(noise)
    if count < 1:
        raise CalibrationError(f"count must be at least 1, got {count}")
    if isinstance(run, str | os.PathLike):
        with open_dataset(run) as data, reading(Path(run)):
            q, pose, rollout = _recorded(data, spec.name, [row.name for row in spec.moving_rows], os.fspath(run))
    else:
        q, pose, rollout = _recorded(run, spec.name, [row.name for row in spec.moving_rows], "the run")
    chosen = np.unique(np.linspace(0, len(q) - 1, min(count, len(q))).round().astype(np.intp))
    rng = np.random.default_rng(seed)
    T = np.tile(np.eye(4), (len(chosen), 1, 1))
    for k, row in enumerate(chosen.tolist()):
        T[k, :3, 3] = pose[row, :3] + length * rng.normal(size=3)
        measured = rotations_of_quaternions(pose[row, 3:] / np.linalg.norm(pose[row, 3:]))
        T[k, :3, :3] = rotations_of_vectors(angle * rng.normal(size=3)) @ measured
    groups = [f"rollout {number}" for number in rollout[chosen].tolist()]
    if kind is Kind.POSITION:
        return measurements(spec, q[chosen], positions=T[:, :3, 3], groups=groups)
    return measurements(spec, q[chosen], poses=T, groups=groups)


def _recorded(data: xr.Dataset, robot: str, joints: list[str], name: str) -> tuple[Array, Array, Array]:
    """Return all whole records: joint vectors, poses and the rollouts that they are of."""
    missing = [variable for variable in ("qpos", "tool_pose") if variable not in data]
    if missing:
        raise CalibrationError(f"{name}: has not recorded {listed(missing)}; record again with qpos,tool_pose")
    if "base_pose" in data:
        raise CalibrationError(f"{name}: the base floats, so that poses of the tool are not in base_link")
    if "design" in data and len(np.unique(data["design"].values)) > 1:
        raise CalibrationError(
            f"{name}: its rollouts are of many designs, each with a table of its own; use a run of one"
        )
    there = [str(joint) for joint in data["joint"].values.tolist()]
    if there != joints:
        raise CalibrationError(f"{name}: its joints are {listed(there)}, those of {robot} are {listed(joints)}")
    q, pose = data["qpos"].values, data["tool_pose"].values
    rollout = np.repeat(np.arange(q.shape[0]), q.shape[1])
    q, pose = q.reshape(-1, q.shape[-1]), pose.reshape(-1, pose.shape[-1])
    whole = np.isfinite(q).all(axis=1) & np.isfinite(pose).all(axis=1)
    if not whole.any():
        raise CalibrationError(f"{name}: nothing was recorded")
    return q[whole], pose[whole], rollout[whole]
