"""Configurations to test the robot files at."""

from __future__ import annotations

import math

import numpy as np

from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array


def limits(spec: RobotSpec) -> Array:
    """Return lower and upper limits of the joint vector, shape (2, n); half a turn where there are none."""
    pairs = [row.limits.position or (-math.pi, math.pi) for row in spec.moving_rows]
    return np.array(pairs).T


def random_configurations(spec: RobotSpec, *, seed: int, count: int = 200) -> Array:
    """Draw joint vectors inside the limits, shape (count, n)."""
    lower, upper = limits(spec)
    return np.random.default_rng(seed).uniform(lower, upper, size=(count, len(lower)))
