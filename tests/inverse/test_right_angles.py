"""Poses at which joints stand at right angles: solutions share coordinates there, and eigenvalues are double."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from dh2sim.inverse.nearest import goal_sigma_min
from dh2sim.inverse.solver import InverseSolver
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.spec import RobotSpec
from tests.inverse.arms import ARMS, CRX, JACO, ORTHOGONAL, arm
from tests.inverse.campaign import is_found
from tests.inverse.right_angles import Tally, compare, random_arms
from tests.sample_robots import robot

RIGHT = 0.5 * np.pi
PARALLEL = arm(
    "parallel_at_the_end",
    (0.35, -RIGHT, -0.15, 0.0, "R"),
    (0.2, -RIGHT, 0.0, 0.0, "R"),
    (0.5, -RIGHT, -0.15, 0.0, "R"),
    (0.35, -RIGHT, 0.4, 0.0, "R"),
    (0.1, 0.0, 0.25, 0.0, "R"),
    (0.0, -RIGHT, 0.4, 0.0, "R"),
)


solver_of = cache(InverseSolver)


@pytest.mark.parametrize("spec", [robot("puma560"), JACO, CRX, ORTHOGONAL], ids=lambda spec: spec.name)
def test_regular_configurations_with_joints_at_right_angles_are_found(spec: RobotSpec) -> None:
    rng = np.random.default_rng(105)
    q = rng.choice([0.0, 0.5 * np.pi, -0.5 * np.pi, np.pi], (200, 6))
    q = np.where(rng.random(q.shape) < 0.4, rng.uniform(-2.0, 2.0, q.shape), q)
    solver = solver_of(spec)
    q = q[goal_sigma_min(spec, q, free=None, size=solver.size, rank=6) > 1e-4]
    assert len(q) > 80
    for drawn, found in zip(q, solver.solve(table_tool_pose(spec, q), limits=False), strict=True):
        assert is_found(spec, drawn, found.q)


@pytest.mark.parametrize(
    ("spec", "q", "count"),
    [
        pytest.param(CRX, (RIGHT, np.pi, np.pi, 0.03804475, np.pi, RIGHT), 12, id="solutions are close together"),
        pytest.param(ORTHOGONAL, (RIGHT, 0.0, 0.0, RIGHT, RIGHT, -RIGHT), 6, id="solutions share an angle"),
        pytest.param(
            ARMS["manocha_canny"],
            (RIGHT, -RIGHT, 0.0, 3.141735470035416, RIGHT, np.pi),
            4,
            id="rounding splits an angle that solutions share",
        ),
        pytest.param(JACO, (-RIGHT, 0.0, np.pi, RIGHT, np.pi, -RIGHT), 8, id="solutions of a skew wrist share one"),
        pytest.param(CRX, (0.526857, np.pi, np.pi, 0.878053, np.pi, -RIGHT), 12, id="all pencils are singular"),
        pytest.param(
            PARALLEL, (-RIGHT, -RIGHT, np.pi, RIGHT, 0.0, RIGHT), 6, id="a regular pencil leaves joints open"
        ),
    ],
)
def test_rounding_of_a_pose_does_not_cost_solutions(spec: RobotSpec, q: tuple[float, ...], count: int) -> None:
    T = table_tool_pose(spec, np.array(q))
    rounded = T * (1.0 + 1e-15 * np.random.default_rng(0).integers(-1, 2, (12, 4, 4)))
    for found in solver_of(spec).solve(rounded, limits=False):
        assert len(found) == count
        assert is_found(spec, np.array(q), found.q)


def test_a_pose_at_which_a_pencil_is_singular_but_for_rounding_has_all_eight() -> None:
    ur10e = robot("ur10e")
    q = np.array([0.0, np.pi, -0.5 * np.pi, np.pi, 0.5 * np.pi, 0.0])
    found = InverseSolver(ur10e).solve(table_tool_pose(ur10e, q), limits=False)
    assert len(found) == 8
    assert is_found(ur10e, q, found.q)


@pytest.mark.slow
def test_at_an_arm_of_close_solutions_solving_in_other_ways_finds_nothing_more() -> None:
    tally = compare(CRX, 20, 12)
    assert tally.solved > 20
    assert (tally.falsely_complete, tally.odd, tally.missed) == (0, 0, 0)


@pytest.mark.slow
def test_complete_answers_lack_nothing_that_solving_in_other_ways_finds() -> None:
    total = Tally()
    for spec in (robot("puma560"), robot("stanford"), robot("ur5e"), JACO, CRX, ORTHOGONAL, *random_arms(0, 6)):
        total.add(compare(spec, 60, 1))
    assert total.solved > 1000
    assert (total.falsely_complete, total.odd) == (0, 0), total.examples
