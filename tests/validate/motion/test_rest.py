"""An arm whose motors balance gravity rests; one whose motors do not is found."""

from __future__ import annotations

import numpy as np
import pytest

from dh2sim.validate.motion.tracking import check_rest, resting_rollouts
from dh2sim.validate.report import LeftOut
from tests.robot_files import ODD
from tests.sample_robots import COSTLY_NAMES
from tests.validate.motion.robots import FRICTION, WEAK, built


@pytest.mark.slow
@pytest.mark.parametrize("robot", [*COSTLY_NAMES, ODD, FRICTION], ids=lambda text: text.split("\n")[0])
def test_gravity_compensation_leaves_a_robot_at_rest(robot: str) -> None:
    run = resting_rollouts(built(robot))
    check = check_rest(run)
    assert check.ok
    assert (check.samples, check.tolerance) == (8, 1e-9)
    assert check.max_error is not None
    assert check.max_error <= 1e-12
    assert run["time"].values[-1] == pytest.approx(1.0)
    assert len(np.unique(run["qpos"].values[:, 0], axis=0)) == 8


@pytest.mark.parametrize("robot", ["stanford", FRICTION], ids=["stanford", "friction"])
def test_a_millionth_of_gravity_is_found_even_where_friction_would_hide_it(robot: str) -> None:
    check = check_rest(resting_rollouts(built(robot), controller=f"{__package__}.careless:Weak"))
    assert check.ok is False
    assert check.max_error is not None
    assert 1e-8 < check.max_error < 1e-4
    assert check.worst is not None
    unit = "m" if check.worst.where == "joint_3" else "rad"
    assert check.reason == (
        f"{check.worst.where} moves by {check.max_error:.2g} {unit} (tolerance 1e-09) though its motor balances "
        "gravity"
    )


def test_what_is_not_finite_does_not_rest() -> None:
    run = resting_rollouts(built("planar_2r"))
    run["qpos"][3, -1, 1] = np.nan
    check = check_rest(run)
    assert (check.ok, check.max_error) == (False, np.inf)
    assert check.worst is not None
    assert (check.worst.where, check.worst.sample) == ("joint_2", 3)


def test_motors_that_cannot_carry_the_arm_are_reported() -> None:
    check = check_rest(resting_rollouts(built(WEAK)))
    assert check.ok is None
    assert check.reason == "rest: the motors are too weak to carry the arm in any of its random poses"
    assert check.left_out is not None
    assert check.left_out.rollouts == 8
    assert check.to_json()["left_out"] == {"rollouts": 8, "joints": dict(check.left_out.joints)}


def test_poses_in_which_a_motor_is_too_weak_are_left_out() -> None:
    stronger = WEAK.replace("0.01", "22")  # it takes up to 5 kg 0.5 m 9.81 m/s² = 24.5 N·m
    run = resting_rollouts(built(stronger.replace("[-0.5, 0.5]", "[-1.5, 1.5]")))
    check = check_rest(run)
    assert check.ok
    assert 0 < check.samples < 8
    assert check.samples == np.count_nonzero(run["saturation"].values[:, 0] == 0)
    out = 8 - check.samples
    assert check.left_out == LeftOut(rollouts=out, joints={"joint_1": out})
    were = "rollout was" if out == 1 else "rollouts were"
    assert str(check.left_out) == f"{out} {were} left out, where a motor is too weak: joint_1 in {out}"


def test_an_assumed_effort_that_is_too_weak_fails() -> None:
    run = resting_rollouts(built(WEAK))
    check = check_rest(run, {"joint_1", "joint_9"})
    assert check.ok is False
    assert check.reason == "the effort that was assumed for joint_1 is too small; give it in the robot file"
    assert check_rest(run, {"joint_9"}).ok is None
