"""Poses that inverse kinematics is asked for, checked."""

from __future__ import annotations

from typing import Final, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.arguments import real_array
from dh2sim.errors import ArgumentError, ConfigurationError
from dh2sim.messages import listed
from dh2sim.typing import Array

Free: TypeAlias = Literal["rotation", "roll"]
"""What a goal leaves open: the whole orientation, or the roll about tool0's z."""
FARTHEST: Final = 1e12
"""m: positions farther away are beyond any robot, and their squares beyond doubles in the end."""
TOLERANCE: Final = 1e-3
"""Largest error of a rotation matrix: single precision and typed numbers are accepted."""


def read_goals(T: ArrayLike) -> Array:
    """Check goals, and make their rotations orthonormal.

    Args:
        T: A pose of tool0 in base_link, shape (4, 4), or several, shape (N, 4, 4).

    Returns:
        Shape (4, 4) or (N, 4, 4).

    Raises:
        ConfigurationError: They are no poses of finite numbers.
    """
    try:
        poses = real_array("T", T)
    except ArgumentError:
        raise ConfigurationError("the goal must be an array of real numbers") from None
    if poses.ndim not in (2, 3) or poses.shape[-2:] != (4, 4):
        shapes = "a pose of shape (4, 4), or poses of shape (N, 4, 4)"
        raise ConfigurationError(f"the goal must be {shapes}, got shape {poses.shape}")
    if not np.isfinite(poses).all():
        *which, row, column = (int(i) for i in np.argwhere(~np.isfinite(poses))[0])
        element = f"{_name(which)}'s element in row {row + 1}, column {column + 1}"
        raise ConfigurationError(f"{element} is {poses[*which, row, column]}: it must be finite")
    if np.abs(poses[..., :3, 3]).max(initial=0.0) > FARTHEST:
        raise ConfigurationError(f"positions of goals must be within {FARTHEST:g} m")
    R = poses[..., :3, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        skewed = np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(axis=(-2, -1))
        right = (np.abs(R).max(axis=(-2, -1)) <= 1.0 + TOLERANCE) & (skewed <= TOLERANCE) & (np.linalg.det(R) > 0.0)
    right &= np.abs(poses[..., 3, :] - [0.0, 0.0, 0.0, 1.0]).max(axis=-1) <= TOLERANCE
    if not right.all():
        which = [int(i) for i in np.argwhere(~right)[0]]
        parts = "its upper left 3x3 part must be a rotation, its last row 0 0 0 1"
        raise ConfigurationError(f"{_name(which)} must be a pose: {parts}")
    left, _, right_vectors = np.linalg.svd(R)
    poses[..., :3, :3] = left @ right_vectors
    poses[..., 3, :] = (0.0, 0.0, 0.0, 1.0)
    return poses


def _name(index: list[int]) -> str:
    return f"goal {index[0]}" if index else "the goal"


def require_free(free: object) -> None:
    """Check what a goal leaves open.

    Raises:
        ConfigurationError: It is none of None, 'rotation' and 'roll'.
    """
    if free is not None and not (isinstance(free, str) and free in get_args(Free)):
        raise ConfigurationError(f"free must be None or one of {listed(map(repr, get_args(Free)))}, got {free!r}")
