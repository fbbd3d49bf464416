"""Solutions near singularities, which lie far from each other in one valley of the error."""

from __future__ import annotations

import numpy as np
import pytest

from dh2sim.inverse.solver import InverseSolver
from dh2sim.kinematics.table_oracle import table_tool_pose
from tests.inverse.arms import odd_arm
from tests.inverse.campaign import is_found
from tests.sample_robots import robot

FAR_OFF = [-2.18348140, -1.28892156, 2.90384777e-05, -2.64799546, 0.183824424, 2.74251415]
IN_THE_VALLEY = [0.772338, -0.63405, 1.37133703e-05, 0.247879, -1.132738, 1.611489]
WRIST_TOO = [-0.935642, 1.007584, 1.85578127e-03, -0.401353, 5.45290418e-05, -1.906015]


@pytest.mark.parametrize(
    "q",
    [
        pytest.param(FAR_OFF, id="eliminations are far off", marks=pytest.mark.slow),
        pytest.param(IN_THE_VALLEY, id="rounding leaves others in the valley", marks=pytest.mark.slow),
        pytest.param(WRIST_TOO, id="wrist nearly singular, too"),
    ],
)
def test_all_eight_are_found_where_the_slide_is_almost_drawn_in(q: list[float]) -> None:
    arm = robot("stanford")
    T = table_tool_pose(arm, np.array(q))
    found = InverseSolver(arm).solve(T, limits=False)
    assert len(found) == 8
    assert is_found(arm, np.array(q), found.q)
    assert found.complete
    assert np.abs(table_tool_pose(arm, found.q) - T).max() < 1e-12


def test_slides_that_are_far_out_are_told_apart_as_exactly_as_they_are_far() -> None:
    arm = odd_arm("PRRPRR")
    q = np.array([0.59972141, -1.64141109, 0.14843222, 1.31982938, 2.90933224, 2.92879854])
    found = InverseSolver(arm).solve(table_tool_pose(arm, q), limits=False)
    assert len(found) == 4
    assert float(np.abs(found.q[:, 0]).max()) > 9e4
