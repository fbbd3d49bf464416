from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dh2sim import build_chain, forward_kinematics, load_robot
from dh2sim.kinematics.forward import frame_names, frame_pose
from tests.export.robots import ODD, write
from tests.program import Outcome, dh2sim

STANFORD = load_robot("stanford")
CHAIN = build_chain(STANFORD)
Q = [0.3, -0.7, 0.5, 1.1, 0.6, -0.4]


def _pose(*arguments: str | Path) -> Any:
    run = dh2sim("fk", *arguments, "--json")
    assert (run.status, run.err) == (0, "")
    return np.array(json.loads(run.out)["pose"])


def test_json_alone_is_printed_and_has_the_shape_of_the_contract() -> None:
    run = dh2sim("fk", "stanford", *map(str, Q), "--json")
    assert (run.status, run.err) == (0, "")
    assert json.loads(run.out) == {
        "robot": "stanford",
        "frame": "tool0",
        "pose": forward_kinematics(CHAIN, Q).tolist(),
    }


@pytest.mark.parametrize(
    "arguments",
    [
        "stanford 0.3 -0.7 0.5 1.1 0.6 -0.4 --json",
        "stanford --json 0.3 -0.7 0.5 1.1 0.6 -0.4",
        "--json stanford 0.3 -0.7 0.5 1.1 0.6 -0.4",
        "stanford --json -- 0.3 -0.7 0.5 1.1 0.6 -0.4",
        "--json -- stanford 0.3 -0.7 0.5 1.1 0.6 -0.4",
        "stanford 0.3 -0.7 --json 0.5 1.1 0.6 -0.4",
        "stanford 3e-1 -7e-1 5.0E-1 1.1 .6 -.4 --json",
        "stanford 3/10 -7/10 1/2 11/10 6/10 -(4/10) --json",
        "--frame tool0 stanford 0.3 -0.7 0.5 1.1 0.6 -0.4 --json",
        "stanford 0.3 -0.7 0.5 1.1 0.6 -0.4 --frame=tool0 --json",
    ],
)
def test_numbers_and_options_stand_in_any_order_with_and_without_a_double_dash(arguments: str) -> None:
    run = dh2sim("fk", *arguments.split())
    assert (run.status, run.err) == (0, "")
    np.testing.assert_allclose(json.loads(run.out)["pose"], forward_kinematics(CHAIN, Q), rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("text", "value"),
    [("-1e-3", -1e-3), ("-1.5E+0", -1.5), ("-.5", -0.5), ("-pi/2", -math.pi / 2), ("-sqrt(2)/2", -math.sqrt(0.5))],
)
@pytest.mark.parametrize("dash", [[], ["--"]], ids=["without --", "with --"])
def test_negative_numbers_are_no_options(text: str, value: float, dash: list[str]) -> None:
    q = [text, text, "0.2", text, "0", text]
    expected = forward_kinematics(CHAIN, [value, value, 0.2, value, 0.0, value])
    run = dh2sim("fk", "stanford", "--json", *dash, *q)
    assert (run.status, run.err) == (0, "")
    np.testing.assert_allclose(json.loads(run.out)["pose"], expected, rtol=0, atol=1e-15)


def test_degrees_hold_for_angles_and_not_for_lengths() -> None:
    degrees = _pose("stanford", "--degrees", "45", "-60", "0.2", "45", "0", "-60")
    radians = [math.radians(45), math.radians(-60), 0.2, math.radians(45), 0.0, math.radians(-60)]
    np.testing.assert_array_equal(degrees, forward_kinematics(CHAIN, radians))


@pytest.mark.parametrize("frame", frame_names(CHAIN))
def test_every_frame_can_be_asked_for(frame: str) -> None:
    expected = frame_pose(CHAIN, frame, Q)
    np.testing.assert_array_equal(_pose("stanford", *map(str, Q), "--frame", frame), expected)


def test_a_configuration_stands_for_its_numbers_and_home_is_where_the_robot_is(tmp_path: Path) -> None:
    printed = forward_kinematics(CHAIN, STANFORD.configurations["printed"])
    home = forward_kinematics(CHAIN, STANFORD.configurations["home"])
    np.testing.assert_array_equal(_pose("stanford", "printed"), printed)
    np.testing.assert_array_equal(_pose("stanford"), home)
    odd = write(tmp_path, ODD)  # which has no home
    np.testing.assert_array_equal(_pose(odd), forward_kinematics(build_chain(load_robot(odd)), np.zeros(4)))


def test_a_person_reads_matrix_position_angles_and_quaternion() -> None:
    assert dh2sim("fk", "stanford", "zero") == Outcome(
        status=0,
        out="""\
stanford: pose of tool0 in base_link
     1.000000000    0.000000000    0.000000000    0.000000000
     0.000000000    1.000000000    0.000000000    0.150000000
     0.000000000    0.000000000    1.000000000    0.700000000
     0.000000000    0.000000000    0.000000000    1.000000000
position    0.000000000 0.150000000 0.700000000 m
rpy         0.000000000 0.000000000 0.000000000 rad
quaternion  1.000000000 0.000000000 0.000000000 0.000000000  (w, x, y, z)
""",
        err="",
    )
    run = dh2sim("fk", "stanford", "--degrees", "90", "0", "0.1", "0", "0", "0")
    assert "rpy         0.000000000 0.000000000 90.000000000 deg\n" in run.out
    assert "-0.000000000" not in run.out


JOINTS = "joint_1 (rad), joint_2 (rad), joint_3 (m), joint_4 (rad), joint_5 (rad), joint_6 (rad)"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("1 2", f"stanford has 6 joint coordinates, got 2: {JOINTS}"),
        ("1", f"stanford has 6 joint coordinates, got 1: {JOINTS}"),
        ("--degrees 1", f"stanford has 6 joint coordinates, got 1: {JOINTS.replace('rad', 'deg')}"),
        ("1 2 3 4 5 6 7", f"stanford has 6 joint coordinates, got 7: {JOINTS}"),
        ("1 2 3 4 5 x", "joint_6: unknown name 'x'. Known names: pi"),
        ("1 2 3 4 5 -j", "joint_6: in '-j': unknown name 'j'. Known names: pi"),
        ("1 2 3 4 5 1/0", "joint_6: in '1/0': division by zero"),
        (
            "hom",
            "stanford has no configuration 'hom'. Did you mean 'home'? Configurations: zero, printed, home",
        ),
        ("sleep", "stanford has no configuration 'sleep'. Configurations: zero, printed, home"),
        (
            "--frame toll0",
            "there is no frame 'toll0'. Did you mean 'tool0'? Frames: base_link, link_1 to link_6, dh_0 to dh_6, "
            "tool0",
        ),
        ("--jsn", "fk has no option '--jsn'. Options: --frame, --degrees, --json, --help"),
        ("1 2 3 4 5 6 --deg=1", "fk has no option '--deg=1'. Options: --frame, --degrees, --json, --help"),
    ],
)
def test_what_is_wrong_is_told_in_words(arguments: str, message: str) -> None:
    assert dh2sim("fk", "stanford", *arguments.split()) == Outcome(status=2, out="", err=f"dh2sim: {message}\n")


def test_a_coordinate_that_is_no_finite_number_is_refused() -> None:
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
        status=2, out="", err="dh2sim: far: the pose of tool0 is too far away for a number to tell\n"
    )


def test_a_robot_that_does_not_move_takes_no_coordinates(tmp_path: Path) -> None:
    robot = write(tmp_path, "name: still\nconvention: standard\njoints:\n  - {type: fixed, a: 0.5}\n")
    np.testing.assert_array_equal(_pose(robot)[:3, 3], [0.5, 0, 0])
    assert dh2sim("fk", robot, "1") == Outcome(
        status=2, out="", err="dh2sim: still has no joint coordinates, got 1\n"
    )
