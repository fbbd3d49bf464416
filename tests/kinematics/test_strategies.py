from __future__ import annotations

import re

import numpy as np
from hypothesis import given

from dh2sim.robot.row import Convention, JointType
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.strategies import inertias, robot_specs, robots_with_joint_vectors


@given(robot_specs())
def test_random_robots_are_ones_that_a_file_could_describe(spec: RobotSpec) -> None:
    names = [spec.name, *(row.name for row in spec.rows)]
    assert all(re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", name) for name in names)
    assert len({row.name for row in spec.rows}) == len(spec.rows)
    assert spec.moving_rows
    for row in spec.rows:
        hayati = row.convention is Convention.HAYATI
        assert row.d == 0.0 or not hayati or row.type is JointType.PRISMATIC
        assert row.beta == 0.0 or hayati
        if row.limits.position is not None:
            assert row.type in (JointType.REVOLUTE, JointType.PRISMATIC)
            assert row.limits.position[0] < row.limits.position[1]
        if row.link.com is not None or row.link.inertia is not None:
            assert row.link.mass is not None
    assert all(q.shape == (len(spec.moving_rows),) for q in spec.configurations.values())


@given(inertias())
def test_random_inertias_are_ones_that_a_body_can_have(tensor: Array) -> None:
    a, b, c = np.linalg.eigvalsh(tensor)
    assert a > 0.0
    assert a + b >= c
    np.testing.assert_array_equal(tensor, tensor.T)


@given(robots_with_joint_vectors())
def test_random_joint_vectors_keep_to_the_limits(robot: tuple[RobotSpec, Array]) -> None:
    spec, q = robot
    for i, row in enumerate(spec.moving_rows):
        if row.limits.position is not None:
            assert (q[:, i] >= row.limits.position[0]).all()
            assert (q[:, i] <= row.limits.position[1]).all()
