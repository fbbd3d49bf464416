from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from numpy.testing import assert_allclose

from dh2sim import build_chain, geometric_jacobian, load_robot
from dh2sim.kinematics.singularity import (
    lost_directions,
    manipulability,
    rank,
    singular_values,
    still_motions,
    velocity_ellipsoid,
)
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
        assert not len(basis) or np.linalg.matrix_rank(basis) == len(basis)
        for vector in basis:
            columns = np.flatnonzero(vector == 1.0)
            assert any(np.count_nonzero(basis[:, column]) == 1 for column in columns)


@given(robots_with_joint_vectors(must_move=False))
def test_the_velocity_ellipsoid_holds_the_velocity_of_every_unit_joint_rate(robot: tuple[RobotSpec, Array]) -> None:
    spec, q = robot
    J = geometric_jacobian(build_chain(spec), q[0])
    ellipsoid, size = velocity_ellipsoid(J), max(1.0, abs(J).max(initial=0.0))
    assert_allclose(ellipsoid.axes.T @ ellipsoid.axes, np.eye(3), atol=1e-12)
    assert np.linalg.det(ellipsoid.axes) > 0.0
    assert np.all(np.diff(ellipsoid.semi_axes) <= 0.0)
    # Gram matrices of both, which are the ellipsoids
    spread = ellipsoid.axes @ np.diag(ellipsoid.semi_axes**2) @ ellipsoid.axes.T
    assert_allclose(spread, J[:3] @ J[:3].T, rtol=0, atol=1e-12 * size**2 * max(1, J.shape[1]))
    rates = np.random.default_rng(1).normal(size=(200, J.shape[1]))
    rates /= np.maximum(np.linalg.norm(rates, axis=1, keepdims=True), 1e-300)
    for k in range(3):
        reach = np.abs(rates @ J[:3].T @ ellipsoid.axes[:, k]).max(initial=0.0)
        assert reach <= ellipsoid.semi_axes[k] + 1e-12 * size


def test_the_ellipse_of_two_links_has_the_half_axes_of_the_closed_form() -> None:
    a1, a2, q1, q2 = 1.0, 0.7, 0.3, 1.1
    ellipsoid = velocity_ellipsoid(jacobian("planar_2r", q1, q2))
    # eigenvalues of J Jᵀ out of its trace and determinant
    trace = a1**2 + 2 * a2**2 + 2 * a1 * a2 * np.cos(q2)
    root = np.sqrt(trace**2 - 4 * (a1 * a2 * np.sin(q2)) ** 2)
    assert_allclose(ellipsoid.semi_axes, [*np.sqrt([(trace + root) / 2, (trace - root) / 2]), 0.0], atol=1e-12)
    assert_allclose(np.abs(ellipsoid.axes[:, 2]), [0, 0, 1], atol=1e-12)


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
