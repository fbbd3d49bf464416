from __future__ import annotations

import numpy as np
from hypothesis import given

from dh2sim.kinematics.transforms import move_point, pose_from_rpy, rotate_tensor
from dh2sim.typing import Array
from tests.strategies import angles, inertias, lengths, vectors


@given(vectors(lengths), vectors(angles), vectors(lengths))
def test_a_point_moves_with_its_frame(xyz: Array, rpy: Array, point: Array) -> None:
    T = pose_from_rpy(xyz, rpy)
    np.testing.assert_allclose(move_point(T, point), T[:3, :3] @ point + xyz, rtol=0, atol=1e-15)


@given(vectors(angles), inertias())
def test_a_tensor_turns_with_its_frame(rpy: Array, tensor: Array) -> None:
    T = pose_from_rpy([0.1, 0.2, 0.3], rpy)
    turned = rotate_tensor(T, tensor)
    np.testing.assert_allclose(turned, T[:3, :3] @ tensor @ T[:3, :3].T, rtol=0, atol=2e-15)
    np.testing.assert_array_equal(turned, turned.T)
    np.testing.assert_array_equal(rotate_tensor(T[:3, :3], tensor), turned)
    assert not turned.flags.writeable
