"""Robots that are off their tables, and what is measured of them: by the oracle, never by the code under test."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dh2sim.calibrate.hayati_rows import fit_rows
from dh2sim.calibrate.measurements import Measurements, measurements
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.links import Pose
from dh2sim.robot.row import Convention, JointType
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only

SIGMA = 5e-5
"""m and rad."""
STATIONS = np.array([[1.2, 0.3, 0.1], [0.2, -1.3, 0.5], [-0.9, 0.9, 0.2], [0.4, 0.5, 1.6]])


def random_q(spec: RobotSpec, count: int, seed: int) -> Array:
    """Joint vectors inside the limits, shape (count, n)."""
    limits = [row.limits.position or (-np.pi, np.pi) for row in spec.moving_rows]
    lower, upper = np.array(limits).T
    return np.random.default_rng(seed).uniform(lower, upper, (count, len(limits)))


def off(spec: RobotSpec, size: float, seed: int) -> RobotSpec:
    """A robot whose numbers are off the table by so many m and rad."""
    rng = np.random.default_rng(seed)
    rows = []
    for row in fit_rows(spec).rows:
        keys = {"theta", "a", "alpha"}
        if row.convention is Convention.HAYATI:
            keys.add("beta")
        if row.convention is not Convention.HAYATI or row.type is JointType.PRISMATIC:
            keys.add("d")
        rows.append(replace(row, **{key: getattr(row, key) + size * rng.normal() for key in sorted(keys)}))
    fitted = fit_rows(spec)
    base, tool = (
        Pose(xyz=pose.xyz + size * rng.normal(size=3), rpy=pose.rpy + size * rng.normal(size=3))
        for pose in (fitted.base.pose, fitted.tool.pose)
    )
    return replace(
        fitted,
        rows=tuple(rows),
        base=replace(fitted.base, pose=base),
        tool=replace(fitted.tool, xyz=tool.xyz, rpy=tool.rpy),
        source_file=None,
    )


def turned(vectors: Array) -> Array:
    """Rotation matrices of small rotation vectors, to second order, made orthonormal."""
    x, y, z = vectors.T
    K = np.zeros((len(vectors), 3, 3))
    K[:, 0, 1], K[:, 0, 2], K[:, 1, 2] = -z, y, -x
    R = np.eye(3) + K - K.transpose(0, 2, 1)
    U, _, Vt = np.linalg.svd(R)
    return np.asarray(U @ Vt)


def measured(
    nominal: RobotSpec, true: RobotSpec, kind: str, q: Array, *, seed: int, sigma: float = SIGMA
) -> Measurements:
    """What is measured of a robot, with normal noise."""
    rng = np.random.default_rng([seed, 1])
    T = table_tool_pose(true, q)
    points = T[:, :3, 3] + sigma * rng.normal(size=(len(q), 3))
    if kind == "pose":
        noisy = T.copy()
        noisy[:, :3, 3] = points
        noisy[:, :3, :3] = turned(sigma * rng.normal(size=(len(q), 3))) @ T[:, :3, :3]
        return measurements(nominal, q, poses=noisy)
    if kind == "position":
        return measurements(nominal, q, positions=points)
    station = np.arange(len(q)) % len(STATIONS)
    distances = np.linalg.norm(T[:, :3, 3] - STATIONS[station], axis=1) + sigma * rng.normal(size=len(q))
    return measurements(nominal, q, distances=distances, stations=station.tolist(), groups=[*range(len(q))])


def numbers(*values: float) -> Array:
    """A read-only array."""
    return read_only(values)
