"""A robot file becomes a RobotSpec in SI units, with nothing left to change by accident."""

from __future__ import annotations

import dataclasses
import hashlib
import math
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.robot.row import ActuatorType, Convention, JointType
from dh2sim.robot.spec import RobotSpec
from tests.arrays import arrays_in
from tests.robot.files import FULL, MINIMAL, robot, with_joint


def test_the_smallest_file_has_the_defaults_of_the_contract() -> None:
    spec = robot(MINIMAL)
    (row,) = spec.rows
    assert (spec.name, spec.description, spec.source, spec.convention) == ("r", "", "", Convention.STANDARD)
    assert dict(spec.parameters) == {}
    assert dict(spec.configurations) == {}
    assert spec.gravity.tolist() == [0, 0, -9.81]
    for pose in (spec.base.pose, spec.tool):
        assert pose.xyz.tolist() == pose.rpy.tolist() == [0, 0, 0]
    assert (spec.base.mesh, spec.base.color) == (None, None)
    assert (row.name, row.type, row.convention) == ("joint_1", JointType.REVOLUTE, Convention.STANDARD)
    assert (row.a, row.alpha, row.d, row.theta, row.flip) == (0, 0, 0, 0, False)
    assert (row.limits.position, row.limits.velocity, row.limits.effort) == (None, None, None)
    assert (row.dynamics.damping, row.dynamics.friction, row.dynamics.armature) == (0, 0, 0)
    assert all(getattr(row.link, field.name) is None for field in dataclasses.fields(row.link))
    assert (row.actuator.type, row.actuator.kp, row.actuator.kv) == (ActuatorType.POSITION, None, None)


def test_every_key_of_a_robot_file_is_converted_to_si_units() -> None:
    spec = robot(FULL)
    turn = spec.rows[0]
    assert (spec.name, spec.description, spec.source) == ("full", "Every key there is", "made up")
    assert dict(spec.parameters) == {"d1": 400, "a2": 200}
    assert spec.base.pose.xyz.tolist() == [0, 0, 0.1]
    assert spec.base.pose.rpy.tolist() == [0, 0, math.pi / 2]
    assert list(spec.base.color or ()) == [1, 1, 1, 1]
    assert spec.tool.xyz.tolist() == [0, 0, 0.01]
    assert spec.tool.rpy.tolist() == [0, math.pi / 4, 0]
    assert spec.gravity.tolist() == [0, 0, -1.62]
    assert (turn.name, turn.type, turn.convention) == ("turn", JointType.REVOLUTE, Convention.STANDARD)
    assert (turn.a, turn.alpha, turn.d, turn.theta) == (0.2, -math.pi / 2, 0.4, math.pi / 4)
    assert turn.flip is True
    assert turn.limits.position == (math.radians(-170), math.radians(170))
    assert (turn.limits.velocity, turn.limits.effort) == (math.pi / 2, 50)
    assert (turn.dynamics.damping, turn.dynamics.friction, turn.dynamics.armature) == (0.1, 0.2, 0.3)
    assert turn.link.mass == 9.29
    assert turn.link.com is not None
    assert turn.link.com.tolist() == [0.001, 0.002, 0.003]
    assert turn.link.inertia is not None
    assert turn.link.inertia.tolist() == [[2, 0.1, 0.2], [0.1, 3, 0.3], [0.2, 0.3, 4]]
    assert (turn.link.density, turn.link.radius) == (2700, 0.04)
    assert list(turn.link.color or ()) == [0.8, 0.4, 0.1, 0.5]
    assert [row.name for row in spec.rows] == ["turn", "joint_2", "joint_3", "joint_4"]
    assert {row.convention for row in spec.rows[1:]} == {Convention.MODIFIED}
    assert list(spec.rows[1].limits.position or ()) == [0, 0.3]
    assert spec.rows[1].limits.velocity == 0.1
    assert spec.configurations["home"].tolist() == [math.pi / 2, 0.1, math.pi / 2]
    assert [row.name for row in spec.moving_rows] == ["turn", "joint_2", "joint_4"]


def test_joint_actuators_inherit_gains_where_the_types_agree() -> None:
    spec = robot(FULL)
    assert [(row.actuator.type.value, row.actuator.kp, row.actuator.kv) for row in spec.rows] == [
        ("position", 7, 10),
        ("position", 100, 10),
        ("none", None, None),
        ("motor", None, None),
    ]


@pytest.mark.parametrize(
    ("unit", "metres"), [("m", 431.8), ("mm", 0.4318), ("cm", 431.8 / 100), ("in", 431.8 * 0.0254)]
)
def test_lengths_are_rounded_once(unit: str, metres: float) -> None:
    text = with_joint("{type: prismatic, a: 431.8, d: 431.8}") + f"units: {{length: {unit}}}\n"
    assert (robot(text).rows[0].a, robot(text).rows[0].d) == (metres, metres)


def test_expressions_with_functions_are_in_radians_whatever_the_unit() -> None:
    text = with_joint("{type: revolute, a: cos(pi / 3), alpha: 'atan2(1, 1) * 180 / pi'}") + "units: {angle: deg}\n"
    row = robot(text).rows[0]
    assert row.a == math.cos(math.pi / 3)
    assert row.alpha == math.pi / 4


def test_the_spec_knows_its_source() -> None:
    source = robot(MINIMAL).source_file
    assert source is not None
    assert (source.name, source.path, source.text) == ("r.yaml", "r.yaml", MINIMAL)
    assert source.sha256 == hashlib.sha256(MINIMAL.encode()).hexdigest()


def test_meshes_are_absolute_and_know_where_they_are_named(tmp_path: Path) -> None:
    (tmp_path / "b.STL").write_bytes(b"")
    text = with_joint("{type: fixed, link: {mesh: {file: b.STL}}}") + "base: {mesh: {file: b.STL, scale: 0.001}}\n"
    spec = robot(text, directory=tmp_path)
    mesh = spec.rows[0].link.mesh
    assert mesh is not None
    assert (mesh.file, mesh.scale) == (tmp_path / "b.STL", 1)
    assert mesh.location == "r.yaml:4:37: joints[0].link.mesh.file"
    assert spec.base.mesh is not None
    assert spec.base.mesh.scale == 0.001
    assert spec.base.mesh.location == "r.yaml:5:21: base.mesh.file"


def test_the_pose_of_a_mesh_is_in_the_files_units(tmp_path: Path) -> None:
    (tmp_path / "b.stl").write_bytes(b"")
    text = with_joint("{type: fixed, link: {mesh: {file: b.stl, xyz: [10, 0, -2.5], rpy: [90, 0, -45]}}}")
    text += "units: {angle: deg, length: mm}\nbase: {mesh: {file: b.stl, xyz: [1, 2, 3]}}\n"
    spec = robot(text, directory=tmp_path)
    mesh = spec.rows[0].link.mesh
    assert mesh is not None
    assert mesh.pose.xyz.tolist() == [0.01, 0, -0.0025]
    assert mesh.pose.rpy.tolist() == [math.pi / 2, 0, -math.pi / 4]
    assert spec.base.mesh is not None
    assert spec.base.mesh.pose.xyz.tolist() == [0.001, 0.002, 0.003]
    assert spec.base.mesh.pose.rpy.tolist() == [0, 0, 0]


def test_a_hayati_row_has_a_second_twist() -> None:
    text = with_joint("{type: revolute, convention: hayati, a: 431.8, alpha: 0.25, beta: -0.05, theta: 10}")
    row = robot(text + "units: {angle: deg, length: mm}\n").rows[0]
    assert row.convention is Convention.HAYATI
    assert (row.a, row.alpha) == (0.4318, math.radians(0.25))
    assert (row.beta, row.d, row.theta) == (math.radians(-0.05), 0, math.radians(10))
    assert robot(MINIMAL.replace("standard", "hayati")).rows[0].convention is Convention.HAYATI


def test_mesh_paths_start_in_the_current_folder_where_there_is_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "b.stl").write_bytes(b"")
    monkeypatch.chdir(tmp_path)
    mesh = robot(with_joint("{type: fixed, link: {mesh: {file: b.stl}}}")).rows[0].link.mesh
    assert mesh is not None
    assert mesh.file == tmp_path / "b.stl"


def test_nothing_in_a_spec_can_be_written_to() -> None:
    spec = robot(FULL)
    arrays = list(arrays_in(spec))
    assert len(arrays) == 8
    assert not any(array.flags.writeable for array in arrays)
    assert isinstance(spec.parameters, MappingProxyType)
    assert isinstance(spec.configurations, MappingProxyType)
    with pytest.raises(dataclasses.FrozenInstanceError):
        spec.name = "x"  # type: ignore[misc]


def _same(one: RobotSpec, other: RobotSpec) -> None:
    for left, right in zip(arrays_in(one), arrays_in(other), strict=True):
        np.testing.assert_allclose(left, right, rtol=1e-14, atol=0)
    for a, b in zip(one.rows, other.rows, strict=True):
        assert (a.type, a.flip) == (b.type, b.flip)
        numbers, others = ([row.a, row.alpha, row.d, row.theta, *(row.limits.position or ())] for row in (a, b))
        np.testing.assert_allclose(np.array(numbers), np.array(others), rtol=1e-14, atol=0)


_NUMBERS = st.floats(-1e3, 1e3).map(lambda x: round(x, 4))


@given(st.lists(_NUMBERS, min_size=8, max_size=8), st.sampled_from(["revolute", "prismatic"]))
def test_degrees_and_millimetres_give_the_spec_that_radians_and_metres_give(values: list[float], kind: str) -> None:
    a, alpha, d, theta, x, yaw, q, span = values

    def text(angle: str, length: str, units: str) -> str:
        coordinate = angle if kind == "revolute" else length
        limits = f"[{q} * {coordinate}, ({q} + {abs(span) + 1}) * {coordinate}]"
        return (
            f"name: r\nconvention: modified\nunits: {units}\njoints:\n"
            f"- {{type: {kind}, a: {a} * {length}, alpha: {alpha} * {angle}, d: {d} * {length}, "
            f"theta: {theta} * {angle}, limits: {{position: {limits}}}, link: {{com: [{x} * {length}, 0, 0]}}}}\n"
            f"base: {{xyz: [{x} * {length}, 0, 0], rpy: [0, 0, {yaw} * {angle}]}}\n"
            f"configurations: {{home: [{q} * {coordinate}]}}\n"
        )

    _same(robot(text("1", "1", "{angle: deg, length: mm}")), robot(text("pi / 180", "1 / 1000", "{}")))
