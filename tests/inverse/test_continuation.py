"""Solutions followed from general complex poses: as many everywhere, and found without any elimination."""

from __future__ import annotations

import numpy as np
import pytest

from dh2sim.inverse.continuation import build_continuation
from dh2sim.inverse.loop import build_arm
from dh2sim.inverse.polish import polish
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.spec import RobotSpec
from tests.inverse.arms import SIXTEEN, arm, odd_arm
from tests.inverse.campaign import is_found
from tests.sample_robots import robot


@pytest.mark.parametrize(
    ("spec", "count"),
    [pytest.param(robot("puma560"), 8, marks=pytest.mark.slow), (SIXTEEN, 16), (odd_arm("PRPRPR"), 2)],
    ids=["puma", "16", "slides"],
)
def test_all_configurations_are_among_as_many_ends_as_the_arm_has_solutions(spec: RobotSpec, count: int) -> None:
    arm = build_arm(build_chain(spec), [row.limits.position for row in spec.moving_rows])
    moving = np.ones(6, dtype=np.bool_)
    continuation = build_continuation(arm, moving)
    assert continuation.count == count
    q = np.random.default_rng(1).uniform(-1.0, 1.0, (3, 6))
    T = arm.scaled_poses(table_tool_pose(spec, q))
    ends = continuation.ends(T, {})
    assert (ends.lost == 0).all()
    solutions, error, _ = polish(arm, ends.q, T[ends.pose], moving)
    reached = error < 1e-10
    for i, own in enumerate(q):
        assert is_found(spec, own, arm.unscaled(solutions[(ends.pose == i) & reached]))
        assert ends.elsewhere[i] + int((ends.pose == i).sum()) == count


def test_locked_joints_follow_to_the_values_of_each_pose() -> None:
    spec = robot("ssrms")
    arm = build_arm(build_chain(spec), [row.limits.position for row in spec.moving_rows])
    moving = np.arange(7) != 2
    q = np.random.default_rng(2).uniform(-2.0, 2.0, (2, 7))
    T = arm.scaled_poses(table_tool_pose(spec, q))
    ends = build_continuation(arm, moving).ends(T, {2: q[:, 2]})
    for i, own in enumerate(q):
        assert is_found(spec, own, ends.q[ends.pose == i])


def test_an_arm_whose_configurations_are_all_singular_has_no_paths_and_leaves_its_poses_open() -> None:
    parallel = build_arm(
        build_chain(arm("parallel", *[(0.1 + 0.05 * i, 0.0, 0.0, 0.0, "R") for i in range(6)])), [None] * 6
    )
    continuation = build_continuation(parallel, np.ones(6, dtype=np.bool_))
    assert continuation.count == 0
    assert continuation.ends(np.eye(4)[None], {}).lost.tolist() == [1]
