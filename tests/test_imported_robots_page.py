"""What the page on imported robots says is so."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest

from dh2sim.importing.sources import import_robot
from dh2sim.typing import Array
from scripts.imported_robots import check
from scripts.real_arms.arm import Arm
from scripts.real_arms.arms import ARMS, IRB140
from scripts.real_arms.packages import PACKAGES, installed
from scripts.real_arms.page import line, measure, stable

PAGE = (Path(__file__).resolve().parent.parent / "docs" / "imported-robots.md").read_text(encoding="utf-8")
FILES = "## Files that are not the robot of the table"
ARM_LINES = re.findall(r"^\|.*` → `.*\|$", PAGE, flags=re.MULTILINE)
RELATION = re.compile(
    r"^\*\*T_published\(q\) = (?:Rz\((?P<turn>[\d.]+)°\) )?T_imported\(q\)(?: E)?\*\*"
    r"(?:, E at \((?P<xyz>.*?)\) m and turned by roll, pitch, yaw \((?P<rpy>.*?)\)°)?"
    r": off by at most (?P<size>.*) at 1000 random q\.$"
)


@dataclass(frozen=True, eq=False)
class Comparison:
    """One section of the page: two tables, and how they hang together."""

    heading: str
    text: str

    @cached_property
    def rows(self) -> list[list[str]]:
        lines = re.findall(r"^\| (?:\d|flange) \|.*\|$", self.text, flags=re.MULTILINE)
        return [[cell.strip() for cell in found.strip("|").split("|")] for found in lines]

    @property
    def convention(self) -> str:
        [found] = re.findall(r"(standard|modified)\s+convention", self.text)
        return str(found)

    @property
    def published(self) -> list[list[float]]:
        return [[float(cell) for cell in row[1:5]] for row in self.rows]

    @property
    def imported(self) -> list[list[float]]:
        return [[float(cell) for cell in row[6:10]] for row in self.rows if row[6] != "—"]

    @property
    def relation(self) -> dict[str, str]:
        [sentence] = re.findall(r"^\*\*T_published.*?random q\.$", self.text, flags=re.MULTILINE | re.DOTALL)
        found = RELATION.match(" ".join(sentence.split()))
        assert found is not None
        return {key: value or "" for key, value in found.groupdict().items()}


def comparisons(part: str) -> list[Comparison]:
    sections = re.findall(r"^### (.*?)\n(.*?)(?=^##|\Z)", part, flags=re.MULTILINE | re.DOTALL)
    return [Comparison(heading, text) for heading, text in sections if "| joint |" in text]


BEFORE, BEHIND = PAGE.split(FILES)
SAME = comparisons(BEFORE)
OTHER = comparisons(BEHIND)


def turn_x(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])


def turn_y(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]])


def turn_z(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def shift(x: float, y: float, z: float) -> Array:
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


def tool(rows: list[list[float]], convention: str, q: Array) -> Array:
    """The tool's pose by the printed numbers; a row without a coordinate is fixed."""
    T = np.eye(4)
    coordinates = [*q.tolist(), 0.0][: len(rows)]
    for (a, alpha, d, theta), coordinate in zip(rows, coordinates, strict=True):
        X = shift(a, 0, 0) @ turn_x(math.radians(alpha))
        Z = turn_z(math.radians(theta) + coordinate) @ shift(0, 0, d)
        T = T @ (Z @ X if convention == "standard" else X @ Z)
    return T


def numbers(text: str) -> list[float]:
    return [float(number) for number in text.split(",")]


def greatest_difference(comparison: Comparison) -> tuple[float, float]:
    """m between the tools of both tables, and the greatest entry by which their axes differ."""
    relation = comparison.relation
    base = turn_z(math.radians(float(relation["turn"] or 0)))
    xyz, (roll, pitch, yaw) = numbers(relation["xyz"] or "0, 0, 0"), numbers(relation["rpy"] or "0, 0, 0")
    turn = turn_z(math.radians(yaw)) @ turn_y(math.radians(pitch)) @ turn_x(math.radians(roll))
    E = shift(xyz[0], xyz[1], xyz[2]) @ turn
    position = rotation = 0.0
    for q in np.random.default_rng(12).uniform(-np.pi, np.pi, (300, len(comparison.imported))):
        published = tool(comparison.published, comparison.convention, q)
        imported = base @ tool(comparison.imported, comparison.convention, q) @ E
        position = max(position, float(np.linalg.norm(published[:3, 3] - imported[:3, 3])))
        rotation = max(rotation, float(np.abs(published[:3, :3] - imported[:3, :3]).max()))
    return position, rotation


def test_the_page_compares_what_it_should() -> None:
    assert [comparison.heading for comparison in SAME] == [
        "Franka Panda",
        "KUKA LBR iiwa 14",
        "UR5",
        "UR10",
        "UFACTORY xArm6",
        "UFACTORY xArm7",
    ]
    assert [comparison.heading for comparison in OTHER] == [
        "KUKA LBR iiwa 14 R820",
        "UR5e",
        "Unimation PUMA 560",
    ]


@pytest.mark.parametrize("comparison", SAME, ids=lambda comparison: comparison.heading)
def test_tables_that_are_called_the_same_arm_have_the_same_tool_everywhere(comparison: Comparison) -> None:
    position, rotation = greatest_difference(comparison)
    assert position < 1e-9
    assert rotation < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("comparison", SAME, ids=lambda comparison: comparison.heading)
def test_a_wrong_number_in_a_table_would_be_noticed(comparison: Comparison) -> None:
    for row in comparison.rows[1:-1]:
        kept, row[6] = row[6], str(float(row[6]) + 1e-4)
        assert greatest_difference(comparison)[0] > 1e-6
        row[6] = kept


@pytest.mark.parametrize("comparison", OTHER[:2], ids=lambda comparison: comparison.heading)
def test_tables_that_are_called_other_arms_differ_by_about_what_is_said(comparison: Comparison) -> None:
    reported = float(comparison.relation["size"].split(" mm")[0])
    assert 0.7 * reported <= 1e3 * greatest_difference(comparison)[0] <= 1.1 * reported


def test_the_puma_of_the_file_has_other_distances_between_its_axes() -> None:
    puma = OTHER[2]
    a_2, a_3 = (row[0] for row in puma.published[1:3])
    assert (a_2, a_3) == (0.4318, 0.0203)
    assert puma.imported[1][0] == pytest.approx(math.hypot(a_2, a_3), abs=1e-9)
    assert puma.imported[2][0] == 0
    assert "0.432277" in puma.text


def test_the_printed_digits_of_ufactory_are_off_their_own_formula_by_what_is_said() -> None:
    [(x, z, printed)] = re.findall(r"sqrt\(([\d.]+)\^2\+([\d.]+)\^2\) = ([\d.]+)` mm", PAGE)
    exact = math.hypot(float(x), float(z))
    assert f"{exact:.6f}" in PAGE
    assert round(1e3 * (float(printed) - exact)) == 2
    assert "2 µm off" in PAGE


def test_the_irb_140_of_the_file_has_the_lengths_on_the_page() -> None:
    root = installed(IRB140.package)
    if root is None:
        pytest.skip(f"{IRB140.package.name} {IRB140.package.version} is not installed")
    rows = import_robot(IRB140.path(root), IRB140.options).spec.rows
    assert f"an upper arm of {rows[1].a:g} m and a forearm of {rows[3].d:g} m" in PAGE


def test_every_arm_of_the_list_is_on_the_page_and_no_other() -> None:
    by_package = [arm for package in PACKAGES for arm in ARMS if arm.package is package]
    assert [found.split(" | ")[0].removeprefix("| ") for found in ARM_LINES] == [arm.robot for arm in by_package]
    for package in PACKAGES:
        assert f"### {package.name} {package.version}\n\n{package.license}; files below `{package.root}`." in PAGE


def test_the_counts_are_those_of_the_tables() -> None:
    kinds = [re.findall(r"(\d+) (?:standard|modified|Hayati)", found) for found in ARM_LINES]
    rows = sum(int(count) for counts in kinds for count in counts)
    assert len(ARM_LINES) >= 20
    assert f"{len(ARM_LINES)} arms and legs" in PAGE
    assert f"{rows} joints in all" in PAGE
    assert f"from {len({(arm.package.name, arm.file) for arm in ARMS})}\npublic files" in PAGE


def test_every_error_in_the_tables_is_within_its_tolerance() -> None:
    for found in ARM_LINES:
        [tolerance] = re.findall(r"--tolerance ([\de-]+)", found) or ["1e-9"]
        cells = re.findall(r"([\de.-]+) m, ([\de.-]+) rad", found)
        assert len(cells) == 2
        assert max(float(value) for cell in cells for value in cell) <= float(tolerance)


@pytest.mark.slow
@pytest.mark.parametrize("arm", ARMS, ids=[arm.key for arm in ARMS])
def test_a_line_is_made_again_as_it_is_but_for_the_digits_of_errors(arm: Arm) -> None:
    root = installed(arm.package)
    if root is None:
        pytest.skip(f"{arm.package.name} {arm.package.version} is not installed")
    assert stable(line(arm, measure(arm, root))) in [stable(found) for found in ARM_LINES]


def test_the_check_sees_a_changed_number_but_no_changed_rounding(capsys: pytest.CaptureFixture[str]) -> None:
    assert check(re.sub(r"\b\de-16 m\b", "7.1e-16 m", PAGE)) == 0
    assert capsys.readouterr().out == "imported-robots.md: up to date\n"
    assert check(PAGE.replace("| 1 | 0 | 0 | 0.333 | 0 |", "| 1 | 0 | 0 | 0.334 | 0 |")) == 1
    reported = capsys.readouterr().err
    assert "-| 1 | 0 | 0 | 0.333 | 0 | | 0 | 0 | 0.333 | 0 |\n+| 1 | 0 | 0 | 0.334 | 0 | |" in reported
