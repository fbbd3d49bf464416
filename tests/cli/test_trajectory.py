from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dh2sim as library
from tests.program import dh2sim
from tests.sample_robots import NAMES, model

WAYPOINTS = """\
robot: puma560
units: {angle: deg, length: mm}
parameters: {lift: 50}
limits: {velocity: 50%, jerk: {joint_1: 4000}}
waypoints:
  - home
  - {q: [10, -50, -20, 5, 40, 20], stop: false}
  - {name: above, q: [20, -40, -20, 5, 40, 20], wait: 0.5}
  - {xyz: [400, 100, "300 + lift"], rpy: [180, 0, 0]}
  - {xyz: [450, 100, 300], kind: line}
  - {xyz: [450, 200, 300], via: [480, 150, 300]}
  - {centre: [450, 150, 300], angle: 90, axis: [0, 0, 1]}
"""


def waypoints(folder: Path, text: str) -> Path:
    file = folder / "points.yaml"
    file.write_text(text, encoding="utf-8")
    return file


def planned(*arguments: str | Path) -> Any:
    run = dh2sim("trajectory", *arguments, "--json")
    assert (run.status, run.err) == (0, "")
    return json.loads(run.out)


@pytest.mark.parametrize("name", NAMES)
def test_every_robot_goes_from_home_to_home_by_way_of_itself(name: str) -> None:
    answer = planned(name, "home", "home")
    assert answer["duration"] == 0.0
    assert [joint["name"] for joint in answer["joints"]] == [j.name for j in model(name).moving_joints]


def test_names_and_numbers_are_waypoints_in_the_files_units() -> None:
    answer = planned("stanford", "home", "20", "40", "0.5", "-30", "45", "-10", "20,40,0.6,-30,45,-10", "home")
    q = [point["q"] for point in answer["waypoints"]]
    np.testing.assert_allclose(q[1], np.radians([20, 40, np.degrees(0.5), -30, 45, -10]), rtol=1e-12)
    assert q[2][2] == 0.6
    assert q[3] == model("stanford").home.tolist()
    assert [point["name"] for point in answer["waypoints"]] == ["home", "", "", "home"]


def test_a_waypoint_file_with_everything_in_it(tmp_path: Path) -> None:
    out = tmp_path / "motion.npz"
    answer = planned("puma560", waypoints(tmp_path, WAYPOINTS), "-o", out)
    assert [p["kind"] for p in answer["waypoints"]] == ["start", "joint", "joint", "joint", "line", "arc", "arc"]
    assert [p["stop"] for p in answer["waypoints"]] == [True, False, True, True, True, True, True]
    assert answer["waypoints"][2]["name"] == "above"
    assert answer["joints"][0]["jerk"]["limit"] == pytest.approx(np.radians(4000))
    read = library.read_trajectory(out)
    assert answer["samples"] == len(read.time)
    puma = library.Robot.load("puma560")
    tool = puma.fk(np.array([p["q"] for p in answer["waypoints"]]))[:, :3, 3]
    np.testing.assert_allclose(tool[3:6], [[0.4, 0.1, 0.35], [0.45, 0.1, 0.3], [0.45, 0.2, 0.3]], atol=1e-9)
    np.testing.assert_allclose(tool[6], [0.4, 0.15, 0.3], atol=1e-9)  # a quarter turn


def test_errors_of_a_waypoint_file_name_line_and_column_all_at_once(tmp_path: Path) -> None:
    file = waypoints(
        tmp_path,
        "robot: stanford\nkind: lin\nwaypoints:\n  - hom\n  - [1, 2]\n  - {xyz: [1, 2, 3], q: home}\n"
        "  - {q: home, via: [0, 0, x]}\n  - {q: home, sotp: false}\n",
    )
    run = dh2sim("trajectory", "puma560", file)
    assert (run.status, run.out) == (2, "")
    for said in (
        f"{file}:1:8: robot: these waypoints are for 'stanford', not for 'puma560'",
        f"{file}:2:7: kind: found 'lin'. Did you mean 'line'? Allowed: joint, line, arc",
        f"{file}:4:5: waypoints[0].q: puma560 has no configuration 'hom'. Did you mean 'home'?",
        f"{file}:5:5: waypoints[1].q: expected 6 joint coordinates",
        f"{file}:6:5: waypoints[2]: q and xyz exclude each other; give one of q, xyz and centre",
        f"{file}:7:27: waypoints[3].via[2]: ",
        f"{file}:8:15: waypoints[4]: unknown key 'sotp'. Did you mean 'stop'?",
    ):
        assert said in run.err


def test_what_cannot_be_followed_names_the_place_in_the_file(tmp_path: Path) -> None:
    file = waypoints(tmp_path, "waypoints:\n  - home\n  - {xyz: [9, 0, 0], kind: line}\n")
    run = dh2sim("trajectory", "ur5e", file)
    assert run.status == 2
    assert run.err.startswith(f"{file}:3:5: waypoints[1]: the path is not reached beyond ")


def test_samples_are_written_once_and_at_the_rate_asked_for(tmp_path: Path) -> None:
    out = tmp_path / "motion.csv"
    line = ("trajectory", "scara", "home", "zero", "-o", out)
    assert dh2sim(*line, "--rate", "100").status == 0
    read = library.read_trajectory(out)
    np.testing.assert_allclose(read.time[:-1], 0.01 * np.arange(len(read.time) - 1), atol=1e-12)
    again = dh2sim(*line)
    assert again.status == 2
    assert "already exists; choose another name, or overwrite it with --force" in again.err
    assert dh2sim(*line, "--samples", "11", "--force").status == 0
    assert len(library.read_trajectory(out).time) == 11


@pytest.mark.parametrize("name", ["puma560", "franka_panda", "so101", "ur5e"])
def test_the_report_fits_into_80_columns(name: str) -> None:
    run = dh2sim("trajectory", name, "home", "home", "--limits")
    assert run.status == 0
    assert max(map(len, run.out.splitlines())) <= 80


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["home"], "dh2sim: a trajectory needs at least two waypoints, got 1"),
        (["home", "zer"], "has no configuration 'zer'. Did you mean 'zero'?"),
        (["home", "1", "2"], "has 6 joint coordinates, got 2"),
        (["home", "zero", "--duration", "0.01"], "0.01 s are too short: within its limits puma560 takes"),
        (
            ["home", "zero", "--kind", "lin"],
            "--kind must be one of joint, line, arc, got 'lin'. Did you mean 'line'?",
        ),
        (["home", "zero", "--limits", "veloctiy=3"], "--limits 'veloctiy' is not a limit. Did you mean 'velocity'?"),
        (["home", "zero", "--limits", "j.velocity=3"], "--limits puma560 has no joint 'j' that moves."),
        (["home", "zero", "--limits", "velocity"], "--limits must be NAME=VALUE, got 'velocity'"),
        (["home", "zero", "--limits", "velocity=0"], "--limits velocity must be a finite number above 0, got 0.0"),
        (["home", "zero", "--rate", "5"], "needs --out"),
        (["home", "zero", "-o", "motion.txt"], "--out must end in .csv or .npz, got 'motion.txt'"),
        (["home", "zero", "--kind", "line"], "the line reaches the pose at its end in another configuration"),
        (["points.yaml", "home"], "points.yaml is a waypoint file: it cannot be combined with other waypoints"),
        (["points.yaml"], "points.yaml: cannot be read"),
        (["points.csv"], "'points.csv' is not a waypoint file: these are YAML with a list 'waypoints'"),
    ],
)
def test_wrong_arguments_exit_2_with_a_sentence(words: list[str], said: str) -> None:
    run = dh2sim("trajectory", "puma560", *words)
    assert (run.status, run.out) == (2, "")
    assert said in run.err
    assert "Traceback" not in run.err
