"""Robot file -> URDF or MJCF -> robot file: the same arm, with all that it carries."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.formats.urdf.write import to_urdf
from dh2sim.importing.sources import ImportOptions, import_robot
from dh2sim.kinematics.forward import joint_poses
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.model.mass import MassProperties, in_frame
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.robot_files import ODD, RICH
from tests.sample_robots import COSTLY_NAMES
from tests.strategies import robot_specs

FORMATS: dict[str, Callable[[RobotModel], str]] = {".urdf": to_urdf, ".xml": to_mjcf}
CONVENTIONS = (Convention.STANDARD, Convention.MODIFIED)


def _again(model: RobotModel, folder: Path, suffix: str, convention: Convention) -> RobotSpec:
    path = folder / f"{model.name}{suffix}"
    path.write_text(FORMATS[suffix](model), encoding="utf-8")
    return import_robot(path, ImportOptions(convention=convention), folder=folder).spec


def _off_by(spec: RobotSpec, again: RobotSpec) -> float:
    q = np.random.default_rng(7).uniform(-3, 3, (300, len(spec.moving_rows)))
    return float(np.abs(table_tool_pose(spec, q) - table_tool_pose(again, q)).max())


def _masses_in_base(model: RobotModel, q: Array) -> list[MassProperties]:
    """Mass properties of the moving links in base_link."""
    poses = joint_poses(model.chain, q)
    return [
        in_frame(T, link.inertial)
        for T, link, joint in zip(poses, model.links, model.joints, strict=True)
        if joint.type.moves and link.inertial is not None
    ]


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("suffix", [".urdf", ".xml"])
@pytest.mark.parametrize("name", COSTLY_NAMES)
def test_every_robot_comes_back_with_its_poses_names_and_limits(
    name: str, suffix: str, convention: Convention, tmp_path: Path
) -> None:
    model = build_model(load_robot(name))
    again = _again(model, tmp_path, suffix, convention)
    assert _off_by(model.spec, again) <= 1e-12 * max(1.0, model.reach)
    assert [row.name for row in again.rows] == [joint.name for joint in model.moving_joints]
    for row, joint in zip(again.rows, model.moving_joints, strict=True):
        if joint.position_range is not None:
            assert row.limits.position == pytest.approx(joint.position_range, abs=1e-9)
        if suffix == ".urdf":
            assert (row.limits.velocity, row.limits.effort) == pytest.approx((joint.velocity, joint.effort))


@pytest.mark.parametrize("suffix", [".urdf", ".xml"])
@pytest.mark.parametrize("name", ["stanford", "puma560", "scara", "ssrms"])
def test_every_link_comes_back_with_its_mass_where_it_was(name: str, suffix: str, tmp_path: Path) -> None:
    model = build_model(load_robot(name))
    again = build_model(_again(model, tmp_path, suffix, Convention.MODIFIED))
    q = np.random.default_rng(2).uniform(-1, 1, model.chain.n)
    for one, other in zip(_masses_in_base(model, q), _masses_in_base(again, q), strict=True):
        assert other.mass == pytest.approx(one.mass, rel=1e-9)
        assert np.abs(other.com - one.com).max() < 1e-8 * max(1.0, model.reach)
        assert np.abs(other.inertia - one.inertia).max() < 1e-8 * np.trace(one.inertia)


@pytest.mark.parametrize("suffix", [".urdf", ".xml"])
def test_dynamics_come_back(suffix: str, tmp_path: Path) -> None:
    model = build_model(parse_robot(RICH))
    first, second = _again(model, tmp_path, suffix, Convention.STANDARD).rows
    assert (first.dynamics.damping, first.dynamics.friction) == (0.1, 0.2)
    assert first.dynamics.armature == (0.05 if suffix == ".xml" else 0.0)  # URDF knows no rotor inertia
    assert first.limits.effort == 80
    assert (first.link.mass, second.name) == (4, "elbow")
    if suffix == ".xml":
        assert (first.actuator.kp, first.actuator.kv) == (100, 10)


@pytest.mark.parametrize("suffix", [".urdf", ".xml"])
def test_flips_fixed_rows_and_mixed_conventions_come_back_as_plain_rows(suffix: str, tmp_path: Path) -> None:
    spec = parse_robot(ODD)
    again = _again(build_model(spec), tmp_path, suffix, Convention.STANDARD)
    assert [row.name for row in again.rows] == ["one", "two", "four", "five"]
    assert not any(row.flip for row in again.rows)
    assert _off_by(spec, again) < 1e-12


@settings(max_examples=min(40, settings().max_examples))
@given(spec=robot_specs(max_rows=8))
def test_any_robot_comes_back_from_a_urdf(spec: RobotSpec, tmp_path_factory: pytest.TempPathFactory) -> None:
    model = build_model(spec)
    again = _again(model, tmp_path_factory.mktemp("any"), ".urdf", Convention.STANDARD)
    assert _off_by(spec, again) <= 1e-9 * max(1.0, model.reach)


@settings(max_examples=min(25, settings().max_examples))
@given(spec=robot_specs(max_rows=8))
def test_any_robot_comes_back_from_an_mjcf(spec: RobotSpec, tmp_path_factory: pytest.TempPathFactory) -> None:
    model = build_model(spec)
    again = _again(model, tmp_path_factory.mktemp("any"), ".xml", Convention.MODIFIED)
    assert _off_by(spec, again) <= 1e-9 * max(1.0, model.reach)
