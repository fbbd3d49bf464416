"""What the page on frame assignment says is so."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from dh2sim import load_robot
from dh2sim.robot.read import parse_robot
from dh2sim.robot.spec import RobotSpec
from scripts.draw_frame_assignment import main as draw_pictures
from scripts.draw_frame_assignment import stanford_axes
from tests.program import dh2sim

ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / "docs" / "frame-assignment.md").read_text(encoding="utf-8")
PUMA = ROOT / "docs" / "puma560_axes.yaml"
DIGITS = r"\d\.\de-\d\d"
"""Of a residual, which are rounding and differ from machine to machine."""


def _block(kind: str, number: int) -> str:
    blocks = re.findall(rf"^```{kind}\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)
    return str(blocks[number])


def _robot_file(folder: Path, axes: Path, *options: str) -> str:
    out = folder / "robot.yaml"
    done = dh2sim("frames", axes, *options, "-o", out, "--quiet")
    assert (done.status, done.out, done.err) == (0, "", "")
    return out.read_text(encoding="utf-8")


def _head_and_rows(text: str) -> str:
    head = [line for line in text.splitlines() if line.startswith("#")]
    return "\n".join([*head, "…", *_rows(text)]) + "\n"


def _rows(text: str) -> list[str]:
    return ["joints:", *(line for line in text.splitlines() if line.startswith("  - {"))]


def _masked(text: str) -> str:
    return re.sub(DIGITS, "?", text)


@pytest.fixture
def stanford(tmp_path: Path) -> Path:
    file = tmp_path / "axes.yaml"
    file.write_bytes(stanford_axes())
    return file


def test_the_page_shows_the_axes_file_of_the_puma() -> None:
    lines = PUMA.read_text(encoding="utf-8").splitlines()
    shown = _block("yaml", 0).splitlines()
    assert shown == [line for line in lines if line.startswith(("parameters", "axes", "  - {", "tool"))]


def test_the_first_command_of_the_page_is_the_one_that_is_explained() -> None:
    assert _block("text", 0) == "dh2sim frames docs/puma560_axes.yaml --explain\n"


def test_the_explanation_of_the_puma_is_what_the_command_writes(tmp_path: Path) -> None:
    text = _robot_file(tmp_path, PUMA, "--explain")
    assert _masked(_block("text", 1)) == _masked(_head_and_rows(text))
    assert len(re.findall(DIGITS, _block("text", 1))) == 2
    assert (tmp_path / "puma560_standard-frames.svg").stat().st_size > 10_000


def test_the_modified_rows_of_the_puma_are_what_the_command_writes(tmp_path: Path) -> None:
    text = _robot_file(tmp_path, PUMA, "--convention", "modified")
    assert _block("text", 2).splitlines() == _rows(text)


def test_the_explanation_of_the_stanford_arm_is_what_the_command_writes(stanford: Path, tmp_path: Path) -> None:
    text = _robot_file(tmp_path, stanford, "--explain")
    assert _masked(_block("text", 3)) == _masked(_head_and_rows(text))


def test_the_published_table_of_the_puma_comes_out_number_for_number(tmp_path: Path) -> None:
    made = parse_robot(_robot_file(tmp_path, PUMA), file="robot.yaml")
    published = load_robot("puma560_standard")
    _same_table(made, published)
    assert [row.limits.position for row in made.rows] == [row.limits.position for row in published.rows]
    assert set(made.configurations) == set(published.configurations)
    for name, vector in published.configurations.items():
        np.testing.assert_array_equal(made.configurations[name], vector)


def test_the_table_of_the_stanford_arm_comes_out_number_for_number(stanford: Path, tmp_path: Path) -> None:
    _same_table(parse_robot(_robot_file(tmp_path, stanford), file="robot.yaml"), load_robot("stanford"))


def _same_table(made: RobotSpec, published: RobotSpec) -> None:
    for row, expected in zip(made.rows, published.rows, strict=True):
        assert (row.type, row.convention) == (expected.type, expected.convention)
        assert (row.a, row.alpha, row.d, row.theta) == (expected.a, expected.alpha, expected.d, expected.theta)
    for pose, expected_pose in ((made.base.pose, published.base.pose), (made.tool, published.tool)):
        np.testing.assert_array_equal(pose.xyz, expected_pose.xyz)
        np.testing.assert_array_equal(pose.rpy, expected_pose.rpy)


@pytest.mark.slow
def test_the_script_draws_every_picture_of_the_page(tmp_path: Path) -> None:
    draw_pictures(tmp_path)
    linked = re.findall(r"\]\(images/(\w+\.svg)\)", PAGE)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(linked)
    assert all((ROOT / "docs" / "images" / name).is_file() for name in linked)


def test_every_link_of_the_page_leads_somewhere() -> None:
    headings = {
        re.sub(r"[^\w -]", "", line.lower()).replace(" ", "-") for line in re.findall(r"^#+ (.*)$", PAGE, re.M)
    }
    for target in re.findall(r"\]\(([^)]+)\)", PAGE):
        if target.startswith("#"):
            assert target[1:] in headings
        else:
            assert (ROOT / "docs" / target).is_file()
