"""Whatever the table: a pose that it reaches is reached, by what the oracle says, and nothing is raised."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.inverse.goals import Free
from dh2sim.inverse.solutions import Solutions
from dh2sim.inverse.solver import InverseSolver
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests import strategies


def reaching(spec: RobotSpec, answer: Solutions, T: Array, free: Free | None, size: float) -> None:
    """By the oracle, every solution and every point of a curve has what the goal asks for."""
    columns = {None: [0, 1, 2, 3], "roll": [2, 3], "rotation": [3]}[free]
    for q in (answer.q, *(curve.q for curve in answer.curves)):
        if len(q):
            gaps = np.abs(table_tool_pose(spec, q)[:, :3, columns] - T[:3, columns]) / max(size, 1.0)
            assert gaps.max() <= 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("free", [None, "roll", "rotation"])
@given(robot_and_vectors=strategies.robots_with_joint_vectors(max_rows=7))
@settings(max_examples=10)
def test_what_reaches_a_pose_is_found_and_reaches_it(
    robot_and_vectors: tuple[RobotSpec, Array], free: Free | None
) -> None:
    spec, vectors = robot_and_vectors
    solver = InverseSolver(spec)
    T = table_tool_pose(spec, vectors[0])
    for numeric in (False, True):
        answer = solver.solve(T, vectors[0], free=free, numeric=numeric)
        assert len(answer) or answer.curves, answer.reason
        reaching(spec, answer, T, free, solver.size)
