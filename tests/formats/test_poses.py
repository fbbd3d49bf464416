from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.formats.urdf.write import to_urdf
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.links import BaseSpec, LinkSpec, Pose, ToolSpec
from dh2sim.robot.row import Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.formats.readers import body_poses, in_mujoco, site_poses
from tests.sample_robots import (
    COSTLY_NAMES,
    FIXED,
    HAYATI,
    MODIFIED,
    NAMES,
    ODD,
    PRISMATIC,
    REVOLUTE,
    STANDARD,
    in_limits,
    model,
    robot,
)
from tests.strategies import robot_specs, robots_with_joint_vectors

TOLERANCE = 1e-13
"""Of a rotation matrix's entries, and of positions as a share of the larger of 1 m and the reach."""


def assert_poses_are_the_tables(built: RobotModel, q: Array) -> None:
    spec = built.spec
    names = [*(f"dh_{i}" for i in range(len(spec.rows) + 1)), "tool0"]
    expected = np.concatenate([table_frame_poses(spec, q), table_tool_pose(spec, q)[:, None]], axis=1)
    for found in (
        site_poses(in_mujoco(to_mjcf(built)), q, names),
        body_poses(in_mujoco(to_urdf(built)), q, names),
    ):
        error = np.abs(found - expected)
        assert error[..., :3, 3].max() <= TOLERANCE * max(1.0, built.reach)
        assert error[..., :3, :3].max() <= TOLERANCE


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_frames_of_both_formats_are_where_the_table_says(name: str) -> None:
    built = model(name)
    assert_poses_are_the_tables(built, in_limits(built, 100, seed=6))


@pytest.mark.slow
@settings(max_examples=min(80, settings().max_examples))
@given(robots_with_joint_vectors(max_rows=12, must_move=False))
def test_frames_of_any_robot_are_where_the_table_says(drawn: tuple[RobotSpec, Array]) -> None:
    spec, q = drawn
    assert_poses_are_the_tables(build_model(spec), q)


@settings(max_examples=min(20, settings().max_examples))
@given(robot_specs(max_rows=12))
def test_frames_of_any_robot_are_where_the_table_says_within_all_limits(spec: RobotSpec) -> None:
    built = build_model(spec)
    assert_poses_are_the_tables(built, in_limits(built, 5, seed=9))


@pytest.mark.parametrize("quarter", [1.57, 1.570796, 1.5707963, 1.57079633, 1.570796327, 1.5707963267949])
@pytest.mark.parametrize("name", COSTLY_NAMES)
def test_frames_are_where_the_table_says_where_right_angles_are_rounded(name: str, quarter: float) -> None:
    spec = robot(name)
    rows = tuple(dataclasses.replace(row, alpha=row.alpha * quarter / (math.pi / 2)) for row in spec.rows)
    built = build_model(dataclasses.replace(spec, rows=rows))
    assert_poses_are_the_tables(built, in_limits(built, 5, seed=10))


TINY = [1e-3, 1e-5, 1e-6, 3e-7, 1e-8, 1e-12, 1e-15, 5e-324]


@pytest.mark.parametrize("tiny", TINY)
@pytest.mark.parametrize("what", ["alpha", "a", "both", "beta", "tool", "base", "com"])
def test_frames_that_are_nearly_others_are_where_the_table_says(tiny: float, what: str) -> None:
    link = LinkSpec(com=read_only([tiny, 0, 0]), inertia=read_only(np.diag([0.1, 0.2, 0.25])), mass=1.0)
    row = Row(
        name="one",
        type=REVOLUTE,
        convention=HAYATI if what == "beta" else STANDARD,
        a=tiny if what in ("a", "both") else 0.3,
        alpha=tiny if what in ("alpha", "both") else 0.0,
        d=0.0 if what == "beta" else 0.2,
        theta=0.1,
        beta=tiny if what == "beta" else 0.0,
        link=link if what == "com" else LinkSpec(),
    )
    pose = Pose(xyz=read_only([0, tiny, 0]), rpy=read_only([0, 0, -tiny]))
    spec = RobotSpec(
        name="near",
        rows=(row, Row(name="two", type=REVOLUTE, convention=STANDARD, a=0.4, alpha=ODD)),
        base=BaseSpec(pose=pose if what == "base" else Pose()),
        tool=ToolSpec.at(pose) if what == "tool" else ToolSpec(),
    )
    assert_poses_are_the_tables(build_model(spec), np.array([[0.7, -1.1], [0.0, 0.0]]))


@pytest.mark.parametrize("kind", [REVOLUTE, PRISMATIC, FIXED])
@pytest.mark.parametrize("convention", [STANDARD, MODIFIED, HAYATI])
def test_a_robot_of_one_row_works(kind: str, convention: str) -> None:
    own = {"beta": -1.1} if convention is HAYATI else {"d": 0.2}
    for lengths in ({}, {"a": 0.3, "alpha": ODD, "theta": -0.8, **own}):
        row = Row(name="only", type=kind, convention=convention, **lengths)  # type: ignore[arg-type]
        built = build_model(RobotSpec(name="one", rows=(row,)))
        assert_poses_are_the_tables(built, in_limits(built, 3, seed=11))


def test_an_arm_of_nearly_parallel_axes_is_where_the_table_says() -> None:
    """A calibrated arm: Hayati rows where axes are parallel but for half a degree, a slide among them."""
    rows = (
        Row(name="waist", type=REVOLUTE, convention=STANDARD, alpha=-math.pi / 2 + 1e-3, d=0.6),
        Row(name="shoulder", type=REVOLUTE, convention=HAYATI, a=0.43, alpha=2e-3, beta=-8e-3, theta=0.01, flip=True),
        Row(name="elbow", type=PRISMATIC, convention=HAYATI, a=0.02, alpha=-4e-3, beta=3e-3, d=0.1, theta=-0.3),
        Row(name="plate", type=FIXED, convention=HAYATI, a=0.1, alpha=1e-3, beta=2e-6, theta=0.7),
        Row(name="wrist", type=REVOLUTE, convention=MODIFIED, a=0.05, alpha=ODD, d=0.2, theta=0.2),
    )
    built = build_model(RobotSpec(name="calibrated", rows=rows, tool=ToolSpec(xyz=read_only([0.1, 0.02, 0.03]))))
    assert_poses_are_the_tables(built, in_limits(built, 100, seed=12))


def test_a_robot_that_does_not_move_works() -> None:
    rows = [Row(name=f"f{i}", type=FIXED, convention=STANDARD, a=0.1 * i, alpha=ODD, d=0.2) for i in range(4)]
    built = build_model(RobotSpec(name="statue", rows=tuple(rows)))
    assert_poses_are_the_tables(built, np.zeros((1, 0)))
    mjcf, urdf = in_mujoco(to_mjcf(built)), in_mujoco(to_urdf(built))
    assert (mjcf.nq, mjcf.nu, mjcf.nkey, urdf.nq) == (0, 0, 0, 0)
