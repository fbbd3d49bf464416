"""All solutions of the robots that come with dh2sim, against the textbook product and the drawn configurations."""

from __future__ import annotations

import pickle
from functools import cache

import numpy as np
import pytest

import dh2sim
from dh2sim.errors import ConfigurationError, ModelError
from dh2sim.inverse.polish import solved
from dh2sim.inverse.solutions import Solutions
from dh2sim.inverse.solver import InverseSolver
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.row import JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.sample_robots import robot

BRANCHES = {
    "abb_irb120": {8},
    "arm_5r": {4},
    "cylindrical": {1},
    "cylindrical_wrist": {4},
    "kuka_kr6_r900": {4, 8},
    "planar_2r": {1},
    "puma560": {8},
    "rpr": {1},
    "scara": {2},
    "so101": {2},
    "spherical_wrist": {2},
    "stanford": {8},
    "staubli_tx2_60": {8},
    "ur10e": {2, 4, 6, 8},
    "ur5e": {2, 4, 6, 8},
}
"""How many solutions poses have that configurations of general position reach, limits aside."""


@cache
def solver(name: str) -> InverseSolver:
    return InverseSolver(robot(name))


def drawn(name: str, count: int, seed: int = 0) -> Array:
    """Joint vectors inside the limits, half a turn to each side where there are none."""
    limits = [row.limits.position or (-np.pi, np.pi) for row in robot(name).moving_rows]
    lower, upper = np.array(limits).T
    return np.random.default_rng(seed).uniform(lower, upper, (count, len(limits)))


def is_among(q: Array, solutions: Solutions) -> bool:
    return bool((np.abs(solutions.q - q).max(axis=1, initial=0.0) < 1e-6).any())


@pytest.mark.parametrize("name", BRANCHES)
def test_the_drawn_configuration_is_among_the_solutions(name: str) -> None:
    q = drawn(name, 40)
    for vector, solutions in zip(q, solver(name).solve(table_tool_pose(robot(name), q)), strict=True):
        assert is_among(vector, solutions)
        assert solutions.complete
        assert solutions.within_limits.all()


@pytest.mark.parametrize("name", BRANCHES)
def test_every_solution_reaches_the_pose_by_the_textbook_product(name: str) -> None:
    T = table_tool_pose(robot(name), drawn(name, 20, seed=1))
    for pose, solutions in zip(T, solver(name).solve(T, limits=False), strict=True):
        assert len(solutions) in BRANCHES[name]
        reached = table_tool_pose(robot(name), solutions.q)
        assert np.abs(reached - pose).max() < 1e-12


def test_a_solver_and_its_pickle_solve_alike() -> None:
    T = table_tool_pose(robot("ur5e"), drawn("ur5e", 3))
    copy = pickle.loads(pickle.dumps(solver("ur5e")))
    for ours, theirs in zip(solver("ur5e").solve(T), copy.solve(T), strict=True):
        assert np.array_equal(ours.q, theirs.q)


def test_one_pose_has_its_solutions_and_many_poses_a_list() -> None:
    T = table_tool_pose(robot("scara"), drawn("scara", 2))
    both = dh2sim.inverse_kinematics(robot("scara"), T)
    alone = dh2sim.inverse_kinematics(robot("scara"), T[1])
    assert np.array_equal(both[1].q, alone.q)


def test_a_pose_that_is_no_rigid_transform_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="must be a pose"):
        solver("scara").solve(2.0 * np.eye(4))


def test_with_all_joints_locked_the_pose_is_reached_or_not() -> None:
    T = table_tool_pose(robot("planar_2r"), np.array([0.2, 0.4]))
    reached = solver("planar_2r").solve(T, lock={"joint_1": 0.2, "joint_2": 0.4})
    assert np.allclose(reached.q, [[0.2, 0.4]])
    missed = solver("planar_2r").solve(T, lock={"joint_1": 0.2, "joint_2": 0.5})
    assert len(missed) == 0
    assert "locked" in missed.reason


def test_a_robot_without_joints_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="still has no joint that moves"):
        InverseSolver(RobotSpec(name="still", rows=(Row(type=JointType.FIXED, a=0.3),)))


def test_a_mechanism_is_refused() -> None:
    four_bar = dh2sim.Robot.load("four_bar")
    for ask in (four_bar.ik, four_bar.explain_ik):
        with pytest.raises(ModelError, match="four_bar: has closed loops: this works on serial robots"):
            ask(four_bar.fk([0.3]))


def test_all_solutions_of_an_arm_of_very_many_joints_are_refused_at_once() -> None:
    long = RobotSpec(
        name="long", rows=tuple(Row(name=f"joint_{k}", type=JointType.REVOLUTE, a=0.1) for k in range(51))
    )
    arm = InverseSolver(long)
    with pytest.raises(ConfigurationError) as caught:
        arm.solve(np.eye(4))
    assert str(caught.value) == (
        "long: 51 joints move; all solutions are found of arms with at most 50: use numeric for one solution"
    )
    T = table_tool_pose(long, np.linspace(0.0, 0.2, 51))
    assert len(arm.solve(T, np.linspace(0.0, 0.2, 51), numeric=True))


def test_a_matrix_that_stays_singular_although_it_is_damped_gives_the_shortest_step() -> None:
    A = np.diag([4.0, 0.0, 0.0])[None]
    np.testing.assert_allclose(solved(A, np.array([[[2.0], [0.0], [0.0]]]))[0, :, 0], [0.5, 0.0, 0.0])
