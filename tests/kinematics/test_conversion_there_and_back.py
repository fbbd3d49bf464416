from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given

from dh2sim.kinematics.conversion import convert_rows
from dh2sim.robot.links import Pose
from dh2sim.robot.read import load_robot
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.kinematics.arms import GENERAL, KINDS, PURE, Q, arm, assert_same_arm, assert_same_numbers, table
from tests.sample_robots import MODIFIED, NAMES, STANDARD
from tests.strategies import robots_with_joint_vectors


@pytest.mark.parametrize("base", [None, PURE, GENERAL], ids=["none", "pure", "general"])
def test_a_standard_table_without_a_tool_comes_back_to_the_last_bit(base: Pose | None) -> None:
    spec = dataclasses.replace(arm(STANDARD, STANDARD, STANDARD, base=base), convention=STANDARD)
    assert_same_numbers(convert_rows(convert_rows(spec, MODIFIED).spec, STANDARD).spec, spec)


@pytest.mark.parametrize("tool", [None, PURE, GENERAL], ids=["none", "pure", "general"])
def test_a_modified_table_without_a_base_comes_back_to_the_last_bit(tool: Pose | None) -> None:
    spec = arm(MODIFIED, MODIFIED, MODIFIED, tool=tool)
    assert_same_numbers(convert_rows(convert_rows(spec, STANDARD).spec, MODIFIED).spec, spec)


@pytest.mark.parametrize("kind", KINDS)
def test_a_free_end_with_a_general_pose_comes_back_to_the_last_bit(kind: Convention) -> None:
    spec = arm(kind, kind, kind, base=GENERAL, tool=GENERAL)
    end = 2 if kind is STANDARD else 0
    rows = list(spec.rows)
    rows[end] = dataclasses.replace(rows[end], a=0.0, alpha=0.0)
    spec = dataclasses.replace(spec, rows=tuple(rows))
    there = convert_rows(spec, STANDARD if kind is MODIFIED else MODIFIED).spec
    assert_same_numbers(convert_rows(there, kind).spec, spec)


@pytest.mark.parametrize("pose", [PURE, GENERAL], ids=["pure", "general"])
@pytest.mark.parametrize("kind", KINDS)
def test_an_end_of_two_parts_comes_back_cut_another_way_and_is_the_same_arm(kind: Convention, pose: Pose) -> None:
    spec = arm(kind, kind, kind, base=pose, tool=pose)
    back = convert_rows(convert_rows(spec, STANDARD if kind is MODIFIED else MODIFIED).spec, kind).spec
    assert table(back) != table(spec)
    assert_same_arm(spec, back, Q[:, :3])


@pytest.mark.parametrize("name", NAMES)
def test_every_robot_that_comes_along_is_the_same_arm_there_and_back(name: str) -> None:
    spec = load_robot(name)
    kind = spec.convention
    there = convert_rows(spec, STANDARD if kind is MODIFIED else MODIFIED)
    back = convert_rows(there.spec, kind)
    assert there.notes == back.notes == ()
    q = np.random.default_rng(6).uniform(-1, 1, (50, len(spec.moving_rows)))
    for converted in (there.spec, back.spec):
        assert_same_arm(spec, converted, q)


@given(robots_with_joint_vectors(must_move=False))
def test_interior_numbers_of_plain_tables_come_back_to_the_last_bit(robot: tuple[RobotSpec, Array]) -> None:
    for kind, other in (KINDS, KINDS[::-1]):
        rows = tuple(dataclasses.replace(one, convention=kind, beta=0.0) for one in robot[0].rows)
        spec = RobotSpec(name="plain", rows=rows)
        assert_same_numbers(convert_rows(convert_rows(spec, other).spec, kind).spec, spec)
