"""The course systems against closed forms that know nothing of Denavit-Hartenberg matrices."""

from __future__ import annotations

import inspect
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from dh2sim import build_chain, forward_kinematics, frame_poses, load_robot
from dh2sim.kinematics.table_oracle import table_frame_poses
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.sample_robots import NAMES, ROBOTS_DIR, robot

from .closed_forms import PARTS, PROVENANCE, ROBOTS, Form
from .makers import ARMS
from .samples import random_configurations

TOLERANCE = 1e-13
"""m, and units of a rotation matrix's entries; rounding at the longest arm's 33 m comes to about 1e-14."""


def parameter_names(form: Form) -> list[str]:
    parameters = inspect.signature(form).parameters.values()
    return [p.name for p in parameters if p.kind is inspect.Parameter.KEYWORD_ONLY]


def closed_form_pose(form: Form, spec: RobotSpec, q: Array) -> Array:
    """Evaluate a closed form with those of the robot's parameters that it asks for."""
    return form(*q.T, **{name: spec.parameters[name] for name in parameter_names(form)})


def poses_between(poses: Array, first: int, last: int) -> Array:
    """Return T_dh(first - 1)_dh(last) from poses of all frames, by the transpose of the rotation."""
    start, end = poses[:, first - 1], poses[:, last]
    relative = np.zeros_like(start)
    relative[:, :3, :3] = np.swapaxes(start[:, :3, :3], 1, 2) @ end[:, :3, :3]
    relative[:, :3, 3] = np.einsum("nji,nj->ni", start[:, :3, :3], end[:, :3, 3] - start[:, :3, 3])
    relative[:, 3, 3] = 1
    return relative


def assert_poses_equal(actual: Array, expected: Array) -> None:
    assert actual.shape == expected.shape
    np.testing.assert_allclose(actual, expected, rtol=0, atol=TOLERANCE)


def test_every_robot_but_the_exercise_has_a_closed_form_or_a_makers_description() -> None:
    assert set(NAMES) - set(ROBOTS) - set(ARMS) == {"puma560_standard"}


def test_every_closed_form_of_a_source_says_where_it_comes_from() -> None:
    printed_parts = {name for name in PARTS if "_of_" not in name}
    assert set(PROVENANCE) == set(ROBOTS) | printed_parts


@pytest.mark.parametrize("name", ROBOTS)
def test_parameters_of_the_file_are_the_arguments_of_the_closed_form(name: str) -> None:
    assert set(robot(name).parameters) == set(parameter_names(ROBOTS[name]))


@pytest.mark.parametrize("name", ROBOTS)
def test_tool_pose_by_the_chain_equals_the_closed_form(name: str) -> None:
    spec = robot(name)
    q = random_configurations(spec, seed=1)
    assert_poses_equal(forward_kinematics(build_chain(spec), q), closed_form_pose(ROBOTS[name], spec, q))


@pytest.mark.parametrize("name", ROBOTS)
def test_last_frame_by_the_table_oracle_equals_the_closed_form(name: str) -> None:
    spec = robot(name)
    q = random_configurations(spec, seed=2)
    assert_poses_equal(table_frame_poses(spec, q)[:, -1], closed_form_pose(ROBOTS[name], spec, q))


@pytest.mark.parametrize("part", PARTS)
def test_frames_between_by_the_chain_equal_the_partial_closed_form(part: str) -> None:
    form, name, first, last = PARTS[part]
    spec = robot(name)
    q = random_configurations(spec, seed=3)
    poses = frame_poses(build_chain(spec), q)
    expected = closed_form_pose(form, spec, q[:, first - 1 : last])
    assert_poses_equal(poses_between(poses, first, last), expected)


@pytest.mark.parametrize("part", PARTS)
def test_frames_between_by_the_table_oracle_equal_the_partial_closed_form(part: str) -> None:
    form, name, first, last = PARTS[part]
    spec = robot(name)
    q = random_configurations(spec, seed=4)
    poses = table_frame_poses(spec, q)
    expected = closed_form_pose(form, spec, q[:, first - 1 : last])
    assert_poses_equal(poses_between(poses, first, last), expected)


@pytest.mark.parametrize("name", [name for name in ROBOTS if name != "ssrms"])
def test_another_size_of_the_same_robot_is_a_change_of_its_parameters(name: str, tmp_path: Path) -> None:
    yaml = YAML(typ="safe", pure=True)
    document = yaml.load(ROBOTS_DIR / f"{name}.yaml")
    document["parameters"] = {
        key: round(value * 1.37 + 0.113 * place, 6)
        for place, (key, value) in enumerate(document["parameters"].items(), start=1)
    }
    path = tmp_path / f"{name}.yaml"
    yaml.dump(document, path)
    spec = load_robot(path)
    q = random_configurations(spec, seed=5, count=20)
    assert dict(spec.parameters) != dict(robot(name).parameters)
    assert_poses_equal(forward_kinematics(build_chain(spec), q), closed_form_pose(ROBOTS[name], spec, q))
