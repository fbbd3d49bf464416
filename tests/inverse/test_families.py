"""Singular poses: families of solutions are curves, isolated solutions stay points."""

from __future__ import annotations

import numpy as np
import pytest

from dh2sim.inverse.solutions import Solutions
from dh2sim.inverse.solver import InverseSolver
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.row import JointType, Row
from dh2sim.robot.spec import RobotSpec
from tests.sample_robots import robot


def solved(name: str, q: list[float]) -> Solutions:
    solutions = InverseSolver(robot(name)).solve(table_tool_pose(robot(name), np.array(q)), np.array(q), limits=False)
    assert isinstance(solutions, Solutions)
    return solutions


@pytest.mark.parametrize("name", ["puma560", "stanford", "staubli_tx2_60"])
def test_a_wrist_in_line_is_a_closed_curve_on_which_two_joints_turn(name: str) -> None:
    q = [0.3, -0.6, 0.5, 0.9, 0.0, -0.4]
    solutions = solved(name, q)
    curve = solutions.curves[0]
    assert curve.kind == "wrist singularity"
    assert curve.closed
    moves = np.ptp(curve.q, axis=0) > 1e-6
    assert moves.tolist() == [False, False, False, True, False, True]
    T = table_tool_pose(robot(name), np.array(q))
    assert np.abs(table_tool_pose(robot(name), curve.q) - T).max() < 1e-12
    assert np.abs(curve.q[:, 3] + curve.q[:, 5] - 0.5).min() < 0.05  # the given configuration is on it


def test_a_wrist_in_line_leaves_the_other_solutions_isolated() -> None:
    solutions = solved("puma560", [0.3, -0.6, 0.5, 0.9, 0.0, -0.4])
    assert len(solutions.curves) == 1
    assert (solutions.sigma_min > 1e-3).sum() == 6
    assert len(solutions) == 7  # and the nearest of the curve


def test_a_wrist_centre_on_the_first_axis_is_a_shoulder_singularity() -> None:
    solutions = solved("cylindrical_wrist", [0.0, 0.0, 0.0, 0.4, 0.7, -0.2])  # the arm's slide is drawn in
    assert {curve.kind for curve in solutions.curves} == {"shoulder singularity"}


def test_two_slides_along_parallel_lines_are_no_singularity_of_shoulder_or_wrist() -> None:
    slide, turn = JointType.PRISMATIC, JointType.REVOLUTE
    arm = (
        (slide, 0.1, 1.5),
        (turn, 0.3, -1.5),
        (slide, 0.0, 0.6),
        (turn, 0.2, 1.5),
        (turn, 0.1, 1.0),
        (slide, 0.0, 0.4),
    )
    spec = RobotSpec(name="arm", rows=tuple(Row(type=kind, a=a, alpha=alpha, d=0.1) for kind, a, alpha in arm))
    q = np.array([0.1, 0.0, 0.2, 0.3, 0.4, 0.5])  # joint 2 has the first slides along parallel lines
    solutions = InverseSolver(spec).solve(table_tool_pose(spec, q), q, limits=False)
    moves = np.ptp(solutions.curves[0].q, axis=0) > 1e-6
    assert moves.tolist() == [True, False, True, False, False, False]
    assert {curve.kind for curve in solutions.curves} == {"self-motion"}


def test_a_stretched_elbow_is_one_isolated_solution() -> None:
    solutions = solved("scara", [0.4, 0.0, 0.1, 0.3])
    assert solutions.curves == ()
    assert len(solutions) == 1
    assert solutions.sigma_min[0] < 1e-6


def test_a_note_says_which_joints_move() -> None:
    solutions = solved("puma560", [0.3, -0.6, 0.5, 0.9, 0.0, -0.4])
    assert solutions.notes == ("Wrist singularity: joint_4 and joint_6 move, tool0 does not.",)


def test_a_straight_elbow_and_a_wrist_in_line_are_one_curve_and_no_point_of_it_beside() -> None:
    straight = -np.arctan2(0.4318, 0.0203)
    solutions = solved("puma560", [0.0, 0.0, float(straight), 0.0, 0.0, 0.0])
    assert [curve.kind for curve in solutions.curves] == ["wrist singularity"]
    in_line = [name for name in solutions.branch if "wrist singular" in name]
    assert in_line == ["left, elbow straight, wrist singular"]


def test_a_wrist_alone_has_a_wrist_singularity() -> None:
    solutions = solved("spherical_wrist", [0.4, 0.0, 0.3])
    assert [curve.kind for curve in solutions.curves] == ["wrist singularity"]


def test_in_a_batch_of_poses_each_has_the_curves_that_it_has_alone() -> None:
    spec = robot("puma560")
    in_line, bent = [0.3, -0.6, 0.5, 0.9, 0.0, -0.4], [0.3, -0.6, 0.5, 0.9, 0.7, -0.4]
    q = np.array([in_line, bent, [-0.5, 0.2, 0.9, 0.1, 0.0, 0.8]])
    T = table_tool_pose(spec, q)
    solver = InverseSolver(spec)
    together = solver.solve(T, limits=False)
    assert [len(solutions.curves) for solutions in together] == [1, 0, 1]
    for pose, solutions in zip(T, together, strict=True):
        alone = solver.solve(pose, limits=False)
        assert solutions.notes == alone.notes
        np.testing.assert_allclose(solutions.q, alone.q, rtol=0.0, atol=1e-9)
        for curve, other in zip(solutions.curves, alone.curves, strict=True):
            assert (curve.kind, curve.closed) == (other.kind, other.closed) == ("wrist singularity", True)
            np.testing.assert_allclose(curve.q, other.q, rtol=0.0, atol=1e-9)
