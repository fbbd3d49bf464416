from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.batch_frame import BLOCK, sines_and_cosines
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.forward import forward_kinematics, frame_poses, joint_poses, reference_joint_poses
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.kinematics.trig import sin_cos
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.sample_robots import ODD_ROBOT, STANFORD, row
from tests.strategies import robots_with_joint_vectors

ODD_CHAIN = build_chain(ODD_ROBOT)
NAMES = "5 joint coordinates (one, two, four, five, six)"


@given(robots_with_joint_vectors(must_move=False))
def test_tool_pose_equals_textbook_product(robot: tuple[RobotSpec, Array]) -> None:
    spec, q = robot
    found = forward_kinematics(build_chain(spec), q)
    np.testing.assert_allclose(found, table_tool_pose(spec, q), rtol=0, atol=4e-14)


@given(robots_with_joint_vectors(must_move=False))
def test_a_dh_frame_stands_still_on_its_joint(robot: tuple[RobotSpec, Array]) -> None:
    spec, q = robot
    chain = build_chain(spec)
    bodies, frames = joint_poses(chain, q), frame_poses(chain, q)
    for i, joint in enumerate(chain.joints):
        np.testing.assert_allclose(bodies[:, i] @ joint.T_joint_dh, frames[:, i + 1], rtol=0, atol=1e-14)


@given(robots_with_joint_vectors(must_move=False))
def test_joint_poses_equal_the_exact_ones(robot: tuple[RobotSpec, Array]) -> None:
    spec, q = robot
    chain = build_chain(spec)
    exact = reference_joint_poses(chain, q[0])
    assert len(exact) == len(chain.joints)
    assert not any(pose.flags.writeable for pose in exact)
    np.testing.assert_allclose(joint_poses(chain, q)[0], exact, rtol=0, atol=4e-14)


@pytest.mark.parametrize("count", [1, BLOCK - 1, BLOCK, BLOCK + 1, 2 * BLOCK + 77])
def test_blocks_join_without_a_seam(count: int) -> None:
    for spec in (ODD_ROBOT, STANFORD):
        q = np.random.default_rng(count).uniform(-3, 3, (count, len(spec.moving_rows)))
        chain, expected = build_chain(spec), table_frame_poses(spec, q)
        np.testing.assert_allclose(frame_poses(chain, q), expected, rtol=0, atol=1e-14)
        np.testing.assert_allclose(forward_kinematics(chain, q), table_tool_pose(spec, q), rtol=0, atol=1e-14)


@pytest.mark.parametrize("batch", [(), (0,), (1,), (3,), (2, 3), (2, 0, 3)])
def test_poses_take_any_batch_shape(batch: tuple[int, ...]) -> None:
    q = np.random.default_rng(0).uniform(-1, 1, (*batch, 5))
    for function, shape in ((forward_kinematics, ()), (frame_poses, (7,)), (joint_poses, (6,))):
        poses = function(ODD_CHAIN, q)
        assert poses.shape == (*batch, *shape, 4, 4)
        assert poses.dtype == np.float64
        for index in np.ndindex(batch):
            np.testing.assert_allclose(poses[index], function(ODD_CHAIN, q[index]), rtol=0, atol=1e-15)


def test_lists_integers_and_strided_arrays_are_taken() -> None:
    q = np.random.default_rng(0).uniform(-1, 1, (5, 8)).T[::2]
    np.testing.assert_array_equal(forward_kinematics(ODD_CHAIN, q), forward_kinematics(ODD_CHAIN, q.copy()))
    np.testing.assert_array_equal(forward_kinematics(ODD_CHAIN, q.tolist()), forward_kinematics(ODD_CHAIN, q))
    np.testing.assert_array_equal(
        forward_kinematics(ODD_CHAIN, [0, 1, 0, 2, 0]),
        forward_kinematics(ODD_CHAIN, [0.0, 1.0, 0.0, 2.0, 0.0]),
    )


def test_joint_vectors_are_left_as_they_were() -> None:
    q = np.random.default_rng(0).uniform(-1, 1, (10, 5))
    before = q.copy()
    forward_kinematics(ODD_CHAIN, q)
    np.testing.assert_array_equal(q, before)


def test_a_robot_that_cannot_move_takes_empty_joint_vectors() -> None:
    spec = RobotSpec(name="stiff", rows=(row("one", "fixed", a=0.3, alpha=0.4, d=0.1, theta=-2.0),))
    chain = build_chain(spec)
    np.testing.assert_allclose(forward_kinematics(chain, []), table_tool_pose(spec, []), rtol=0, atol=1e-15)
    assert forward_kinematics(chain, np.empty((3, 0))).shape == (3, 4, 4)


def test_results_may_be_written_to() -> None:
    assert forward_kinematics(ODD_CHAIN, np.zeros((2, 5))).flags.writeable


@pytest.mark.parametrize("function", [forward_kinematics, frame_poses, joint_poses, reference_joint_poses])
@pytest.mark.parametrize(
    ("q", "message"),
    [
        (0.3, f"expected {NAMES} along the last axis, got shape ()"),
        ([0.1, 0.2], f"expected {NAMES} along the last axis, got shape (2,)"),
        (np.zeros((4, 6)), f"expected {NAMES} along the last axis, got shape (4, 6)"),
        ([0.0, 0.0, math.nan, 0.0, 0.0], "coordinate of four is nan: it must be finite"),
        (
            [[0.0] * 5, [0.0, 0.0, 0.0, 0.0, -math.inf]],
            "coordinate of six of the joint vector at index (1,) is -inf: it must be finite",
        ),
        ([math.inf, -math.inf, 0.0, 0.0, 0.0], "coordinate of one is inf: it must be finite"),
        ([1j, 0, 0, 0, 0], "joint coordinates must be real numbers, got an array of complex128"),
        (["a", "b", "c", "d", "e"], "joint coordinates must be real numbers, got an array of <U1"),
        ([None] * 5, "joint coordinates must be real numbers, got an array of object"),
        ([[0.0] * 5, [0.0] * 4], "joint vectors must have equal lengths"),
    ],
)
def test_what_is_no_joint_vector_is_refused(function: object, q: ArrayLike, message: str) -> None:
    assert callable(function)
    with pytest.raises(ConfigurationError) as caught:
        function(ODD_CHAIN, q)
    assert str(caught.value) == message


def test_a_robot_of_one_joint_is_spoken_of_in_the_singular() -> None:
    chain = build_chain(RobotSpec(name="one", rows=(row("only"),)))
    with pytest.raises(ConfigurationError) as caught:
        forward_kinematics(chain, [])
    assert str(caught.value) == "expected 1 joint coordinate (only) along the last axis, got shape (0,)"


def test_exact_poses_are_of_one_configuration() -> None:
    with pytest.raises(ConfigurationError) as caught:
        reference_joint_poses(ODD_CHAIN, np.zeros((2, 5)))
    assert str(caught.value) == "expected one joint vector of shape (5,), got shape (2, 5)"


def test_a_sum_that_overflows_is_no_reason_to_refuse() -> None:
    spec = RobotSpec(name="long", rows=(row("one", "prismatic"), row("two", "prismatic", alpha=1.0)))
    assert forward_kinematics(build_chain(spec), [1.5e308, 0.0])[2, 3] == 1.5e308
    assert forward_kinematics(build_chain(spec), [[1.5e308, 0.0], [1.5e308, 0.0]])[1, 2, 3] == 1.5e308


@given(st.floats(-10.0, 10.0) | st.sampled_from([k * math.pi / 4 for k in range(-16, 17)]))
def test_fast_sines_and_cosines_are_as_good_as_exact_ones(angle: float) -> None:
    sine, cosine = sines_and_cosines(np.array([angle]))
    exact = sin_cos(angle)
    assert sine[0] == pytest.approx(exact[0], rel=0.0, abs=2e-15)
    assert cosine[0] == pytest.approx(exact[1], rel=0.0, abs=2e-15)
