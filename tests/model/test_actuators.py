from __future__ import annotations

import dataclasses

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.model.actuators import gravity_loads, seen_inertias
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.spec import RobotSpec, Row
from dh2sim.typing import Array, read_only
from tests.model.samples import compiled
from tests.sample_robots import NAMES, ODD_ROBOT, PRISMATIC, REVOLUTE, STANDARD, in_limits, model
from tests.strategies import robot_specs

SIDEWAYS = read_only([3.0, -4.0, -7.5])


def errors(built: RobotModel, count: int) -> tuple[float, float]:
    """Greatest errors of loads and inertias against MuJoCo, as shares of the greatest of each."""
    mj = compiled(built)
    mj.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data, full = mujoco.MjData(mj), np.zeros((mj.nv, mj.nv))
    bodies = [link.inertial for link in built.links]
    loads: list[Array] = []
    inertias: list[Array] = []
    for q in in_limits(built, count, seed=7):
        data.qpos[:] = q
        mujoco.mj_forward(mj, data)
        mujoco.mj_fullM(mj, data, full)
        found = np.array(gravity_loads(built.chain, bodies, q, built.spec.gravity))
        loads.append(np.array([found, data.qfrc_bias]))
        seen = np.array(seen_inertias(built.chain, bodies, q))
        inertias.append(np.array([seen, np.diag(full) - mj.dof_armature]))
    load, inertia = np.array(loads), np.array(inertias)
    heaviest = max(float(np.abs(load).max()), 1e-3 * built.mass)
    return (
        float(np.abs(load[:, 0] - load[:, 1]).max()) / heaviest,
        float(np.abs(inertia[:, 0] - inertia[:, 1]).max()) / float(inertia.max()),
    )


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_gravity_loads_and_seen_inertias_equal_those_of_mujoco(name: str) -> None:
    load, inertia = errors(model(name), 20)
    assert load < 1e-11
    assert inertia < 1e-11


def test_gravity_may_pull_sideways() -> None:
    load, _ = errors(build_model(dataclasses.replace(ODD_ROBOT, gravity=SIDEWAYS)), 20)
    assert load < 1e-12


@settings(max_examples=30)
@given(robot_specs())
def test_gravity_loads_and_seen_inertias_of_any_robot_equal_those_of_mujoco(spec: RobotSpec) -> None:
    # MuJoCo takes frames for one that are less than 1e-6 apart, and random robots have such
    load, inertia = errors(build_model(spec), 2)
    assert load < 1e-5
    assert inertia < 1e-5


def test_a_hanging_arm_is_held_by_nothing_and_a_level_one_by_its_weight() -> None:
    # z level, x along the arm: theta 0 is level, -90 degrees hangs
    up = Row(name="mount", type=REVOLUTE, convention=STANDARD, alpha=np.pi / 2)
    arm = Row(name="arm", type=REVOLUTE, convention=STANDARD, a=0.5)
    built = build_model(RobotSpec(name="lever", rows=(up, arm)))
    bodies = [link.inertial for link in built.links]
    level = gravity_loads(built.chain, bodies, read_only([0, 0]), built.spec.gravity)
    hanging = gravity_loads(built.chain, bodies, read_only([0, -np.pi / 2]), built.spec.gravity)
    body = bodies[1]
    assert body is not None
    assert level == pytest.approx((0.0, body.mass * 9.81 * float(body.com[0])), abs=1e-12)
    assert hanging == pytest.approx((0.0, 0.0), abs=1e-12)


def test_joints_of_massless_links_are_held_by_nothing() -> None:
    built = model("stanford")
    nothing = [None] * len(built.links)
    q = in_limits(built, 1, seed=0)[0]
    assert gravity_loads(built.chain, nothing, q, built.spec.gravity) == (0.0,) * 6
    assert seen_inertias(built.chain, nothing, q) == (0.0,) * 6


def assert_strong_enough(built: RobotModel, count: int) -> None:
    bodies = [link.inertial for link in built.links]
    for q in in_limits(built, count, seed=8):
        loads = gravity_loads(built.chain, bodies, q, built.spec.gravity)
        for joint, load in zip(built.moving_joints, loads, strict=True):
            if "effort" in joint.assumed:
                assert 2 * abs(load) <= joint.effort * (1 + 1e-9)


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_assumed_effort_lifts_twice_the_arm_in_any_pose(name: str) -> None:
    assert_strong_enough(model(name), 100)


@settings(max_examples=40)
@given(robot_specs())
def test_assumed_effort_lifts_twice_any_robot_in_any_pose(spec: RobotSpec) -> None:
    assert_strong_enough(build_model(spec), 5)


def test_assumed_effort_counts_the_assumed_travel_of_slides() -> None:
    rows = (
        Row(name="turn", type=REVOLUTE, convention=STANDARD, alpha=np.pi / 2),
        Row(name="lift", type=REVOLUTE, convention=STANDARD, alpha=np.pi / 2),
        Row(name="slide", type=PRISMATIC, convention=STANDARD, d=0.1),
        Row(name="tip", type=REVOLUTE, convention=STANDARD, a=0.8),
    )
    assert_strong_enough(build_model(RobotSpec(name="boom", rows=rows)), 500)
