"""``dh2sim calibrate``: measurements in, a robot file and a report out."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.read import load_robot
from tests.calibrate.measured import off, random_q
from tests.program import dh2sim
from tests.sample_robots import robot


@pytest.fixture(scope="module")
def points(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Positions of a Stanford arm that is off its table, in six placements."""
    nominal = robot("stanford")
    q = random_q(nominal, 60, 1)
    p = table_tool_pose(off(nominal, 1e-3, 2), q)[:, :3, 3] + 5e-5 * np.random.default_rng(3).normal(size=(60, 3))
    lines = [
        ",".join(
            [f"joint_{i} [{'mm' if i == 3 else 'deg'}]" for i in range(1, 7)]
            + ["x [mm]", "y [mm]", "z [mm]", "placement"]
        )
    ]
    for k, (each, point) in enumerate(zip(q.tolist(), (1e3 * p).tolist(), strict=True)):
        joints = [1e3 * value if i == 2 else math.degrees(value) for i, value in enumerate(each)]
        lines.append(",".join([*map(repr, [*joints, *point]), f"place {k % 6}"]))
    file = tmp_path_factory.mktemp("points") / "points.csv"
    file.write_text("\n".join(lines) + "\n")
    return file


def test_the_report_says_what_is_told_and_how_well(points: Path, tmp_path: Path) -> None:
    out = tmp_path / "my_stanford.yaml"
    run = dh2sim("calibrate", "stanford", points, "--noise", "0.05mm", "-o", out)
    assert (run.status, run.err) == (0, "")
    lines = run.out.splitlines()
    assert lines[0] == "stanford: calibrated with 60 positions, 6 placements"
    assert any(line.startswith("identifiable  25 parameters of the robot, 25 at most") for line in lines)
    assert any(line.startswith("held out by placement: as it was") for line in lines)
    assert "Folded: joint_1.d into base.z" in lines
    assert max(map(len, lines[:-1])) <= 80
    calibrated = load_robot(out)
    q = random_q(calibrated, 100, 5)
    true = off(robot("stanford"), 1e-3, 2)
    errors = table_tool_pose(calibrated, q)[:, :3, 3] - table_tool_pose(true, q)[:, :3, 3]
    assert np.linalg.norm(errors, axis=1).max() < 2e-4
    text = out.read_text(encoding="utf-8")
    assert "# Note: calibrated with 60 positions, 6 placements of points.csv" in text
    assert "printed: [45, 60, 0.2, 45, 0, -60]       # the slides' other pose" in text
    assert [row.limits.position for row in calibrated.rows] == [row.limits.position for row in robot("stanford").rows]
    again = dh2sim("calibrate", "stanford", points, "-o", out)
    assert again.status == 2
    assert "already exists" in again.err


def test_json_is_the_same_as_data(points: Path) -> None:
    run = dh2sim("calibrate", "stanford", points, "--json", "--unknown", "base,tool,theta")
    assert (run.status, run.err) == (0, "")
    data = json.loads(run.out)
    assert data["kind"] == "position"
    assert data["grouped_by"] == "placement"
    assert len(data["held_out"]["folds"]) == 6
    assert {each["status"] for each in data["parameters"] if each["name"].endswith(".alpha")} == {"held"}
    assert data["errors"]["nominal"]["length"] > data["errors"]["calibrated"]["length"] > 5e-5


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "give a file of measurements, or a run with --from-run"),
        (["no.csv"], "no.csv: cannot be read"),
        (["DATA", "--noise", "fast"], "must be a positive number with a unit"),
        (["DATA", "--prior", "1"], "'1' needs a unit, such as 1mm or 1mrad"),
        (["DATA", "--kind", "points"], "It is called 'position' here"),
        (["DATA", "--unknown", "thta"], "Did you mean 'theta'?"),
        (["DATA", "--groups", "day"], "there is no column 'day' to group by"),
        (["DATA", "--kind", "socket"], "missing column socket of --kind socket"),
        (["--from-run", "run.zarr"], "needs --noise"),
    ],
)
def test_wrong_arguments_are_told(arguments: list[str], message: str, points: Path) -> None:
    run = dh2sim("calibrate", "stanford", *[str(points) if word == "DATA" else word for word in arguments])
    assert run.status == 2
    assert message in run.err
    assert run.out == ""


def test_a_run_of_many_designs_is_refused(tmp_path: Path) -> None:
    run = tmp_path / "run.zarr"
    made = dh2sim("rollout", "planar_2r", "--vary", "a1=0.1", "--rollouts", "2", "--steps", "2", "--out", run)
    assert made.status == 0
    refused = dh2sim("calibrate", "planar_2r", "--from-run", run, "--noise", "5e-5")
    assert refused.status == 2
    assert "its rollouts are of many designs, each with a table of its own; use a run of one" in refused.err


@pytest.mark.slow
def test_a_report_is_one_page_that_needs_nothing_else(points: Path, tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    run = dh2sim("calibrate", "stanford", points, "--report", page, "--quiet")
    assert (run.status, run.out, run.err) == (0, "", "")
    text = page.read_text(encoding="utf-8")
    assert "<script" not in text
    assert "http" not in text
    assert text.count("<svg") == text.count("</svg>") == 6
    for svg in re.findall(r"<svg.*?</svg>", text, flags=re.DOTALL):
        ElementTree.fromstring(svg)
    assert "held out by placement: predicted" in text
    assert "nan" not in text


@pytest.mark.slow
def test_configurations_to_measure_are_written_as_the_columns_of_a_file(tmp_path: Path) -> None:
    out = tmp_path / "plan.csv"
    run = dh2sim("calibrate", "scara", "--plan", "10", "-o", out)
    assert (run.status, run.err) == (0, "")
    head, *rows = out.read_text().splitlines()
    assert head == "joint_1 [deg],joint_2 [deg],joint_3 [m],joint_4 [deg]"
    assert len(rows) == 10
    data = json.loads(dh2sim("calibrate", "scara", "--plan", "10", "--json").out)
    assert data["ratio"] < 0.65
    assert np.abs(np.degrees(data["q"])[:, 0] - [float(row.split(",")[0]) for row in rows]).max() < 1e-3
    printed = dh2sim("calibrate", "planar_2r", "--plan", "12", "--kind", "pose").out.splitlines()
    assert max(map(len, printed)) <= 80
    assert "does not apply to --plan" in dh2sim("calibrate", "scara", "data.csv", "--plan", "10").err


@pytest.mark.slow
def test_recordings_of_a_run_stand_in_for_a_tracker(tmp_path: Path) -> None:
    true = tmp_path / "true.yaml"
    text = robot("scara").source_file
    assert text is not None
    true.write_text(text.text.replace("a1: 0.325", "a1: 0.3262").replace("a2: 0.275", "a2: 0.2741"))
    run, out = tmp_path / "run.zarr", tmp_path / "found.yaml"
    assert dh2sim("rollout", true, "--rollouts", "12", "--steps", "400", "--every", "50", "--out", run).status == 0
    done = dh2sim("calibrate", "scara", "--from-run", run, "--noise", "5e-5", "-o", out)
    assert (done.status, done.err) == (0, "")
    q = random_q(robot("scara"), 50, 1)
    gap = table_tool_pose(load_robot(out), q) - table_tool_pose(load_robot(true), q)
    assert np.abs(gap[:, :3, 3]).max() < 6e-4
    assert dh2sim("export", out, "--out", tmp_path / "build").status == 0
    assert dh2sim("validate", out, "--samples", "20").status == 0
