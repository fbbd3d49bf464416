"""How a camera sees, against a projection matrix."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.draw.projection import Pinhole
from dh2sim.typing import Array
from dh2sim.view.scene.camera import pinhole_of


@dataclass
class Camera:
    """What is read of viser's camera."""

    position: Array
    wxyz: Array
    fov: float = 0.8
    image_height: int = 600


def looking(rng: np.random.Generator) -> tuple[Camera, Array, Array]:
    """A camera somewhere, turned somehow; the columns of its rotation by the textbook's entries; and its position."""
    quaternion = rng.normal(size=4)
    quaternion /= np.linalg.norm(quaternion)
    w, x, y, z = quaternion
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    position = rng.normal(size=3)
    return Camera(position=position, wxyz=quaternion), R, position


def pinhole(camera: Camera) -> Pinhole:
    found = pinhole_of(camera)  # type: ignore[arg-type]
    assert found is not None
    return found


@given(st.integers(0, 10_000))
def test_points_are_seen_where_a_pinhole_camera_has_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera, R, position = looking(rng)
    points = rng.normal(size=(20, 3)) * 3.0
    in_camera = (points - position) @ R  # x right, y down, z ahead
    seen = pinhole(camera).project(points)
    focal = 300.0 / math.tan(0.4)
    np.testing.assert_allclose(seen[:, 2], in_camera[:, 2], rtol=0, atol=1e-12)
    ahead = in_camera[:, 2] > 0.0
    expected = focal * in_camera[ahead, :2] / in_camera[ahead, 2:] * [1.0, -1.0]
    np.testing.assert_allclose(seen[ahead, :2], expected, rtol=1e-9, atol=1e-9)
    assert np.isnan(seen[~ahead, :2]).all()


@given(st.integers(0, 10_000), st.floats(-200.0, 200.0))
def test_a_raised_point_is_seen_so_many_pixels_higher_and_as_deep(seed: int, pixels: float) -> None:
    camera, R, position = looking(np.random.default_rng(seed))
    point = position + R @ (0.3, -0.2, 2.5)
    seen = pinhole(camera)
    raised = seen.raised((point[0], point[1], point[2]), pixels, 2.5)
    before, after = seen.project(np.array([point, raised]))
    np.testing.assert_allclose(after - before, [0.0, pixels, 0.0], rtol=0, atol=1e-9)


def test_in_a_frame_that_moves_along_nothing_is_seen_elsewhere() -> None:
    rng = np.random.default_rng(3)
    camera, _, _ = looking(rng)
    _, R, t = looking(rng)
    T_world_frame = np.eye(4)
    T_world_frame[:3, :3], T_world_frame[:3, 3] = R, t
    points = rng.normal(size=(10, 3))
    in_world = points @ R.T + t
    moved = pinhole(camera).in_frame(T_world_frame)
    np.testing.assert_allclose(moved.project(points), pinhole(camera).project(in_world), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    "change",
    [
        {"image_height": 0},
        {"fov": 0.0},
        {"fov": math.pi},
        {"fov": math.nan},
        {"position": np.array([0, 0, math.inf])},
    ],
    ids=str,
)
def test_a_camera_of_nonsense_sees_nothing(change: dict[str, object]) -> None:
    camera, _, _ = looking(np.random.default_rng(0))
    assert pinhole_of(replace(camera, **change)) is None  # type: ignore[arg-type]


def test_small_moves_make_no_difference_and_large_ones_do() -> None:
    camera, _, position = looking(np.random.default_rng(1))
    here = pinhole(camera)
    assert here.resembles(here, 0.02, 2.0)
    for step, same in ((0.03, True), (0.05, False)):
        there = pinhole(replace(camera, position=position + np.array([step, 0.0, 0.0])))
        assert there.resembles(here, 0.02, 2.0) is same
    for height, same in ((610, True), (620, False)):
        assert pinhole(replace(camera, image_height=height)).resembles(here, 0.02, 2.0) is same
    turned = replace(here, right=here.up, up=tuple(-value for value in here.right))  # type: ignore[arg-type]
    assert not turned.resembles(here, 0.02, 2.0)
