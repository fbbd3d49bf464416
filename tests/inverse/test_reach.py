"""Why a pose is not reached, and by how much: against distances known from geometry."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from dh2sim.inverse.reach import beyond_limits, limits_reason, why_unreachable
from dh2sim.inverse.solver import inverse_kinematics
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.robot.row import Limits
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit, Units
from dh2sim.typing import Array
from tests.sample_robots import row


def planar(*lengths: float, angle: AngleUnit = AngleUnit.DEG) -> RobotSpec:
    rows = tuple(row(f"j{i}", a=a) for i, a in enumerate(lengths, start=1))
    return RobotSpec(name="planar", rows=rows, units=Units(angle=angle))


def at(x: float, y: float, z: float = 0.0, *, roll: float = 0.0, yaw: float = 0.0) -> Array:
    return np.array(pose_from_rpy([x, y, z], [roll, 0.0, yaw]))


def reason(spec: RobotSpec, T: Array, **options: object) -> str:
    solutions = inverse_kinematics(spec, T, **options)  # type: ignore[arg-type]
    assert len(solutions) == 0
    return str(solutions.reason)


# an arm with a spherical wrist at the end of two links of 0.5 m, which reaches 1 m in any orientation
SPHERICAL = RobotSpec(
    name="elbow",
    rows=(
        row("j1", alpha=-math.pi / 2),
        row("j2", a=0.5),
        row("j3", alpha=math.pi / 2, theta=math.pi / 2),
        row("j4", d=0.5, alpha=-math.pi / 2),
        row("j5", alpha=math.pi / 2),
        row("j6"),
    ),
    units=Units(angle=AngleUnit.DEG),
)


@pytest.mark.parametrize("free", [None, "roll", "rotation"])
def test_a_point_beyond_the_longest_reach_is_told_with_the_distance(free: str | None) -> None:
    assert reason(SPHERICAL, at(0.9, 0.8, 0.0, roll=0.3), free=free) == "out of reach by 0.204 m"


def test_a_point_off_an_arms_plane_is_told_with_its_height() -> None:
    message = "out of reach by 0.12 m: tool0 moves in a plane"
    assert reason(planar(0.7, 0.5), at(0.5, 0.5, 0.12), free="rotation") == message


def test_a_point_off_a_slides_line_is_told_with_its_distance() -> None:
    slide = RobotSpec(name="slide", rows=(row("j1", "prismatic"),))
    assert reason(slide, at(0.3, 0.4, 2.0)) == "out of reach by 0.5 m: tool0 moves along a line"


def test_an_orientation_that_few_joints_cannot_have_is_told_with_the_angle() -> None:
    # in the plane, elbow up or down have fixed angles; 10 degrees off one of them
    spec = planar(0.7, 0.5)
    T = table_tool_pose(spec, np.array([0.2, 0.8]))
    T[:3, :3] = at(0.0, 0.0, yaw=1.0 + math.radians(10.0))[:3, :3]
    assert reason(spec, T) == "orientation unreachable with 2 joints, nearest by 10 degrees"
    radians = reason(planar(0.7, 0.5, angle=AngleUnit.RAD), T)
    assert radians == "orientation unreachable with 2 joints, nearest by 0.175 rad"


def test_six_joints_out_of_reach_in_this_orientation_are_told_both_ways_to_get_nearer() -> None:
    # with a tool of 0.1 m, a point at 1.05 m is reached only where the tool points outwards
    spec = replace(SPHERICAL, tool=replace(SPHERICAL.tool, xyz=np.array([0.0, 0.0, 0.1])))
    T = at(1.05, 0.0, 0.0)
    T[:3, :3] = [[0, 0, -1], [0, 1, 0], [1, 0, 0]]  # pointing inwards: the wrist would have to be at 1.15 m
    # at this point the wrist is at 1 m at most: by the law of cosines the tool is this much off outwards
    outwards = math.degrees(math.acos((1.05**2 + 0.1**2 - 1.0) / (2.0 * 1.05 * 0.1)))
    expected = f"in this orientation out of reach by 0.15 m; at this position by {180.0 - outwards:.3g} degrees"
    assert reason(spec, T) == expected


def test_what_only_limits_rule_out_is_told_with_the_joint_that_exceeds_least() -> None:
    rows = tuple(replace(r, limits=Limits(position=(-0.5, 0.5))) for r in planar(0.7, 0.5).rows)
    spec = RobotSpec(name="bounded", rows=rows, units=Units(angle=AngleUnit.DEG))
    T = table_tool_pose(spec, np.array([0.3, 0.5 + math.radians(12.0)]))
    assert reason(spec, T) == "only outside limits: j2 by 12 degrees"


def test_the_least_offence_counts_and_rounding_is_none() -> None:
    rows = tuple(replace(r, limits=Limits(position=(-0.5, 0.5))) for r in planar(0.7, 0.5).rows)
    spec = RobotSpec(name="bounded", rows=rows)
    q = np.array([[0.9, 0.0], [-0.7, 0.5 + 1e-10], [2.0, 2.0]])
    assert beyond_limits(spec.moving_rows, q) == pytest.approx(np.array([[0.4, 0.0], [-0.2, 0.0], [1.5, 1.5]]))
    assert limits_reason(spec, q) == "only outside limits: j1 by 0.2 rad"


def test_what_can_be_reached_has_no_reason() -> None:
    T = table_tool_pose(SPHERICAL, np.array([0.3, -0.4, 0.5, 0.6, 0.7, -0.8]))
    assert why_unreachable(SPHERICAL, T) is None


def test_the_nearest_configuration_is_as_far_as_the_reason_says() -> None:
    T = at(0.9, 0.8, 0.0)
    solutions = inverse_kinematics(SPHERICAL, T)
    tool = table_tool_pose(SPHERICAL, solutions.nearest)
    assert math.dist(tool[:3, 3], T[:3, 3]) == pytest.approx(math.hypot(0.9, 0.8) - 1.0, abs=1e-9)


def test_a_locked_joint_is_named_where_nothing_is_reached() -> None:
    message = reason(planar(0.7, 0.5), at(0.5, 0.5), free="rotation", lock={"j2": 0.1})
    assert message.startswith("not reached with j2 locked; the nearest is ")
    assert message.endswith(" m away")
