"""Where an arm runs, whatever its table says."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.kinematics.arm_path import arm_path
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.row import Limits
from dh2sim.robot.spec import RobotSpec
from tests.kinematics.frame_assignment.chains import chain_of
from tests.kinematics.perturbed_arms import KINDS, perturbed, textbook_table
from tests.sample_robots import CONTINUOUS, STANDARD
from tests.strategies import robot_specs


@pytest.mark.parametrize("kind", KINDS)
def test_the_reach_of_a_table_is_that_of_its_axes(kind: str) -> None:
    axes, tip = perturbed(kind, 0.03, 5)
    by_axes = arm_path(chain_of(axes, tip, np.random.default_rng(2)))
    by_table = arm_path(build_chain(textbook_table(axes, tip)))
    assert by_table.reach == pytest.approx(by_axes.reach, rel=1e-12)


@pytest.mark.parametrize("size", [1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("kind", KINDS)
def test_axes_turned_a_little_change_the_reach_a_little(kind: str, size: float) -> None:
    exact = arm_path(chain_of(*perturbed(kind, 0.0, 0))).reach
    assert arm_path(chain_of(*perturbed(kind, size, 1))).reach == pytest.approx(exact, abs=5 * size)


def test_the_reach_of_a_ur5_is_the_sum_of_its_lengths() -> None:
    lengths = [0.089159, 0.425, 0.39225, 0.10915, 0.09465, 0.0823]
    assert arm_path(chain_of(*perturbed("ur", 0.0, 0))).reach == pytest.approx(math.fsum(lengths), abs=1e-12)


@given(spec=robot_specs(max_rows=6), seed=st.integers(0, 100))
def test_no_tool_leaves_the_reach(spec: RobotSpec, seed: int) -> None:
    """Of arms that only turn, measured from the point of the first axis that is nearest to base_link."""
    rows = tuple(
        dataclasses.replace(row, type=CONTINUOUS, convention=STANDARD, beta=0.0, limits=Limits()) for row in spec.rows
    )
    arm = RobotSpec(name="arm", rows=rows, convention=spec.convention, base=spec.base, tool=spec.tool)
    chain = build_chain(arm)
    first = chain.joints[0].T_parent_joint
    mounted = first[:3, 3] - (first[:3, 3] @ first[:3, 2]) * first[:3, 2]
    q = np.random.default_rng(seed).uniform(-np.pi, np.pi, (20, len(rows)))
    away = np.linalg.norm(table_tool_pose(arm, q)[:, :3, 3] - mounted, axis=1)
    assert away.max() <= arm_path(chain).reach + 1e-9
