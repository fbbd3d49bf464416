from __future__ import annotations

import dataclasses
import xml.etree.ElementTree as ET
from itertools import pairwise

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.model.actuators import gravity_loads, seen_inertias
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.links import LinkSpec, PayloadSpec, ToolSpec
from dh2sim.robot.row import Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.model.samples import compiled
from tests.sample_robots import NAMES, ODD, ODD_ROBOT, PRISMATIC, REVOLUTE, STANDARD, in_limits, model
from tests.strategies import robot_specs

SIDEWAYS = read_only([3.0, -4.0, -7.5])


def errors(built: RobotModel, count: int) -> tuple[float, float]:
    """Greatest errors of loads and inertias against MuJoCo, as shares of the greatest of each."""
    mj = compiled(built)
    mj.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data, full = mujoco.MjData(mj), np.zeros((mj.nv, mj.nv))
    bodies = built.bodies
    loads: list[Array] = []
    inertias: list[Array] = []
    for q in in_limits(built, count, seed=7):
        data.qpos[:] = q
        mujoco.mj_forward(mj, data)
        mujoco.mj_fullM(mj, data, full)
        found = np.array(gravity_loads(built.chain, bodies, q[None], built.spec.gravity)[0])
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


@settings(max_examples=min(30, settings().max_examples))
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
    level = gravity_loads(built.chain, bodies, read_only([[0, 0]]), built.spec.gravity)[0]
    hanging = gravity_loads(built.chain, bodies, read_only([[0, -np.pi / 2]]), built.spec.gravity)[0]
    body = bodies[1]
    assert body is not None
    assert level == pytest.approx((0.0, body.mass * 9.81 * float(body.com[0])), abs=1e-12)
    assert hanging == pytest.approx((0.0, 0.0), abs=1e-12)


def test_joints_of_massless_links_are_held_by_nothing() -> None:
    built = model("stanford")
    nothing = [None] * len(built.links)
    q = in_limits(built, 1, seed=0)[0]
    assert gravity_loads(built.chain, nothing, q[None], built.spec.gravity)[0] == (0.0,) * 6
    assert seen_inertias(built.chain, nothing, q) == (0.0,) * 6


def assert_strong_enough(built: RobotModel, count: int) -> None:
    bodies = [link.inertial for link in built.links]
    for q in in_limits(built, count, seed=8):
        loads = gravity_loads(built.chain, bodies, q[None], built.spec.gravity)[0]
        for joint, load in zip(built.moving_joints, loads, strict=True):
            if "effort" in joint.assumed:
                assert 2 * abs(load) <= joint.effort * (1 + 1e-9)


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_assumed_effort_lifts_twice_the_arm_in_any_pose(name: str) -> None:
    assert_strong_enough(model(name), 100)


@settings(max_examples=min(40, settings().max_examples))
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


def loaded(payload: PayloadSpec, tool: ToolSpec | None = None) -> RobotModel:
    """An odd arm, empty-handed or with a tool, that is to carry something."""
    links = [LinkSpec(mass=mass, com=read_only([0.05, 0.02, -0.03])) for mass in (4.0, 2.0, 0.3)]
    rows = (
        Row(type=REVOLUTE, convention=STANDARD, d=0.3, alpha=ODD, link=links[0]),
        Row(type=REVOLUTE, convention=STANDARD, a=0.4, alpha=-0.9, d=0.1, link=links[1]),
        Row(type=REVOLUTE, convention=STANDARD, a=0.2, alpha=0.3, d=0.05, link=links[2]),
    )
    frame = ToolSpec(xyz=read_only([0.03, 0.0, 0.1]), rpy=read_only([0.4, 0.0, -0.2]))
    return build_model(RobotSpec(name="loaded", rows=rows, tool=tool or frame, payload=payload))


def test_a_payload_counts_like_a_tool_of_the_same_mass_and_place() -> None:
    carries = loaded(PayloadSpec(mass=1.5))
    assert carries.payload is not None
    body = carries.payload
    T = carries.chain.T_dhn_tool0
    radius = (3 * 1.5 / (4 * np.pi * 1000)) ** (1 / 3)
    np.testing.assert_allclose(body.com, T[:3, 3] + radius * T[:3, 2], rtol=0, atol=1e-3 * radius)
    np.testing.assert_allclose(body.inertia, 0.4 * 1.5 * radius**2 * np.eye(3), rtol=1e-2, atol=1e-12)
    tool = ToolSpec(
        xyz=carries.spec.tool.xyz, rpy=carries.spec.tool.rpy, mass=body.mass, com=body.com, inertia=body.inertia
    )
    holds = loaded(PayloadSpec(mass=0.0), tool)
    assert holds.payload is None
    assert holds.mass == pytest.approx(carries.mass + 1.5, rel=1e-15)
    for one, other in zip(carries.joints, holds.joints, strict=True):
        assert one.limits.effort == other.limits.effort
        assert (one.actuator.kp, one.actuator.kv) == (other.actuator.kp, other.actuator.kv)
        assert one.duty.load == pytest.approx(other.duty.load, rel=1e-12)
    empty = loaded(PayloadSpec(mass=0.0))
    assert all(
        light.effort < heavy.effort for light, heavy in zip(empty.moving_joints, carries.moving_joints, strict=True)
    )


def test_a_payload_that_is_not_given_is_a_fifth_of_the_moving_mass() -> None:
    built = loaded(PayloadSpec())
    assert built.payload is not None
    assert built.payload.mass == pytest.approx(0.2 * 6.3, rel=1e-15)
    beside = loaded(PayloadSpec(mass=1.0, com=read_only([0.1, -0.2, 0.3]))).payload
    assert beside is not None
    assert beside.com.tolist() == [0.1, -0.2, 0.3]


@pytest.mark.parametrize("name", NAMES)
def test_no_joint_is_given_next_to_nothing(name: str) -> None:
    turning = [joint for joint in model(name).moving_joints if joint.type.turns]
    for before, joint in pairwise(turning):
        if "effort" in before.assumed and "effort" in joint.assumed:
            assert joint.effort >= 0.18 * before.effort  # rounded up to two digits, both
        if before.actuator.assumed and joint.actuator.assumed:
            assert joint.actuator.kp >= 0.198 * before.actuator.kp
            assert joint.actuator.kv >= 0.198 * before.actuator.kv


@pytest.mark.parametrize("name", ["puma560", "staubli_tx2_60", "arm_5r"])
def test_an_arm_with_its_payload_does_not_sag_visibly(name: str) -> None:
    built = model(name)
    assert built.payload is not None
    root = ET.fromstring(to_mjcf(built))
    last = next(body for body in root.iter("body") if body.get("name") == built.links[-1].name)
    T = built.joints[-1].T_joint_dh
    com, turned = T[:3, :3] @ built.payload.com + T[:3, 3], built.payload.inertia[0, 0]
    load = ET.SubElement(last, "body", pos=" ".join(map(repr, com.tolist())))
    ET.SubElement(
        load, "inertial", pos="0 0 0", mass=repr(built.payload.mass), diaginertia=" ".join([repr(float(turned))] * 3)
    )
    mj = mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))
    mj.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(mj)
    for q in in_limits(built, 3, seed=2):
        mujoco.mj_resetData(mj, data)
        data.qpos[:] = data.ctrl[:] = q
        mujoco.mj_step(mj, data, 1500)
        assert np.abs(data.qpos - q).max() < 0.011
        assert np.abs(data.qvel).max() < 1e-3
