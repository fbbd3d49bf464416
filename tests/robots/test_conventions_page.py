"""The worked example of docs/conventions.md: its numbers are recomputed from the YAML that it shows."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from dh2sim import build_chain, load_robot
from dh2sim.kinematics.table import row_matrix, table_tool_pose
from dh2sim.robot.spec import Convention, Pose, RobotSpec
from dh2sim.typing import Array

DOCS = Path(__file__).parents[2] / "docs"
Q = np.radians([20, 50])
IMAGE = re.compile(r"!\[[^\]]+\]\((images/[^)]+)\)")


@cache
def page() -> str:
    return (DOCS / "conventions.md").read_text(encoding="utf-8")


@pytest.fixture
def example(tmp_path: Path) -> RobotSpec:
    match = re.search(r"```yaml\n(name: odd_twists\n.*?)```", page(), re.DOTALL)
    assert match is not None
    path = tmp_path / "odd_twists.yaml"
    path.write_text(match[1], encoding="utf-8")
    return load_robot(path)


def read_as(spec: RobotSpec, convention: Convention) -> RobotSpec:
    return replace(spec, rows=tuple(replace(row, convention=convention) for row in spec.rows))


def assert_printed(heading: str, matrix: Array, *, column: int = 0, occurrence: int = 0) -> None:
    """Check the numbers below the nth line that holds ``heading``; two matrices may share a line."""
    lines = page().splitlines()
    start = [number for number, line in enumerate(lines) if heading in line][occurrence]
    printed = [line.split()[4 * column : 4 * column + 4] for line in lines[start + 1 : start + 4]]
    assert printed == [[f"{value + 0:.4f}" for value in row] for row in np.round(matrix[:3], 4).tolist()]


@pytest.mark.parametrize(
    ("convention", "occurrence", "headings"),
    [
        (Convention.STANDARD, 0, ("A_1 = Z_1 X_1", "A_2 = Z_2 X_2")),
        (Convention.MODIFIED, 1, ("A_1 = X_1 Z_1", "A_2 = X_2 Z_2")),
    ],
)
def test_rows_and_tool_pose_of_the_example_are_as_printed(
    example: RobotSpec, convention: Convention, occurrence: int, headings: tuple[str, str]
) -> None:
    spec = read_as(example, convention)
    for column, heading in enumerate(headings):
        A = row_matrix(spec.rows[column], Q[column : column + 1])[:, :, 0]
        assert_printed(heading, A, column=column)
    assert_printed("T = A_1 A_2", table_tool_pose(spec, Q), occurrence=occurrence)


@pytest.mark.parametrize("convention", Convention)
def test_bodies_of_the_example_stand_where_printed(example: RobotSpec, convention: Convention) -> None:
    chain = build_chain(read_as(example, convention))
    for column, (pair, joint) in enumerate(zip(("base_body1", "body1_body2"), chain.joints, strict=True)):
        assert_printed(f"{convention}: T_{pair} =", joint.T_parent_joint, column=column)


def test_distances_of_the_common_mistakes_are_as_printed(example: RobotSpec) -> None:
    right = table_tool_pose(example, Q)
    first, second = example.rows
    late = (replace(first, a=0, alpha=0), replace(second, a=first.a, alpha=first.alpha))
    in_radians = [replace(row, alpha=np.degrees(row.alpha), theta=np.degrees(row.theta)) for row in example.rows]
    wrong = {
        "the wrong convention": read_as(example, Convention.MODIFIED),
        "degrees taken for radians": replace(example, rows=tuple(in_radians)),
        "sign of alpha_1 turned": replace(example, rows=(replace(first, alpha=-first.alpha), second)),
        "a and alpha one row late": replace(example, rows=late),
        "the theta offset forgotten": replace(example, rows=(first, replace(second, theta=0))),
    }
    for mistake, spec in wrong.items():
        q = np.degrees(Q) if mistake == "degrees taken for radians" else Q
        distance = np.linalg.norm((table_tool_pose(spec, q) - right)[:3, 3])
        assert re.search(rf"^\| {mistake} \|.*\| {distance:.2f} m \|$", page(), re.MULTILINE), mistake


def test_shifting_a_and_alpha_down_and_the_last_into_the_tool_keeps_the_arm(example: RobotSpec) -> None:
    first, second = example.rows
    shifted = (replace(first, a=0, alpha=0), replace(second, a=first.a, alpha=first.alpha))
    tool = Pose(xyz=np.array([second.a, 0, 0]), rpy=np.array([second.alpha, 0, 0]))
    modified = read_as(replace(example, rows=shifted, tool=tool), Convention.MODIFIED)
    np.testing.assert_allclose(table_tool_pose(modified, Q), table_tool_pose(example, Q), rtol=0, atol=1e-15)


def test_every_picture_of_the_page_is_there() -> None:
    pictures = IMAGE.findall(page())
    assert len(pictures) == 4
    assert all((DOCS / picture).is_file() for picture in pictures)
