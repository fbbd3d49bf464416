"""Goals of inverse kinematics: poses are checked, and made orthonormal."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim.errors import ConfigurationError
from dh2sim.inverse.goals import read_goals, require_free
from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.typing import Array
from tests.refusals import refusal


def changed(row: int, column: int, value: float) -> Array:
    T = np.eye(4)
    T[row, column] = value
    return T


PARTS = "must be a pose: its upper left 3x3 part must be a rotation, its last row 0 0 0 1"


@pytest.mark.parametrize(
    ("T", "message"),
    [
        (changed(1, 3, math.nan), "the goal's element in row 2, column 4 is nan: it must be finite"),
        (changed(0, 0, math.inf)[None], "goal 0's element in row 1, column 1 is inf: it must be finite"),
        (np.eye(3), "the goal must be a pose of shape (4, 4), or poses of shape (N, 4, 4), got shape (3, 3)"),
        ([["x"]], "the goal must be an array of real numbers"),
        (changed(2, 2, -1.0), f"the goal {PARTS}"),
        (changed(2, 2, 1e300), f"the goal {PARTS}"),
        (np.stack([np.eye(4), changed(3, 3, 2.0)]), f"goal 1 {PARTS}"),
        (changed(0, 3, 1e13), "positions of goals must be within 1e+12 m"),
    ],
    ids=["nan", "inf", "shape", "text", "mirror", "huge", "last row", "far"],
)
def test_what_is_no_pose_is_refused(T: object, message: str) -> None:
    assert refusal(ConfigurationError, read_goals, T) == message


def test_rotations_of_single_precision_are_made_orthonormal() -> None:
    T = np.array(pose_from_rpy([0.1, 0.2, 0.3], [0.4, -0.5, 0.6]))
    goal = read_goals(T.astype(np.float32))
    assert goal == pytest.approx(T, abs=1e-6)
    assert np.abs(goal[:3, :3] @ goal[:3, :3].T - np.eye(3)).max() <= 1e-15


def test_what_a_goal_leaves_free_has_two_names() -> None:
    for free in (None, "rotation", "roll"):
        require_free(free)
    assert refusal(ConfigurationError, require_free, "pitch") == (
        "free must be None or one of 'rotation', 'roll', got 'pitch'"
    )
