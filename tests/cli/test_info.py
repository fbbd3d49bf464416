from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from dh2sim import build_chain, build_model, forward_kinematics, frame_poses, load_robot
from tests.program import dh2sim
from tests.robot_files import ODD, RICH, write
from tests.sample_robots import NAMES

FLIPPED = """\
name: flipped
description: "[bold]Not markup[/bold]"
convention: standard
units: {angle: deg}
joints:
  - {type: revolute, a: 0.1, alpha: -90, d: 0.3, theta: 30, flip: true, limits: {position: [10, 20]}}
  - {type: prismatic, d: -0.5}
  - {type: continuous, theta: -45}
  - {type: fixed, d: 0.25, theta: 15}
"""

HAYATI = """\
name: hayati
convention: hayati
units: {angle: deg}
joints:
  - {name: shoulder, type: revolute, a: 0.4318, alpha: 0.1, beta: -0.05}
  - {name: slide, type: prismatic, a: 0.1, d: 0.2, limits: {position: [-1, 1]}}
  - {name: plate, type: fixed, beta: 0.25, theta: 15}
"""


def test_json_holds_everything_in_si_units(tmp_path: Path) -> None:
    robot = write(tmp_path, RICH)
    run = dh2sim("info", robot, "--json")
    assert (run.status, run.err) == (0, "")
    printed = json.loads(run.out)
    chain, home = build_chain(load_robot(robot)), [0.3, -0.4]
    frames = {f"dh_{i}": T.tolist() for i, T in enumerate(frame_poses(chain, home))}
    assert printed["frames_at_home"] == {**frames, "tool0": forward_kinematics(chain, home).tolist()}
    assert printed["configurations"] == {"home": home, "up": [1.0, 1.0]}
    assert [printed[key] for key in ("name", "home", "reach")] == ["rich", home, 0.7]
    assert printed["rows"][0] == {
        "joint": "joint_1",
        "type": "revolute",
        "convention": "standard",
        "a": 0.4,
        "alpha": 0.0,
        "d": 0.0,
        "theta": 0.0,
        "beta": 0.0,
        "flip": False,
        "limits": {"position": [-2.0, 2.0], "velocity": 3.0, "effort": 80.0, "assumed": []},
    }
    assert [link["estimated"] for link in printed["links"]] == [["inertia"], ["mass", "com", "inertia"]]
    assert printed["links"][0]["mass"] == 4.0
    assert printed["mass"] == sum(link["mass"] for link in printed["links"])
    assert printed["disabled_collisions"] == [
        {"link1": "base_link", "link2": "link_1", "reason": "Adjacent"},
        {"link1": "link_1", "link2": "link_2", "reason": "Adjacent"},
    ]


def test_a_robot_that_comes_with_dh2sim_is_printed_with_its_kind(tmp_path: Path) -> None:
    assert dh2sim("info", "ur5e").out.startswith("ur5e  Universal Robots UR5e, six turning joints (cobot)\n")
    assert json.loads(dh2sim("info", "ur5e", "--json").out)["group"] == "cobot"
    assert json.loads(dh2sim("info", write(tmp_path, RICH), "--json").out)["group"] is None


def test_the_table_reads_as_in_a_textbook(tmp_path: Path) -> None:
    robot = write(tmp_path, FLIPPED)
    lines = dh2sim("info", robot).out.splitlines()
    travel = build_model(load_robot(robot)).joints[1].position_range
    assert travel is not None
    assert lines[0] == "flipped  [bold]Not markup[/bold]"
    assert lines[1:3] == ["", "DH table, standard convention"]
    assert [line.split() for line in lines[3:5]] == [
        ["a", "i", "alpha", "i", "d", "i", "theta", "i"],
        ["i", "joint", "type", "m", "deg", "m", "deg", "limits"],
    ]
    assert [" ".join(line.split()) for line in lines[6:10]] == [
        "1 joint_1 revolute 0.1 -90 0.3 30 - θ1* 10 … 20°",
        f"2 joint_2 prismatic 0 0 d2* - 0.5 0 ({travel[0]:.6g} … {travel[1]:.6g} m)",
        "3 joint_3 continuous 0 0 0 θ3* - 45 none",
        "4 joint_4 fixed 0 0 0.25 15",
    ]
    assert "Limits in parentheses are assumed." in lines


def test_a_modified_table_names_its_indices_and_a_mixed_one_each_rows_convention(tmp_path: Path) -> None:
    modified = dh2sim("info", "puma560").out
    assert "DH table, modified convention" in modified
    assert ["a", "i-1", "alpha", "i-1", "d", "i", "theta", "i"] in [line.split() for line in modified.splitlines()]
    mixed = dh2sim("info", write(tmp_path, ODD)).out
    assert "DH table, mixed conventions" in mixed
    rows = [line.split()[:4] for line in mixed.splitlines() if line.split()[:1] in (["1"], ["2"], ["3"])]
    assert rows[:3] == [
        ["1", "one", "revolute", "standard"],
        ["2", "two", "prismatic", "modified"],
        ["3", "three", "fixed", "modified"],
    ]


def test_a_hayati_table_has_a_second_twist_and_no_offset_but_of_slides(tmp_path: Path) -> None:
    robot = write(tmp_path, HAYATI)
    lines = dh2sim("info", robot).out.splitlines()
    assert lines[2] == "DH table, Hayati convention"
    assert [line.split() for line in lines[3:5]] == [
        ["a", "i", "alpha", "i", "beta", "i", "d", "i", "theta", "i"],
        ["i", "joint", "type", "m", "deg", "deg", "m", "deg"],
    ]
    words = [" ".join(line.split()) for line in lines]
    assert words[6:9] == [
        "1 shoulder revolute 0.4318 0.1 -0.05 θ1*",
        "2 slide prismatic 0.1 0 0 d2* + 0.2 0",
        "3 plate fixed 0 0 0.25 15",
    ]
    assert words[10:15] == ["Limits", "i joint limits", "─" * 26, "1 shoulder (-180 … 180°)", "2 slide -1 … 1 m"]
    printed = json.loads(dh2sim("info", robot, "--json").out)
    assert [row["convention"] for row in printed["rows"]] == ["hayati"] * 3
    assert [row["beta"] for row in printed["rows"]] == [math.radians(-0.05), 0.0, math.radians(0.25)]


def test_rows_of_other_conventions_have_no_second_twist(tmp_path: Path) -> None:
    text = HAYATI.replace("type: fixed", "type: fixed, convention: standard").replace("beta: 0.25", "d: 0.3")
    lines = dh2sim("info", write(tmp_path, text)).out.splitlines()
    assert lines[2] == "DH table, mixed conventions"
    assert [" ".join(line.split()) for line in lines[6:9]] == [
        "1 shoulder revolute hayati 0.4318 0.1 -0.05 θ1*",
        "2 slide prismatic hayati 0.1 0 0 d2* + 0.2 0",
        "3 plate fixed standard 0 0 0.3 15",
    ]


def test_nothing_of_a_wide_table_is_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    name = "a_joint_with_a_name_that_goes_on_and_on_and_on"
    out = dh2sim("info", write(tmp_path, ODD.replace("one,", f"{name},"))).out
    assert name in out
    assert "37.2996" in out
    assert "-143.239 … 154.699°" in out


@pytest.mark.parametrize(
    ("text", "title"),
    [
        (RICH, "Frames in base_link at home"),
        (ODD, "Frames in base_link at zero"),
        (FLIPPED, "Frames in base_link at zero moved inside the limits"),
    ],
    ids=["home", "zero", "moved"],
)
def test_the_configuration_of_the_frames_is_named(tmp_path: Path, text: str, title: str) -> None:
    lines = dh2sim("info", write(tmp_path, text)).out.splitlines()
    assert title in [line.strip() for line in lines]


def test_what_was_estimated_and_assumed_is_printed(tmp_path: Path) -> None:
    lines = dh2sim("info", write(tmp_path, RICH)).out.splitlines()
    assert lines[-3:] == [
        "Estimated from the shapes, not measured: inertia of link_1.",
        "Estimated from the shapes, not measured: mass, com, inertia of link_2.",
        "Assumed, not given: effort limits of elbow.",
    ]
    assert lines[-4].startswith("reach at most 0.7 m, moving mass ")


def test_pairs_of_links_that_do_not_collide_are_printed_when_asked_for(tmp_path: Path) -> None:
    robot = write(tmp_path, RICH)
    without = dh2sim("info", robot).out
    assert dh2sim("info", robot, "--srdf").out == without + (
        "Pairs of links that do not collide, as in an SRDF:\n"
        '  <disable_collisions link1="base_link" link2="link_1" reason="Adjacent"/>\n'
        '  <disable_collisions link1="link_1" link2="link_2" reason="Adjacent"/>\n'
    )


MILLIMETRES = """\
name: millimetres
convention: modified
units: {angle: deg, length: mm}
joints:
  - {type: revolute, a: 431.8, d: 150, limits: {position: [-90, 90]}}
  - {type: prismatic, alpha: 90, d: 20, limits: {position: [0, 210]}}
"""


def test_lengths_are_printed_in_the_unit_of_the_file_too(tmp_path: Path) -> None:
    out = dh2sim("info", write(tmp_path, MILLIMETRES)).out
    lines = [" ".join(line.split()) for line in out.splitlines()]
    assert lines[3:5] == ["a i-1 a i-1 alpha i-1 d i d i theta i", "i joint type m mm deg m mm deg"]
    assert lines[6:8] == [
        "1 joint_1 revolute 0.4318 431.8 0 0.15 150 θ1*",
        "2 joint_2 prismatic 0 0 90 d2* + 0.02 d2* + 20 0",
    ]
    assert lines[12:14] == ["1 joint_1 -90 … 90°", "2 joint_2 0 … 210 mm = 0 … 0.21 m"]
    assert lines[16:18] == ["x y z x y z roll pitch yaw", "frame m m m mm mm mm deg deg deg"]
    assert lines[20] == "dh_1 0.4318 0.0000 0.1500 431.8 0.0 150.0 0.000 0.000 0.000"
    assert lines[24].startswith("reach at most 687.1 mm (0.6871 m), moving mass ")


def test_limits_are_in_a_table_of_their_own_where_one_would_be_too_wide(tmp_path: Path) -> None:
    lines = dh2sim("info", write(tmp_path, MILLIMETRES)).out.splitlines()
    start = lines.index("Limits")
    assert lines[start : start + 5] == [
        "Limits",
        "i  joint                     limits",
        "───────────────────────────────────",
        "1  joint_1                -90 … 90°",
        "2  joint_2  0 … 210 mm = 0 … 0.21 m",
    ]
    assert max(map(len, lines[:start])) <= 80


WIDE = ("kinova_gen3", "scara", "ssrms", "stanford", "ur10e")
"""Robots whose tables are wide in one way or another."""


@pytest.mark.parametrize(
    "name", [name if name in WIDE else pytest.param(name, marks=pytest.mark.slow) for name in NAMES]
)
def test_eighty_columns_hold_all_that_is_printed_of_a_robot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    for arguments in (["info", name], ["export", name], ["export", name], ["validate", name, "--samples", "20"]):
        run = dh2sim(*arguments)
        assert (run.status, run.err) == (0, "")
        assert max(len(line) for line in run.out.splitlines()) <= 80, arguments
