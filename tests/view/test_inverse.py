"""Where the tool is dragged to, it goes; where it cannot, it goes as near as it can."""

from __future__ import annotations

import math
import re
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.kinematics.transforms import identity, pose_from_rpy
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from dh2sim.view.motion.inverse import HandleKinematics, HandleSolution
from tests import strategies
from tests.sample_robots import model as robot

ROBOTS = ("planar_2r", "rpr", "scara", "cylindrical", "arm_5r", "spherical_wrist", "stanford", "puma560", "ssrms")
FEW_JOINTS = ("planar_2r", "scara", "arm_5r")


@cache
def inverse(name: str) -> HandleKinematics:
    return HandleKinematics(robot(name))


def solve(name: str, q: Array, T: Array) -> HandleSolution:
    return inverse(name).solve(q, T)


def angle_between(R_a: Array, R_b: Array) -> float:
    """By the chord: 2 sin(angle / 2) is the Frobenius distance over sqrt(2)."""
    return 2.0 * math.asin(min(1.0, float(np.linalg.norm(R_a - R_b)) / math.sqrt(8.0)))


def assert_within_limits(model: RobotModel, q: Array) -> None:
    for joint, value in zip(model.moving_joints, q, strict=True):
        if joint.position_range is not None:
            lower, upper = joint.position_range
            assert lower <= value <= upper, joint.name


@pytest.mark.parametrize("name", ROBOTS)
def test_a_goal_near_the_start_that_can_be_reached_is_reached(name: str) -> None:
    model, generator = robot(name), np.random.default_rng(7)
    lower, upper = model.travel
    for _ in range(40):
        q = generator.uniform(lower, upper)
        near = np.clip(q + 0.04 * (upper - lower) * generator.uniform(-1.0, 1.0, len(q)), lower, upper)
        T = forward_kinematics(model.chain, near)
        found = solve(name, q, T)
        T_found = forward_kinematics(model.chain, found.q)
        assert found.reached
        assert np.abs(T_found[:3, 3] - T[:3, 3]).max() <= 1e-6
        assert angle_between(T_found, T) <= 1e-6
        assert_within_limits(model, found.q)


def test_goals_at_the_limits_of_joints_are_reached_as_exactly_as_others() -> None:
    model, generator = robot("ssrms"), np.random.default_rng(1)
    lower, upper = model.travel
    for _ in range(300):
        q = generator.uniform(lower, upper)
        beyond = q + 0.05 * (upper - lower) * generator.uniform(-0.5, 0.5, len(q))
        there = np.clip(beyond, lower, upper)
        if np.array_equal(there, beyond):
            continue
        found = solve("ssrms", q, forward_kinematics(model.chain, there))
        assert found.reached
        assert found.position_error <= 1e-8
        assert_within_limits(model, found.q)


@pytest.mark.parametrize("name", ROBOTS)
def test_where_the_tool_is_already_nothing_moves(name: str) -> None:
    model = robot(name)
    found = solve(name, model.home, forward_kinematics(model.chain, model.home))
    assert found.reached
    assert np.abs(found.q - model.home).max() <= 1e-9


@pytest.mark.parametrize("name", ["planar_2r", "arm_5r", "stanford", "ssrms"])
@given(data=st.data())
@settings(max_examples=min(40, settings().max_examples))
def test_limits_hold_for_any_pose_and_errors_are_those_of_the_solution(name: str, data: st.DataObject) -> None:
    model = robot(name)
    lower, upper = model.travel
    far = st.floats(-1e9, 1e9) | st.floats(-2.0, 2.0) | st.sampled_from([0.0, 1e300, -1e300])
    T = np.array(pose_from_rpy([0.0, 0.0, 0.0], data.draw(strategies.vectors(strategies.angles))))
    T[:3, 3] = data.draw(strategies.vectors(far))
    share = data.draw(strategies.vectors(st.floats(-0.2, 1.2), size=len(lower)))
    found = inverse(name).solve(lower + share * (upper - lower), T, steps=40)
    assert_within_limits(model, found.q)
    T_found = forward_kinematics(model.chain, found.q)
    assert found.position_error == pytest.approx(math.dist(T_found[:3, 3], T[:3, 3]), rel=1e-9, abs=1e-12)
    assert found.rotation_error == pytest.approx(angle_between(T_found[:3, :3], T[:3, :3]), abs=1e-7)


@pytest.mark.slow
@given(robot_and_vectors=strategies.robots_with_joint_vectors(max_rows=7))
@settings(max_examples=min(60, settings().max_examples))
def test_any_robot_stays_within_its_limits_and_gets_no_farther_from_the_goal(
    robot_and_vectors: tuple[RobotSpec, Array],
) -> None:
    spec, vectors = robot_and_vectors
    model = build_model(spec)
    lower, upper = model.travel
    start, T = np.clip(vectors[0], lower, upper), forward_kinematics(model.chain, vectors[-1])
    found = HandleKinematics(model).solve(start, T, steps=40)
    assert_within_limits(model, found.q)
    before = forward_kinematics(model.chain, start)

    def cost(distance: float, angle: float) -> float:
        size, lever = max(model.reach, 1e-6), 0.3 if model.chain.n >= 6 else 0.03
        return math.hypot(distance / size, lever * angle)

    first = cost(math.dist(before[:3, 3], T[:3, 3]), angle_between(before[:3, :3], T[:3, :3]))
    # at the end a robot with few joints gives up orientation for position; the drag of the start counts 0.001 a joint
    left = cost(found.position_error, found.rotation_error if model.chain.n >= 6 else 0.0)
    assert left <= first + 1e-2


@pytest.mark.parametrize("direction", [0.0, 0.7, 2.0, -1.3])
def test_an_arm_in_a_plane_stretches_towards_what_is_out_of_reach(direction: float) -> None:
    model = robot("planar_2r")
    a_1, a_2 = (row.a for row in model.spec.rows)
    towards = np.array([math.cos(direction), math.sin(direction), 0.0])
    T = np.array(identity())
    T[:3, 3] = 2.0 * (a_1 + a_2) * towards
    found = solve("planar_2r", np.array([direction - 0.4, 0.9]), T)
    assert not found.reached
    assert found.position_error == pytest.approx(a_1 + a_2, rel=1e-5)
    tool = forward_kinematics(model.chain, found.q)[:3, 3]
    assert tool == pytest.approx((a_1 + a_2) * towards, abs=5e-3 * (a_1 + a_2))


@pytest.mark.parametrize("name", ["scara", "arm_5r", "puma560"])
def test_out_of_reach_the_tool_gets_as_near_as_any_of_many_configurations(name: str) -> None:
    model, generator = robot(name), np.random.default_rng(5)
    lower, upper = model.travel
    q = generator.uniform(lower, upper, (100_000, len(lower)))
    T = forward_kinematics(model.chain, q)
    farthest = np.argsort(np.linalg.norm(T[:, :3, 3], axis=1))[-2000::400]  # stretched without touching a limit
    for k in farthest:
        goal = T[k].copy()
        goal[:3, 3] *= 1.6
        found = solve(name, q[k], goal)
        best = np.linalg.norm(T[:, :3, 3] - goal[:3, 3], axis=1).min()
        assert not found.reached
        assert found.position_error <= best + 0.01 * model.reach


def test_a_stretched_arm_finds_out_which_way_to_bend() -> None:
    model = robot("planar_2r")
    a_1, a_2 = (row.a for row in model.spec.rows)
    T = np.array(identity())
    T[:3, 3] = [0.8 * (a_1 + a_2), 0.0, 0.0]  # no joint moves the tool that way, to first order
    found = solve("planar_2r", np.zeros(2), T)
    assert found.reached
    assert abs(found.q[1]) > 0.1


@pytest.mark.parametrize("name", FEW_JOINTS)
def test_with_few_joints_the_position_comes_first(name: str) -> None:
    model, generator = robot(name), np.random.default_rng(11)
    lower, upper = model.travel
    for _ in range(20):
        q = generator.uniform(lower + 0.2 * (upper - lower), upper - 0.2 * (upper - lower))
        T = np.array(forward_kinematics(model.chain, q + 0.02 * (upper - lower)))
        T[:3, :3] = T[:3, :3] @ pose_from_rpy([0.0, 0.0, 0.0], [0.5, 0.3, 0.0])[:3, :3]
        found = solve(name, q, T)
        assert found.reached
        assert found.position_error <= 1e-6
        assert found.rotation_error > 1e-3


def test_with_few_joints_the_orientation_is_sought_after_the_position() -> None:
    # four joints in a plane: one more than the position and the angle in the plane need
    rows = tuple(
        Row(name=f"j{i}", type=JointType.CONTINUOUS, convention=Convention.STANDARD, a=0.4) for i in range(4)
    )
    model = build_model(RobotSpec(name="snake", rows=rows))
    q = np.array([0.4, 1.2, -1.4, 0.3])
    T = np.array(forward_kinematics(model.chain, q))
    T[:3, :3] = T[:3, :3] @ pose_from_rpy([0.0, 0.0, 0.0], [0.0, 0.0, 0.7])[:3, :3]
    found = HandleKinematics(model).solve(q, T)
    assert found.reached
    assert found.rotation_error <= 1e-6


def test_an_orientation_out_of_reach_is_not_called_reached_with_six_joints() -> None:
    model = robot("stanford")
    found = solve("stanford", model.home, np.array(pose_from_rpy([0.0, 0.0, 0.0], [0.0, 0.0, 0.0])))
    assert not found.reached


@pytest.mark.parametrize("name", ["stanford", "planar_2r"])
def test_a_start_beyond_its_limits_is_moved_inside(name: str) -> None:
    model = robot(name)
    found = solve(name, np.full(model.chain.n, 1e4), forward_kinematics(model.chain, model.home))
    assert_within_limits(model, found.q)


def test_half_a_turn_away_there_is_a_way_too() -> None:
    model = robot("stanford")
    T = np.array(forward_kinematics(model.chain, model.home))
    T[:3, :3] = T[:3, :3] @ np.diag([-1.0, -1.0, 1.0])
    found = solve("stanford", model.home, T)
    assert found.rotation_error < math.pi - 0.5


def test_when_steps_are_used_up_what_was_found_so_far_is_returned() -> None:
    model = robot("puma560")
    lower, upper = model.travel
    T = forward_kinematics(model.chain, 0.5 * (lower + upper))
    one = inverse("puma560").solve(model.home, T, steps=1)
    assert not one.reached
    before = math.dist(forward_kinematics(model.chain, model.home)[:3, 3], T[:3, 3])
    assert solve("puma560", model.home, T).position_error < one.position_error < before


def test_poses_of_single_precision_are_welcome() -> None:
    model = robot("stanford")
    T = forward_kinematics(model.chain, model.home + 0.05).astype(np.float32)
    found = solve("stanford", model.home, T.astype(float))
    assert found.reached


def test_a_robot_that_only_turns_turns() -> None:
    rows = tuple(
        Row(name=f"j{i}", type=JointType.CONTINUOUS, convention=Convention.STANDARD, alpha=math.pi / 2)
        for i in range(3)
    )
    model = build_model(RobotSpec(name="ball", rows=rows))
    T = forward_kinematics(model.chain, [0.3, 0.8, -0.4])
    found = HandleKinematics(model).solve([0.2, 0.7, -0.2], T)
    assert found.reached
    assert found.rotation_error <= 1e-6


def test_a_robot_without_moving_joints_stays_and_tells_how_far_it_is() -> None:
    row = Row(name="j", type=JointType.FIXED, convention=Convention.STANDARD, a=0.5)
    model = build_model(RobotSpec(name="stick", rows=(row,)))
    found = HandleKinematics(model).solve([], pose_from_rpy([0.5, 0.0, 0.25], [0.0, 0.0, 0.4]))
    assert found.q.shape == (0,)
    assert (found.position_error, found.rotation_error) == pytest.approx((0.25, 0.4))
    assert not found.reached


@pytest.mark.parametrize(
    ("q", "message"),
    [
        ([0.0, math.nan], "coordinate of shoulder is nan: it must be finite"),
        ([[0.0, 0.0]], "expected one joint vector of shape (2,), got shape (1, 2)"),
    ],
    ids=["nan", "two axes"],
)
def test_an_invalid_joint_vector_is_refused(q: list[float], message: str) -> None:
    message = message.replace("shoulder", robot("planar_2r").moving_joints[1].name)
    with pytest.raises(ConfigurationError, match=f"^{re.escape(message)}$"):
        inverse("planar_2r").solve(q, identity())
