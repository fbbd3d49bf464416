from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.kinematics.forward import joint_poses
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.model.limits import ASSUMED_SLIDE_RATE, ASSUMED_TURN_RATE
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.links import BaseSpec, Pose
from dh2sim.robot.row import JointType, Limits, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.sample_robots import (
    CONTINUOUS,
    FIXED,
    MODIFIED,
    NAMES,
    ODD,
    PRISMATIC,
    REVOLUTE,
    STANDARD,
    in_limits,
    model,
)
from tests.strategies import robot_specs


def one(kind: JointType, limits: Limits | None = None) -> RobotModel:
    row = Row(name="only", type=kind, convention=STANDARD, a=0.3, alpha=ODD, d=0.4, limits=limits or Limits())
    return build_model(RobotSpec(name="one", rows=(row,)))


def test_a_revolute_joint_without_limits_is_assumed_to_turn_half_a_turn_either_way() -> None:
    (joint,) = one(REVOLUTE).joints
    assert joint.position_range == joint.travel == (-math.pi, math.pi)
    assert joint.velocity == ASSUMED_TURN_RATE
    assert joint.assumed == ("position", "velocity", "effort")


def test_a_prismatic_joint_without_limits_is_assumed_to_slide_as_far_as_the_rest_reaches() -> None:
    built = one(PRISMATIC)
    (joint,) = built.joints
    assert joint.position_range == pytest.approx((-(0.3 + 0.4), 0.3 + 0.4))
    assert joint.assumed == ("position", "velocity", "effort")
    assert joint.velocity == ASSUMED_SLIDE_RATE
    assert built.reach == pytest.approx(2 * (0.3 + 0.4))


@pytest.mark.parametrize("rounding", [0.0, 1.8e-17, 1e-300])
def test_a_prismatic_joint_of_a_robot_without_lengths_is_assumed_to_slide_a_metre(rounding: float) -> None:
    row = Row(name="only", type=PRISMATIC, convention=STANDARD, a=rounding)
    (joint,) = build_model(RobotSpec(name="one", rows=(row,))).joints
    assert joint.position_range == (-1.0, 1.0)


def test_a_continuous_joint_is_given_no_position_limits() -> None:
    (joint,) = one(CONTINUOUS).joints
    assert (joint.position_range, joint.travel) == (None, (-math.pi, math.pi))
    assert joint.assumed == ("velocity", "effort")


def test_a_fixed_row_has_nothing_to_assume() -> None:
    (joint,) = one(FIXED).joints
    assert joint.position_range is None
    assert joint.assumed == ()


@pytest.mark.parametrize("kind", [REVOLUTE, PRISMATIC])
def test_given_limits_win(kind: JointType) -> None:
    (joint,) = one(kind, Limits(position=(-0.25, 0.75), velocity=2.5, effort=30.0)).joints
    assert joint.position_range == joint.travel == (-0.25, 0.75)
    assert (joint.velocity, joint.effort, joint.assumed) == (2.5, 30.0, ())


@pytest.mark.parametrize(("position", "inside"), [(-7.0, -0.25), (0.5, 0.5), (1.0, 0.75)])
def test_a_coordinate_is_moved_inside_the_limits(position: float, inside: float) -> None:
    (joint,) = one(REVOLUTE, Limits(position=(-0.25, 0.75))).joints
    assert joint.clamped(position) == inside
    (free,) = one(CONTINUOUS).joints
    assert free.clamped(position) == position


def test_home_is_zero_moved_inside_the_limits_where_the_file_has_none() -> None:
    rows = (
        Row(name="a", type=REVOLUTE, convention=STANDARD, a=0.3, limits=Limits(position=(0.2, 1.0))),
        Row(name="b", type=CONTINUOUS, convention=STANDARD, a=0.3),
        Row(name="c", type=FIXED, convention=STANDARD, a=0.3),
        Row(name="d", type=PRISMATIC, convention=STANDARD, limits=Limits(position=(-0.5, -0.1))),
    )
    np.testing.assert_array_equal(build_model(RobotSpec(name="r", rows=rows)).home, [0.2, 0.0, -0.1])


def farthest_frame(built: RobotModel, q: Array) -> float:
    """Greatest distance of any joint, DH frame or tool0 from base_link's origin."""
    poses = [
        joint_poses(built.chain, q),
        table_frame_poses(built.spec, q),
        table_tool_pose(built.spec, q)[:, None],
    ]
    positions = np.concatenate(poses, axis=1)[..., :3, 3]
    return float(np.linalg.norm(positions, axis=-1).max())


def farthest_tool(built: RobotModel, q: Array) -> float:
    """Greatest distance of tool0 from base_link's origin."""
    return float(np.linalg.norm(table_tool_pose(built.spec, q)[:, :3, 3], axis=-1).max())


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_nothing_is_farther_away_than_the_reach(name: str) -> None:
    built = model(name)
    q = in_limits(built, 500, seed=5)
    assert farthest_tool(built, q) <= built.reach * (1 + 1e-12)
    assert farthest_frame(built, q) <= built.extent * (1 + 1e-12)


@settings(max_examples=min(60, settings().max_examples))
@given(robot_specs(must_move=False))
def test_nothing_of_any_robot_is_farther_away_than_its_reach(spec: RobotSpec) -> None:
    built = build_model(spec)
    q = in_limits(built, 50, seed=5)
    rounding = 1e-14 * max(1.0, built.extent)
    assert farthest_tool(built, q) <= built.reach + rounding
    assert farthest_frame(built, q) <= built.extent + rounding


def test_the_extent_counts_dh_frames_that_are_farther_out_than_their_neighbours() -> None:
    out = Row(name="out", type=REVOLUTE, convention=STANDARD, a=1.0)
    back = Row(name="back", type=REVOLUTE, convention=MODIFIED, a=-1.0)
    assert build_model(RobotSpec(name="r", rows=(out, back))).extent == 1.0
    base = BaseSpec(pose=Pose(xyz=read_only([0, 0, 2.0])))
    down = Row(name="down", type=REVOLUTE, convention=STANDARD, d=-2.0)
    assert build_model(RobotSpec(name="r", rows=(down,), base=base)).extent == 2.0


def test_the_reach_counts_no_frames_that_are_away_from_the_arm() -> None:
    up = Row(name="up", type=REVOLUTE, convention=STANDARD, a=0.3, d=500.0)
    down = Row(name="down", type=REVOLUTE, convention=STANDARD, a=0.2, d=-500.0)
    built = build_model(RobotSpec(name="r", rows=(up, down)))
    assert built.reach == 0.5
    assert built.extent > 1000.0
