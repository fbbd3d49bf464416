"""The pose that inverse kinematics looks for: checked, and measured against."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.typing import Array, read_only

TOLERANCE = 1e-3
"""How far a rotation matrix may be from one: single precision, and numbers that were typed, are welcome."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Goal:
    """A pose in base_link."""

    position: Array
    """m, shape (3,)."""
    rotation: Array
    """A rotation to the last bits, shape (3, 3)."""

    def within(self, distance: float) -> Array:
        """Return the position, or where the way to it leaves a ball around base_link's origin, m, shape (3,)."""
        far = math.hypot(*self.position)
        if far <= distance:
            return self.position
        # the greatest component first: the length of the longest vectors is no double
        direction = self.position / np.abs(self.position).max()
        return np.asarray(direction * (distance / np.linalg.norm(direction)))


def read_goal(T: ArrayLike) -> Goal:
    """Check a pose, and turn its axes to right angles where they are only nearly so.

    Raises:
        ConfigurationError: it is no pose of finite numbers.
    """
    try:
        pose = np.asarray(T, dtype=np.float64)
    except (TypeError, ValueError):
        raise ConfigurationError("the goal must be an array of real numbers") from None
    if pose.shape != (4, 4):
        raise ConfigurationError(f"the goal must be a pose of shape (4, 4), got shape {pose.shape}")
    if not np.isfinite(pose).all():
        row, column = (int(i) for i in np.argwhere(~np.isfinite(pose))[0])
        raise ConfigurationError(
            f"the goal's element in row {row + 1}, column {column + 1} is {pose[row, column]}: it must be finite"
        )
    R = pose[:3, :3]
    wrong = np.abs(R).max() > 1.0 + TOLERANCE or np.abs(R.T @ R - np.eye(3)).max() > TOLERANCE
    if wrong or np.linalg.det(R) < 0.0 or np.abs(pose[3] - [0.0, 0.0, 0.0, 1.0]).max() > TOLERANCE:
        raise ConfigurationError(
            "the goal is no pose: its upper left 3x3 part must be a rotation, its last row 0 0 0 1"
        )
    left, _, right = np.linalg.svd(R)
    return Goal(position=read_only(pose[:3, 3]), rotation=read_only(left @ right))


def rotation_angle(R_a: Array, R_b: Array) -> float:
    """Return the angle between two orientations, rad, from 0 to pi, exact for small ones too."""
    R = R_a.T @ R_b
    sine = 0.5 * math.hypot(R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1])
    return math.atan2(sine, 0.5 * (float(np.trace(R)) - 1.0))
