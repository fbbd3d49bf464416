"""Two axes in space."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim.kinematics.frame_assignment.lines import (
    Line,
    across,
    angle_about,
    common_normal,
    cross_of_directions,
    distance_of_parallels,
    frame,
    sine_between,
    transversal,
)
from tests.kinematics.frame_assignment.chains import pose, turn, unit


def _line(point: object, direction: object) -> Line:
    return Line(point=np.asarray(point, dtype=float), direction=unit(direction))


def test_the_common_normal_of_skew_lines_meets_both_at_right_angles() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        first, second = (_line(rng.uniform(-1, 1, 3), rng.normal(size=3)) for _ in range(2))
        normal = common_normal(first, second)
        gap = normal.next_foot - normal.foot
        for line, foot in ((first, normal.foot), (second, normal.next_foot)):
            assert np.linalg.norm(np.cross(foot - line.point, line.direction)) < 1e-12
            assert abs(gap @ line.direction) < 1e-12
            assert abs(normal.direction @ line.direction) < 1e-12


def test_the_feet_on_lines_that_intersect_are_where_they_intersect() -> None:
    place = np.array([0.3, -0.2, 0.7])
    first = _line(place - 0.4 * unit([1, 2, 3]), [1, 2, 3])
    second = _line(place + 1.3 * unit([0, 1, -1]), [0, 1, -1])
    normal = common_normal(first, second)
    assert np.abs([normal.foot - place, normal.next_foot - place]).max() < 1e-15


@pytest.mark.parametrize("flipped", [1.0, -1.0], ids=["parallel", "antiparallel"])
@pytest.mark.parametrize("tilt", [1e-3, 1e-6, 1e-9, 1e-12])
def test_the_normal_of_almost_parallel_directions_is_perpendicular_to_both_to_full_precision(
    tilt: float, flipped: float
) -> None:
    z1 = unit([0.3, -0.5, 0.8])
    z2 = flipped * (turn(unit(np.cross(z1, [1, 0, 0])), tilt) @ z1)
    n = cross_of_directions(z1, z2)
    assert np.linalg.norm(n) == pytest.approx(tilt, rel=1e-3)
    assert max(abs(unit(n) @ z1), abs(unit(n) @ z2)) < 1e-15


def test_parallel_lines_know_their_distance() -> None:
    first, second = _line([0, 0, 0], [0, 0, 1]), _line([3, 4, 17], [0, 0, -1])
    assert distance_of_parallels(first, second) == 5.0
    assert sine_between(first, second) == 0.0


def test_a_line_that_meets_two_others_is_found() -> None:
    first, second = _line([0, 0, 0], [0, 0, 1]), _line([1, 2, 3], [0, 1, 0])
    meeting = transversal(first, second, np.array([1.0, 0.0, 0.0]), 1e-3)
    assert meeting is not None
    assert meeting.tolist() == [0, 0, 3]  # from there along x to (1, 0, 3), which is on the second line


def test_no_line_meets_two_others_where_the_three_directions_lie_in_a_plane() -> None:
    first, second = _line([0, 0, 0], [0, 0, 1]), _line([1, 2, 3], [0, 1e-4, 1])
    assert transversal(first, second, np.array([1.0, 0.0, 0.0]), 1e-3) is None


def test_a_line_moves_with_its_frame() -> None:
    T = pose(turn(unit([1, 1, 0]), 0.7), np.array([0.1, 0.2, 0.3]))
    moved = _line([1, 0, 0], [0, 0, 1]).moved(T)
    assert np.allclose(moved.point, (T @ [1, 0, 0, 1])[:3], atol=1e-15)
    assert np.allclose(moved.direction, T[:3, 2], atol=1e-15)


def test_a_frame_is_right_handed() -> None:
    T = frame(np.array([1.0, 2.0, 3.0]), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    assert T.tolist() == [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]


def test_what_is_left_across_an_axis_is_perpendicular_even_where_little_is_left() -> None:
    z = unit([0.3, -0.5, 0.8])
    x = across(z + 1e-9 * np.array([1.0, 0.0, 0.0]), z)
    assert abs(x @ z) < 1e-16
    assert np.linalg.norm(x) == pytest.approx(1.0, abs=1e-15)


def test_half_a_turn_is_plus_pi() -> None:
    z, x = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    assert angle_about(z, x, -x) == math.pi
    assert angle_about(z, x, np.array([-1.0, -0.0, 0.0])) == math.pi
    assert angle_about(z, x, np.array([0.0, 1.0, 0.0])) == math.pi / 2
