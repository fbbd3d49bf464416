"""``dh2sim frames``."""

from __future__ import annotations

from pathlib import Path

import pytest

from dh2sim.robot.read import parse_robot
from tests.program import Outcome, contents, dh2sim

AXES = """\
name: two
axes:
  - {type: revolute, point: [0, 0, 0.3], direction: [0, 0, 1]}
  - {type: revolute, point: [0.4, 0, 0.3], direction: [0, -1, 0]}
tool: {xyz: [0.7, 0, 0.3]}
"""


@pytest.fixture
def axes(tmp_path: Path) -> Path:
    path = tmp_path / "axes.yaml"
    path.write_text(AXES)
    return path


def test_the_robot_file_is_printed(axes: Path) -> None:
    run = dh2sim("frames", axes)
    assert run.status == 0
    assert [row.a for row in parse_robot(run.out).rows] == [0.4, 0.3]
    assert not run.out.startswith("#")
    assert run.err.startswith("two, 2 rows, standard; off by at most ")


@pytest.mark.slow
def test_with_explain_every_step_is_reported_and_drawn(axes: Path, tmp_path: Path) -> None:
    out = tmp_path / "two.yaml"
    run = dh2sim("frames", axes, "--explain", "-o", out)
    assert (run.status, run.err) == (0, "")
    drawing = tmp_path / "two-frames.svg"
    assert run.out.splitlines()[1] == f"{drawing}: axes and frames"
    assert drawing.read_text().startswith("<?xml")
    assert out.read_text().startswith("# ")
    assert [row.a for row in parse_robot(out.read_text()).rows] == [0.4, 0.3]


def test_the_picture_goes_where_asked_for(axes: Path, tmp_path: Path) -> None:
    drawing = tmp_path / "frames.png"
    run = dh2sim("frames", axes, "--picture", drawing)
    assert run.status == 0
    assert drawing.read_bytes().startswith(b"\x89PNG")
    assert not run.out.startswith("#")


def test_a_picture_that_exists_is_not_overwritten_and_nothing_else_is_written(axes: Path, tmp_path: Path) -> None:
    drawing, out = tmp_path / "frames.svg", tmp_path / "two.yaml"
    drawing.write_text("mine")
    before = contents(tmp_path)
    run = dh2sim("frames", axes, "--picture", drawing, "-o", out)
    assert (run.status, run.out) == (2, "")
    assert run.err == f"dh2sim: '{drawing}' already exists; choose another name, or overwrite it with --force\n"
    assert contents(tmp_path) == before


def test_a_picture_of_an_unknown_kind_is_refused_before_anything_is_done(axes: Path, tmp_path: Path) -> None:
    run = dh2sim("frames", axes, "--picture", tmp_path / "frames.bmp")
    assert (run.status, run.out) == (2, "")
    assert "allowed endings: " in run.err


def test_mistakes_in_the_axes_are_reported_all_at_once_with_their_places(tmp_path: Path) -> None:
    path = tmp_path / "axes.yaml"
    path.write_text(AXES.replace("[0, -1, 0]", "[0, 0, 0]").replace("tool:", "tol:"))
    run = dh2sim("frames", path)
    assert (run.status, run.out) == (2, "")
    lines = run.err.splitlines()
    assert len(lines) == 2
    assert lines[0].startswith(f"{path}:4:")
    assert "Did you mean 'tool'?" in lines[1]


def test_the_convention_is_the_one_asked_for(axes: Path) -> None:
    run = dh2sim("frames", axes, "--convention", "modified")
    assert {row.convention.value for row in parse_robot(run.out).rows} == {"modified"}


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("arm.urdf", "<robot name='arm'/>", "this is a URDF, not a list of axes: run 'dh2sim import {file}'"),
        ("arm.md", "| a | d |\n", "this is a Markdown table, not a list of axes: run 'dh2sim import {file}'"),
        (
            "arm.yaml",
            "joints: []\n",
            "this is a robot file, not a list of axes; 'dh2sim info {file}' shows its table",
        ),
    ],
)
def test_other_files_than_axes_are_named(tmp_path: Path, name: str, text: str, reason: str) -> None:
    file = tmp_path / name
    file.write_text(text)
    assert dh2sim("frames", file) == Outcome(status=2, out="", err=f"dh2sim: {file}: {reason.format(file=file)}\n")
