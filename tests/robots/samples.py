"""The robot files under test, and configurations to test them at."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np

from dh2sim import load_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array

ROBOTS_DIR: Final = Path(__file__).parents[2] / "robots"

NAMES: Final = tuple(sorted(path.stem for path in ROBOTS_DIR.glob("*.yaml")))


@cache
def robot(name: str) -> RobotSpec:
    """Load a file of robots/; a specification cannot be changed, so the tests may share it."""
    return load_robot(ROBOTS_DIR / f"{name}.yaml")


def limits(spec: RobotSpec) -> Array:
    """Return lower and upper limits of the joint vector, shape (2, n); half a turn where there are none."""
    pairs = [row.limits.position or (-math.pi, math.pi) for row in spec.moving_rows]
    return np.array(pairs).T


def random_configurations(spec: RobotSpec, *, seed: int, count: int = 200) -> Array:
    """Draw joint vectors inside the limits, shape (count, n)."""
    lower, upper = limits(spec)
    return np.random.default_rng(seed).uniform(lower, upper, size=(count, len(lower)))
