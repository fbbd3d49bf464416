"""Numeric inverse kinematics gets to a goal inside the limits, or as near to it as can be."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.inverse.goals import Free
from dh2sim.inverse.numeric import Nearest, NumericSolver
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests import strategies
from tests.sample_robots import ODD_ROBOT, in_limits, model, row

ROBOTS = ("planar_2r", "rpr", "scara", "arm_5r", "stanford", "puma560", "franka_panda", "odd")


def bounds(spec: RobotSpec) -> tuple[Array, Array]:
    ranges = [row.limits.position or (-math.inf, math.inf) for row in spec.moving_rows]
    lower, upper = np.array(ranges, dtype=np.float64).reshape(-1, 2).T
    return lower, upper


def solver_of(spec: RobotSpec) -> NumericSolver:
    return NumericSolver(build_chain(spec), *bounds(spec))


def spec_of(name: str) -> RobotSpec:
    return ODD_ROBOT if name == "odd" else model(name).spec


def planar(*lengths: float) -> RobotSpec:
    return RobotSpec(name="planar", rows=tuple(row(f"j{i}", a=a) for i, a in enumerate(lengths)))


def at(x: float, y: float, z: float = 0.0, yaw: float = 0.0) -> Array:
    return np.array(pose_from_rpy([x, y, z], [0.0, 0.0, yaw]))[None]


def errors(spec: RobotSpec, q: Array, T: Array, free: Free | None) -> Array:
    """By the oracle: the largest difference of what the goal asks for, lengths in m."""
    found = table_tool_pose(spec, q)
    columns = {None: [0, 1, 2, 3], "roll": [2, 3], "rotation": [3]}[free]
    return np.asarray(np.abs(found[:, :3, columns] - T[:, :3, columns]).max(axis=(1, 2)))


def assert_inside(spec: RobotSpec, q: Array) -> None:
    lower, upper = bounds(spec)
    assert ((q >= lower - 1e-12) & (q <= upper + 1e-12)).all()


@pytest.mark.parametrize("free", [None, "roll", "rotation"])
@pytest.mark.parametrize("name", ROBOTS)
def test_goals_within_reach_are_reached_inside_the_limits(name: str, free: Free | None) -> None:
    spec = spec_of(name)
    T = table_tool_pose(spec, in_limits(model(name), 40, seed=5))
    found = solver_of(spec).search(T, free=free)
    assert found.reached.all()
    assert errors(spec, found.q, T, free).max() <= 1e-8
    assert_inside(spec, found.q)


@pytest.mark.parametrize("name", ROBOTS)
def test_from_nearby_a_goal_is_reached_in_one_descent_that_stays_nearby(name: str) -> None:
    spec, generator = spec_of(name), np.random.default_rng(3)
    q = in_limits(model(name), 200, seed=8)
    lower, upper = bounds(spec)
    start = np.clip(q + generator.uniform(-0.02, 0.02, q.shape), lower, upper)
    T = table_tool_pose(spec, q)
    found = solver_of(spec).descend(T, start)
    assert found.reached.mean() >= 0.99
    assert errors(spec, found.q[found.reached], T[found.reached], None).max() <= 1e-8
    # a redundant arm, or one near a singularity, ends beside where the goal was drawn
    assert np.median(np.abs(found.q - q).max(axis=1)) <= 0.03


def test_where_the_tool_is_already_nothing_moves() -> None:
    spec = spec_of("puma560")
    q = in_limits(model("puma560"), 20, seed=1)
    found = solver_of(spec).descend(table_tool_pose(spec, q), q)
    assert np.array_equal(found.q, q)


@pytest.mark.parametrize("direction", [0.0, 0.7, 2.0, -2.3])
def test_an_arm_stretches_towards_a_point_out_of_reach(direction: float) -> None:
    goal = at(3.0 * math.cos(direction), 3.0 * math.sin(direction))
    found = solver_of(planar(0.7, 0.5)).search(goal, np.array([direction - 1.0, 1.3]), free="rotation")
    assert not found.reached[0]
    assert found.position_error == pytest.approx([3.0 - 1.2], abs=1e-12)
    assert found.q[0, 1] == pytest.approx(0.0, abs=1e-6)


def test_out_of_reach_few_steps_suffice() -> None:
    # the steps of Gauss and Newton would take hundreds: the stretched arm is singular, and the error stays large
    goal = at(0.3, 3.0, 0.4)
    found = solver_of(planar(0.7, 0.5, 0.3)).descend(goal, np.array([[1.0, 0.4, 0.7]]), free="rotation", steps=12)
    assert found.position_error == pytest.approx([math.hypot(math.hypot(0.3, 3.0) - 1.5, 0.4)], abs=1e-12)


def test_an_arm_folds_towards_a_point_too_near_its_base() -> None:
    found = solver_of(planar(0.7, 0.3)).search(at(0.05, 0.1), free="rotation")
    assert found.position_error == pytest.approx([0.4 - math.hypot(0.05, 0.1)], abs=1e-12)


def test_a_point_off_the_plane_is_missed_by_its_height() -> None:
    found = solver_of(planar(0.7, 0.5)).search(at(0.6, 0.4, 0.23), free="rotation")
    assert found.position_error == pytest.approx([0.23], abs=1e-12)


def test_a_stretched_arm_leaves_the_saddle_in_which_no_joint_moves_the_tool_towards_the_goal() -> None:
    found = solver_of(planar(0.7, 0.5)).descend(at(0.9, 0.0), np.zeros((1, 2)), free="rotation")
    assert found.reached[0]
    assert abs(found.q[0, 1]) > 0.1


def test_half_a_turn_away_an_orientation_is_found_too() -> None:
    found = solver_of(planar(0.7, 0.5, 0.2)).descend(at(1.4, 0.0, yaw=math.pi), np.zeros((1, 3)))
    stretched = solver_of(planar(0.7, 0.5, 0.2)).descend(at(0.5, 0.0, yaw=math.pi), np.zeros((1, 3)))
    assert found.rotation_error[0] < math.pi - 0.1
    assert stretched.reached[0]


@pytest.mark.parametrize("name", ["scara", "arm_5r", "puma560"])
def test_out_of_reach_no_random_configuration_is_nearer(name: str) -> None:
    spec = spec_of(name)
    q = in_limits(model(name), 20_000, seed=5)
    T = table_tool_pose(spec, q)
    goals = T[::4000].copy()
    goals[:, :3, 3] *= 3.0
    found = solver_of(spec).search(goals, free="rotation")
    for goal, error in zip(goals, found.position_error, strict=True):
        assert error <= np.linalg.norm(T[:, :3, 3] - goal[:3, 3], axis=1).min() + 1e-12


def test_a_limit_stops_a_joint_and_the_others_do_what_they_can() -> None:
    spec = planar(0.7, 0.5)
    solver = NumericSolver(build_chain(spec), np.array([-0.4, -2.0]), np.array([0.4, 2.0]))
    found = solver.search(at(0.0, 3.0), free="rotation")
    assert found.q[0, 0] == 0.4
    # the second link points from the elbow to the goal
    elbow = 0.7 * np.array([math.cos(0.4), math.sin(0.4)])
    assert found.q[0, 1] == pytest.approx(math.atan2(3.0 - elbow[1], -elbow[0]) - 0.4, abs=1e-6)


def test_every_run_finds_the_same() -> None:
    spec = spec_of("stanford")
    T = table_tool_pose(spec, in_limits(model("stanford"), 10, seed=2))
    first, second = (solver_of(spec).search(T) for _ in range(2))
    assert np.array_equal(first.q, second.q)


def test_goals_of_a_batch_do_not_influence_each_other() -> None:
    spec = spec_of("stanford")
    T = table_tool_pose(spec, in_limits(model("stanford"), 8, seed=2))
    together = solver_of(spec).search(T)
    alone = np.array([solver_of(spec).search(T[k : k + 1]).q[0] for k in range(8)])
    assert together.q == pytest.approx(alone, abs=1e-6)


def test_lengths_in_any_unit_give_the_same_angles() -> None:
    goal = at(0.5, 0.3)
    expected = solver_of(planar(0.7, 0.5)).search(goal, np.array([0.1, 0.4]), free="rotation").q
    for unit in (1e-3, 1e3):
        scaled = goal.copy()
        scaled[:, :3, 3] *= unit
        found = solver_of(planar(0.7 * unit, 0.5 * unit)).search(scaled, np.array([0.1, 0.4]), free="rotation")
        assert found.q == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("distance", [1e9, 1e300])
def test_goals_at_any_distance_are_told_from_those_within_reach(distance: float) -> None:
    found = solver_of(spec_of("puma560")).search(at(distance, 0.0))
    assert not found.reached[0]
    assert found.position_error == pytest.approx([distance])
    assert np.isfinite(found.q).all()


def test_an_arm_of_sliding_joints_without_limits_gets_anywhere() -> None:
    rows = (
        row("x", "prismatic", alpha=-math.pi / 2),
        row("y", "prismatic", alpha=1.1, theta=0.8),
        row("z", "prismatic"),
    )
    spec = RobotSpec(name="gantry", rows=rows)
    T = table_tool_pose(spec, np.array([[3.0, -4.0, 7.0]]))
    found = solver_of(spec).search(T)
    assert found.q == pytest.approx(np.array([[3.0, -4.0, 7.0]]), abs=1e-8)


def test_an_arm_that_does_not_move_is_as_far_as_it_is() -> None:
    spec = RobotSpec(name="stick", rows=(row("j", "fixed", a=0.5),))
    found = solver_of(spec).search(at(0.5, 0.0, 0.25, yaw=0.4))
    assert found.q.shape == (1, 0)
    assert (found.position_error[0], found.rotation_error[0]) == pytest.approx((0.25, 0.4))


@given(robot_and_vectors=strategies.robots_with_joint_vectors(max_rows=7))
@settings(max_examples=40)
def test_any_arm_stays_inside_its_limits_and_gets_no_farther_from_the_goal(
    robot_and_vectors: tuple[RobotSpec, Array],
) -> None:
    spec, vectors = robot_and_vectors
    solver = solver_of(spec)
    T, start = table_tool_pose(spec, vectors[-1:]), vectors[:1]
    found = solver.descend(T, start)
    assert_inside(spec, found.q)

    def cost(pose: Array) -> float:
        axes = float(np.sum((pose[:3, :3] - T[0, :3, :3]) ** 2))
        return math.dist(pose[:3, 3], T[0, :3, 3]) ** 2 / solver.size**2 + 0.3**2 * axes / 2

    before, after = (table_tool_pose(spec, q)[0] for q in (start, found.q))
    assert cost(after) <= cost(before) + 1e-12
    assert_errors_are_those_of(found, after, T[0])


def assert_errors_are_those_of(found: Nearest, pose: Array, T: Array) -> None:
    chord = float(np.linalg.norm(pose[:3, :3] - T[:3, :3]))
    assert found.position_error[0] == pytest.approx(math.dist(pose[:3, 3], T[:3, 3]), rel=1e-9, abs=1e-12)
    assert found.rotation_error[0] == pytest.approx(2.0 * math.asin(min(1.0, chord / math.sqrt(8.0))), abs=1e-6)
