"""Numbers: those that the sources print (weak), and points at general poses (strong)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from dh2sim import build_chain, forward_kinematics
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.sample_robots import robot

STANFORD_PRINTED_POSE = np.array(
    [
        [0.5245, -0.5915, 0.6124, 0.2001],
        [0.1585, 0.7745, 0.6124, 0.4123],
        [-0.8365, -0.2241, 0.5, 0.65],
        [0, 0, 0, 1],
    ]
)
"""WEAK: joint 5 is at zero, so that joints 4 and 6 are in line and their signs go unseen."""

STRONG_POINTS = {
    "stanford": (
        [0.3, -0.7, 0.5, 1.1, 0.6, -0.4],
        [-0.492905237028, 0.162561152730, 1.021295582581],
    ),
    "puma560": (
        [0.3, -0.7, 0.5, 1.1, 0.6, -0.4],
        [0.372126223844, 0.272177208276, -0.140986563547],
    ),
    "ssrms": (
        [0.3, -0.7, 0.5, 1.1, 0.6, -0.4, 0.9],
        [14.323319251304, -4.170418251941, -4.009514219281],
    ),
}
"""Tool positions, m, to twelve decimals, at poses where every joint counts."""


def tool_pose(spec: RobotSpec, q: Iterable[float]) -> Array:
    """Return the tool pose by the chain, having compared it with the table's."""
    q = np.array(list(q))
    pose = forward_kinematics(build_chain(spec), q)
    np.testing.assert_allclose(pose, table_tool_pose(spec, q), rtol=0, atol=1e-12)
    return pose


def translation(x: float, y: float, z: float) -> Array:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def with_twists_flipped(spec: RobotSpec, *numbers: int) -> RobotSpec:
    """Return the robot with the sign of alpha changed in the rows of these numbers, counted from 1."""
    rows = (
        replace(row, alpha=-row.alpha) if number in numbers else row for number, row in enumerate(spec.rows, start=1)
    )
    return replace(spec, rows=tuple(rows))


@pytest.mark.parametrize("name", STRONG_POINTS)
def test_tool_position_at_a_general_pose_agrees_to_twelve_decimals(name: str) -> None:
    q, position = STRONG_POINTS[name]
    np.testing.assert_allclose(tool_pose(robot(name), q)[:3, 3], position, rtol=0, atol=6e-13)


@pytest.mark.parametrize("name", STRONG_POINTS)
def test_strong_point_sees_the_sign_of_every_twist_that_it_can(name: str) -> None:
    """The last nonzero twist of an arm without a last offset turns the tool about its own point."""
    spec = robot(name)
    q, position = STRONG_POINTS[name]
    unseen = {"stanford": [], "puma560": [5, 6], "ssrms": [6]}[name]
    for number, row in enumerate(spec.rows, start=1):
        if row.alpha != 0:
            moved = np.linalg.norm(tool_pose(with_twists_flipped(spec, number), q)[:3, 3] - position)
            assert (moved < 1e-9) == (number in unseen), f"row {number}: moved by {moved} m"


def test_weak_printed_stanford_zero_pose_is_met() -> None:
    np.testing.assert_allclose(
        tool_pose(robot("stanford"), np.zeros(6)), translation(0, 0.15, 0.7), rtol=0, atol=1e-15
    )


def test_weak_printed_stanford_pose_is_met() -> None:
    spec = robot("stanford")
    pose = tool_pose(spec, spec.configurations["printed"])
    np.testing.assert_allclose(pose, STANFORD_PRINTED_POSE, rtol=0, atol=5.1e-5)


def test_weak_printed_ssrms_home_is_met() -> None:
    np.testing.assert_allclose(tool_pose(robot("ssrms"), np.zeros(7)), translation(24, 0, -10.5), rtol=0, atol=1e-13)


def test_weak_stanford_numbers_do_not_see_the_signs_of_twists_4_and_5() -> None:
    spec = robot("stanford")
    wrong = with_twists_flipped(spec, 4, 5)
    printed = spec.configurations["printed"]
    np.testing.assert_allclose(tool_pose(wrong, printed), STANFORD_PRINTED_POSE, rtol=0, atol=5.1e-5)
    np.testing.assert_allclose(tool_pose(wrong, np.zeros(6)), translation(0, 0.15, 0.7), rtol=0, atol=1e-15)


def test_weak_ssrms_home_does_not_see_the_sign_of_any_twist() -> None:
    wrong = with_twists_flipped(robot("ssrms"), 1, 2, 3, 4, 5, 6, 7)
    np.testing.assert_allclose(tool_pose(wrong, np.zeros(7)), translation(24, 0, -10.5), rtol=0, atol=1e-13)
