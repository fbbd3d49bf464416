from __future__ import annotations

import itertools

import numpy as np
import pytest

from dh2sim.draw.markers import joined_label, simplified


@pytest.mark.parametrize(
    ("names", "label"),
    [
        (["dh_1"], "dh_1"),
        (["dh_4", "tool0"], "dh_4, tool0"),
        (["dh_3", "dh_4"], "dh_3, dh_4"),
        (["dh_3", "dh_4", "dh_5"], "dh_3…dh_5"),
        (["dh_3", "dh_5", "dh_6"], "dh_3, dh_5, dh_6"),
        (["dh_9", "dh_10", "dh_11", "tool0"], "dh_9…dh_11, tool0"),
    ],
)
def test_frames_at_one_point_share_a_label(names: list[str], label: str) -> None:
    assert joined_label(names) == label


def test_a_straight_line_needs_its_ends_only() -> None:
    points = np.outer(np.linspace(0.0, 1.0, 50) ** 2, [1.0, -2.0, 0.5])
    assert simplified(points, 1e-9) == [0, 49]
    assert simplified(np.zeros((5, 3)), 1e-9) == [0, 4]
    assert simplified(np.eye(3)[:2], 1e-9) == [0, 1]


def test_every_point_is_within_the_tolerance_of_the_line_through_the_simplified() -> None:
    t = np.linspace(0.0, 9.0, 400)
    points = np.stack([np.sin(t), np.cos(1.7 * t), 0.2 * t], axis=1)
    kept = simplified(points, 0.01)
    assert kept[0] == 0
    assert kept[-1] == 399
    assert 20 < len(kept) < 150
    for start, end in itertools.pairwise(kept):
        for point in points[start : end + 1]:
            along = points[end] - points[start]
            share = np.clip((point - points[start]) @ along / (along @ along), 0.0, 1.0)
            assert np.linalg.norm(points[start] + share * along - point) <= 0.01 + 1e-12


def test_a_way_back_along_the_same_line_is_not_left_out() -> None:
    x = np.concatenate([np.linspace(0, 1, 20), np.linspace(1, 0.2, 20)])
    points = np.stack([x, 0 * x, 0 * x], axis=1)
    kept = simplified(points, 1e-3)
    assert points[kept, 0].max() == 1.0
