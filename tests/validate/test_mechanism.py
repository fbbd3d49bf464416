"""Mechanisms are validated: the tree's poses, and the loops at home and in motion."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from dh2sim import Robot
from dh2sim.engines.mujoco_mechanism import MujocoMechanism
from dh2sim.robot.catalog import builtin_mechanisms
from dh2sim.validate.mechanism import validate_mechanism
from tests.program import dh2sim

LOOPS = ["loops at home", "freedoms of loops", "loops in motion"]
OTHERS = ["yourdfpy", "pinocchio", "pybullet"]
COSTLY = [name if name == "four_bar" else pytest.param(name, marks=pytest.mark.slow) for name in builtin_mechanisms()]


@pytest.mark.parametrize("name", COSTLY)
def test_mechanisms_that_come_with_dh2sim_match_their_tables(name: str) -> None:
    robot = Robot.load(name)
    if not robot.spec.is_mechanism:
        pytest.skip("a serial robot")
    report = robot.validate()
    assert report.ok, [check for check in report.checks if not check.ok]
    poses = [check for check in report.checks if check.quantity == "pose"]
    assert [check.engine for check in poses] == ["dh2sim", "mujoco-mjcf", "mujoco-urdf", *OTHERS]
    assert all(check.reason for check in poses if check.ok is None), "absent ones say why"
    if robot.spec.closures:
        assert [check.quantity for check in report.checks if check.reference == "loops"] == LOOPS


def _changed(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def test_a_constraint_that_is_missing_or_moved_fails(tmp_path: Path) -> None:
    Robot.load("four_bar").export(tmp_path)
    path = tmp_path / "four_bar" / "four_bar.xml"
    exported = path.read_text(encoding="utf-8")
    _changed(path, '<connect name="C_1"', '<connect active="false" name="C_1"')
    _changed(path, '<connect name="C_2"', '<connect active="false" name="C_2"')
    failed = _failed(tmp_path)
    assert failed == ["freedoms of loops"]
    path.write_text(exported, encoding="utf-8")
    _changed(path, '<body name="rocker/link_1" pos="2.0', '<body name="rocker/link_1" pos="2.001')
    assert _failed(tmp_path)[:2] == ["pose", "loops at home"]


SPHERICAL = """
name: balls
convention: standard
units: {angle: deg}
joints: [{type: R, alpha: 40}, {type: R, alpha: 70}]
branches:
  rocker: {from: base_link, pose: {rpy: [80, 0, 0]}, joints: [{type: R, alpha: 65}]}
closures: [{name: C, between: [dh_2, rocker/dh_1], type: revolute}]
actuated: [joint_1]
assembly: {q: [70, -60, 110]}
"""


def test_a_spherical_linkage_of_balls_whose_centres_rest_is_simulated(tmp_path: Path) -> None:
    (tmp_path / "balls.yaml").write_text(SPHERICAL, encoding="utf-8")
    robot = Robot.load(tmp_path / "balls.yaml")
    robot.export(tmp_path)
    path = tmp_path / "balls" / "balls.xml"
    assert MujocoMechanism(path).gap_in_motion(0.2) < 1e-4
    sites_in_links = re.sub(
        r'<body name="C_([ab]_[12])" (pos="[^"]*") [^>]*>.*?</body>',
        r'<site name="C_\1" \2 />',
        path.read_text(encoding="utf-8"),
        flags=re.DOTALL,
    )
    path.write_text(sites_in_links, encoding="utf-8")
    assert MujocoMechanism(path).gap_in_motion(0.2) == float("inf"), "MuJoCo starts again, and the check ends"
    report = validate_mechanism(robot.mechanism, samples=1, folder=path.parent)
    assert [check.reason for check in report.checks if check.ok is False] == ["the simulation is unstable"]


def test_readers_of_urdf_find_what_was_moved_in_the_tree_and_in_what_mimics(tmp_path: Path) -> None:
    robot = Robot.load("parallel_four_bar")
    robot.export(tmp_path)
    folder = tmp_path / "parallel_four_bar"
    path = folder / "parallel_four_bar.urdf"
    exported = path.read_text(encoding="utf-8")
    _changed(path, 'multiplier="-1.0"', 'multiplier="-1.001"')
    report = validate_mechanism(robot.mechanism, samples=5, folder=folder)
    failed = [check.engine for check in report.checks if check.ok is False]
    assert failed == [check.engine for check in report.checks if check.engine == "yourdfpy" and check.ok is not None]
    path.write_text(exported.replace("<robot", "<robo"), encoding="utf-8")
    report = validate_mechanism(robot.mechanism, samples=5, folder=folder)
    present = [
        "mujoco-urdf",
        *(check.engine for check in report.checks if check.engine in OTHERS and not check.frames),
    ]
    assert [check.engine for check in report.checks if check.ok is False] == present
    assert all(check.quantity == "file" for check in report.checks if check.ok is False)


def _failed(folder: Path) -> list[str]:
    run = dh2sim("validate", "four_bar", "--dir", folder, "--json", "-")
    assert run.status == 1
    [robot] = json.loads(run.out)["robots"]
    return [check["quantity"] for check in robot["engines"] if check["ok"] is False]


def test_physics_checks_are_of_serial_robots() -> None:
    run = dh2sim("validate", "four_bar", "--dynamics")
    assert (run.status, run.err) == (
        2,
        "dh2sim: four_bar: --dynamics is for serial robots; this one is a mechanism\n",
    )
