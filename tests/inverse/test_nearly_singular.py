"""Solutions near singularities, which lie far from each other in one valley of the error."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from dh2sim.inverse.solver import ROUNDED, InverseSolver
from dh2sim.kinematics.table_oracle import table_tool_pose
from tests.inverse.arms import arm, odd_arm
from tests.inverse.campaign import is_found
from tests.sample_robots import robot

FAR_OFF = [-2.18348140, -1.28892156, 2.90384777e-05, -2.64799546, 0.183824424, 2.74251415]
IN_THE_VALLEY = [0.772338, -0.63405, 1.37133703e-05, 0.247879, -1.132738, 1.611489]
WRIST_TOO = [-0.935642, 1.007584, 1.85578127e-03, -0.401353, 5.45290418e-05, -1.906015]


@cache
def stanford_solver() -> InverseSolver:
    return InverseSolver(robot("stanford"))


@pytest.mark.parametrize(
    "q",
    [
        pytest.param(FAR_OFF, id="eliminations are far off"),
        pytest.param(IN_THE_VALLEY, id="rounding leaves others in the valley"),
        pytest.param(WRIST_TOO, id="wrist nearly singular, too"),
    ],
)
def test_all_eight_are_found_where_the_slide_is_almost_drawn_in(q: list[float]) -> None:
    stanford = robot("stanford")
    T = table_tool_pose(stanford, np.array(q))
    found = stanford_solver().solve(T, limits=False)
    assert len(found) == 8
    assert is_found(stanford, np.array(q), found.q)
    assert found.complete
    assert np.abs(table_tool_pose(stanford, found.q) - T).max() < 1e-12


def test_slides_that_are_far_out_are_told_apart_as_exactly_as_they_are_far() -> None:
    slides = odd_arm("PRRPRR")
    q = np.array([0.59972141, -1.64141109, 0.14843222, 1.31982938, 2.90933224, 2.92879854])
    found = InverseSolver(slides).solve(table_tool_pose(slides, q), limits=False)
    assert len(found) == 4
    assert float(np.abs(found.q[:, 0]).max()) > 9e4


@pytest.mark.slow
def test_an_arm_that_is_regular_by_rounding_alone_is_told_so() -> None:
    twists = (3.141593, 3.141593, 3.141593, 1.570796, 1.570796, 0.0)
    four_parallel = arm("rounded", *((0.1 + 0.05 * i, twist, 0.0, 0.0, "R") for i, twist in enumerate(twists)))
    q = np.array([0.1, 0.5, -0.3, 0.4, 0.5, 0.6])
    found = InverseSolver(four_parallel).solve(table_tool_pose(four_parallel, q), limits=False)
    assert is_found(four_parallel, q, found.q)
    assert not found.complete
    assert ROUNDED in found.notes
