from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dh2sim import build_chain, forward_kinematics, frame_poses, load_robot
from dh2sim.kinematics.forward import frame_names, frame_pose
from tests.program import Outcome, dh2sim
from tests.robot_files import ODD, write

STANFORD = load_robot("stanford")
CHAIN = build_chain(STANFORD)
Q = [0.3, -0.7, 0.5, 1.1, 0.6, -0.4]
"""rad and m, inside the limits."""
IN_RADIANS = ["--radians", *map(str, Q)]


def _pose(*arguments: str | Path) -> Any:
    run = dh2sim("fk", *arguments, "--json")
    assert (run.status, run.err) == (0, "")
    return np.array(json.loads(run.out)["pose"])


def test_json_alone_is_printed_and_has_the_shape_of_the_contract() -> None:
    run = dh2sim("fk", "stanford", *IN_RADIANS, "--json")
    assert (run.status, run.err) == (0, "")
    assert json.loads(run.out) == {
        "robot": "stanford",
        "frame": "tool0",
        "q": Q,
        "pose": forward_kinematics(CHAIN, Q).tolist(),
    }


@pytest.mark.parametrize(
    "arguments",
    [
        "stanford 0.3 -0.7 0.5 1.1 0.6 -0.4 --json --radians",
        "stanford --json --radians 0.3 -0.7 0.5 1.1 0.6 -0.4",
        "--json --radians stanford 0.3 -0.7 0.5 1.1 0.6 -0.4",
        "stanford --json --radians -- 0.3 -0.7 0.5 1.1 0.6 -0.4",
        "--json --radians -- stanford 0.3 -0.7 0.5 1.1 0.6 -0.4",
        "stanford 0.3 -0.7 --json --radians 0.5 1.1 0.6 -0.4",
        "stanford 3e-1 -7e-1 5.0E-1 1.1 .6 -.4 --json --radians",
        "stanford 3/10 -7/10 1/2 11/10 6/10 -(4/10) --json --radians",
        "--frame tool0 stanford 0.3 -0.7 0.5 1.1 0.6 -0.4 --json --radians",
        "stanford 0.3 -0.7 0.5 1.1 0.6 -0.4 --to=tool0 --json --radians",
        "stanford 0.3,-0.7,0.5,1.1,0.6,-0.4 --json --radians",
        "stanford 0.3, -0.7, 0.5, 1.1, 0.6, -0.4 --json --radians",
        "stanford [0.3, -0.7, 0.5, 1.1, 0.6, -0.4] --json --radians",
        "stanford [ 0.3 -0.7 0.5 1.1 0.6 -0.4 ] --json --radians",
        "stanford --json --radians atan2(sin(0.3),cos(0.3)),-0.7 (0.5) 1.1,0.6 -0.4,",
    ],
)
def test_numbers_and_options_stand_in_any_order_with_and_without_a_double_dash(arguments: str) -> None:
    run = dh2sim("fk", *arguments.split())
    assert (run.status, run.err) == (0, "")
    np.testing.assert_allclose(json.loads(run.out)["pose"], forward_kinematics(CHAIN, Q), rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    "text", ["0.3 -0.7 0.5 1.1 0.6 -0.4", "[0.3 -0.7  0.5 1.1 0.6 -0.4]", " 0.3, -0.7, .5, 1.1, .6, -.4"]
)
def test_a_vector_in_quotation_marks_is_taken_apart(text: str) -> None:
    np.testing.assert_allclose(_pose("stanford", "--radians", text), forward_kinematics(CHAIN, Q), rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("text", "value"),
    [("-1e-3", -1e-3), ("-1.5E+0", -1.5), ("-.5", -0.5), ("-pi/2", -math.pi / 2), ("-sqrt(2)/2", -math.sqrt(0.5))],
)
@pytest.mark.parametrize("dash", [[], ["--"]], ids=["without --", "with --"])
def test_negative_numbers_are_no_options(text: str, value: float, dash: list[str]) -> None:
    q = [text, text, "0.2", text, "0", text]
    expected = forward_kinematics(CHAIN, [value, value, 0.2, value, 0.0, value])
    run = dh2sim("fk", "stanford", "--json", "--radians", *dash, *q)
    assert run.status == 0
    np.testing.assert_allclose(json.loads(run.out)["pose"], expected, rtol=0, atol=1e-15)


def test_coordinates_are_read_in_the_units_of_the_robot_file_unless_an_option_says_otherwise(tmp_path: Path) -> None:
    q = ["45", "-60", "0.2", "45", "0", "-60"]  # of a file in deg and m
    radians = [math.radians(45), math.radians(-60), 0.2, math.radians(45), 0.0, math.radians(-60)]
    np.testing.assert_array_equal(_pose("stanford", *q), forward_kinematics(CHAIN, radians))
    np.testing.assert_array_equal(_pose("stanford", "--degrees", *q), forward_kinematics(CHAIN, radians))
    small = "name: small\nconvention: standard\nunits: {length: mm}\njoints: [{type: revolute}, {type: prismatic}]\n"
    robot = write(tmp_path, small)
    for options, expected in (
        ([], [0.5, 0.25]),
        (["--radians"], [0.5, 250]),
        (["--degrees"], [math.radians(0.5), 250]),
    ):
        run = dh2sim("fk", robot, *options, "0.5", "250", "--json")
        assert json.loads(run.out)["q"] == expected
    assert "\nq           0.5 rad, 250 mm\n" in dh2sim("fk", robot, "0.5", "250").out
    assert "\nq           0.5 deg, 0.25 m\n" in dh2sim("fk", robot, "--degrees", "0.5", "0.25").out
    run = dh2sim("fk", robot, "--degrees", "--radians", "0.5", "250")
    assert (run.status, run.err.splitlines()[-1]) == (
        2,
        "dh2sim: --degrees, --radians cannot be combined",
    )


def test_coordinates_outside_the_limits_are_warned_of() -> None:
    run = dh2sim("fk", "stanford", "170", "-171", "2", "0", "0", "0", "--json")
    assert run.status == 0
    assert run.err == (
        "dh2sim: warning: joint_2: -171 deg is outside the limits -170 to 170\n"
        "dh2sim: warning: joint_3: 2 m is outside the limits 0 to 1.27\n"
    )
    json.loads(run.out)
    assert dh2sim("fk", "stanford", "--radians", "2.96705973", "0", "0", "0", "0", "0").err == ""
    assert "joint_1: 3 rad is outside the limits -2.967059728 to 2.967059728" in (
        dh2sim("fk", "stanford", "--radians", "3", "0", "0", "0", "0", "0").err
    )


@pytest.mark.parametrize("frame", frame_names(CHAIN))
def test_every_frame_can_be_asked_for(frame: str) -> None:
    expected = frame_pose(CHAIN, frame, Q)
    np.testing.assert_array_equal(_pose("stanford", *IN_RADIANS, "--frame", frame), expected)
    np.testing.assert_array_equal(_pose("stanford", *IN_RADIANS, "--to", frame), expected)


def test_a_configuration_may_be_named_and_home_is_the_default(tmp_path: Path) -> None:
    printed = forward_kinematics(CHAIN, STANFORD.configurations["printed"])
    home = forward_kinematics(CHAIN, STANFORD.configurations["home"])
    np.testing.assert_array_equal(_pose("stanford", "printed"), printed)
    np.testing.assert_array_equal(_pose("stanford"), home)


def test_every_robot_has_the_configurations_home_and_zero(tmp_path: Path) -> None:
    odd = write(tmp_path, ODD)  # names none
    chain = build_chain(load_robot(odd))
    for arguments in ([odd], [odd, "home"], [odd, "zero"]):
        np.testing.assert_array_equal(_pose(*arguments), forward_kinematics(chain, np.zeros(4)))
    high = write(
        tmp_path,
        "name: high\nconvention: standard\njoints:\n  - {type: prismatic, limits: {position: [0.1, 1]}}\n"
        "  - {type: prismatic, limits: {position: [-2, -1]}}\n",
    )
    assert json.loads(dh2sim("fk", high, "home", "--json").out)["q"] == [0.1, -1.0]
    run = dh2sim("fk", high, "zero", "--json")
    assert json.loads(run.out)["q"] == [0.0, 0.0]
    assert len(run.err.splitlines()) == 2


def test_the_pose_of_any_frame_in_any_other_is_printed() -> None:
    found = _pose("stanford", *IN_RADIANS, "--from", "dh_2", "--to", "dh_4")
    T_base_from, T_base_to = frame_pose(CHAIN, "dh_2", Q), frame_pose(CHAIN, "dh_4", Q)
    np.testing.assert_allclose(T_base_from @ found, T_base_to, rtol=0, atol=1e-15)
    run = dh2sim("fk", "stanford", "--from", "tool0", "--to", "base_link")
    assert run.out.startswith("stanford: pose of base_link in tool0\n")
    assert json.loads(dh2sim("fk", "stanford", "--from", "dh_1", "--json").out)["from"] == "dh_1"


def test_all_prints_every_rows_transform_and_every_frame(tmp_path: Path) -> None:
    odd = write(tmp_path, ODD)
    found = json.loads(dh2sim("fk", odd, "0.3", "-0.4", "0.5", "0.6", "--all", "--json").out)
    assert found["q"] == [0.3, -0.4, 0.5, 0.6]
    T_base_0, product = np.array(found["T_base_link_0"]), np.eye(4)
    frames = frame_poses(build_chain(load_robot(odd)), found["q"])
    for A, T, T_base in zip(found["A"], found["T_0"], frames[1:], strict=True):
        product = product @ A
        np.testing.assert_allclose(T, product, rtol=0, atol=1e-15)
        np.testing.assert_allclose(T_base_0 @ T, T_base, rtol=0, atol=1e-15)
    np.testing.assert_allclose(
        T_base_0 @ product @ found["T_n_tool0"], _pose(odd, "0.3", "-0.4", "0.5", "0.6"), rtol=0, atol=1e-15
    )
    text = dh2sim("fk", odd, "--all").out
    titles = [line for line in text.splitlines() if not line.startswith("  ")]
    assert titles[2:5] == ["T_base_link_0", "A_1  (one)", "T_0_1"]
    assert titles[-1] == "T_5_tool0"
    plain = [line for line in dh2sim("fk", "rpr", "--all").out.splitlines() if not line.startswith("  ")]
    assert plain[2:] == [
        f"{kind}{i}{name}" for i in (1, 2, 3) for kind, name in (("A_", f"  (joint_{i})"), ("T_0_", ""))
    ]
    run = dh2sim("fk", "rpr", "--all", "--frame", "dh_1")
    assert (run.status, run.err.splitlines()[-1]) == (
        2,
        "dh2sim: --all prints every row; leave the other option out",
    )


def test_a_person_reads_matrix_position_angles_and_quaternion() -> None:
    assert dh2sim("fk", "stanford", "zero") == Outcome(
        status=0,
        out="""\
stanford: pose of tool0 in base_link
q           zero: 0 deg, 0 deg, 0 m, 0 deg, 0 deg, 0 deg
     1.000000000    0.000000000    0.000000000    0.000000000
     0.000000000    1.000000000    0.000000000    0.150000000
     0.000000000    0.000000000    1.000000000    0.700000000
     0.000000000    0.000000000    0.000000000    1.000000000
position    0.000000000 0.150000000 0.700000000 m
rpy         0.000000000 0.000000000 0.000000000 deg
quaternion  1.000000000 0.000000000 0.000000000 0.000000000  (w, x, y, z)
""",
        err="",
    )
    run = dh2sim("fk", "stanford", "--degrees", "90", "0", "0.1", "0", "0", "0")
    assert "rpy         0.000000000 0.000000000 90.000000000 deg\n" in run.out
    assert "-0.000000000" not in run.out


JOINTS = "joint_1 (deg), joint_2 (deg), joint_3 (m), joint_4 (deg), joint_5 (deg), joint_6 (deg)"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("45deg 0 0 0 0 0", "joint_1: '45deg' has a unit; write the number alone, in deg"),
        ("0 0 400mm 0 0 0", "joint_3: '400mm' has a unit; write the number alone, in m"),
        ("0 0 0 nan 0 0", "joint_4: 'nan' is not a finite number"),
        ("1 2", f"stanford has 6 joint coordinates, got 2: {JOINTS}"),
        ("1", f"stanford has 6 joint coordinates, got 1: {JOINTS}"),
        ("--radians 1", f"stanford has 6 joint coordinates, got 1: {JOINTS.replace('deg', 'rad')}"),
        ("[1,2,3]", f"stanford has 6 joint coordinates, got 3: {JOINTS}"),
        ("1 2 3 4 5 6 7", f"stanford has 6 joint coordinates, got 7: {JOINTS}"),
        ("1 2 3 4 5 x", "joint_6: unknown name 'x'. Known names: pi"),
        ("-q 1", "unknown option '-q'. 'dh2sim fk --help' lists them all"),
        ("1 -q", "unknown option '-q'. 'dh2sim fk --help' lists them all"),
        ("1 2 3 4 5 -j", "unknown option '-j'. 'dh2sim fk --help' lists them all"),
        ("-- 1 2 3 4 5 -j", "joint_6: in '-j': unknown name 'j'. Known names: pi"),
        ("1 2 3 4 5 1/0", "joint_6: in '1/0': division by zero"),
        (
            "hom",
            "stanford has no configuration 'hom'. Did you mean 'home'? Configurations: home, zero, printed",
        ),
        ("sleep", "stanford has no configuration 'sleep'. Configurations: home, zero, printed"),
        (
            "--frame toll0",
            "unknown frame 'toll0'. Did you mean 'tool0'? Frames: base_link, link_1 to link_6, dh_0 to dh_6, tool0",
        ),
    ],
)
def test_what_is_wrong_is_reported_in_words(arguments: str, message: str) -> None:
    assert dh2sim("fk", "stanford", *arguments.split()) == Outcome(status=2, out="", err=f"dh2sim: {message}\n")


def test_a_coordinate_that_is_not_a_finite_number_is_refused() -> None:
    for text in ("nan", "inf", "1e400", "1e308*10"):
        run = dh2sim("fk", "stanford", "0", "0", text, "0", "0", "0")
        assert (run.status, run.out) == (2, "")
        assert run.err.startswith("dh2sim: joint_3: ")


def test_a_pose_beyond_all_numbers_is_refused_and_never_printed_as_infinity(tmp_path: Path) -> None:
    robot = write(
        tmp_path,
        "name: far\nconvention: standard\njoints:\n  - {type: prismatic}\n  - {type: prismatic}\n",
    )
    assert dh2sim("fk", robot, "--json", "1.7e308", "1.7e308") == Outcome(
        status=2, out="", err="dh2sim: far: the pose of tool0 is too large for a floating-point number\n"
    )


def test_a_robot_that_does_not_move_takes_no_coordinates(tmp_path: Path) -> None:
    robot = write(tmp_path, "name: still\nconvention: standard\njoints:\n  - {type: fixed, a: 0.5}\n")
    np.testing.assert_array_equal(_pose(robot)[:3, 3], [0.5, 0, 0])
    assert dh2sim("fk", robot, "1") == Outcome(
        status=2, out="", err="dh2sim: still has no joint coordinates, got 1\n"
    )


def test_a_mechanism_is_moved_by_its_driven_joint() -> None:
    moved = dh2sim("fk", "four_bar", "120", "--frame", "rocker/dh_1", "--json")
    assert (moved.status, moved.err) == (0, "")
    found = json.loads(moved.out)
    whole = [str(value) for value in found["q"]]
    again = _pose("four_bar", "--radians", *whole, "--frame", "dh_2")
    assert np.abs(again[:3, 3] - np.array(found["pose"])[:3, 3]).max() < 1e-12
    refused = dh2sim("fk", "four_bar", "home", "--all")
    assert refused.status == 2
    assert refused.err == "dh2sim: four_bar: --all prints the rows of serial robots; use --frame\n"


def test_loops_that_are_not_closed_are_warned_of() -> None:
    open_ = dh2sim("fk", "four_bar", "1", "2", "3")
    assert open_.status == 0
    assert open_.err.startswith("dh2sim: warning: the loops are not closed at these coordinates: C stays open by")
