"""The worked example of docs/conventions.md: its numbers are recomputed from the YAML that it shows."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from dh2sim import build_chain
from dh2sim.kinematics.table_oracle import row_matrix, table_tool_pose
from dh2sim.robot.links import ToolSpec
from dh2sim.robot.read import parse_robot
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array

DOCS = Path(__file__).parents[2] / "docs"
Q = np.radians([20, 50])
IMAGE = re.compile(r"!\[[^\]]+\]\((images/[^)]+)\)")


@cache
def page() -> str:
    return (DOCS / "conventions.md").read_text(encoding="utf-8")


def shown(name: str) -> RobotSpec:
    """The robot of this name that the page shows."""
    match = re.search(rf"```yaml\n(name: {name}\n.*?)```", page(), re.DOTALL)
    assert match is not None
    return parse_robot(match[1])


@pytest.fixture
def example() -> RobotSpec:
    return shown("odd_twists")


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


@pytest.mark.parametrize("convention", [Convention.STANDARD, Convention.MODIFIED])
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
        "wrong sign of alpha_1": replace(example, rows=(replace(first, alpha=-first.alpha), second)),
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
    tool = ToolSpec(xyz=np.array([second.a, 0, 0]), rpy=np.array([second.alpha, 0, 0]))
    modified = read_as(replace(example, rows=shifted, tool=tool), Convention.MODIFIED)
    np.testing.assert_allclose(table_tool_pose(modified, Q), table_tool_pose(example, Q), rtol=0, atol=1e-15)


def upper_arms() -> list[tuple[Row, Row]]:
    """The rows of the table of upper arms, as standard and as Hayati rows."""
    line_of_table = r"^\| [a-z0-9].*\| (\S+) m, (\S+)°, (\S+) m \| (\S+) m, (\S+)°, (\S+)° \|$"
    found = re.findall(line_of_table, page(), re.MULTILINE)
    arms = []
    for line in found:
        a, alpha, d, own_a, own_alpha, own_beta = (float(word) for word in line)
        blank = Row(name="upper_arm", type=JointType.REVOLUTE, convention=Convention.STANDARD)
        hayati = replace(blank, convention=Convention.HAYATI, a=own_a)
        arms.append(
            (
                replace(blank, a=a, alpha=np.radians(alpha), d=d),
                replace(hayati, alpha=np.radians(own_alpha), beta=np.radians(own_beta)),
            )
        )
    return arms


def test_both_rows_of_every_upper_arm_have_the_same_elbow_axis() -> None:
    arms = upper_arms()
    assert len(arms) == 4
    for standard, hayati in arms:
        far_away = standard.a == 0.0
        elbow = row_matrix(hayati, np.zeros(1))[:, :, 0]
        other = row_matrix(replace(standard, theta=np.pi / 2 if far_away else 0.0), np.zeros(1))[:, :, 0]
        np.testing.assert_allclose(other[:3, 2], elbow[:3, 2], rtol=0, atol=1e-15)
        up = np.linalg.norm(elbow[:3, 3] - other[:3, 3]) if far_away else 0.0  # from where the axes meet to the elbow
        assert f"{up:.2f}" == f"{abs(standard.d):.2f}"
        np.testing.assert_allclose(other[:3, 3] + up * other[:3, 2], elbow[:3, 3], rtol=0, atol=1e-5)


def test_both_files_of_the_tilted_elbow_are_one_arm() -> None:
    near, far = shown("tilted_elbow"), shown("tilted_elbow_far_away")
    tilt = near.rows[0].beta
    assert tilt == np.radians(0.05)
    assert [f"{row.d:.9f}" for row in far.rows] == [f"{-0.4318 / np.tan(tilt):.9f}", f"{0.4318 / np.sin(tilt):.9f}"]
    q = np.random.default_rng(4).uniform(-np.pi, np.pi, (50, 2))
    np.testing.assert_allclose(table_tool_pose(far, q), table_tool_pose(near, q), rtol=0, atol=2e-9)


def test_a_small_error_of_a_twist_moves_the_tool_as_far_as_printed() -> None:
    for name, twist in (("tilted_elbow_far_away", "alpha"), ("tilted_elbow", "beta")):
        spec = shown(name)
        first, second = spec.rows
        off = replace(first, **{twist: getattr(first, twist) + np.radians(0.0005)})
        moved = (table_tool_pose(replace(spec, rows=(off, second)), Q) - table_tool_pose(spec, Q))[:3, 3]
        distance = 1000 * np.linalg.norm(moved)
        assert (f"{distance:.1f} mm" if distance > 1 else f"{distance:.3f} mm") in page()


def entry(text: str, values: dict[str, float]) -> float:
    """The value of a matrix's printed entry, such as ``cos θ sin β + sin θ sin α cos β``."""
    functions: dict[str, Callable[[float], float]] = {"cos": math.cos, "sin": math.sin, "": float}
    total = 0.0
    for term in re.split(r" (?=[+-] )", text):
        factors = [functions[name](values[of]) for name, of in re.findall(r"(cos|sin|) ?([θαβa0])", term)]
        total += float(np.prod(factors)) * (-1.0 if term.startswith("-") else 1.0)
    return total


def test_hayatis_printed_matrix_is_the_product_of_its_moves() -> None:
    row = Row(name="r", type=JointType.REVOLUTE, convention=Convention.HAYATI, a=0.3, alpha=0.7, beta=-0.4, theta=1.1)
    [start] = [i for i, line in enumerate(page().splitlines()) if "cos θ cos β - sin" in line]
    values = {"θ": row.theta, "α": row.alpha, "β": row.beta, "a": row.a, "0": 0.0}
    lines = [line[line.index("|") + 1 : line.rindex("|")].strip() for line in page().splitlines()[start : start + 3]]
    found = [[entry(cell, values) for cell in re.split(r"\s{2,}", line)] for line in lines]
    np.testing.assert_allclose(found, row_matrix(row, np.zeros(1))[:3, :, 0], rtol=0, atol=1e-15)


def test_every_picture_of_the_page_is_there() -> None:
    pictures = IMAGE.findall(page())
    assert len(pictures) == 4
    assert all((DOCS / picture).is_file() for picture in pictures)
