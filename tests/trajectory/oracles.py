"""What tests of trajectories compare with: finite differences, and the table's textbook product."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.spec import RobotSpec
from dh2sim.trajectory.trajectory import Trajectory
from dh2sim.typing import Array


def assert_derivatives_agree(
    values: Callable[[Array], Array], rates: Callable[[Array], Array], end: float, most: Array, change: Array
) -> None:
    """Compare rates with central differences of values, away from where rates may jump."""
    h = 1e-6 * end
    t = np.linspace(2.0 * h, end - 2.0 * h, 997)
    differences = (values(t + h) - values(t - h)) / (2.0 * h)
    # rates change by at most their own limit of change over the width; values are rounded
    allowed = h * np.asarray(change) + 1e-6 * np.asarray(most) + 1e-15 * 4.0 / h
    assert (np.abs(differences - rates(t)) <= allowed).all()


def assert_limits_are_kept(planned: Trajectory, *, jerk: bool = True, count: int = 5003) -> None:
    """Look at times that planning did not look at: even ones, and random ones."""
    even = np.linspace(0.0, planned.duration, count)
    t = np.concatenate([even, np.random.default_rng(7).uniform(0.0, planned.duration, count)])
    q, *rates = planned.at(t)
    limits = planned.limits
    slack = 1e-8
    assert (q >= limits.lower - slack).all()
    assert (q <= limits.upper + slack).all()
    for rate, limit in list(zip(rates, limits.rates, strict=True))[: 3 if jerk else 2]:
        assert (np.abs(rate) <= limit).all(), (np.abs(rate) / limit).max()


def tool_poses(spec: RobotSpec, planned: Trajectory, count: int = 401) -> tuple[Array, Array]:
    """Return times of their own, and the pose of tool0 there by the table's textbook product."""
    t = np.sort(np.random.default_rng(11).uniform(0.0, planned.duration, count))
    return t, table_tool_pose(spec, planned.at(t)[0])


def angle_between(R: Array, S: Array) -> Array:
    """Return angles between rotations, rad, by quaternion-free arithmetic: from the norm of the difference."""
    gap = np.linalg.norm(R - S, axis=(-2, -1))
    return np.asarray(2.0 * np.arcsin(np.minimum(1.0, gap / np.sqrt(8.0))))
