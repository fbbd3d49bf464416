"""A robot that is written and read back is the same robot."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.robot.catalog import builtin_robots
from dh2sim.robot.links import BaseSpec, MeshSpec
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.row import ActuatorSpec, ActuatorType, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit, LengthUnit, Units
from dh2sim.robot.write import robot_file_text
from dh2sim.robot.yaml_tree import NOT_PRINTABLE
from tests.robot.files import FULL, robot
from tests.strategies import joint_vectors_for, lengths, names, poses, robot_specs, robots_with_joint_vectors, vectors

NOT_WRITTEN = ("source_file", "parameters", "location", "units")
"""Units are chosen by who writes."""
IN_UNITS = (
    "acceleration",
    "jerk",
    "a",
    "alpha",
    "beta",
    "d",
    "theta",
    "xyz",
    "rpy",
    "com",
    "radius",
    "position",
    "velocity",
    "configurations",
)
ODD_NAMES = ["null", "true", "No", "y", "e1"]
MESHES = ["a.stl", "sub/b.OBJ", "../beside/c 1.ply", "sub/7.glb", 'quo"te#.stl']

texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=200).filter(
    lambda text: not NOT_PRINTABLE.search(text)
)
actuators = st.one_of(
    st.builds(
        ActuatorSpec,
        type=st.just(ActuatorType.POSITION),
        kp=st.none() | st.floats(1e-3, 1e4),
        kv=st.none() | st.floats(1e-3, 1e4),
    ),
    st.builds(ActuatorSpec, type=st.just(ActuatorType.VELOCITY), kv=st.none() | st.floats(1e-3, 1e4)),
    st.builds(ActuatorSpec, type=st.sampled_from([ActuatorType.MOTOR, ActuatorType.NONE])),
)
angle_units, length_units = st.sampled_from(AngleUnit), st.sampled_from(LengthUnit)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder for robot files, with meshes in it and beside it."""
    folder = tmp_path_factory.mktemp("files") / "robots"
    for name in MESHES:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(b"")
    return folder


@st.composite
def meshes(draw: DrawFn, folder: Path) -> MeshSpec:
    return MeshSpec(
        file=folder / draw(st.sampled_from(MESHES)),
        scale=draw(st.sampled_from([1.0, 0.001]) | st.floats(1e-6, 10)),
        pose=draw(poses),
    )


@st.composite
def whole_robots(draw: DrawFn, folder: Path) -> RobotSpec:
    """Robots that have everything a robot file can hold, at times."""
    spec = draw(robot_specs(max_rows=6, must_move=False))
    colors = st.none() | st.tuples(*[st.floats(0, 1)] * 4)
    shared = draw(st.none() | actuators)

    odd = draw(st.permutations(ODD_NAMES)) if draw(st.booleans()) else []

    def decorated(index: int, row: Row) -> Row:
        link, actuator = row.link, row.actuator
        if draw(st.booleans()):
            link = dataclasses.replace(link, mesh=draw(st.none() | meshes(folder)), color=draw(colors))
        if row.type.moves:
            actuator = shared or draw(st.just(actuator) | actuators)
        name = odd[index] if index < len(odd) else row.name
        return dataclasses.replace(row, name=name, link=link, actuator=actuator)

    vector_names = draw(st.lists(names | st.sampled_from(ODD_NAMES), max_size=3))
    return dataclasses.replace(
        spec,
        rows=tuple(decorated(index, row) for index, row in enumerate(spec.rows)),
        description=draw(texts),
        source=draw(texts | st.lists(st.text("abc.:", min_size=1), min_size=20).map(" ".join)),
        base=BaseSpec(pose=spec.base.pose, mesh=draw(st.none() | meshes(folder)), color=draw(colors)),
        gravity=draw(vectors(lengths)),
        configurations=MappingProxyType({name: draw(joint_vectors_for(spec)) for name in vector_names}),
    )


def _leaves(value: Any, path: tuple[str, ...] = ()) -> list[tuple[tuple[str, ...], Any]]:
    """Return everything in a spec that a robot file holds, with the names on the way to it."""
    match value:
        case np.ndarray():
            parts = [(str(index), number) for index, number in enumerate(value.ravel().tolist())]
        case tuple():
            parts = [(str(index), part) for index, part in enumerate(value)]
        case Mapping():
            parts = list(value.items())
        case Row(type=JointType.FIXED):  # it has no actuator, whatever the spec says
            parts = [(field.name, getattr(value, field.name)) for field in dataclasses.fields(value)][:-1]
        case _ if dataclasses.is_dataclass(value):
            parts = [(field.name, getattr(value, field.name)) for field in dataclasses.fields(value)]
        case Path():
            return [(path, value.resolve())]
        case _:
            return [(path, value)]
    empty = [((*path, "size"), len(parts))]
    return empty + [leaf for name, part in parts if name not in NOT_WRITTEN for leaf in _leaves(part, (*path, name))]


def _assert_same(one: RobotSpec, other: RobotSpec, *, ulps: int) -> None:
    """Lengths and angles are at most ``ulps`` apart, everything else is equal."""
    for (path, left), (where, right) in zip(_leaves(one), _leaves(other), strict=True):
        assert path == where
        if isinstance(left, float) and not isinstance(left, Enum) and any(name in IN_UNITS for name in path):
            assert abs(left - right) <= ulps * math.ulp(left), path
        else:
            assert left == right, path
            assert isinstance(right, type(left)), path


def test_the_comparison_sees_every_key_of_a_robot_file() -> None:
    seen = {path[-1] for path, _ in _leaves(robot(FULL))} | {
        name for path, _ in _leaves(robot(FULL)) for name in path
    }
    assert {"gravity", "flip", "damping", "inertia", "kp", "home", "rpy", "color", "beta", "source"} <= seen


@given(data=st.data(), angle=angle_units, length=length_units)
def test_any_robot_reads_back_as_the_same_robot(
    data: st.DataObject, angle: AngleUnit, length: LengthUnit, folder: Path
) -> None:
    spec = data.draw(whole_robots(folder))
    text = robot_file_text(spec, header=[spec.source], folder=folder, angle=angle, length=length)
    back = parse_robot(text, directory=folder)
    assert back.units == Units(angle=angle, length=length)
    _assert_same(spec, back, ulps=0 if (angle, length) == (AngleUnit.RAD, LengthUnit.M) else 1)
    assert robot_file_text(back, header=[spec.source], folder=folder, angle=angle, length=length) == text


@given(robot_and_vectors=robots_with_joint_vectors(max_rows=8), angle=angle_units, length=length_units)
def test_the_robot_read_back_has_the_same_poses(
    robot_and_vectors: tuple[RobotSpec, Any], angle: AngleUnit, length: LengthUnit
) -> None:
    spec, q = robot_and_vectors
    back = parse_robot(robot_file_text(spec, angle=angle, length=length))
    np.testing.assert_allclose(table_frame_poses(back, q), table_frame_poses(spec, q), rtol=0, atol=1e-14)
    np.testing.assert_allclose(table_tool_pose(back, q), table_tool_pose(spec, q), rtol=0, atol=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize("angle", AngleUnit)
@pytest.mark.parametrize("length", LengthUnit)
@pytest.mark.parametrize("name", builtin_robots())
def test_robots_that_come_with_dh2sim_read_back_as_the_same_robots(
    name: str, angle: AngleUnit, length: LengthUnit
) -> None:
    spec = load_robot(name)
    back = parse_robot(robot_file_text(spec, angle=angle, length=length))
    # angles of files in degrees are whole degrees, or made from them
    exact = length is LengthUnit.M and (angle is AngleUnit.RAD or spec.units.angle is AngleUnit.DEG)
    _assert_same(spec, back, ulps=0 if exact else 1)
