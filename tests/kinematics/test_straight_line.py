from __future__ import annotations

import copy
import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from dh2sim import Robot
from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.chain import KinematicChain, build_chain
from dh2sim.kinematics.forward import frame_names, frame_pose, geometric_jacobian
from dh2sim.kinematics.straight_line import CALLS_BEFORE_CODE
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.sample_robots import ODD_ROBOT, STANFORD, row
from tests.strategies import robots_with_joint_vectors

ODD_Q = np.array([0.3, -1.2, 2.5, 0.7, -0.4])


def pose_of(chain: KinematicChain, q: Any, frame: str = "tool0") -> Array:
    return frame_pose(chain, frame, q)


def jacobian_of(chain: KinematicChain, q: Any, frame: str = "tool0") -> Array:
    return geometric_jacobian(chain, q, frame=frame)


def compiled(chain: KinematicChain, q: Array, frame: str = "tool0") -> KinematicChain:
    """The chain, asked so often that it has code."""
    for _ in range(CALLS_BEFORE_CODE):
        frame_pose(chain, frame, q)
        geometric_jacobian(chain, q, frame=frame)
    assert frame in chain.code.pose
    assert frame in chain.code.jacobian
    return chain


@given(robots_with_joint_vectors(must_move=False))
def test_the_pose_of_one_joint_vector_equals_the_textbook_product(robot: tuple[RobotSpec, Array]) -> None:
    spec, q = robot
    walked, coded = build_chain(spec), compiled(build_chain(spec), q[0])
    for vector in q[:3]:
        expected = table_tool_pose(spec, vector)
        np.testing.assert_allclose(frame_pose(coded, "tool0", vector), expected, rtol=0, atol=4e-14)
        assert frame_pose(walked, "tool0", vector).tobytes() == frame_pose(coded, "tool0", vector).tobytes()


@given(robots_with_joint_vectors())
def test_the_jacobian_of_one_joint_vector_equals_that_of_a_batch(robot: tuple[RobotSpec, Array]) -> None:
    spec, q = robot
    walked, coded = build_chain(spec), compiled(build_chain(spec), q[0])
    batch = geometric_jacobian(coded, q[:3])
    for vector, expected in zip(q[:3], batch, strict=True):
        found = geometric_jacobian(coded, vector)
        np.testing.assert_allclose(found, expected, rtol=0, atol=4e-14)
        assert found.tobytes() == geometric_jacobian(walked, vector).tobytes()


def test_every_frame_has_its_pose_and_its_jacobian() -> None:
    chain = build_chain(ODD_ROBOT)
    for frame in frame_names(chain):
        coded = compiled(build_chain(ODD_ROBOT), ODD_Q, frame)
        for function in (pose_of, jacobian_of):
            expected = function(chain, ODD_Q[None], frame)[0]
            np.testing.assert_allclose(function(coded, ODD_Q, frame), expected, rtol=0, atol=2e-15, err_msg=frame)
    frames = table_frame_poses(ODD_ROBOT, ODD_Q)
    for i, pose in enumerate(frames):
        np.testing.assert_allclose(frame_pose(chain, f"dh_{i}", ODD_Q), pose, rtol=0, atol=2e-15)


@pytest.mark.parametrize("size", [1.0, 1e3, 1.6e6, 1e12])
def test_large_angles_are_as_exact_as_small_ones(size: float) -> None:
    turning = RobotSpec(name="t", rows=tuple(row(f"j{i}", a=0.3, alpha=0.4 + i, d=0.2, theta=0.0) for i in range(4)))
    chain = compiled(build_chain(turning), np.zeros(4))
    for q in np.random.default_rng(0).uniform(-size, size, (50, 4)):
        np.testing.assert_allclose(frame_pose(chain, "tool0", q), table_tool_pose(turning, q), rtol=0, atol=3e-15)


def test_results_are_new_arrays_that_may_be_written_to() -> None:
    chain = compiled(build_chain(STANFORD), np.zeros(6))
    for function in (pose_of, jacobian_of):
        one, other = function(chain, np.zeros(6)), function(chain, np.zeros(6))
        one[...] = 7.0
        assert not np.shares_memory(one, other)
        assert one.flags.c_contiguous
        assert one.dtype == np.float64
        assert function(chain, np.zeros(6)).tobytes() == other.tobytes()


def test_no_zero_has_a_minus_sign() -> None:
    for q in (np.zeros(6), np.full(6, math.pi), -np.zeros(6)):
        for chain in (build_chain(STANFORD), compiled(build_chain(STANFORD), q)):
            for found in (frame_pose(chain, "tool0", q), geometric_jacobian(chain, q)):
                assert not np.signbit(found[found == 0.0]).any()


@pytest.mark.parametrize(
    "q",
    [
        [0.1, 0.2],
        [0.0, 0.0, math.nan, 0.0, 0.0],
        (0.0, 0.0, 0.0, 0.0, -math.inf),
        [math.inf, -math.inf, 0.0, 0.0, 0.0],
        [1j, 0, 0, 0, 0],
        ["a", "b", "c", "d", "e"],
        [None] * 5,
        [[0.0] * 5, [0.0] * 4],
        np.zeros(4),
        np.zeros(6),
        np.full(5, np.nan),
        np.array(0.3),
        np.zeros(5, dtype=complex),
        0.3,
        None,
        "home",
        {},
    ],
)
def test_code_refuses_what_is_refused_without_it(q: object) -> None:
    plain, coded = build_chain(ODD_ROBOT), compiled(build_chain(ODD_ROBOT), ODD_Q)
    for function in (pose_of, jacobian_of):
        with pytest.raises(ConfigurationError) as expected:
            function(plain, q)
        with pytest.raises(ConfigurationError) as found:
            function(coded, q)
        assert str(found.value) == str(expected.value)


@pytest.mark.parametrize(
    "q",
    [
        ODD_Q.tolist(),
        tuple(ODD_Q.tolist()),
        list(ODD_Q),
        np.repeat(ODD_Q, 2)[::2],
        ODD_Q.astype(">f8"),
        ODD_Q.astype(np.longdouble),
        ODD_Q.view(np.ma.MaskedArray),
    ],
)
def test_code_takes_what_is_taken_without_it(q: Any) -> None:
    chain = compiled(build_chain(ODD_ROBOT), ODD_Q)
    assert frame_pose(chain, "tool0", q).tobytes() == frame_pose(chain, "tool0", ODD_Q).tobytes()
    assert frame_pose(chain, "tool0", [True, 0, 1, False, 2]).tobytes() == (
        frame_pose(chain, "tool0", [1.0, 0.0, 1.0, 0.0, 2.0]).tobytes()
    )


def test_coordinates_whose_sum_overflows_are_taken() -> None:
    slides = RobotSpec(name="s", rows=tuple(row(f"j{i}", "prismatic") for i in range(2)))
    chain = compiled(build_chain(slides), np.zeros(2))
    with np.errstate(over="ignore"):
        assert frame_pose(chain, "dh_1", [1.7e308, 1.7e308])[2, 3] == 1.7e308
        assert geometric_jacobian(chain, [1.7e308, 1.7e308]).tolist()[2] == [1.0, 1.0]


def test_a_chain_with_code_can_be_pickled_and_copied() -> None:
    chain = compiled(build_chain(ODD_ROBOT), ODD_Q)
    for other in (pickle.loads(pickle.dumps(chain)), copy.deepcopy(chain)):
        assert not other.code.pose
        assert frame_pose(other, "tool0", ODD_Q).tobytes() == frame_pose(chain, "tool0", ODD_Q).tobytes()
    assert chain.code.pose


def test_a_robot_has_the_same_answer_at_every_call() -> None:
    arm, q = Robot.from_spec(STANFORD), np.linspace(-1.0, 1.0, 6)
    poses = {arm.fk(q).tobytes() for _ in range(2 * CALLS_BEFORE_CODE)}
    jacobians = {arm.jacobian(q, "link_4").tobytes() for _ in range(2 * CALLS_BEFORE_CODE)}
    assert (len(poses), len(jacobians)) == (1, 1)


def test_an_arm_of_400_joints_gets_code() -> None:
    rows = tuple(row(f"j{i}", "prismatic" if i % 7 == 3 else "revolute", a=0.05, alpha=0.3 * i) for i in range(400))
    spec = RobotSpec(name="long", rows=rows)
    q = np.random.default_rng(0).uniform(-1.0, 1.0, 400)
    chain = build_chain(spec)
    walked = frame_pose(chain, "tool0", q)
    for _ in range(CALLS_BEFORE_CODE):
        found = frame_pose(chain, "tool0", q)
    assert found.tobytes() == walked.tobytes()
    np.testing.assert_allclose(found, table_tool_pose(spec, q), rtol=0, atol=1e-12)
