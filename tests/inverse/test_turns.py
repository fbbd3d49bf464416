"""Whole turns: all that fit into the limits, and only those."""

from __future__ import annotations

import math

import numpy as np

from dh2sim.inverse.solver import InverseSolver
from dh2sim.inverse.turns import Turns
from dh2sim.kinematics.table_oracle import table_tool_pose
from tests.sample_robots import robot

TURNS = Turns(
    np.array([-4.6, -1.0, -math.inf, 0.0]),
    np.array([4.6, 1.0, math.inf, 0.5]),
    np.array([True, True, True, False]),
    np.ones(4),
)
"""Joints that turn by ±263 degrees, ±57 degrees and without limits, and one that slides."""


def test_all_whole_turns_inside_limits_are_returned() -> None:
    which, q = TURNS.allowed(np.array([[2.0, 0.5, 7.0, 0.2]]), np.zeros(4))
    assert which.tolist() == [0, 0]
    first = np.sort(q[:, 0])
    assert np.allclose(first, [2.0 - 2.0 * math.pi, 2.0])
    assert np.allclose(q[:, 1:], [0.5, 7.0 - 2.0 * math.pi, 0.2])


def test_what_no_whole_turn_brings_inside_is_left_out() -> None:
    which, _ = TURNS.allowed(np.array([[0.0, 2.0, 0.0, 0.2], [0.0, 0.0, 0.0, 0.6]]), np.zeros(4))
    assert which.tolist() == []


def test_without_limits_joints_stay_near_the_given_configuration() -> None:
    q = TURNS.nearest(np.array([[3.0, 3.0, 3.0, 0.3]]), np.array([-2.0, 9.0, 0.0, 0.0]))
    assert np.allclose(q, [[3.0 - 2.0 * math.pi, 3.0 + 2.0 * math.pi, 3.0, 0.3]])


def test_a_wrist_that_turns_more_than_once_has_each_turn_as_a_solution() -> None:
    spec = robot("puma560")
    q = np.array([0.2, -0.4, 0.3, 0.5, 0.6, 3.5])
    solutions = InverseSolver(spec).solve(table_tool_pose(spec, q), q)
    last = solutions.q[solutions.same == solutions.same[0]][:, 5]
    assert np.allclose(np.sort(last), [3.5 - 2.0 * math.pi, 3.5])
    assert np.allclose(solutions.best, q)


def test_the_nearest_solution_comes_first() -> None:
    spec = robot("ur5e")
    q = np.array([0.2, -1.4, 1.3, 0.5, 0.6, 1.0])
    near = q + 0.05
    solutions = InverseSolver(spec).solve(table_tool_pose(spec, q), near)
    distances = np.linalg.norm(solutions.q - near, axis=1)
    assert np.allclose(solutions.best, q)
    assert (np.diff(distances) >= -1e-12).all()
