"""Rotations of axes and angles, vectors and quaternions."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim.kinematics.rotations import (
    hat,
    rotation_vectors,
    rotations_about,
    rotations_of_quaternions,
    rotations_of_vectors,
)
from dh2sim.typing import Array

ANGLES = [0.0, 1e-12, 1e-7, math.radians(37.3), 3.1415926, math.pi]


def turned(axis: Array, angle: float, point: Array) -> Array:
    """Return where a point goes: what is along the axis stays, the rest turns in its plane."""
    along = axis * float(axis @ point)
    across = point - along
    return along + math.cos(angle) * across + math.sin(angle) * np.cross(axis, across)


@pytest.mark.parametrize("angle", [*ANGLES, -2.0, 5.0])
def test_vectors_quaternions_and_angles_turn_points_about_the_axis(angle: float) -> None:
    rng = np.random.default_rng(0)
    for _ in range(10):
        axis, point = rng.normal(size=(2, 3))
        axis /= np.linalg.norm(axis)
        expected = turned(axis, angle, point)
        quaternion = np.array([math.cos(angle / 2), *(math.sin(angle / 2) * axis)])
        about, of_vector = rotations_about(axis, angle), rotations_of_vectors(angle * axis)
        for R in (about, of_vector, rotations_of_quaternions(quaternion)):
            assert np.abs(R @ point - expected).max() < 4e-15


def test_the_matrix_of_a_cross_product_makes_it() -> None:
    a, b = np.random.default_rng(0).normal(size=(2, 4, 5, 3))
    np.testing.assert_allclose((hat(a) @ b[..., None])[..., 0], np.cross(a, b), rtol=0, atol=1e-15)


def test_rotation_vectors_come_back_up_to_half_a_turn() -> None:
    rng = np.random.default_rng(0)
    axes = rng.normal(size=(50, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    vectors = axes * np.concatenate([ANGLES, rng.uniform(0.0, 3.1, 44)])[:, None]
    R = rotations_of_vectors(vectors)
    found = rotation_vectors(R)
    assert np.abs(found[:5] - vectors[:5]).max() < 1e-9
    assert np.abs(found[:3] - vectors[:3]).max() < 1e-15
    assert np.abs(found[6:] - vectors[6:]).max() < 1e-13
    assert np.abs(rotations_of_vectors(found) - R).max() < 1e-9


def test_any_number_of_rotations_is_made_at_a_time() -> None:
    vectors = np.random.default_rng(0).normal(size=(2, 3, 3))
    R = rotations_of_vectors(vectors)
    one = vectors[1, 2]
    assert R.shape == (2, 3, 3, 3)
    assert rotation_vectors(R).shape == (2, 3, 3)
    np.testing.assert_array_equal(R[1, 2], rotations_of_vectors(one))
    np.testing.assert_allclose(rotation_vectors(R[1, 2]), one, rtol=0, atol=1e-14)
    assert rotations_about(np.array([0.0, 0.0, 1.0]), np.zeros((2, 4))).shape == (2, 4, 3, 3)
    assert rotations_of_quaternions(np.ones((2, 4)) / 2.0).shape == (2, 3, 3)
