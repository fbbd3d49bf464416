"""Computed torque is as close to its reference as sampled control can be; what spoils that is found."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from dh2sim.model.build import build_model
from dh2sim.robot.read import load_robot
from dh2sim.simulate.run import rollout
from dh2sim.validate.motion.free_motion import without_contacts, without_dry_friction
from dh2sim.validate.motion.tracking import check_tracking, tracking_rollouts
from tests.robot_files import ODD
from tests.sample_robots import COSTLY_NAMES
from tests.validate.motion.robots import FRICTION, WEAK, built


@pytest.mark.slow
@pytest.mark.parametrize("robot", [*COSTLY_NAMES, ODD, FRICTION], ids=lambda text: text.split("\n")[0])
def test_a_robot_follows_its_reference(robot: str) -> None:
    check = check_tracking(tracking_rollouts(built(robot)))
    assert check.ok
    assert (check.samples, check.tolerance) == (8, 0.2)
    assert check.max_error == pytest.approx(0.1413, abs=1e-3)


def test_the_error_of_an_arm_is_that_of_a_unit_mass_under_the_same_sampled_control() -> None:
    run = tracking_rollouts(built("puma560"))
    found = re.fullmatch("computed-torque:bandwidth=(.+),period=(.+)", run.attrs["controller"])
    assert found is not None
    bandwidth, period = map(float, found.groups())
    assert bandwidth * period == 20.0
    h, kp, kd = run.attrs["timestep"], bandwidth**2, 2 * bandwidth
    reference, rate = run["qpos_ref"].values, run["qvel_ref"].values
    # the minimum-jerk curve's acceleration, Δ/T² (60 s - 180 s² + 120 s³), from the waypoints that were recorded
    s = np.arange(500) * h / period % 1.0
    way = np.repeat(reference[:, [250, 500]] - reference[:, [0, 250]], 250, axis=1)
    acceleration = way * (60 * s - 180 * s**2 + 120 * s**3)[None, :, None] / period**2
    q, v = reference[:, 0].copy(), rate[:, 0].copy()
    for k in range(500):
        v += h * (acceleration[:, k] + kd * (rate[:, k] - v) + kp * (reference[:, k] - q))
        q += h * v
        np.testing.assert_allclose(run["qpos"].values[:, k + 1], q, rtol=0, atol=1e-11)


def test_arms_with_weak_motors_follow_slower_references() -> None:
    spec, strong = load_robot("ssrms"), built("ssrms")
    rows = tuple(
        replace(row, limits=replace(row.limits, effort=0.1 * joint.effort))
        for row, joint in zip(spec.rows, strong.joints, strict=True)
    )
    run = tracking_rollouts(build_model(replace(spec, rows=rows)))
    assert run.attrs["controller"] == "computed-torque:bandwidth=5,period=4"
    assert run.attrs["timestep"] == 4 / 250
    assert not run["saturation"].values.any()


@pytest.mark.slow
@pytest.mark.parametrize("robot", COSTLY_NAMES)
def test_assumed_motors_are_strong_enough_for_the_default_references(robot: str) -> None:
    model = built(robot)
    assumed = all("effort" in joint.assumed for joint in model.moving_joints)
    run = tracking_rollouts(model)
    assert not run["saturation"].values.any()
    assert not assumed or run.attrs["controller"] == "computed-torque:bandwidth=20,period=1"


@pytest.mark.slow
@pytest.mark.parametrize("robot", COSTLY_NAMES)
def test_every_joint_follows_with_the_options_that_controllers_have_by_default(robot: str) -> None:
    # as docs/controllers.md says
    model = without_contacts(without_dry_friction(built(robot)))
    for controller, most in (("computed-torque", 0.003), ("sine", 0.1)):
        run = rollout(model, rollouts=8, duration=3.0, controller=controller, start="random", seed=3)
        error = np.abs(run["qpos"].values - run["qpos_ref"].values).max(axis=(0, 1))
        assert error.max() < most, dict(zip(run["joint"].values, error, strict=True))
        assert not run["saturation"].values.any()


def test_motors_that_are_too_weak_for_any_motion_are_reported() -> None:
    check = check_tracking(tracking_rollouts(built(WEAK)))
    assert check.ok is None
    assert check.reason == "tracking: the motors are too weak for any motion that was tried"
    assert check.left_out is not None
    assert check.left_out.rollouts == 8


@pytest.mark.slow
def test_an_assumed_effort_that_no_motion_is_slow_enough_for_fails() -> None:
    check = check_tracking(tracking_rollouts(built(WEAK)), {"joint_1"})
    assert check.ok is False
    assert check.reason == "the effort that was assumed for joint_1 is too small; give it in the robot file"


def test_a_controller_that_forgets_coriolis_forces_is_found_out() -> None:
    check = check_tracking(tracking_rollouts(built("puma560"), controller=f"{__package__}.careless:Forgetful"))
    assert check.ok is False
    assert check.max_error is not None
    assert check.max_error > 0.3


def test_dry_friction_that_a_controller_knows_nothing_of_is_found_out() -> None:
    run = rollout(
        built(FRICTION), rollouts=2, steps=200, controller="computed-torque", record=("qpos", "qvel", "reference")
    )
    check = check_tracking(run)
    assert check.ok is False
    assert check.worst is not None
    assert check.reason is not None
    assert check.reason.startswith(f"{check.worst.where} is ")
    assert check.reason.endswith(" of its motion in a time step (tolerance 0.2)")


def test_what_is_not_finite_is_off_its_reference() -> None:
    run = tracking_rollouts(built("planar_2r"))
    run["qpos"][3, -1, 1] = np.nan
    check = check_tracking(run)
    assert (check.ok, check.max_error) == (False, np.inf)


def test_a_joint_at_rest_is_close_to_its_reference() -> None:
    still = """\
name: still
convention: standard
joints:
  - {type: revolute, a: 0.4, limits: {position: [-2, 2]}}
  - {type: revolute, a: 0.3, limits: {position: [0.5, 0.500000000000001]}}
"""
    assert check_tracking(tracking_rollouts(built(still))).ok
