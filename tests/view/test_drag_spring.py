"""The spring with which the mouse drags a link."""

from __future__ import annotations

import numpy as np
import pytest

from dh2sim.view.motion.applied_force import (
    MAX_ACCELERATION,
    NATURAL_FREQUENCY,
    DragSpring,
    drag_spring,
    spring_force,
)


def test_a_spring_pulls_towards_the_mouse_and_brakes() -> None:
    spring = DragSpring(stiffness=10.0, damping=3.0, max_force=1e9)
    force = spring_force(spring, [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [1.0, 0.0, 0.5])
    assert force.tolist() == [0.0, -6.0, 5.0]


def test_the_force_grows_with_the_mass_and_with_the_distance() -> None:
    def pull(mass: float, distance: float) -> float:
        return float(spring_force(drag_spring(mass), [0.0] * 3, [0.0] * 3, [0.0, distance, 0.0])[1])

    assert pull(2.0, 0.1) == pytest.approx(2.0 * NATURAL_FREQUENCY**2 * 0.1)
    assert pull(6.0, 0.1) == pytest.approx(3.0 * pull(2.0, 0.1))
    assert pull(2.0, 0.2) == pytest.approx(2.0 * pull(2.0, 0.1))


def test_the_force_has_a_greatest_value_and_keeps_its_direction() -> None:
    force = spring_force(drag_spring(2.0), [0.0] * 3, [0.0] * 3, [300.0, 400.0, 0.0])
    assert force.tolist() == pytest.approx([0.6 * 2.0 * MAX_ACCELERATION, 0.8 * 2.0 * MAX_ACCELERATION, 0.0])


def test_the_ends_of_the_number_range_do_not_overflow() -> None:
    force = spring_force(drag_spring(1.0), [-1e308, 0.0, 0.0], [0.0] * 3, [1.7e308, 0.0, 0.0])
    assert force.tolist() == pytest.approx([MAX_ACCELERATION, 0.0, 0.0])


def test_a_free_mass_on_a_spring_comes_to_rest_at_the_mouse_without_swinging_over() -> None:
    spring, x, v, step = drag_spring(3.0), np.zeros(3), np.zeros(3), 0.001
    target = np.array([0.2, 0.0, -0.1])
    highest = 0.0
    for _ in range(2000):
        v += step / 3.0 * spring_force(spring, x, v, target)
        x += step * v
        highest = max(highest, x[0])
    assert x == pytest.approx(target, abs=1e-6)
    assert highest <= 0.2 + 1e-6
