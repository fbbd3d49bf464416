"""Inverse kinematics of random arms: the drawn configuration is found, however the table is written."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

from dh2sim.inverse.solutions import Solutions
from dh2sim.inverse.solver import InverseSolver
from dh2sim.kinematics.conversion import convert_rows
from dh2sim.kinematics.forward import geometric_jacobian
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.kinematics.transforms import pose_from_rpy, rpy_from_rotation
from dh2sim.robot.links import BaseSpec, Pose, ToolSpec
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.inverse.arms import CRX, GENERAL, JACO, ORTHOGONAL, SIXTEEN, UR5, odd_arm
from tests.kinematics.perturbed_arms import perturbed, textbook_table

POSES = 6
REGULAR = 1e-4
"""Least singular value from which on a configuration must be found."""
SPECIAL = st.sampled_from([0.0, math.pi / 2, -math.pi / 2, math.pi])
TWISTS = SPECIAL | st.floats(-math.pi, math.pi)
LENGTHS = st.sampled_from([0.0, 0.0, 0.4, -0.25]) | st.floats(0.1, 0.6)


@st.composite
def arms(draw: DrawFn) -> RobotSpec:
    """Arms of 1 to 6 joints, up to three of which slide, like those of textbooks as often as odd ones."""
    n = draw(st.integers(1, 6))
    slides = draw(st.sets(st.integers(0, n - 1), max_size=min(3, n)))
    distal = draw(st.booleans())
    rows = []
    for i in range(n):
        convention = draw(st.sampled_from(["standard", "hayati"])) if distal else "modified"
        kind = JointType.PRISMATIC if i in slides else JointType.REVOLUTE
        has_d = convention != "hayati" or i in slides
        rows.append(
            Row(
                type=kind,
                convention=Convention(convention),
                a=draw(LENGTHS),
                alpha=draw(TWISTS),
                d=draw(LENGTHS) if has_d else 0.0,
                theta=draw(SPECIAL),
                beta=draw(st.sampled_from([0.0, 0.3])) if convention == "hayati" else 0.0,
                flip=draw(st.booleans()),
            )
        )
    tool = ToolSpec(xyz=np.array([0.1, -0.05, 0.2]), rpy=np.array([0.3, -0.4, 1.0]))
    return RobotSpec(name="random", rows=tuple(rows), tool=tool)


def drawn(spec: RobotSpec, count: int = POSES, seed: int = 0) -> Array:
    ranges = [(-math.pi, math.pi) if row.type.turns else (-0.6, 0.8) for row in spec.moving_rows]
    lower, upper = np.array(ranges).T
    return np.random.default_rng(seed).uniform(lower, upper, (count, len(ranges)))


def gaps(spec: RobotSpec, q: Array, other: Array) -> Array:
    """How far joint vectors are from another, whole turns left out, shape (k,)."""
    turns = np.array([row.type.turns for row in spec.moving_rows])
    gap = q - other
    gap = np.where(turns, gap - 2.0 * np.pi * np.round(gap / (2.0 * np.pi)), gap)
    return np.asarray(np.abs(gap).max(axis=1, initial=0.0))


def check(spec: RobotSpec, q: Array, results: Iterable[Solutions]) -> None:
    """Check that drawn configurations are found, solutions reach their poses, and are of an even number."""
    size = InverseSolver(spec).size
    for vector, T, solutions in zip(q, table_tool_pose(spec, q), results, strict=True):
        if len(solutions) and solutions.sigma_min.min() < REGULAR:
            continue
        assert (gaps(spec, solutions.q, vector) < 1e-6).sum() == 1
        reached = table_tool_pose(spec, solutions.q)
        extent = 1.0 + np.abs(solutions.q).max() / size
        assert np.abs(reached[:, :3, 3] - T[:3, 3]).max() <= 1e-10 * size * extent
        assert np.abs(reached[:, :3, :3] - T[:3, :3]).max() <= 1e-10 * extent
        if len(vector) == 6:
            assert len(solutions) % 2 == 0
            assert len(solutions) <= 16


def check_random(spec: RobotSpec) -> None:
    q = drawn(spec)
    values = np.linalg.svd(geometric_jacobian(spec, q), compute_uv=False)
    assume((values[:, -1] > 1e-6).any())  # otherwise the arm has joints to spare
    check(spec, q, InverseSolver(spec).solve(table_tool_pose(spec, q), limits=False))


@pytest.mark.slow
@given(arms())
@settings(max_examples=6)
def test_drawn_configurations_of_random_arms_are_found(spec: RobotSpec) -> None:
    check_random(spec)


@pytest.mark.slow
@given(arms())
@settings(max_examples=100)
def test_drawn_configurations_of_many_random_arms_are_found(spec: RobotSpec) -> None:
    check_random(spec)


@pytest.mark.parametrize("spec", [SIXTEEN, CRX, JACO, ORTHOGONAL], ids=lambda spec: spec.name)
def test_arms_of_the_literature_are_solved(spec: RobotSpec) -> None:
    q = drawn(spec, 20)
    check(spec, q, InverseSolver(spec).solve(table_tool_pose(spec, q), limits=False))


def test_an_arm_reaches_a_pose_in_sixteen_ways() -> None:
    q = drawn(SIXTEEN, 60)
    counts = [len(found) for found in InverseSolver(SIXTEEN).solve(table_tool_pose(SIXTEEN, q), limits=False)]
    assert max(counts) == 16


@pytest.mark.parametrize("pattern", ["RRPRRR", "PRPRRR", "PRRPRR", "RRPRRP", "PPPRRR", "RPRPRP"])
def test_slides_may_be_anywhere(pattern: str) -> None:
    spec = odd_arm(pattern)
    q = drawn(spec)
    check(spec, q, InverseSolver(spec).solve(table_tool_pose(spec, q), limits=False))


@pytest.mark.slow
@pytest.mark.parametrize("slides", [(i, j) for i in range(6) for j in range(i)])
def test_any_two_slides(slides: tuple[int, int]) -> None:
    spec = odd_arm("".join("P" if i in slides else "R" for i in range(6)))
    q = drawn(spec, 60)
    check(spec, q, InverseSolver(spec).solve(table_tool_pose(spec, q), limits=False))


@pytest.mark.parametrize("kind", ["ur", "elbow"])
def test_frames_far_out_along_nearly_parallel_axes_cost_no_solution(kind: str) -> None:
    spec = textbook_table(*perturbed(kind, 3e-4, 1))
    assert max(abs(row.d) for row in spec.rows) > 20.0
    q = drawn(spec, 20)
    check(spec, q, InverseSolver(spec).solve(table_tool_pose(spec, q), limits=False))


def same_sets(spec: RobotSpec, ours: Solutions, theirs: Array) -> bool:
    return len(ours) == len(theirs) and all((gaps(spec, ours.q, q) < 1e-6).any() for q in theirs)


@pytest.mark.parametrize("spec", [UR5, GENERAL, odd_arm("RRPRRR")], ids=lambda spec: spec.name)
def test_the_convention_of_the_table_does_not_matter(spec: RobotSpec) -> None:
    other = convert_rows(spec, Convention.MODIFIED).spec
    T = table_tool_pose(spec, drawn(spec))
    for ours, theirs in zip(
        InverseSolver(spec).solve(T, limits=False), InverseSolver(other).solve(T, limits=False), strict=True
    ):
        assert same_sets(spec, ours, theirs.q)


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_the_unit_of_length_does_not_matter(factor: float) -> None:
    spec = odd_arm("RRPRRR")
    scaled = replace(spec, rows=tuple(replace(row, a=factor * row.a, d=factor * row.d) for row in spec.rows))
    T = table_tool_pose(spec, drawn(spec))
    T_scaled = T.copy()
    T_scaled[:, :3, 3] *= factor
    units = np.array([1.0 if row.type.turns else factor for row in spec.moving_rows])
    q0 = np.zeros(6)
    for ours, theirs in zip(
        InverseSolver(spec).solve(T, q0, limits=False),
        InverseSolver(scaled).solve(T_scaled, q0, limits=False),
        strict=True,
    ):
        assert same_sets(spec, ours, theirs.q / units)


def test_where_base_and_tool_are_does_not_matter() -> None:
    T_base, T_tool = (
        pose_from_rpy(xyz, rpy) for xyz, rpy in (([30.0, -2.0, 1.0], [1, 2, 3]), ([0, 3, 1], [3, 1, 2]))
    )
    moved = replace(
        UR5,
        base=BaseSpec(pose=Pose(xyz=T_base[:3, 3], rpy=rpy_from_rotation(T_base))),
        tool=ToolSpec(xyz=T_tool[:3, 3], rpy=rpy_from_rotation(T_tool)),
    )
    T = table_tool_pose(UR5, drawn(UR5))
    for ours, theirs in zip(
        InverseSolver(UR5).solve(T, limits=False),
        InverseSolver(moved).solve(T_base @ T @ T_tool, limits=False),
        strict=True,
    ):
        assert same_sets(UR5, ours, theirs.q)
