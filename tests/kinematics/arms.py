"""Arms to convert, and what two of them have in common."""

from __future__ import annotations

import numpy as np

from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.links import BaseSpec, Pose, ToolSpec
from dh2sim.robot.row import Convention, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.sample_robots import HAYATI, MODIFIED, ODD, STANDARD, row

KINDS = (STANDARD, MODIFIED)
PURE = Pose(xyz=read_only([0.25, 0, 0]), rpy=read_only([-ODD, 0, 0]))
GENERAL = Pose(xyz=read_only([0.1, -0.2, 0.3]), rpy=read_only([0.4, 0.5, -0.6]))


def numbers(one: Row) -> tuple[float, ...]:
    return (one.a, one.alpha, one.d, one.theta, one.beta)


def table(spec: RobotSpec) -> list[tuple[float, ...]]:
    return [numbers(one) for one in spec.rows]


def pose_numbers(pose: Pose) -> list[float]:
    return [*pose.xyz.tolist(), *pose.rpy.tolist()]


def assert_same_numbers(spec: RobotSpec, other: RobotSpec) -> None:
    assert table(spec) == table(other)
    assert [one.convention for one in spec.rows] == [one.convention for one in other.rows]
    assert pose_numbers(spec.base.pose) == pose_numbers(other.base.pose)
    assert pose_numbers(spec.tool) == pose_numbers(other.tool)


def reach(spec: RobotSpec, q: Array) -> float:
    """An upper bound of how far anything of the arm is from base_link, at least 1 m."""
    ends = np.linalg.norm(spec.base.pose.xyz) + np.linalg.norm(spec.tool.xyz)
    slides = [not one.type.turns for one in spec.moving_rows]
    travel = np.abs(q[..., slides]).sum(axis=-1).max()
    return max(1.0, float(ends + travel) + sum(abs(one.a) + abs(one.d) for one in spec.rows))


def assert_same_arm(spec: RobotSpec, converted: RobotSpec, q: Array) -> None:
    gap = np.abs(table_tool_pose(converted, q) - table_tool_pose(spec, q))
    assert gap[..., :3, 3].max() <= 1e-13 * reach(spec, q)
    assert gap[..., :3, :3].max() <= 1e-13


def arm(*conventions: Convention, base: Pose | None = None, tool: Pose | None = None, beta: float = 0.3) -> RobotSpec:
    """An arm of odd rows, one of each of these conventions; Hayati ones have the second twist ``beta``."""
    rows = []
    for i, convention in enumerate(conventions):
        hayati = convention is HAYATI
        d, own_beta = (0.0, beta) if hayati else (0.05 * i - 0.1, 0.0)
        rows.append(
            row(
                f"j{i + 1}", "revolute", convention, a=0.1 * i + 0.2, alpha=0.7 - i, d=d, theta=0.2 * i, beta=own_beta
            )
        )
    return RobotSpec(
        name="arm",
        rows=tuple(rows),
        base=BaseSpec(pose=base or Pose()),
        tool=ToolSpec.at(tool or Pose()),
        source="made up",
    )


Q = np.random.default_rng(5).uniform(-3, 3, (20, 8))
