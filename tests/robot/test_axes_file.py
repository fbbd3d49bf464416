"""An axes file becomes joint axes in base_link, in SI units."""

from __future__ import annotations

import dataclasses
import hashlib
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.kinematics.table_oracle import table_frame_poses
from dh2sim.robot.axes_file import AxesSpec, read_axes
from dh2sim.robot.read import load_robot
from dh2sim.robot.row import ActuatorType, Convention, JointType

PUMA = Path(__file__).parents[2] / "docs" / "puma560_axes.yaml"

FULL = """\
name: full
description: Every key there is
source: made up
convention: modified
units: {angle: deg, length: mm}
parameters: {h: 400, a2: h / 2}
axes:
- name: turn
  type: revolute
  point: [1, a2, h]
  direction: [0, 3, 4]
  limits: {position: [-170, 170], velocity: 90, effort: 50}
  dynamics: {damping: 0.1, friction: 0.2, armature: 0.3}
  actuator: {kp: 7}
- {type: prismatic, direction: [0, 0, sin(-pi / 2)], limits: {position: [0, 300], velocity: 100}}
- {type: continuous, point: [0, 0, 0], direction: [-1e-200, 0, 0], actuator: {type: motor}}
tool: {xyz: [0, 0, 10], rpy: [0, 45, 0]}
gravity: [0, 0, -1.62]
configurations: {home: [90, 100, "180 / 2"]}
actuators: {type: position, kp: 100, kv: 10}
"""


def axes(text: str) -> AxesSpec:
    return read_axes(text.encode(), file="a.yaml", directory=Path())


def test_every_key_of_an_axes_file_is_converted_to_si_units() -> None:
    spec = axes(FULL)
    turn, slide, roll = spec.joints
    assert (spec.name, spec.description, spec.source) == ("full", "Every key there is", "made up")
    assert spec.convention is Convention.MODIFIED
    assert (turn.name, turn.type) == ("turn", JointType.REVOLUTE)
    assert turn.point is not None
    assert turn.point.tolist() == [0.001, 0.2, 0.4]
    assert turn.direction.tolist() == [0, 0.6, 0.8]
    assert turn.limits.position == (math.radians(-170), math.radians(170))
    assert (turn.limits.velocity, turn.limits.effort) == (math.pi / 2, 50)
    assert (turn.dynamics.damping, turn.dynamics.friction, turn.dynamics.armature) == (0.1, 0.2, 0.3)
    assert (turn.actuator.type, turn.actuator.kp, turn.actuator.kv) == (ActuatorType.POSITION, 7, 10)
    assert (slide.name, slide.type, slide.point) == ("joint_2", JointType.PRISMATIC, None)
    assert slide.direction.tolist() == [0, 0, -1]
    assert (slide.limits.position, slide.limits.velocity) == ((0, 0.3), 0.1)
    assert (slide.actuator.kp, slide.actuator.kv) == (100, 10)
    assert (roll.name, roll.type) == ("joint_3", JointType.CONTINUOUS)
    assert roll.direction.tolist() == [-1, 0, 0]
    assert (roll.actuator.type, roll.actuator.kp) == (ActuatorType.MOTOR, None)
    assert spec.tool.xyz.tolist() == [0, 0, 0.01]
    assert spec.tool.rpy.tolist() == [0, math.pi / 4, 0]
    assert spec.gravity.tolist() == [0, 0, -1.62]
    assert {name: vector.tolist() for name, vector in spec.configurations.items()} == {
        "home": [math.pi / 2, 0.1, math.pi / 2]
    }
    assert spec.source_file is not None
    assert (spec.source_file.path, spec.source_file.text) == ("a.yaml", FULL)
    assert spec.source_file.sha256 == hashlib.sha256(FULL.encode()).hexdigest()


def test_the_smallest_file_has_defaults() -> None:
    spec = axes("name: r\naxes: [{type: prismatic, direction: [0, 0, 1]}]\n")
    (joint,) = spec.joints
    assert (spec.description, spec.source, spec.convention, dict(spec.configurations)) == ("", "", None, {})
    assert spec.gravity.tolist() == [0, 0, -9.81]
    assert (joint.name, joint.point) == ("joint_1", None)
    assert (joint.limits.position, joint.limits.velocity, joint.limits.effort) == (None, None, None)
    assert (joint.dynamics.damping, joint.dynamics.friction, joint.dynamics.armature) == (0, 0, 0)
    assert (joint.actuator.type, joint.actuator.kp, joint.actuator.kv) == (ActuatorType.POSITION, None, None)


@pytest.mark.parametrize(
    ("last", "tool", "xyz", "rpy"),
    [
        ("type: revolute, point: [100, 200, 300]", "{}", [0.1, 0.2, 0.3], [0, 0, 0]),
        ("type: revolute, point: [100, 200, 300]", "{rpy: [0, 0, 90]}", [0.1, 0.2, 0.3], [0, 0, math.pi / 2]),
        ("type: revolute, point: [100, 200, 300]", "{xyz: [0, 0, 0]}", [0, 0, 0], [0, 0, 0]),
        ("type: prismatic, point: [100, 0, 0]", "{}", [0.1, 0, 0], [0, 0, 0]),
        ("type: prismatic", "{}", [0, 0, 0], [0, 0, 0]),
    ],
)
def test_the_tool_stands_at_the_last_axis_unless_the_file_says_otherwise(
    last: str, tool: str, xyz: list[float], rpy: list[float]
) -> None:
    first = "{type: revolute, point: [9, 9, 9], direction: [1, 0, 0]}"
    spec = axes(
        "name: r\nunits: {angle: deg, length: mm}\n"
        f"axes:\n- {first}\n- {{{last}, direction: [0, 0, 1]}}\ntool: {tool}\n"
    )
    assert (spec.tool.xyz.tolist(), spec.tool.rpy.tolist()) == (xyz, rpy)


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=3, max_size=3).filter(any))
def test_directions_of_any_length_become_unit_vectors(direction: list[float]) -> None:
    (joint,) = axes(f"name: r\naxes: [{{type: prismatic, direction: {direction}}}]\n").joints
    assert np.linalg.norm(joint.direction) == pytest.approx(1, abs=1e-15)
    largest = max(map(abs, direction))
    scaled = [number / largest for number in direction]
    np.testing.assert_allclose(joint.direction * np.linalg.norm(scaled), scaled, rtol=0, atol=1e-15)


def test_nothing_of_the_axes_can_be_written_to() -> None:
    spec = axes(FULL)
    arrays = [spec.tool.xyz, spec.tool.rpy, spec.gravity, *spec.configurations.values()]
    arrays += [joint.direction for joint in spec.joints]
    arrays += [joint.point for joint in spec.joints if joint.point is not None]
    assert len(arrays) == 9
    assert not any(array.flags.writeable for array in arrays)
    with pytest.raises(dataclasses.FrozenInstanceError):
        spec.name = "x"  # type: ignore[misc]


def test_the_axes_of_the_puma_are_those_of_its_standard_table() -> None:
    spec = read_axes(PUMA.read_bytes(), file=PUMA.name, directory=PUMA.parent)
    robot = load_robot("puma560_standard")
    frames = table_frame_poses(robot, np.zeros(6))  # the joint of row i turns about z of frame i - 1
    for joint, frame in zip(spec.joints, frames, strict=False):
        assert joint.point is not None
        np.testing.assert_allclose(joint.direction, frame[:3, 2], rtol=0, atol=1e-15)
        np.testing.assert_allclose(np.cross(joint.point - frame[:3, 3], frame[:3, 2]), 0, rtol=0, atol=1e-15)
    np.testing.assert_allclose(spec.tool.xyz, frames[-1, :3, 3], rtol=0, atol=1e-15)
    np.testing.assert_allclose(frames[-1, :3, :3], np.eye(3), rtol=0, atol=1e-15)
    assert spec.tool.rpy.tolist() == [0, 0, 0]


def test_the_axes_file_of_the_puma_says_what_its_robot_file_says() -> None:
    spec = read_axes(PUMA.read_bytes(), file=PUMA.name, directory=PUMA.parent)
    robot = load_robot("puma560_standard")
    assert (spec.name, spec.convention) == (robot.name, robot.convention)
    assert [joint.limits.position for joint in spec.joints] == [row.limits.position for row in robot.rows]
    assert {name: vector.tolist() for name, vector in spec.configurations.items()} == {
        name: vector.tolist() for name, vector in robot.configurations.items()
    }
