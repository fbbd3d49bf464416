from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given

from dh2sim.kinematics.chain import KinematicChain, build_chain
from dh2sim.kinematics.forward import frame_poses
from dh2sim.kinematics.table_oracle import row_matrix, table_frame_poses
from dh2sim.kinematics.transforms import compose, joint_part, link_part
from dh2sim.robot.links import ToolSpec
from dh2sim.robot.row import Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.sample_robots import HAYATI, MODIFIED, ODD, ODD_ROBOT, STANDARD, STANFORD, row
from tests.strategies import robot_specs, robots_with_joint_vectors

Q = np.random.default_rng(1).uniform(-2, 2, (20, 5))


def zero_poses(chain: KinematicChain) -> list[Array]:
    """DH frames in base_link at coordinate zero, from the chain's constant transforms alone."""
    T, frames = np.eye(4), [chain.T_base_link_dh0]
    for joint in chain.joints:
        T = T @ joint.T_parent_joint
        frames.append(T @ joint.T_joint_dh)
    return frames


@given(robot_specs(must_move=False))
def test_chain_at_zero_is_the_table_at_zero(spec: RobotSpec) -> None:
    expected = table_frame_poses(spec, np.zeros(len(spec.moving_rows)))
    np.testing.assert_allclose(zero_poses(build_chain(spec)), expected, rtol=0, atol=2e-14)


@given(robots_with_joint_vectors(must_move=False))
def test_all_dh_frames_equal_textbook_product(robot: tuple[RobotSpec, Array]) -> None:
    spec, q = robot
    poses = frame_poses(build_chain(spec), q)
    np.testing.assert_allclose(poses, table_frame_poses(spec, q), rtol=0, atol=4e-14)


def spoil(wrong: Row, change: str) -> Row:
    match change:
        case "flip":
            return dataclasses.replace(wrong, flip=not wrong.flip)
        case "convention":
            return dataclasses.replace(wrong, convention=STANDARD if wrong.convention is MODIFIED else MODIFIED)
        case _:
            return dataclasses.replace(wrong, **{change: -getattr(wrong, change)})


@pytest.mark.parametrize(
    ("index", "change"),
    [
        (index, change)
        for index, one in enumerate(ODD_ROBOT.rows)
        for change in ("alpha", "theta", "a", "d", "flip", "convention")
        if change != "flip" or one.type.moves
    ],
)
def test_an_error_in_one_row_of_the_chain_is_noticed(index: int, change: str) -> None:
    rows = list(ODD_ROBOT.rows)
    rows[index] = spoil(rows[index], change)
    chain = build_chain(dataclasses.replace(ODD_ROBOT, rows=tuple(rows)))
    gap = np.abs(frame_poses(chain, Q) - table_frame_poses(ODD_ROBOT, Q)).max()
    assert gap > 0.01


def test_the_link_part_of_a_standard_row_goes_in_front_of_the_next_joint() -> None:
    one, two = row("one", a=0.3, alpha=ODD, d=0.1, theta=0.2), row("two", a=0.5, alpha=-1.0, d=0.4, theta=0.6)
    first, second = build_chain(RobotSpec(name="r", rows=(one, two))).joints
    np.testing.assert_array_equal(first.T_parent_joint, joint_part(0.2, 0.1))
    np.testing.assert_array_equal(first.T_joint_dh, link_part(0.3, ODD))
    np.testing.assert_array_equal(second.T_parent_joint, compose(link_part(0.3, ODD), joint_part(0.6, 0.4)))
    np.testing.assert_array_equal(second.T_joint_dh, link_part(0.5, -1.0))


def test_a_modified_row_has_its_dh_frame_at_the_joint() -> None:
    one = row("one", "prismatic", MODIFIED, a=0.3, alpha=ODD, d=0.1, theta=0.2)
    (joint,) = build_chain(RobotSpec(name="r", rows=(one,))).joints
    np.testing.assert_allclose(joint.T_parent_joint, row_matrix(one, np.zeros(1))[:, :, 0], rtol=0, atol=1e-15)
    np.testing.assert_array_equal(joint.T_joint_dh, np.eye(4))


def test_a_modified_row_after_a_standard_one_takes_over_its_link_part() -> None:
    rows = (row("one", a=0.3, alpha=ODD), row("two", "revolute", MODIFIED, a=0.2, alpha=0.7, d=0.1))
    second = build_chain(RobotSpec(name="r", rows=rows)).joints[1]
    expected = link_part(0.3, ODD) @ link_part(0.2, 0.7) @ joint_part(0.0, 0.1)
    np.testing.assert_allclose(second.T_parent_joint, expected, rtol=0, atol=1e-15)


@pytest.mark.parametrize("joint_type", ["revolute", "prismatic", "fixed"])
def test_a_hayati_row_turns_twice_behind_its_joint(joint_type: str) -> None:
    d = 0.25 if joint_type == "prismatic" else 0.0
    one = row("one", joint_type, HAYATI, a=0.3, alpha=ODD, d=d, theta=0.7, beta=-0.4)
    first, second = build_chain(RobotSpec(name="r", rows=(one, row("two", theta=0.6, d=0.4)))).joints
    np.testing.assert_array_equal(first.T_parent_joint, joint_part(0.7, d))
    c, s = math.cos(-0.4), math.sin(-0.4)
    twist = np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]])
    np.testing.assert_allclose(first.T_joint_dh, link_part(0.3, ODD) @ twist, rtol=0, atol=1e-15)
    np.testing.assert_allclose(second.T_parent_joint, first.T_joint_dh @ joint_part(0.6, 0.4), rtol=0, atol=1e-15)


def test_a_hayati_row_without_a_second_twist_is_a_standard_one() -> None:
    standard, hayati = (
        build_chain(RobotSpec(name="r", rows=(row("one", "prismatic", kind, a=0.3, alpha=ODD, d=0.1, theta=0.2),)))
        for kind in (STANDARD, HAYATI)
    )
    np.testing.assert_array_equal(hayati.joints[0].T_joint_dh, standard.joints[0].T_joint_dh)
    np.testing.assert_array_equal(hayati.joints[0].T_parent_joint, standard.joints[0].T_parent_joint)


def test_the_first_joint_stands_in_base_link() -> None:
    chain = build_chain(ODD_ROBOT)
    expected = chain.T_base_link_dh0 @ joint_part(0.3, 0.2)
    np.testing.assert_allclose(chain.joints[0].T_parent_joint, expected, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(chain.T_base_link_dh0[:3, 3], ODD_ROBOT.base.pose.xyz)


def test_a_flipped_row_has_a_negative_sign() -> None:
    assert [joint.sign for joint in build_chain(ODD_ROBOT).joints] == [-1, -1, 1, 1, 1, 1]


def test_a_fixed_row_is_a_body_without_a_coordinate() -> None:
    chain = build_chain(ODD_ROBOT)
    assert [joint.name for joint in chain.joints] == ["one", "two", "three", "four", "five", "six"]
    assert [joint.name for joint in chain.moving_joints] == ["one", "two", "four", "five", "six"]
    assert chain.n == 5


def test_right_angles_give_exact_zeros_and_ones() -> None:
    for joint in build_chain(STANFORD).joints:
        for T in (joint.T_parent_joint, joint.T_joint_dh):
            assert set(np.abs(T[:3, :3]).ravel()) == {0.0, 1.0}
            assert not np.signbit(T[T == 0.0]).any()


def test_all_of_the_chain_is_read_only() -> None:
    chain = build_chain(ODD_ROBOT)
    arrays = [chain.T_base_link_dh0, chain.T_dhn_tool0]
    arrays += [T for joint in chain.joints for T in (joint.T_parent_joint, joint.T_joint_dh)]
    assert not any(array.flags.writeable for array in arrays)
    with pytest.raises(dataclasses.FrozenInstanceError):
        chain.joints[0].sign = 2.0  # type: ignore[misc]


def test_a_tool_turned_by_a_right_angle_is_exact() -> None:
    spec = dataclasses.replace(STANFORD, tool=ToolSpec(rpy=read_only([0, math.pi / 2, 0])))
    expected = [[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]]
    np.testing.assert_array_equal(build_chain(spec).T_dhn_tool0, expected)
