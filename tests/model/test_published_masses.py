"""Estimated masses are of the size of those that makers publish."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from dh2sim.model.build import build_model
from dh2sim.robot.links import LinkSpec
from dh2sim.robot.row import Row
from dh2sim.robot.spec import RobotSpec
from tests.sample_robots import REVOLUTE, STANDARD, robot

PUBLISHED = ("ur5e", "ur10e", "franka_panda", "kuka_iiwa14", "xarm7", "kuka_kr6_r900")
"""Robots whose links have the maker's masses, or masses identified from its torques."""
LIGHT = ("kinova_gen3", "so101")
"""Built lighter than any rule from the geometry of the others says."""
UNIVERSAL_ROBOTS = {
    "ur3e": ((0.15185, -0.24355, -0.2132, 0.13105, 0.08535, 0.0921), (1.98, 3.4445, 1.437, 0.871, 0.805, 0.261)),
    "ur16e": ((0.1807, -0.4784, -0.36, 0.17415, 0.11985, 0.11655), (7.369, 10.45, 4.321, 2.18, 2.033, 0.907)),
    "ur20": ((0.2363, -0.862, -0.7287, 0.201, 0.1593, 0.1543), (16.343, 29.632, 7.879, 3.054, 3.126, 0.926)),
}
"""d1, a2, a3, d4, d5, d6 and masses of the links: Universal Robots, 'DH Parameters for calculations of kinematics and
dynamics'. """


def estimated_mass(spec: RobotSpec) -> float:
    return build_model(replace(spec, rows=tuple(replace(row, link=LinkSpec()) for row in spec.rows))).mass


@pytest.mark.parametrize("name", PUBLISHED)
def test_an_estimated_mass_is_within_a_factor_of_two_of_the_published_one(name: str) -> None:
    published = math.fsum(row.link.mass or 0.0 for row in robot(name).rows)
    assert published > 5.0
    assert published / 2 < estimated_mass(robot(name)) < published * 2


def test_where_only_the_whole_arm_is_published_most_of_it_moves() -> None:
    assert 0.85 * 25.0 / 2 < estimated_mass(robot("abb_irb120")) < 0.85 * 25.0 * 2


@pytest.mark.parametrize("name", UNIVERSAL_ROBOTS)
def test_arms_of_other_sizes_are_within_a_factor_of_two(name: str) -> None:
    (d1, a2, a3, d4, d5, d6), masses = UNIVERSAL_ROBOTS[name]
    table = ((0, math.pi / 2, d1), (a2, 0, 0), (a3, 0, 0), (0, math.pi / 2, d4), (0, -math.pi / 2, d5), (0, 0, d6))
    rows = [
        Row(name=f"joint_{i}", type=REVOLUTE, convention=STANDARD, a=a, alpha=alpha, d=d)
        for i, (a, alpha, d) in enumerate(table, start=1)
    ]
    assert sum(masses) / 2 < estimated_mass(RobotSpec(name=name, rows=tuple(rows))) < sum(masses) * 2


@pytest.mark.parametrize("name", LIGHT)
def test_light_arms_are_estimated_too_heavy(name: str) -> None:
    published = math.fsum(row.link.mass or 0.0 for row in robot(name).rows)
    assert 2 * published < estimated_mass(robot(name)) < 10 * published
