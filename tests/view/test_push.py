"""Where the mouse is in space, and the spring from there."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.view.motion.applied_force import RATE, STRONGEST, Spring, dragged_point, spring_for, spring_force
from tests.strategies import vectors

coordinates = st.floats(-10.0, 10.0, allow_subnormal=False)


@given(vectors(coordinates), vectors(coordinates), vectors(coordinates), vectors(coordinates))
def test_a_dragged_point_is_on_the_ray_and_in_the_plane_that_faces_the_camera(
    origin: np.ndarray, direction: np.ndarray, grabbed: np.ndarray, normal: np.ndarray
) -> None:
    point = dragged_point(origin, direction, grabbed, normal)
    if point is None:
        return
    scale = 1.0 + float(np.linalg.norm(point))
    facing = normal / np.linalg.norm(normal)
    assert abs(float((point - grabbed) @ facing)) <= 1e-8 * scale
    ray = direction / np.linalg.norm(direction)
    assert np.linalg.norm(np.cross(point - origin, ray)) <= 1e-8 * scale
    assert float((point - origin) @ ray) >= -1e-8 * scale


def test_a_ray_is_met_where_a_drawing_says() -> None:
    point = dragged_point([0.0, -2.0, 1.0], [1.0, 2.0, 0.0], [5.0, 0.0, 3.0], [0.0, 4.0, 0.0])
    assert point is not None
    assert point.tolist() == pytest.approx([1.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("direction", "normal"),
    [([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]), ([0.0, -1.0, 0.0], [0.0, 1.0, 0.0]), ([0.0] * 3, [0.0, 1.0, 0.0])],
    ids=["along the plane", "away from it", "no direction"],
)
def test_a_ray_that_misses_the_plane_gives_nothing(direction: list[float], normal: list[float]) -> None:
    assert dragged_point([0.0, -1.0, 0.0], direction, [0.0, 0.0, 0.0], normal) is None


def test_a_spring_pulls_towards_the_mouse_and_brakes() -> None:
    spring = Spring(stiffness=10.0, damping=3.0, strongest=1e9)
    force = spring_force(spring, [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [1.0, 0.0, 0.5])
    assert force.tolist() == [0.0, -6.0, 5.0]


def test_the_force_grows_with_the_mass_and_with_the_distance() -> None:
    def pull(mass: float, distance: float) -> float:
        return float(spring_force(spring_for(mass), [0.0] * 3, [0.0] * 3, [0.0, distance, 0.0])[1])

    assert pull(2.0, 0.1) == pytest.approx(2.0 * RATE**2 * 0.1)
    assert pull(6.0, 0.1) == pytest.approx(3.0 * pull(2.0, 0.1))
    assert pull(2.0, 0.2) == pytest.approx(2.0 * pull(2.0, 0.1))


def test_the_force_has_a_greatest_value_and_keeps_its_direction() -> None:
    force = spring_force(spring_for(2.0), [0.0] * 3, [0.0] * 3, [300.0, 400.0, 0.0])
    assert force.tolist() == pytest.approx([0.6 * 2.0 * STRONGEST, 0.8 * 2.0 * STRONGEST, 0.0])


def test_the_ends_of_the_number_range_do_not_overflow() -> None:
    force = spring_force(spring_for(1.0), [-1e308, 0.0, 0.0], [0.0] * 3, [1.7e308, 0.0, 0.0])
    assert force.tolist() == pytest.approx([STRONGEST, 0.0, 0.0])


def test_a_free_mass_on_a_spring_comes_to_rest_at_the_mouse_without_swinging_over() -> None:
    spring, x, v, step = spring_for(3.0), np.zeros(3), np.zeros(3), 0.001
    target = np.array([0.2, 0.0, -0.1])
    highest = 0.0
    for _ in range(2000):
        v += step / 3.0 * spring_force(spring, x, v, target)
        x += step * v
        highest = max(highest, x[0])
    assert x == pytest.approx(target, abs=1e-6)
    assert highest <= 0.2 + 1e-6
