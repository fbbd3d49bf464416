from __future__ import annotations

import dataclasses
import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.errors import NotFiniteError
from dh2sim.formats.mjcf.scene import to_scene
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.formats.urdf.write import to_urdf
from dh2sim.formats.xml_write import number, numbers
from dh2sim.model.build import build_model
from dh2sim.model.mass import MassProperties
from dh2sim.robot.links import LinkSpec
from dh2sim.robot.row import Limits, Row
from dh2sim.robot.spec import RobotSpec, SourceFile
from dh2sim.typing import read_only
from tests.formats.readers import in_check_urdf, in_mujoco, parsed
from tests.sample_robots import CONTINUOUS, FIXED, ODD_ROBOT, REVOLUTE, STANDARD, model

SMALLEST = 2.2250738585072014e-308


@given(st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=False))
def test_a_number_reads_back_as_the_same_double(value: float) -> None:
    assert struct.pack("d", float(number(value))) == struct.pack("d", value + 0.0)


def test_numbers_are_written_as_short_as_they_can_be() -> None:
    assert numbers([0.1, 1e-20, 12345678.9, np.float64(math.pi), 3]) == ("0.1 1e-20 12345678.9 3.141592653589793 3.0")


def test_minus_zero_is_written_as_zero() -> None:
    assert number(-0.0) == "0.0"


@pytest.mark.parametrize("value", [5e-324, -1e-310, SMALLEST / 2])
def test_a_number_that_mujoco_cannot_read_because_it_is_so_small_is_written_as_zero(value: float) -> None:
    assert number(value) == "0.0"


@pytest.mark.parametrize("value", [SMALLEST, -SMALLEST, 1.7e308])
def test_mujoco_reads_the_smallest_and_greatest_numbers_that_are_written(value: float) -> None:
    mj = in_mujoco(f'<mujoco><worldbody><body pos="{number(value)} 0 0"/></worldbody></mujoco>')
    assert mj.body_pos[1, 0] == value


NAMES = [
    "plain.yaml",
    "two--hyphens.yaml",
    "---",
    "-->",
    "ends in a hyphen-",
    "<&>\"'.yaml",
    "tab\tnew\nline\rbell\x07.yaml",
    "ärm 机器人 🤖.yaml",
    "not utf-8 \udcff\ud800.yaml",
    "\ufffe\uffff.yaml",
]


@pytest.mark.slow
@pytest.mark.parametrize("source", NAMES)
def test_a_comment_is_safe_whatever_the_source_is_called(source: str) -> None:
    spec = dataclasses.replace(ODD_ROBOT, source_file=SourceFile(name=source, path=source, text="", sha256="0" * 64))
    built = build_model(spec)
    for text in (to_urdf(built), to_mjcf(built), to_scene(built)):
        text.encode("utf-8")
        parsed(text)
    in_check_urdf(to_urdf(built))
    in_mujoco(to_mjcf(built))


def test_a_comment_is_safe_whatever_the_robot_and_its_joints_are_called() -> None:
    rows = (
        Row(name="a--b-", type=REVOLUTE, convention=STANDARD, a=0.3),
        Row(name="c---", type=CONTINUOUS, convention=STANDARD, a=0.3),
    )
    built = build_model(RobotSpec(name="my--arm-", rows=rows))
    root = parsed(to_urdf(built))
    in_check_urdf(to_urdf(built))
    in_mujoco(to_mjcf(built))
    assert root.attrib["name"] == "my--arm-"
    assert {"a--b-", "c---"} <= {joint.attrib["name"] for joint in root.iter("joint")}


def header(text: str) -> list[str]:
    lines = text.split("<!--\n", 1)[1].split("\n-->", 1)[0].splitlines()
    return [line.removeprefix("  ") for line in lines]


def test_the_header_names_the_source_and_its_hash_and_what_was_estimated_and_assumed() -> None:
    source = SourceFile(name="arm.yaml", path="here/arm.yaml", text="", sha256="0123abcd")
    weighed = LinkSpec(mass=1.0, com=read_only([0, 0, 0]), inertia=read_only(np.eye(3)))
    limits = Limits(position=(-1.0, 1.0), velocity=1.0, effort=1.0)
    rows = (
        Row(name="a", type=REVOLUTE, convention=STANDARD, a=0.3),
        Row(name="b", type=REVOLUTE, convention=STANDARD, a=0.3, limits=limits),
        Row(name="c", type=CONTINUOUS, convention=STANDARD, a=0.3, link=weighed),
        Row(name="d", type=FIXED, convention=STANDARD, a=0.3),
        Row(name="e", type=REVOLUTE, convention=STANDARD, a=0.3, link=LinkSpec(mass=2.0)),
    )
    built = build_model(RobotSpec(name="arm", rows=rows, source_file=source))
    begin = [
        "arm: made by dh2sim from arm.yaml (SHA-256 0123abcd).",
        "Do not edit: change the robot file and export again.",
    ]
    estimated = [
        "Estimated from the shapes, not measured: mass, com, inertia of link_1 to link_2, link_4.",
        "Estimated from the shapes, not measured: com, inertia of link_5.",
    ]
    assumed = [
        "Assumed, not given: position, velocity, effort limits of a, e.",
        "Assumed, not given: velocity, effort limits of c.",
    ]
    assert [entry.sentence for entry in built.estimates] == estimated
    assert [entry.sentence for entry in built.assumptions] == assumed
    assert header(to_mjcf(built)) == begin + estimated
    assert header(to_scene(built)) == begin
    assert header(to_urdf(built)) == begin + estimated + assumed


def test_the_header_says_where_a_robot_was_made_in_code() -> None:
    assert header(to_mjcf(model("odd")))[0] == "odd: made by dh2sim from a robot made in code."


def test_limits_that_are_assumed_of_all_joints_are_said_in_one_line() -> None:
    (assumed,) = model("planar_2r").assumptions
    assert assumed.sentence == "Assumed, not given: velocity, effort limits of all joints."
    assert (assumed.what, assumed.where) == (("velocity", "effort"), ("joint_1", "joint_2"))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_is_never_written(value: float) -> None:
    """Whatever a defect makes of a model, its place is named and nothing is written."""
    built = model("planar_2r")
    second = dataclasses.replace(built.joints[1], actuator=dataclasses.replace(built.joints[1].actuator, kp=value))
    with pytest.raises(NotFiniteError) as refusal:
        to_mjcf(dataclasses.replace(built, joints=(built.joints[0], second)))
    assert str(refusal.value) == (
        f"mujoco.actuator.position[joint_2_position].kp: {value} is not a finite number, and is not written. This is "
        "a defect of dh2sim: please report it with the robot file"
    )
    heavy = dataclasses.replace(
        built.links[0], inertial=MassProperties(mass=1.0, com=np.array([0, 0, value]), inertia=np.eye(3))
    )
    with pytest.raises(NotFiniteError, match=r"^robot\.link\[link_1\]\.inertial\.origin\.xyz: 0\.0 0\.0 "):
        to_urdf(dataclasses.replace(built, links=(heavy, built.links[1])))
