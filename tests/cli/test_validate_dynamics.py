"""``dh2sim validate --dynamics``: what is simulated is reported like the rest."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from tests.program import Outcome, dh2sim, dh2sim_process
from tests.robot_files import small, write
from tests.validate.motion.robots import FOLDED, WEAK

QUANTITIES = ["energy order", "momentum", "rest", "tracking", "inverse dynamics", "self-contact"]


def expected(run: Outcome) -> str:
    """What was printed, with its lines joined."""
    return " ".join(run.out.split())


def test_the_table_shows_the_physics_checks_after_the_others(tmp_path: Path) -> None:
    robot = write(tmp_path, small())
    run = dh2sim("validate", robot, "--samples", "3", "--dynamics")
    assert (run.status, run.err) == (0, "")
    rows = [line for line in run.out.splitlines() if line.startswith("mujoco-rollout")]
    for row, name in zip(rows, QUANTITIES, strict=True):
        assert row.removeprefix("mujoco-rollout").split("  ")[1].strip() == name
    assert all(row.endswith(" ok") for row in rows)
    assert run.out.splitlines()[-6:] == rows
    without = dh2sim("validate", robot, "--samples", "3")
    assert without.status == 0
    assert "mujoco-rollout" not in without.out


@pytest.mark.slow
def test_programs_get_the_same_report_every_time(tmp_path: Path) -> None:
    robot = write(tmp_path, small())
    options = ("validate", robot, "--samples", "3", "--dynamics", "--json", "-")
    runs = [dh2sim_process(*options, cwd=tmp_path), dh2sim(*options)]
    assert runs[0] == runs[1]
    assert (runs[0].status, runs[0].err) == (0, "")
    [report] = json.loads(runs[0].out)["robots"]
    entries = [entry for entry in report["engines"] if entry["engine"] == "mujoco-rollout"]
    assert [entry["quantity"] for entry in entries] == QUANTITIES
    assert [entry["tolerance"] for entry in entries] == [0.5, 1e-9, 1e-9, 0.2, 1e-9, 0.0]
    assert all(set(entry) >= {"reference", "samples", "max_error", "ok"} for entry in entries)
    assert {path.name for path in tmp_path.iterdir()} == {"small.yaml"}
    other = dh2sim(*options, "--seed", "1")
    assert json.loads(other.out) != json.loads(runs[0].out)


def test_a_robot_that_falls_short_makes_the_exit_status_1(tmp_path: Path) -> None:
    junit = tmp_path / "report.xml"
    run = dh2sim("validate", write(tmp_path, FOLDED), "--samples", "3", "--dynamics", "--junit", junit)
    assert (run.status, run.err) == (1, "")
    assert run.out.startswith("folded DOES NOT match its table\n")
    [line] = [line for line in run.out.splitlines() if " self-contact " in line and line.endswith("FAILED")]
    assert line.startswith("mujoco-rollout")
    assert "mujoco-rollout, self-contact: link_1 and link_3 overlap by " in expected(run)
    assert " in configuration 'folded'" in expected(run)
    [failure] = ET.parse(junit).iter("failure")
    assert "in configuration 'folded'" in failure.get("message", "")
    assert dh2sim("validate", tmp_path / "folded.yaml", "--samples", "3").status == 0


@pytest.mark.slow
def test_what_cannot_be_checked_is_reported_and_is_no_failure(tmp_path: Path) -> None:
    run = dh2sim("validate", write(tmp_path, WEAK), "--samples", "3", "--dynamics")
    assert run.status == 0
    for text in (
        "rest: the motors are too weak to carry the arm in any of its random poses",
        "tracking: the motors are too weak for any motion that was tried",
    ):
        assert f"mujoco-rollout: {text}" in expected(run)


@pytest.mark.slow
def test_several_robots_are_simulated_one_after_the_other() -> None:
    run = dh2sim("validate", "scara", "rpr", "--samples", "3", "--dynamics", "--json", "-")
    assert run.status == 0
    report = json.loads(run.out)
    for robot in report["robots"]:  # PyBullet is not everywhere
        assert len([entry for entry in robot["engines"] if entry["engine"] != "pybullet"]) == 24


def test_the_help_tells_of_it() -> None:
    run = dh2sim("validate", "--help")
    assert "--dynamics" in run.out
    assert "dh2sim validate stanford --dynamics" in run.out
