"""Joint axes to robot files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dh2sim.importing.axes import import_axes, serial_robot
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.axes_file import AxesSpec, read_axes
from dh2sim.robot.read import load_robot
from dh2sim.robot.row import Convention
from tests.kinematics.frame_assignment.chains import Axis, pose, tip_by_exponentials, unit

DOCS = Path(__file__).parents[2] / "docs"
ODD = """\
name: odd
source: an exercise
units: {angle: deg, length: mm}
axes:
  - {type: revolute, point: [100, 0, 300], direction: [0, 0, 2], limits: {position: [-90, 90]}}
  - {name: slide, type: prismatic, direction: [1, 2, 2]}
  - {type: continuous, point: [400, -50, 300], direction: [1, -1, 0.5], dynamics: {damping: 0.3}}
tool: {xyz: [500, 0, 250], rpy: [0, 90, 0]}
configurations: {home: [45, 20, 30]}
"""


def _read(text: str) -> AxesSpec:
    return read_axes(text.encode(), file="axes.yaml", directory=Path())


@pytest.mark.parametrize("convention", [Convention.STANDARD, Convention.MODIFIED])
def test_the_arm_is_that_of_the_axes(convention: Convention) -> None:
    spec = import_axes(_read(ODD), convention=convention).spec
    axes = [
        Axis(np.array([0.1, 0.0, 0.3]), np.array([0.0, 0.0, 1.0]), spec.rows[0].type),
        Axis(np.zeros(3), unit([1, 2, 2]), spec.rows[1].type),
        Axis(np.array([0.4, -0.05, 0.3]), unit([1, -1, 0.5]), spec.rows[2].type),
    ]
    T_base_tip = pose(np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]]), np.array([0.5, 0.0, 0.25]))
    for q in np.random.default_rng(0).uniform(-2, 2, (20, 3)):
        expected = tip_by_exponentials(axes, T_base_tip, q)
        assert np.abs(table_tool_pose(spec, q) - expected).max() < 1e-14


def test_what_else_the_file_says_is_in_the_robot_file() -> None:
    imported = import_axes(_read(ODD))
    spec = imported.spec
    assert [row.name for row in spec.rows] == ["joint_1", "slide", "joint_3"]
    assert spec.rows[0].limits.position == pytest.approx((-np.pi / 2, np.pi / 2))
    assert spec.rows[2].dynamics.damping == 0.3
    assert spec.configurations["home"] == pytest.approx([np.pi / 4, 0.02, np.pi / 6])
    assert spec.source.startswith("an exercise. Made by dh2sim; at 1000 random configurations")


def test_the_files_convention_is_taken_where_none_is_asked_for() -> None:
    assert import_axes(_read(f"convention: modified\n{ODD}")).spec.convention is Convention.MODIFIED
    assert import_axes(_read(ODD)).spec.convention is Convention.STANDARD


def test_a_slide_without_a_point_is_where_the_joint_before_it_is() -> None:
    chain = serial_robot(_read(ODD)).chain
    assert chain.joints[1].T_parent_link.tolist() == np.eye(4).tolist()


def test_the_puma_560s_table_comes_out_of_its_axes_number_for_number() -> None:
    path = DOCS / "puma560_axes.yaml"
    axes = read_axes(path.read_bytes(), file=path.name, directory=DOCS)
    made, published = import_axes(axes).spec, load_robot("puma560_standard")
    assert [(r.name, r.type, r.a, r.alpha, r.d, r.theta, r.flip) for r in made.rows] == [
        (r.name, r.type, r.a, r.alpha, r.d, r.theta, r.flip) for r in published.rows
    ]
    assert [r.limits.position for r in made.rows] == [r.limits.position for r in published.rows]
    for one, other in ((made.base.pose, published.base.pose), (made.tool, published.tool)):
        assert (one.xyz.tolist(), one.rpy.tolist()) == (other.xyz.tolist(), other.rpy.tolist())


def test_an_explanation_is_at_the_top_of_the_file_and_changes_nothing_else() -> None:
    plain, explained = import_axes(_read(ODD)).text, import_axes(_read(ODD), explain=True).text
    assert explained.endswith(plain)
    assert all(line.startswith("#") for line in explained.removesuffix(plain).splitlines())
    assert "slide" in explained.removesuffix(plain)
