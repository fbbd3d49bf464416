from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.kinematics.transforms import compose, pose_errors, pose_from_rpy
from dh2sim.typing import Array
from tests.strategies import angles, lengths, vectors


@given(vectors(lengths), vectors(angles), vectors(lengths), st.floats(0.0, math.pi), st.sampled_from(range(3)))
def test_errors_are_the_distance_and_the_angle(p: Array, rpy: Array, shift: Array, angle: float, axis: int) -> None:
    turn = [0.0, 0.0, 0.0]
    turn[axis] = angle
    T = pose_from_rpy(p, rpy)
    position, rotation = pose_errors(compose(T, pose_from_rpy(shift, turn)), T)
    assert position == pytest.approx(np.linalg.norm(shift), rel=0.0, abs=4e-15)
    assert rotation == pytest.approx(angle, rel=0.0, abs=2e-14 if angle < 3.0 else 1e-7)


@pytest.mark.parametrize("angle", [1e-14, 1e-12, 1e-9, 1e-6])
def test_tiny_angles_keep_their_precision(angle: float) -> None:
    _, rotation = pose_errors(pose_from_rpy([0, 0, 0], [0, 0, angle]), np.eye(4))
    assert rotation == pytest.approx(angle, rel=1e-12)


def test_equal_poses_have_no_error() -> None:
    T = np.random.default_rng(0).uniform(-1, 1, (3, 5, 4, 4))
    for errors in pose_errors(T, T.copy()):
        assert errors.shape == (3, 5)
        assert not errors.any()


@pytest.mark.parametrize("batch", [(), (0,), (2, 3), (5000, 2)])
def test_errors_have_the_batch_shape(batch: tuple[int, ...]) -> None:
    rng = np.random.default_rng(0)
    T, reference = rng.uniform(-1, 1, (2, *batch, 4, 4))
    position, rotation = pose_errors(T, reference)
    assert position.shape == rotation.shape == batch
    gap = T - reference
    np.testing.assert_allclose(position, np.linalg.norm(gap[..., :3, 3], axis=-1), rtol=1e-12)
    norm = np.linalg.norm(gap[..., :3, :3], axis=(-2, -1)) / math.sqrt(8)
    np.testing.assert_allclose(rotation, 2 * np.arcsin(np.minimum(1, norm)), rtol=1e-12)


def test_poses_of_any_memory_layout_are_compared() -> None:
    T = np.random.default_rng(0).uniform(-1, 1, (4, 4, 6, 2)).transpose(2, 3, 0, 1)
    position, _ = pose_errors(T, np.zeros_like(T))
    np.testing.assert_allclose(position, np.linalg.norm(T[..., :3, 3], axis=-1), rtol=1e-12)


@pytest.mark.parametrize("row", range(3))
@pytest.mark.parametrize("column", range(4))
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_what_is_not_finite_passes_no_tolerance(row: int, column: int, value: float) -> None:
    T = np.tile(np.eye(4), (3, 1, 1))
    T[1, row, column] = value
    for left, right in ((T, np.tile(np.eye(4), (3, 1, 1))), (np.tile(np.eye(4), (3, 1, 1)), T), (T, T)):
        position, rotation = pose_errors(left, right)
        ok = (position <= 1e-12) & (rotation <= 1e-12)
        assert ok.tolist() == [True, False, True]
        assert not np.maximum(position, rotation).max() <= 1e-12


def test_half_a_turn_is_the_greatest_angle() -> None:
    _, rotation = pose_errors(np.diag([2.0, -2.0, -2.0, 1.0]), np.eye(4))
    assert rotation == pytest.approx(math.pi)


@pytest.mark.parametrize(
    ("shape", "other"), [((4, 4), (2, 4, 4)), ((3, 3), (3, 3)), ((4,), (4,)), ((2, 4, 4), (3, 4, 4))]
)
def test_unequal_shapes_are_refused(shape: tuple[int, ...], other: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="expected two equal shapes") as caught:
        pose_errors(np.zeros(shape), np.zeros(other))
    assert str(caught.value) == f"expected two equal shapes (..., 4, 4), got {shape} and {other}"
