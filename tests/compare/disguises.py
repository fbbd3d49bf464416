"""Tables written otherwise, and misread ones: of both it is known by construction what they are.

A disguise changes how a mechanism is written down, never the mechanism: it follows identities of the rows' factors.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from dh2sim.compare.comparison import Equivalence
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.kinematics.transforms import compose, link_part, pose_from_rpy, rpy_from_rotation
from dh2sim.robot.links import BaseSpec, Pose, ToolSpec
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec

Generator = np.random.Generator


def random_table(rng: Generator, rows: int, *, odd: bool) -> RobotSpec:
    """An arm of the standard convention; right-angled, or with odd twists too."""
    twists = [0.0, math.pi / 2, -math.pi / 2]
    made = []
    for i in range(rows):
        slides = rng.random() < 0.2
        alpha = float(rng.choice(twists))
        if odd and rng.random() < 0.5:
            alpha = float(np.round(rng.uniform(0.2, 1.4) * rng.choice([-1, 1]), 3))
        made.append(
            Row(
                name=f"joint_{i + 1}",
                type=JointType.PRISMATIC if slides else JointType.REVOLUTE,
                convention=Convention.STANDARD,
                a=float(np.round(rng.uniform(0.05, 0.6), 3)) if rng.random() < 0.6 else 0.0,
                alpha=alpha,
                d=float(np.round(rng.uniform(0.05, 0.6), 3)) if rng.random() < 0.6 else 0.0,
                theta=float(rng.choice(twists)),
            )
        )
    return RobotSpec(name="table", rows=tuple(made))


def disguised(spec: RobotSpec, rng: Generator) -> RobotSpec:
    """The same mechanism, written in another way by several identities, each used or not."""
    ways: Sequence[Callable[[RobotSpec, Generator], RobotSpec]] = (
        other_normals,
        other_senses_of_z,
        other_places_along_parallel_axes,
        other_zeros,
        other_senses,
        other_convention,
        other_base_and_tool,
    )
    for way in ways:
        if rng.random() < 0.6:
            spec = way(spec, rng)
    return spec


def other_zeros(spec: RobotSpec, rng: Generator) -> RobotSpec:
    """Let every joint start elsewhere."""
    rows = [
        replace(row, theta=row.theta + float(rng.uniform(-3, 3)))
        if row.type.turns
        else replace(row, d=row.d + float(rng.uniform(-0.3, 0.3)))
        for row in spec.rows
    ]
    return replace(spec, rows=tuple(rows))


def other_senses(spec: RobotSpec, rng: Generator) -> RobotSpec:
    """Let some joints turn or slide the other way."""
    return replace(spec, rows=tuple(replace(row, flip=bool(rng.random() < 0.4)) for row in spec.rows))


def other_normals(spec: RobotSpec, rng: Generator) -> RobotSpec:
    """Turn some x axes round: Z(theta) X(a, alpha) = Z(theta + pi) X(-a, -alpha) Rz(-pi)."""
    rows = list(spec.rows)
    for i in range(len(rows) - 1):
        if rng.random() < 0.5:
            row, behind = rows[i], rows[i + 1]
            rows[i] = replace(row, theta=row.theta + math.pi, a=-row.a, alpha=-row.alpha)
            rows[i + 1] = replace(behind, theta=behind.theta - math.pi)
    return replace(spec, rows=tuple(rows))


def other_senses_of_z(spec: RobotSpec, rng: Generator) -> RobotSpec:
    """Turn some z axes round: Z(theta, d) = Rx(pi) Z(-theta, -d) Rx(-pi); the coordinate keeps its number."""
    rows = list(spec.rows)
    for i in range(1, len(rows)):
        if rng.random() < 0.5:
            before, row = rows[i - 1], rows[i]
            rows[i - 1] = replace(before, alpha=before.alpha + math.pi)
            rows[i] = replace(row, theta=-row.theta, d=-row.d, alpha=row.alpha - math.pi)
    return replace(spec, rows=tuple(rows))


def other_places_along_parallel_axes(spec: RobotSpec, rng: Generator) -> RobotSpec:
    """Shift frames along z where the next axis is parallel, so that d goes from one row to the next."""
    rows = list(spec.rows)
    for i in range(len(rows) - 1):
        if rows[i].alpha == 0.0:
            shift = float(rng.uniform(-0.5, 0.5))
            rows[i] = replace(rows[i], d=rows[i].d + shift)
            rows[i + 1] = replace(rows[i + 1], d=rows[i + 1].d - shift)
    return replace(spec, rows=tuple(rows))


def other_convention(spec: RobotSpec, rng: Generator) -> RobotSpec:
    """Write a standard table as a modified one: a and alpha go to the next row, the last ones to the tool."""
    links = [(0.0, 0.0), *((row.a, row.alpha) for row in spec.rows)]
    rows = [
        replace(row, convention=Convention.MODIFIED, a=a, alpha=alpha)
        for row, (a, alpha) in zip(spec.rows, links, strict=False)
    ]
    T = compose(link_part(*links[-1]), pose_from_rpy(spec.tool.xyz, spec.tool.rpy))
    tool = ToolSpec.at(Pose(xyz=T[:3, 3], rpy=rpy_from_rotation(T)))
    return replace(spec, rows=tuple(rows), tool=tool)


def other_base_and_tool(spec: RobotSpec, rng: Generator) -> RobotSpec:
    """Put the arm somewhere else, and another tool on it."""
    poses = [Pose(xyz=rng.uniform(-1, 1, 3), rpy=rng.uniform(-3, 3, 3)) for _ in range(2)]
    return replace(spec, base=BaseSpec(pose=poses[0]), tool=ToolSpec.at(poses[1]))


def equation_error(a: RobotSpec, b: RobotSpec, same: Equivalence) -> float:
    """How far FK_B(sense q + zero) is from what the equivalence says, in any entry, at 20 random configurations."""
    rng = np.random.default_rng(0)
    q = rng.uniform(-2, 2, (20, len(same.joints)))
    q_b = np.empty_like(q)
    for i, joint in enumerate(same.joints):
        q_b[:, same.order[i]] = joint.sense * q[:, i] + joint.zero
    right = np.linalg.inv(same.T_a_base_b_base) @ table_tool_pose(a, q) @ same.T_a_tool_b_tool
    return float(np.abs(table_tool_pose(b, q_b) - right).max())
