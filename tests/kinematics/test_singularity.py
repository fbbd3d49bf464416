from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from numpy.testing import assert_allclose

from dh2sim import build_chain, geometric_jacobian, load_robot
from dh2sim.kinematics.singularity import lost_directions, manipulability, rank, singular_values, still_motions
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.strategies import robots_with_joint_vectors


def jacobian(robot: str, *q: float) -> Array:
    return geometric_jacobian(build_chain(load_robot(robot)), q)


def test_manipulability_of_two_links_is_the_textbooks() -> None:
    q = np.random.default_rng(0).uniform(-3, 3, (100, 2))
    J = geometric_jacobian(build_chain(load_robot("planar_2r")), q)
    assert_allclose(manipulability(J[:, :2]), abs(1.0 * 0.7 * np.sin(q[:, 1])), rtol=1e-12)


@given(robots_with_joint_vectors(must_move=False))
def test_manipulability_is_the_square_root_of_a_determinant(robot: tuple[RobotSpec, Array]) -> None:
    spec, q = robot
    J = geometric_jacobian(build_chain(spec), q)
    transposed = np.swapaxes(J, -1, -2)
    gram = J @ transposed if J.shape[-1] >= 6 else transposed @ J
    assert singular_values(J).shape == (*q.shape[:-1], min(6, q.shape[-1]))
    scale = singular_values(J).max(axis=-1, initial=1.0) ** (2 * min(6, q.shape[-1]))
    assert np.all(abs(manipulability(J) ** 2 - np.linalg.det(gram)) <= 1e-11 * scale)


@given(robots_with_joint_vectors(must_move=False))
def test_still_motions_and_lost_directions_are_all_there_are(robot: tuple[RobotSpec, Array]) -> None:
    spec, q = robot
    J = geometric_jacobian(build_chain(spec), q[0])
    still, lost, size = still_motions(J), lost_directions(J), max(1.0, abs(J).max(initial=0.0))
    n = J.shape[1]
    assert (still.shape, lost.shape) == ((n - rank(J), n), (6 - rank(J), 6))
    assert_allclose(J @ still.T, 0.0, atol=1e-7 * size)
    assert_allclose(lost @ J, 0.0, atol=1e-7 * size)
    for basis in (still, lost):
        assert np.linalg.matrix_rank(basis) == len(basis)
        for vector in basis:
            columns = np.flatnonzero(vector == 1.0)
            assert any(np.count_nonzero(basis[:, column]) == 1 for column in columns)


def test_a_straight_wrist_turns_joints_4_and_6_against_each_other() -> None:
    J = jacobian("stanford", 0.3, -0.7, 0.5, 1.1, 0.0, -0.4)
    assert rank(J) == 5
    assert_allclose(still_motions(J), [[0, 0, 0, 1, 0, -1]], atol=1e-15)
    assert manipulability(J) < 1e-15
    assert rank(jacobian("stanford", 0.3, -0.7, 0.5, 1.1, 0.6, -0.4)) == 6


def test_an_outstretched_planar_arm_loses_its_own_direction() -> None:
    J = jacobian("planar_2r", np.pi / 2, 0.0)
    assert rank(J) == 2
    assert_allclose(
        float(np.linalg.norm(lost_directions(J) @ [0, 1, 0, 0, 0, 0])), 1.0, atol=1e-15
    )  # it points along y
    assert_allclose(still_motions(J[:2]), [[-0.7 / 1.7, 1.0]], atol=1e-15)


def test_a_redundant_robot_has_one_self_motion() -> None:
    J = jacobian("ssrms", *[0.3] * 7)
    assert rank(J) == 6
    assert still_motions(J).shape == (1, 7)
    assert lost_directions(J).shape == (0, 6)


@pytest.mark.parametrize("n", [0, 1])
def test_a_jacobian_without_motion_has_rank_zero(n: int) -> None:
    J = np.zeros((6, n))
    assert rank(J) == 0
    assert_allclose(still_motions(J), np.eye(n))
    assert_allclose(lost_directions(J), np.eye(6))
