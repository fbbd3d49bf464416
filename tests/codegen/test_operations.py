"""What code costs, in multiplications and additions: whatever changes that should be seen to."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from dh2sim import Revolute, Robot
from dh2sim.codegen.generate import summarize
from dh2sim.robot.links import LinkSpec
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import read_only
from tests.codegen.test_base_parameters import with_general_links
from tests.sample_robots import robot


def cost(spec: RobotSpec, what: str) -> tuple[int, int]:
    [operations] = summarize(spec, what).operations.values()
    return operations.multiplications, operations.additions


@pytest.mark.parametrize(
    ("name", "pose", "jacobian"),
    [
        ("puma560", (40, 20), (34, 14)),
        ("puma560_standard", (40, 20), (34, 14)),
        ("stanford", (42, 20), (45, 18)),
        ("ur5e", (36, 21), (34, 15)),
        ("scara", (4, 5), (4, 3)),
        ("franka_panda", (68, 36), (91, 44)),
    ],
)
def test_kinematics_take_few_operations(name: str, pose: tuple[int, int], jacobian: tuple[int, int]) -> None:
    assert cost(robot(name), "pose") == pose
    assert cost(robot(name), "jacobian") == jacobian


def with_links_of_the_usual_kind(spec: RobotSpec) -> RobotSpec:
    """A PUMA 560 with inertias along the frames' axes and, of links 4 to 6, centres of mass on the joints' axes."""
    coms = ([0, 0, 0], [0.07, 0.006, -0.016], [0, -0.07, 0.014], [0, 0, -0.02], [0, 0, 0], [0, 0, 0.03])
    links = [
        LinkSpec(mass=10.0 - i, com=read_only(com), inertia=read_only(np.diag([0.2, 0.3, 0.4]) / (i + 1)))
        for i, com in enumerate(coms)
    ]
    return replace(spec, rows=tuple(replace(row, link=link) for row, link in zip(spec.rows, links, strict=True)))


def test_inverse_dynamics_take_few_operations() -> None:
    general, usual = with_general_links(robot("puma560")), with_links_of_the_usual_kind(robot("puma560"))
    assert cost(general, "inverse-dynamics") == (257, 239)
    assert cost(usual, "inverse-dynamics") == (184, 146)


def test_inverse_dynamics_take_the_operations_that_are_compared_with_published_ones() -> None:
    """The arms of the table in docs/symbolic.md."""
    rows = [Revolute(), Revolute(alpha=pi / 2), Revolute(a=0.45), Revolute(alpha=-pi / 2, d=0.45)]
    rx90 = Robot([*rows, Revolute(alpha=pi / 2), Revolute(alpha=-pi / 2)], convention="modified").spec
    assert cost(replace(with_general_links(rx90), gravity=read_only([0, 0, 0])), "inverse-dynamics") == (243, 224)

    armstrong = (  # mass, centre of mass and inertia along the axes, as measured by Armstrong, Khatib and Burdick
        (1e-9, (0, 0, 0), (0.175, 0.175, 0.35)),  # of which they give the last alone
        (17.4, (0.068, 0.006, -0.016), (0.13, 0.524, 0.539)),
        (4.8, (0, -0.070, 0.014), (0.066, 0.0125, 0.066)),
        (0.82, (0, 0, -0.019), (1.8e-3, 1.8e-3, 1.3e-3)),
        (0.34, (0, 0, 0), (0.3e-3, 0.3e-3, 0.4e-3)),
        (0.09, (0, 0, 0.032), (0.15e-3, 0.15e-3, 0.04e-3)),
    )
    links = [
        LinkSpec(mass=m, com=read_only(com), inertia=read_only(np.diag(inertia))) for m, com, inertia in armstrong
    ]
    rows = [Revolute(), Revolute(alpha=-pi / 2, d=0.2435), Revolute(a=0.4318, d=-0.0934)]
    rows += [Revolute(a=-0.0203, alpha=pi / 2, d=0.4331), Revolute(alpha=-pi / 2), Revolute(alpha=pi / 2)]
    puma = Robot(rows, convention="modified").spec
    puma = replace(puma, rows=tuple(replace(row, link=link) for row, link in zip(puma.rows, links, strict=True)))
    assert cost(puma, "inverse-dynamics") == (178, 142)
