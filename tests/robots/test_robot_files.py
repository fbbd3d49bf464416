"""What every file in robots/ must say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim import build_chain, frame_poses, geometric_jacobian
from dh2sim.robot.row import Convention, JointType
from tests.sample_robots import NAMES, robot

from .samples import limits, random_configurations

PARAMETERS = {
    "arm_5r": {"L2": 0.4, "L3": 0.3},
    "cylindrical": {"d1": 0.4},
    "cylindrical_wrist": {"d1": 0.4, "d6": 0.3},
    "planar_2r": {"a1": 1.0, "a2": 0.7},
    "puma560": {"a2": 0.4318, "a3": 0.0203, "d3": 0.15005, "d4": 0.4318},
    "puma560_standard": {"a2": 0.4318, "a3": 0.0203, "d3": 0.15005, "d4": 0.4318},
    "rpr": {"L2": 0.2},
    "scara": {"a1": 0.325, "a2": 0.275, "d4": 0.05},
    "spherical_wrist": {"d6": 0.3},
    "ssrms": {},
    "stanford": {"d1": 0.4, "d2": 0.15, "d6": 0.3},
    "stanford_shoulder_origin": {"d2": 0.15, "d6": 0.3},
}

MODIFIED = {"arm_5r", "puma560", "rpr"}

BELOW_THE_BASE_PLANE = {"scara"}
"""Robots whose table leaves the tool no way to stay above it."""


def test_the_twelve_course_robots_are_there() -> None:
    assert set(NAMES) >= set(PARAMETERS)
    assert len(PARAMETERS) == 12


@pytest.mark.parametrize("name", NAMES)
def test_file_and_robot_have_the_same_name(name: str) -> None:
    assert robot(name).name == name


@pytest.mark.parametrize("name", PARAMETERS)
def test_parameters_are_those_of_the_source(name: str) -> None:
    assert dict(robot(name).parameters) == PARAMETERS[name]


@pytest.mark.parametrize("name", PARAMETERS)
def test_convention_is_that_of_the_source(name: str) -> None:
    expected = Convention.MODIFIED if name in MODIFIED else Convention.STANDARD
    assert {row.convention for row in robot(name).rows} == {expected}


@pytest.mark.parametrize("name", PARAMETERS)
def test_base_and_tool_are_where_the_table_puts_them(name: str) -> None:
    chain = build_chain(robot(name))
    assert np.array_equal(chain.T_base_link_dh0, np.eye(4))
    assert np.array_equal(chain.T_dhn_tool0, np.eye(4))


@pytest.mark.parametrize("name", NAMES)
def test_file_says_what_the_robot_is_and_where_its_numbers_come_from(name: str) -> None:
    spec = robot(name)
    assert spec.description
    assert len(spec.source) > 40


@pytest.mark.parametrize("name", PARAMETERS)
def test_file_says_of_its_masses_that_they_are_estimated(name: str) -> None:
    spec = robot(name)
    assert "masses are estimated from the shapes" in spec.source
    assert all(row.link.mass is None and row.link.inertia is None for row in spec.rows)


@pytest.mark.parametrize("name", NAMES)
def test_every_joint_has_position_limits_that_is_not_continuous(name: str) -> None:
    for row in robot(name).moving_rows:
        assert (row.limits.position is None) == (row.type is JointType.CONTINUOUS)


@pytest.mark.parametrize("name", NAMES)
def test_every_configuration_is_inside_the_limits(name: str) -> None:
    spec = robot(name)
    lower, upper = limits(spec)
    for label, q in spec.configurations.items():
        assert np.all((lower <= q) & (q <= upper)), label


@pytest.mark.parametrize("name", NAMES)
def test_zero_is_named_where_it_is_inside_the_limits(name: str) -> None:
    spec = robot(name)
    lower, upper = limits(spec)
    assert ("zero" in spec.configurations) == bool(np.all((lower <= 0) & (upper >= 0)))
    if "zero" in spec.configurations:
        assert not np.any(spec.configurations["zero"])


@pytest.mark.parametrize("name", NAMES)
def test_home_is_bent_at_every_joint(name: str) -> None:
    home = robot(name).configurations["home"]
    assert np.all(home != 0)


@pytest.mark.parametrize("name", NAMES)
def test_home_is_not_near_a_singular_pose(name: str) -> None:
    spec = robot(name)
    chain = build_chain(spec)
    elsewhere = geometric_jacobian(chain, random_configurations(spec, seed=21))
    rank = int(np.max(np.linalg.matrix_rank(elsewhere)))
    singular_values = np.linalg.svd(geometric_jacobian(chain, spec.configurations["home"]), compute_uv=False)
    assert singular_values[rank - 1] > 0.01 * singular_values[0]


@pytest.mark.parametrize("name", [name for name in NAMES if name not in BELOW_THE_BASE_PLANE])
def test_home_keeps_every_frame_on_or_above_the_base_plane(name: str) -> None:
    spec = robot(name)
    heights = frame_poses(build_chain(spec), spec.configurations["home"])[:, 2, 3]
    assert np.min(heights) > -1e-12


def test_stanford_limits_hold_every_pose_that_the_slides_print() -> None:
    lower, upper = limits(robot("stanford"))
    np.testing.assert_allclose(np.rad2deg(upper[[0, 1, 3, 4, 5]]), [170, 170, 170, 90, 170], rtol=1e-15)
    np.testing.assert_allclose(lower[[0, 1, 3, 4, 5]], -upper[[0, 1, 3, 4, 5]], rtol=1e-15)
    assert (lower[2], upper[2]) == (0, 1.27)


def test_scara_limits_are_those_of_the_cobra_600() -> None:
    lower, upper = limits(robot("scara"))
    np.testing.assert_allclose(upper[:3], [math.radians(50), math.radians(88), 0.21], rtol=1e-15)
    np.testing.assert_allclose(lower[:3], [-math.radians(50), -math.radians(88), 0], rtol=1e-15)
