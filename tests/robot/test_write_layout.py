"""Robot files are written to be read by people too: tables as tables, short parts on one line."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from dh2sim.robot.links import BaseSpec, LinkSpec, MeshSpec, Pose
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.row import ActuatorSpec, ActuatorType, Convention, JointType, Limits, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.robot.write import robot_file_text
from dh2sim.typing import read_only
from tests.robot.files import FULL, robot


def test_a_robot_file_in_its_own_units_keeps_its_numbers() -> None:
    text = robot_file_text(robot(FULL), header=["Made by hand.", "", "Twice."], length=LengthUnit.MM)
    assert text == (
        """\
# Made by hand.
#
# Twice.
name: full
description: Every key there is
source: made up
convention: modified
units: {angle: deg, length: mm}
base: {xyz: [0, 0, 100], rpy: [0, 0, 90], color: [1, 1, 1]}
tool: {xyz: [0, 0, 10], rpy: [0, 45, 0]}
gravity: [0, 0, -1.62]
joints:
  - name: turn
    type: revolute
    a: 200
    alpha: -90
    d: 400
    theta: 45
    convention: standard
    flip: true
    limits: {position: [-170, 170], velocity: 90, effort: 50}
    dynamics: {damping: 0.1, friction: 0.2, armature: 0.3}
    link:
      mass: 9.29
      com: [1, 2, 3]
      inertia: {ixx: 2, iyy: 3, izz: 4, ixy: 0.1, ixz: 0.2, iyz: 0.3}
      density: 2700
      radius: 40
      color: [0.8, 0.4, 0.1, 0.5]
    actuator: {type: position, kp: 7, kv: 10}
  - name: joint_2
    type: prismatic
    a: 10
    alpha: 0
    d: 0
    theta: 0
    limits: {position: [0, 300], velocity: 100}
    actuator: {type: position, kp: 100, kv: 10}
  - {name: joint_3, type: fixed,      a: 0, alpha: 0, d: 5, theta: 0}
  - {name: joint_4, type: continuous, a: 0, alpha: 0, d: 0, theta: 0, actuator: {type: motor}}
configurations:
  home: [90, 100, 90]
"""
    )


def test_a_table_of_short_rows_has_aligned_columns_and_no_default_names() -> None:
    text = robot_file_text(load_robot("stanford"))
    assert text[text.index("convention:") :] == (
        """\
convention: standard
units: {angle: deg, length: m}
joints:
  - {type: revolute,  a: 0, alpha: -90, d:  0.4, theta: 0, limits: {position: [-170, 170]}}
  - {type: revolute,  a: 0, alpha:  90, d: 0.15, theta: 0, limits: {position: [-170, 170]}}
  - {type: prismatic, a: 0, alpha:   0, d:    0, theta: 0, limits: {position: [0, 1.27]}}
  - {type: revolute,  a: 0, alpha: -90, d:    0, theta: 0, limits: {position: [-170, 170]}}
  - {type: revolute,  a: 0, alpha:  90, d:    0, theta: 0, limits: {position: [-90, 90]}}
  - {type: revolute,  a: 0, alpha:   0, d:  0.3, theta: 0, limits: {position: [-170, 170]}}
configurations:
  zero: [0, 0, 0, 0, 0, 0]
  printed: [45, 60, 0.2, 45, 0, -60]
  home: [30, 50, 0.6, 20, 45, 30]
"""
    )


def _spec(*rows: Row, **more: Any) -> RobotSpec:
    return RobotSpec(name="r", rows=rows, **more)


def _row(index: int = 1, **more: Any) -> Row:
    values = {"name": f"joint_{index}", "type": JointType.REVOLUTE, "convention": Convention.STANDARD, **more}
    return Row(**values)


def _joints(spec: RobotSpec, **more: Any) -> str:
    text = robot_file_text(spec, **more)
    parse_robot(text, directory=more.get("folder"))
    return text[text.index("joints:\n") + len("joints:\n") :]


def test_hayati_rows_have_beta_in_place_of_d_unless_they_slide() -> None:
    hayati = {"convention": Convention.HAYATI, "alpha": math.radians(0.5), "beta": math.radians(-0.25)}
    spec = _spec(
        _row(1, d=0.4, alpha=-math.pi / 2),
        _row(2, a=0.425, **hayati),
        _row(3, type=JointType.PRISMATIC, d=0.1, **hayati),
        _row(4, type=JointType.FIXED, a=0.2, **hayati),
    )
    assert _joints(spec) == (
        """\
  - {type: revolute,  a:     0, alpha: -90, d:      0.4, theta: 0}
  - {type: revolute,  a: 0.425, alpha: 0.5, beta: -0.25, theta: 0, convention: hayati}
  - {type: prismatic, a:     0, alpha: 0.5, beta: -0.25, d:   0.1, theta: 0, convention: hayati}
  - {type: fixed,     a:   0.2, alpha: 0.5, beta: -0.25, theta: 0, convention: hayati}
"""
    )


def test_rows_that_are_too_long_when_aligned_are_written_as_they_are() -> None:
    limits = Limits(position=(-1.0, 1.0))
    spec = _spec(
        _row(name="short", type=JointType.PRISMATIC, limits=limits),
        _row(name="a_long_name_of_a_joint_that_has_none"),
        _row(name="a_long_name_of_a_joint_that_has_limits", limits=limits),
    )
    assert _joints(spec) == (
        """\
  - {name: short, type: prismatic, a: 0, alpha: 0, d: 0, theta: 0, limits: {position: [-1, 1]}}
  - {name: a_long_name_of_a_joint_that_has_none, type: revolute, a: 0, alpha: 0, d: 0, theta: 0}
  - name: a_long_name_of_a_joint_that_has_limits
    type: revolute
    a: 0
    alpha: 0
    d: 0
    theta: 0
    limits: {position: [-57.29577951308232, 57.29577951308232]}
"""
    )


def test_parts_that_do_not_fit_on_a_line_have_a_line_for_each_key(tmp_path: Path) -> None:
    name = "a_mesh_with_a_long_name_that_shows_the_base_of_the_robot.stl"
    (tmp_path / name).write_bytes(b"")
    pose = Pose(xyz=read_only([0.1, 1 / 3, 2 / 3]), rpy=read_only([0, 0, 0.1]))
    base = BaseSpec(pose=pose, mesh=MeshSpec(file=tmp_path / name, scale=0.001, pose=pose))
    text = robot_file_text(_spec(_row(), base=base), folder=tmp_path, angle=AngleUnit.RAD)
    assert text[text.index("base:") : text.index("joints:")] == (
        f"""\
base:
  xyz: [0.1, 0.3333333333333333, 0.6666666666666666]
  rpy: [0, 0, 0.1]
  mesh:
    file: {name}
    scale: 0.001
    xyz: [0.1, 0.3333333333333333, 0.6666666666666666]
    rpy: [0, 0, 0.1]
"""
    )


def test_an_inertia_stays_on_one_line_and_zero_products_are_left_out() -> None:
    inertia = np.diag([1 / 3, 2 / 3, 1 / 7 + 1 / 3])
    inertia[0, 1] = inertia[1, 0] = 1e-5 / 3
    link = LinkSpec(mass=2.0, com=read_only([0, 0, 0]), inertia=read_only(inertia))
    assert _joints(_spec(_row(link=link))).splitlines()[5:] == [
        "    link:",
        "      mass: 2",
        "      com: [0, 0, 0]",
        "      inertia: {ixx: 0.3333333333333333, iyy: 0.6666666666666666, izz: 0.47619047619047616, "
        "ixy: 3.3333333333333337e-6}",
    ]


def test_an_actuator_that_all_moving_joints_have_is_written_once() -> None:
    motor = ActuatorSpec(type=ActuatorType.MOTOR)
    fixed = _row(2, type=JointType.FIXED)
    text = robot_file_text(_spec(_row(1, actuator=motor), fixed, _row(3, actuator=motor)))
    assert text.endswith("theta: 0}\nactuators: {type: motor}\n")


def test_actuators_that_differ_are_written_with_their_joints() -> None:
    strong, weak = ActuatorSpec(kp=100.0, kv=1.5), ActuatorSpec(type=ActuatorType.VELOCITY, kv=0.5)
    assert _joints(_spec(_row(1, actuator=strong), _row(2), _row(3, actuator=weak))) == (
        "  - {type: revolute, a: 0, alpha: 0, d: 0, theta: 0, actuator: {type: position, kp: 100, kv: 1.5}}\n"
        "  - {type: revolute, a: 0, alpha: 0, d: 0, theta: 0}\n"
        "  - {type: revolute, a: 0, alpha: 0, d: 0, theta: 0, actuator: {type: velocity, kv: 0.5}}\n"
    )
