from __future__ import annotations

import dataclasses
import math
from types import MappingProxyType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.kinematics.conversion import convert_rows
from dh2sim.kinematics.table_oracle import table_frame_poses
from dh2sim.robot.read import load_robot
from dh2sim.robot.row import Convention, Limits
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.kinematics.arms import (
    GENERAL,
    KINDS,
    PURE,
    Q,
    arm,
    assert_same_arm,
    assert_same_numbers,
    numbers,
    pose_numbers,
)
from tests.sample_robots import HAYATI, MODIFIED, ODD, ODD_ROBOT, STANDARD, STANFORD, row
from tests.strategies import robots_with_joint_vectors


@pytest.mark.parametrize("to", KINDS)
@given(robot=robots_with_joint_vectors(must_move=False))
def test_any_robot_is_the_same_arm_in_the_other_convention(to: Convention, robot: tuple[RobotSpec, Array]) -> None:
    spec, q = robot
    assert_same_arm(spec, convert_rows(spec, to).spec, q)


@pytest.mark.parametrize("to", KINDS)
@given(robot=robots_with_joint_vectors(must_move=False))
def test_only_link_parts_change(to: Convention, robot: tuple[RobotSpec, Array]) -> None:
    spec, _ = robot
    conversion = convert_rows(spec, to)
    converted = conversion.spec
    kept = ("name", "type", "d", "theta", "flip", "limits", "dynamics", "actuator")
    for old, new in zip(spec.rows, converted.rows, strict=True):
        assert [getattr(new, key) for key in kept] == [getattr(old, key) for key in kept]
        assert new.beta == (old.beta if new.convention is HAYATI else 0.0)
    others = [one for one in converted.rows if one.convention is not to]
    assert [note.split()[0] for note in conversion.notes] == [one.name for one in others]
    assert all(one.beta != 0.0 for one in others if one.convention is HAYATI)
    unchanged = ("name", "description", "source", "parameters", "gravity", "configurations")
    assert [getattr(converted, key) for key in unchanged] == [getattr(spec, key) for key in unchanged]
    assert converted.convention is to


@pytest.mark.parametrize("to", KINDS)
@given(robot=robots_with_joint_vectors(must_move=False))
def test_a_second_conversion_changes_nothing(to: Convention, robot: tuple[RobotSpec, Array]) -> None:
    once = convert_rows(robot[0], to)
    twice = convert_rows(once.spec, to)
    assert_same_numbers(twice.spec, once.spec)
    assert twice.notes == once.notes


def test_a_standard_table_moves_a_and_alpha_one_row_down() -> None:
    spec = arm(STANDARD, STANDARD, STANDARD)
    converted = convert_rows(spec, MODIFIED).spec
    (_, a1, a2), alphas = (one.a for one in converted.rows), [one.alpha for one in converted.rows]
    assert (a1, a2) == (spec.rows[0].a, spec.rows[1].a)
    assert alphas == [0.0, spec.rows[0].alpha, spec.rows[1].alpha]
    assert pose_numbers(converted.base.pose) == [0.0] * 6
    assert pose_numbers(converted.tool) == [spec.rows[2].a, 0, 0, spec.rows[2].alpha, 0, 0]
    assert {one.convention for one in converted.rows} == {MODIFIED}


def test_a_modified_table_moves_a_and_alpha_one_row_up() -> None:
    spec = arm(MODIFIED, MODIFIED, MODIFIED, tool=GENERAL)
    converted = convert_rows(spec, STANDARD).spec
    assert [one.a for one in converted.rows] == [spec.rows[1].a, spec.rows[2].a, 0.0]
    assert [one.alpha for one in converted.rows] == [spec.rows[1].alpha, spec.rows[2].alpha, 0.0]
    assert pose_numbers(converted.base.pose) == [spec.rows[0].a, 0, 0, spec.rows[0].alpha, 0, 0]
    assert pose_numbers(converted.tool) == pose_numbers(GENERAL)


def test_parts_of_mixed_rows_become_one() -> None:
    spec = arm(STANDARD, MODIFIED, STANDARD)
    first, second = spec.rows[:2]
    total = (first.a + second.a, first.alpha + second.alpha)
    one = convert_rows(spec, STANDARD).spec.rows[0]
    two = convert_rows(spec, MODIFIED).spec.rows[1]
    assert (one.a, one.alpha) == total
    assert (two.a, two.alpha) == total
    assert (one.d, one.theta, two.d, two.theta) == (first.d, first.theta, second.d, second.theta)


def test_twists_that_become_one_are_brought_between_minus_and_plus_pi() -> None:
    rows = (row("one", alpha=math.pi / 2, a=0.1), row("two", "revolute", MODIFIED, alpha=math.pi, a=0.2))
    spec = RobotSpec(name="over", rows=rows)
    assert convert_rows(spec, STANDARD).spec.rows[0].alpha == -math.pi / 2
    assert convert_rows(spec, MODIFIED).spec.rows[1].alpha == -math.pi / 2


def test_row_one_takes_over_a_base_that_is_a_pure_link_part() -> None:
    converted = convert_rows(arm(STANDARD, STANDARD, base=PURE), MODIFIED).spec
    assert (converted.rows[0].a, converted.rows[0].alpha) == (0.25, -ODD)
    assert pose_numbers(converted.base.pose) == [0.0] * 6


def test_a_base_that_is_no_pure_link_part_stays_the_base() -> None:
    converted = convert_rows(arm(STANDARD, STANDARD, base=GENERAL), MODIFIED).spec
    assert (converted.rows[0].a, converted.rows[0].alpha) == (0.0, 0.0)
    assert pose_numbers(converted.base.pose) == pose_numbers(GENERAL)


def test_a_first_row_that_was_modified_leaves_the_base_alone() -> None:
    spec = arm(MODIFIED, STANDARD, base=PURE)
    converted = convert_rows(spec, MODIFIED).spec
    assert numbers(converted.rows[0]) == numbers(spec.rows[0])
    assert pose_numbers(converted.base.pose) == pose_numbers(PURE)


def test_the_last_row_takes_over_a_tool_that_is_a_pure_link_part() -> None:
    converted = convert_rows(arm(MODIFIED, MODIFIED, tool=PURE), STANDARD).spec
    assert (converted.rows[1].a, converted.rows[1].alpha) == (0.25, -ODD)
    assert pose_numbers(converted.tool) == [0.0] * 6


def test_a_last_row_that_was_standard_leaves_the_tool_alone() -> None:
    spec = arm(MODIFIED, STANDARD, tool=PURE)
    converted = convert_rows(spec, STANDARD).spec
    assert numbers(converted.rows[1]) == numbers(spec.rows[1])
    assert pose_numbers(converted.tool) == pose_numbers(PURE)


@pytest.mark.parametrize("to", KINDS)
def test_a_table_of_one_row_is_converted(to: Convention) -> None:
    for kind in KINDS:
        spec = arm(kind, base=GENERAL, tool=GENERAL)
        assert_same_arm(spec, convert_rows(spec, to).spec, Q[:, :1])


def test_modified_frames_stand_at_their_joints_and_standard_ones_at_the_next() -> None:
    spec = dataclasses.replace(ODD_ROBOT, convention=STANDARD)
    n, q = len(spec.rows), Q[0, :5]
    behind = table_frame_poses(convert_rows(spec, STANDARD).spec, q)
    before = table_frame_poses(convert_rows(spec, MODIFIED).spec, q)
    for i in range(1, n):  # z of joint i + 1 is z of standard frame i and of modified frame i + 1
        np.testing.assert_allclose(behind[i, :3, 2], before[i + 1, :3, 2], rtol=0, atol=1e-14)
        gap = before[i + 1, :3, 3] - behind[i, :3, 3]
        np.testing.assert_allclose(np.cross(gap, behind[i, :3, 2]), 0, rtol=0, atol=1e-14)


def test_limits_and_configurations_stay() -> None:
    rows = tuple(dataclasses.replace(one, limits=Limits(position=(-1.0, 2.0))) for one in STANFORD.rows)
    home = MappingProxyType({"home": read_only([0.1] * 6)})
    spec = dataclasses.replace(STANFORD, rows=rows, configurations=home)
    converted = convert_rows(spec, MODIFIED).spec
    assert all(one.limits.position == (-1.0, 2.0) for one in converted.rows)
    assert converted.configurations is home


def test_a_converted_robot_has_its_source_but_no_source_file() -> None:
    spec = load_robot("puma560_standard")
    converted = convert_rows(spec, STANDARD).spec
    assert spec.source_file is not None
    assert converted.source_file is None
    assert converted.source == spec.source


def test_a_table_is_not_converted_to_hayati() -> None:
    with pytest.raises(ValueError, match=r"^a table is converted to standard or modified, not to hayati$"):
        convert_rows(STANFORD, HAYATI)


@given(st.data())
def test_arrays_of_a_converted_robot_are_read_only(data: st.DataObject) -> None:
    spec, _ = data.draw(robots_with_joint_vectors(max_rows=4, must_move=False))
    for to in KINDS:
        converted = convert_rows(spec, to).spec
        arrays = [converted.base.pose.xyz, converted.base.pose.rpy, converted.tool.xyz, converted.tool.rpy]
        arrays += [x for one in converted.rows for x in (one.link.com, one.link.inertia) if x is not None]
        assert not any(array.flags.writeable for array in arrays)
