from __future__ import annotations

import numpy as np
import pytest

from dh2sim.kinematics.table_oracle import table_tool_pose
from tests.inverse import completeness
from tests.inverse.completeness import compare, random_coordinates, random_table, regular, same, search


def test_the_searchs_own_poses_are_those_of_the_table() -> None:
    for seed in range(10):
        table = random_table(seed)
        q = random_coordinates(table, np.random.default_rng(seed), 5)
        np.testing.assert_allclose(table.poses(q)[0], table_tool_pose(table.spec(), q), rtol=0.0, atol=1e-13)


def test_the_searchs_own_jacobian_is_the_derivative_of_its_poses() -> None:
    table, rng = random_table(8), np.random.default_rng(8)
    q, step = random_coordinates(table, rng, 1), 1e-6
    J = table.poses(q)[1][0]
    for joint in range(6):
        ahead, behind = q + step * np.eye(6)[joint], q - step * np.eye(6)[joint]
        twist = completeness.errors(table.poses(behind)[0], table.poses(ahead)[0][0])[0] / (2 * step)
        np.testing.assert_allclose(twist, J[:, joint], rtol=0.0, atol=1e-8)


def test_the_search_finds_what_is_there_to_be_found() -> None:
    # a Manocha-Canny arm: sixteen configurations reach this pose
    table = completeness.Table(
        a=np.array([0.3, 1.0, 0.0, 1.5, 0.0, 1.1358]),
        alpha=np.radians([90.0, 1.0, 90.0, 1.0, 90.0, 1.0]),
        d=np.array([0.0, 0.0, 0.2, 0.0, 0.0, 0.0]),
        theta=np.zeros(6),
        turns=np.ones(6, dtype=np.bool_),
    )
    rng = np.random.default_rng(3)
    most = 0
    for _ in range(4):
        q = random_coordinates(table, rng, 1)
        found = regular(table, search(table, table.poses(q)[0][0], random_coordinates(table, rng, 250)))
        assert any(same(table, q[0], other) for other in found)
        most = max(most, len(found))
    assert most >= 8


@pytest.mark.parametrize("seed", [2, 6])
def test_the_solver_lacks_nothing_that_a_short_search_finds(seed: int) -> None:
    tally = compare(seed, poses=1, starts=60)
    assert tally.found_by_search >= 4
    assert (tally.lacked, tally.wrong, tally.failed) == (0, 0, 0)


@pytest.mark.slow
def test_the_solver_lacks_nothing_that_a_long_search_finds() -> None:
    total = completeness.Tally()
    for seed in range(1000, 1080):
        total.add(compare(seed, poses=2))
    assert total.arms >= 20
    assert (total.lacked, total.wrong, total.failed) == (0, 0, 0)
