from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dh2sim.kinematics.transforms import (
    compose,
    identity,
    invert,
    joint_part,
    link_part,
    move_point,
    pose_from_rpy,
    quaternion_from_rotation,
    rotate_tensor,
    rpy_from_rotation,
)
from dh2sim.typing import Array
from tests.sample_robots import ODD
from tests.strategies import angles, inertias, lengths, vectors

turns = st.floats(-math.pi, math.pi, allow_subnormal=False)
tiny = st.sampled_from([0.0, 1e-16, 1e-15, 1e-12, 1e-10, 1e-9, 1e-8, 1e-5])
RIGHT_ANGLES = [-math.pi / 2, 0.0, math.pi / 2, math.pi]


def rotation(axis: str, angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return {
        "x": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
        "y": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
        "z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]),
    }[axis]


def rotation_from_quaternion(q: Array) -> Array:
    w, v = q[0], q[1:]
    skew = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    matrix: Array = np.eye(3) + 2 * w * skew + 2 * skew @ skew
    return matrix


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> Array:
    return pose_from_rpy([0, 0, 0], [roll, pitch, yaw])[:3, :3]


@given(vectors(lengths), vectors(angles), vectors(lengths), vectors(angles))
def test_composing_is_multiplying(p: Array, rpy: Array, p2: Array, rpy2: Array) -> None:
    T_a_b, T_b_c = pose_from_rpy(p, rpy), pose_from_rpy(p2, rpy2)
    np.testing.assert_allclose(compose(T_a_b, T_b_c), T_a_b @ T_b_c, rtol=0, atol=2e-15)


@given(vectors(lengths), vectors(angles))
def test_a_pose_and_its_inverse_cancel(p: Array, rpy: Array) -> None:
    T = pose_from_rpy(p, rpy)
    np.testing.assert_allclose(compose(T, invert(T)), np.eye(4), rtol=0, atol=2e-15)
    np.testing.assert_allclose(compose(invert(T), T), np.eye(4), rtol=0, atol=2e-15)


def test_link_part_is_a_shift_along_x_and_a_turn_about_x() -> None:
    expected = np.eye(4)
    expected[:3, :3], expected[0, 3] = rotation("x", ODD), 0.3
    np.testing.assert_allclose(link_part(0.3, ODD), expected, rtol=0, atol=1e-15)


def test_joint_part_is_a_turn_about_z_and_a_shift_along_z() -> None:
    expected = np.eye(4)
    expected[:3, :3], expected[2, 3] = rotation("z", ODD), 0.3
    np.testing.assert_allclose(joint_part(ODD, 0.3), expected, rtol=0, atol=1e-15)


@given(vectors(lengths), vectors(angles))
def test_pose_turns_about_fixed_x_then_y_then_z(p: Array, rpy: Array) -> None:
    T = pose_from_rpy(p, rpy)
    expected = rotation("z", rpy[2]) @ rotation("y", rpy[1]) @ rotation("x", rpy[0])
    np.testing.assert_allclose(T[:3, :3], expected, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(T[:3, 3], p)
    np.testing.assert_array_equal(T[3], [0, 0, 0, 1])


@given(turns, st.sampled_from([-1.0, 1.0]), tiny, turns)
@example(0.3, 1.0, 0.0, -1.2)
def test_angles_give_the_rotation_again_at_and_near_gimbal_lock(
    roll: float, side: float, gap: float, yaw: float
) -> None:
    R = rotation_from_rpy(roll, side * (math.pi / 2 - gap), yaw)
    np.testing.assert_allclose(rotation_from_rpy(*rpy_from_rotation(R)), R, rtol=0, atol=7e-16)


@given(vectors(turns), vectors(turns))
def test_angles_give_the_rotation_again_anywhere(rpy: Array, rpy2: Array) -> None:
    R = compose(pose_from_rpy([0, 0, 0], rpy), pose_from_rpy([0, 0, 0], rpy2))
    np.testing.assert_allclose(rotation_from_rpy(*rpy_from_rotation(R)), R[:3, :3], rtol=0, atol=1e-15)


@given(turns, st.floats(-1.5, 1.5), turns)
def test_angles_of_a_rotation_are_the_ones_it_was_made_of(roll: float, pitch: float, yaw: float) -> None:
    found = rpy_from_rotation(rotation_from_rpy(roll, pitch, yaw))
    gap = (found - [roll, pitch, yaw] + math.pi) % (2 * math.pi) - math.pi
    np.testing.assert_allclose(gap, 0.0, rtol=0, atol=2e-14)


@pytest.mark.parametrize("rpy", list(product(RIGHT_ANGLES, repeat=3)))
def test_right_angles_stay_exact(rpy: tuple[float, float, float]) -> None:
    R = rotation_from_rpy(*rpy)
    assert set(np.abs(R).ravel()) == {0.0, 1.0}
    found = rpy_from_rotation(R)
    assert set(found) <= set(RIGHT_ANGLES)
    np.testing.assert_array_equal(rotation_from_rpy(*found), R)
    assert set(np.abs(quaternion_from_rotation(R))) <= {0.0, 0.5, 1.0, math.sqrt(8) / 4, 2 / math.sqrt(8)}


@given(vectors(angles))
def test_quaternion_is_a_unit_and_gives_the_rotation_again(rpy: Array) -> None:
    R = rotation_from_rpy(*rpy)
    q = quaternion_from_rotation(R)
    assert math.fsum(value * value for value in q) == pytest.approx(1.0, rel=0.0, abs=5e-16)
    assert next(value for value in q if value != 0.0) > 0.0
    assert q[0] >= 0.0
    np.testing.assert_allclose(rotation_from_quaternion(q), R, rtol=0, atol=2e-15)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("angle", [math.pi, math.pi - 1e-9, 3.0, -3.0, ODD, 1e-9])
def test_quaternion_of_a_turn_about_an_axis_is_half_its_angle(axis: str, angle: float) -> None:
    expected = np.zeros(4)
    expected[0], expected["wxyz".index(axis)] = math.cos(angle / 2), math.sin(angle / 2)
    np.testing.assert_allclose(quaternion_from_rotation(rotation(axis, angle)), expected, rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    "array",
    [
        identity(),
        compose(identity(), identity()),
        invert(identity()),
        link_part(0.0, ODD),
        joint_part(ODD, 0.0),
        pose_from_rpy([0, 0, 0], [0, 0, 0]),
        rpy_from_rotation(identity()),
        quaternion_from_rotation(identity()),
    ],
)
def test_results_are_read_only(array: Array) -> None:
    assert not array.flags.writeable


@given(st.permutations([0, 1, 2]), vectors(st.sampled_from(RIGHT_ANGLES)), vectors(st.just(-0.0)))
def test_no_result_holds_minus_zero(order: list[int], rpy: Array, p: Array) -> None:
    T = pose_from_rpy(p, rpy[order])
    for array in (
        T,
        invert(T),
        compose(T, T),
        rpy_from_rotation(T),
        quaternion_from_rotation(T),
        link_part(-0.0, -0.0),
        joint_part(-0.0, -0.0),
    ):
        assert not np.signbit(array[array == 0.0]).any()


@given(vectors(lengths), vectors(angles), vectors(lengths))
def test_a_point_moves_with_its_frame(xyz: Array, rpy: Array, point: Array) -> None:
    T = pose_from_rpy(xyz, rpy)
    np.testing.assert_allclose(move_point(T, point), T[:3, :3] @ point + xyz, rtol=0, atol=1e-15)


@given(vectors(angles), inertias())
def test_a_tensor_turns_with_its_frame(rpy: Array, tensor: Array) -> None:
    T = pose_from_rpy([0.1, 0.2, 0.3], rpy)
    turned = rotate_tensor(T, tensor)
    np.testing.assert_allclose(turned, T[:3, :3] @ tensor @ T[:3, :3].T, rtol=0, atol=2e-15)
    np.testing.assert_array_equal(turned, turned.T)
    np.testing.assert_array_equal(rotate_tensor(T[:3, :3], tensor), turned)
    assert not turned.flags.writeable
