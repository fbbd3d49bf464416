"""Kinematics of what is read from an MJCF, against MuJoCo's own."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from dh2sim.formats.mjcf.read import read_mjcf
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.robot.row import ActuatorType, JointType
from tests.formats.mjcf.reading import BALL, arm_text, model_text, read_text, residual
from tests.sample_robots import NAMES, model


@pytest.mark.parametrize("name", NAMES)
def test_an_exported_robot_is_read_back(name: str, tmp_path: Path) -> None:
    built = model(name)
    path = tmp_path / f"{name}.xml"
    path.write_text(to_mjcf(built), encoding="utf-8")
    robot = read_mjcf(path, file=path.name)
    mj = mujoco.MjModel.from_xml_path(str(path))
    links = [link.name for joint, link in zip(built.joints, built.links, strict=True) if joint.type.moves]
    scale = 1.0 + float(np.abs(mj.body_pos).sum())
    assert residual(robot, mj, "base_link", [*links, "tool0"]) < 1e-14 * robot.chain.n * scale
    assert robot.name == built.name
    assert robot.description == f"MJCF {name}.xml, from base_link to tool0"
    assert [link.name for link in robot.links] == links
    moving = built.moving_joints
    assert [joint.name for joint in robot.chain.joints] == [joint.name for joint in moving]
    assert [joint.type for joint in robot.chain.joints] == [joint.type for joint in moving]
    for limits, joint in zip(robot.limits, moving, strict=True):
        expected = joint.position_range
        assert limits.position == expected
        assert limits.effort == (None if "effort" in joint.assumed else joint.effort)
        assert limits.velocity is None
    for dynamics, joint in zip(robot.dynamics, moving, strict=True):
        found = (dynamics.damping, dynamics.friction, dynamics.armature)
        assert found == (joint.dynamics.damping, joint.dynamics.friction, joint.dynamics.armature)
    np.testing.assert_array_equal(robot.gravity, built.spec.gravity)


@pytest.mark.parametrize("name", NAMES)
def test_masses_and_actuators_of_an_exported_robot_are_read_back(name: str, tmp_path: Path) -> None:
    built = model(name)
    robot = read_text(tmp_path, to_mjcf(built))
    assert robot.actuators is not None
    for found, joint in zip(robot.actuators, built.moving_joints, strict=True):
        assert found.type is joint.actuator.type
        if found.type is ActuatorType.POSITION:
            assert (found.kp, found.kv) == (joint.actuator.kp, joint.actuator.kv)
    if len(built.links) != len(robot.links):
        return  # fixed rows are merged: see the tests of masses
    for link, built_link in zip(robot.links, built.links, strict=True):
        assert (link.mass is None) == (built_link.inertial is None)
        if built_link.inertial is not None:
            assert link.mass == built_link.inertial.mass
            assert link.com is not None
            assert link.inertia is not None
            np.testing.assert_allclose(link.com, built_link.inertial.com, rtol=0, atol=1e-15)
            trace = np.trace(built_link.inertial.inertia)
            np.testing.assert_allclose(link.inertia, built_link.inertial.inertia, rtol=0, atol=1e-11 * trace)


DEGREES = """
<compiler angle="degree" eulerseq="ZyX"/>
<default><joint damping="1"/><default class="y"><joint axis="0 1 0" range="-120 45"/></default></default>
"""


def test_defaults_euler_sequences_and_degrees_are_mujocos_business(tmp_path: Path) -> None:
    bodies = f"""
    <frame pos="1 2 3" euler="10 20 30">
      <body name="base" childclass="y" pos="0.1 0.2 0.3" axisangle="1 2 3 40">
        <frame euler="40 50 60"><body name="one" pos="0 0 0.4"><joint name="a" pos="0.1 -0.2 0.3"/>{BALL}
          <body name="between" zaxis="1 1 1" pos="0.2 0 0">{BALL}
            <body name="two" xyaxes="0 1 0 1 0 1" pos="0 0.7 0"><joint name="b" axis="1 2 3" pos="0 0.3 0"/>{BALL}
              <body name="flange" pos="0.3 0 0.1" euler="1 2 3"><site name="tip" euler="70 80 90" pos="0 0 1"/></body>
            </body></body></body></frame></body></frame>"""
    text = model_text(bodies, DEGREES)
    robot = read_text(tmp_path, text)
    mj = mujoco.MjModel.from_xml_string(text)
    assert residual(robot, mj, "base", ["one", "two", "tip"]) < 1e-14
    assert [limits.position for limits in robot.limits] == [tuple(np.deg2rad([-120, 45]).tolist())] * 2
    assert robot.dynamics[0].damping == 1.0
    assert "The tip is the site 'tip' on 'flange', the only one on the last link." in robot.notes


def test_right_angles_come_out_exact(tmp_path: Path) -> None:
    half = 0.5**0.5
    bodies = f"""<body name="base"><body name="l1" quat="{half} {half} 0 0"><joint name="a"/>{BALL}
        <body name="l2" euler="0 -90 0"><joint name="b"/>{BALL}
          <body name="l3" quat="0.5 0.5 0.5 0.5"><joint name="c"/>{BALL}
            <site name="tip" quat="0 3 0 3"/></body></body></body></body>"""
    robot = read_text(tmp_path, model_text(bodies))
    poses = [*(joint.T_parent_link for joint in robot.chain.joints), robot.chain.T_link_tip]
    for T in poses:
        assert set(np.abs(T).ravel().tolist()) == {0.0, 1.0}


def test_a_reference_shifts_the_coordinate_of_hinges_and_slides(tmp_path: Path) -> None:
    bodies = f"""<body name="base"><body name="one" pos="0.3 0 0">
        <joint name="a" pos="0.1 0.2 0" axis="0 1 1" ref="35"/>{BALL}
        <body name="two" pos="0 0 1"><joint name="b" type="slide" axis="1 0 1" pos="1 1 1" ref="0.25"/>{BALL}
          </body></body></body>"""
    text = model_text(bodies)
    robot = read_text(tmp_path, text)
    assert residual(robot, mujoco.MjModel.from_xml_string(text), "base", ["one", "two", "two"]) < 1e-14
    assert [joint.type for joint in robot.chain.joints] == [JointType.CONTINUOUS, JointType.PRISMATIC]


def test_several_joints_of_one_body_move_it_in_order(tmp_path: Path) -> None:
    bodies = f"""<body name="base" pos="0 1 0"><body name="cart" pos="0.3 0 0.1" euler="10 20 30">
        <joint name="x" type="slide" axis="1 0 0" ref="0.1"/><joint name="y" type="slide" axis="1 1 0"/>
        <joint name="turn" axis="0 0.6 0.8" pos="0.1 0.2 0.3" ref="-20"/>
        <joint name="nod" axis="1 0 0" pos="0 0 0.5"/>
        {BALL}<body name="two" pos="0 0 1"><joint name="b" axis="0 1 0"/>{BALL}</body></body></body>"""
    text = model_text(bodies)
    robot = read_text(tmp_path, text)
    frames = [None, None, None, "cart", "two", "two"]
    assert residual(robot, mujoco.MjModel.from_xml_string(text), "base", frames) < 1e-14
    assert [link.name for link in robot.links] == ["cart_x", "cart_y", "cart_turn", "cart", "two"]
    assert [link.mass is None for link in robot.links] == [True, True, True, False, False]
    assert (
        "Bodies with several joints were split; the links between have no mass: 'cart' ('x', 'y', 'turn', 'nod')."
        in robot.notes
    )


def test_copies_are_read_as_mujoco_names_them(tmp_path: Path) -> None:
    bodies = f"""<body name="base"><replicate count="2" offset="1 0 0" euler="0 0 30">
        <body name="arm"><joint name="a"/>{BALL}<body name="fore" pos="0 0 1"><joint name="b" axis="1 0 0"/>{BALL}
        </body></body></replicate></body>"""
    text = model_text(bodies)
    robot = read_text(tmp_path, text, tip="fore1")
    mj = mujoco.MjModel.from_xml_string(text)
    assert [joint.name for joint in robot.chain.joints] == ["a1", "b1"]
    assert residual(robot, mj, "base", ["arm1", "fore1", "fore1"]) < 1e-14


def test_nested_includes_are_read(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "outer.xml").write_text(
        f'<x><body name="one" euler="0 30 0"><joint name="a"/>{BALL}<include file="inner.xml"/></body></x>'
    )
    (tmp_path / "parts" / "inner.xml").write_text(
        f'<x><body name="two" pos="0 1 0"><joint name="b"/>{BALL}<site name="tcp" pos="0 0 0.2"/></body></x>'
    )
    robot = read_text(tmp_path, model_text('<body name="base"><include file="parts/outer.xml"/></body>'))
    mj = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    assert residual(robot, mj, "base", ["one", "two", "tcp"]) < 1e-14


def test_attached_models_are_read_with_their_own_meshes(tmp_path: Path) -> None:
    (tmp_path / "arm").mkdir()
    (tmp_path / "arm" / "arm.xml").write_text(arm_text(3, '<site name="tip" pos="0 0 1"/>'))
    text = model_text(
        '<body name="table" pos="0 0 0.7"><attach model="arm" body="base" prefix="left_"/></body>',
        '<asset><model name="arm" file="arm/arm.xml"/></asset>',
    )
    robot = read_text(tmp_path, text)
    mj = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    frames: list[str | None] = ["left_link_1", "left_link_2", "left_link_3", "left_tip"]
    assert residual(robot, mj, "table", frames) < 1e-14


def test_what_a_compiler_may_drop_is_kept(tmp_path: Path) -> None:
    flange = '<body name="flange" pos="0 0 0.1"><geom contype="0" conaffinity="0" size="0.1" rgba="1 0 0 1"/></body>'
    text = arm_text(1, flange, before='<compiler fusestatic="true" discardvisual="true"/>')
    robot = read_text(tmp_path, text, base="base", tip="flange")
    np.testing.assert_array_equal(robot.chain.T_link_tip[:3, 3], [0, 0, 0.1])
    assert robot.links[0].color == (1.0, 0.0, 0.0, 1.0)


def test_axes_and_points_are_those_of_the_file(tmp_path: Path) -> None:
    one = f'<body name="one"><joint name="a" pos="0.1 0.2 0.3" axis="0 0 -2"/>{BALL}</body>'
    robot = read_text(tmp_path, model_text(f'<body name="base">{one}</body>'))
    np.testing.assert_array_equal(robot.chain.joints[0].axis, [0, 0, -1])
    np.testing.assert_array_equal(robot.chain.joints[0].point, [0.1, 0.2, 0.3])


def test_joints_without_names_are_numbered(tmp_path: Path) -> None:
    bodies = f"""<body><body><joint/>{BALL}<body pos="0 0 1"><joint name="joint_1"/>{BALL}<body><joint/>{BALL}</body>
        </body></body></body>"""
    robot = read_text(tmp_path, f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    assert [joint.name for joint in robot.chain.joints] == ["joint_1_", "joint_1", "joint_3"]
    assert [link.name for link in (robot.base, *robot.links)] == ["base", "link_1", "link_2", "link_3"]
    assert robot.name == "robot"
    assert robot.description == "MJCF robot.xml, from base to link_3"
    assert "Joints without a name are called 'joint_1_', 'joint_3'." in robot.notes


def test_gravity_is_turned_into_the_base(tmp_path: Path) -> None:
    arm = f'<body name="one"><joint name="a"/>{BALL}</body>'
    text = model_text(f'<body name="base" euler="90 0 0">{arm}</body>', '<option gravity="0 0 -9.81"/>')
    robot = read_text(tmp_path, text)
    np.testing.assert_allclose(robot.gravity, [0.0, -9.81, 0.0], rtol=0, atol=1e-15)
    assert "Gravity is (0, -9.81, 0) m/s² in the base 'base', which is turned in the world." in robot.notes
    off = read_text(tmp_path, model_text(arm, '<option><flag gravity="disable"/></option>'))
    np.testing.assert_array_equal(off.gravity, [0, 0, 0])
    assert "The file switches gravity off." in off.notes
