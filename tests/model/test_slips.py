"""Notes about numbers that are allowed but rarely meant."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim import Robot, RobotFileError, find_slips, parse_robot
from dh2sim.model.slips import Slip, SlipKind
from dh2sim.robot.catalog import builtin_robots
from dh2sim.robot.table_rows import Prismatic, Revolute
from dh2sim.robot.write import robot_file_text
from tests.kinematics.test_compaction import calibrated_ur5
from tests.program import dh2sim
from tests.refusals import refusal
from tests.robot_files import write

DEGREES_IN_RAD = """\
name: arm
convention: standard
joints:
  - {type: revolute, alpha: 90, d: 0.4, limits: {position: [-170, 170]}}
  - {type: revolute, a: 0.3}
"""


def of(joints: str, *, units: str = "", more: str = "") -> list[tuple[str, str, str]]:
    """Return kind, path and message of the slips in a robot of these rows."""
    head = f"name: arm\nconvention: {more or 'standard'}\n{units and f'units: {units}'}\n"
    rows = "\n".join(f"  - {{{row}}}" for row in joints.split("|"))
    return [
        (slip.kind.value, slip.path, slip.message) for slip in find_slips(parse_robot(f"{head}joints:\n{rows}\n"))
    ]


def test_degrees_in_a_file_of_radians_are_noted_at_their_places(tmp_path: Path) -> None:
    slips = Robot.load(write(tmp_path, DEGREES_IN_RAD)).slips()
    assert [str(slip).removeprefix(str(tmp_path)) for slip in slips] == [
        "/arm.yaml:4:29: joints[0].alpha: 90 rad is more than a full turn; "
        "if degrees are meant, set 'units: {angle: deg}'",
        "/arm.yaml:4:60: joints[0].limits.position: limits of 27.1 turns; "
        "if degrees are meant, set 'units: {angle: deg}'; a joint without limits is 'continuous'",
    ]


@pytest.mark.parametrize(
    ("typed", "part"),
    [("1.57", "pi/2"), ("-1.571", "-pi/2"), ("3.14", "pi"), ("3.1416", "pi"), ("0.785", "pi/4"), ("4.71", "3*pi/2")],
)
def test_radians_in_a_file_of_degrees_are_noted(typed: str, part: str) -> None:
    slips = of(f"type: revolute, alpha: {typed}|type: revolute, a: 0.3", units="{angle: deg}")
    assert slips == [
        (
            "radians-in-deg",
            "joints[0].alpha",
            f"{typed} deg looks like {part} rad; angles of this file are in deg",
        )
    ]


def test_limits_of_pi_in_a_file_of_degrees_are_noted() -> None:
    slips = of("type: revolute, a: 0.3, limits: {position: [-3.14, 3.14]}", units="{angle: deg}")
    assert [(kind, path) for kind, path, _ in slips] == [
        ("radians-in-deg", "joints[0].limits.position[0]"),
        ("radians-in-deg", "joints[0].limits.position[1]"),
    ]


@pytest.mark.parametrize(
    ("typed", "units", "right"),
    [
        ("1.57", "rad", "pi/2"),
        ("1.571", "rad", "pi/2"),
        ("1.5707", "rad", "pi/2"),
        ("1.5708", "rad", "pi/2"),
        ("-1.570796", "rad", "-pi/2"),
        ("3.14159", "rad", "pi"),
        ("6.2832", "rad", "2*pi"),
        ("90.00021045914971", "deg", "90"),  # 1.5708 rad, converted
        ("-179.99984796050424", "deg", "-180"),  # 3.14159 rad, converted
    ],
)
def test_right_angles_that_lost_digits_are_noted(typed: str, units: str, right: str) -> None:
    [(kind, path, message)] = of(f"type: revolute, a: 0.3, theta: {typed}", units=f"{{angle: {units}}}")
    assert (kind, path) == ("rounded-right-angle", "joints[0].theta")
    assert message.endswith(f"rad off a right angle; if that is meant, write {right}")


@pytest.mark.parametrize("angle", ["pi/2", "1.5707963267948966", "-pi", "1.57033858830411", "1.58", "1.5", "0.785"])
def test_exact_and_calibrated_angles_are_not_noted(angle: str) -> None:
    assert of(f"type: revolute, a: 0.3, alpha: {angle}|type: revolute, a: 0.3") == []


@given(st.floats(-2 * math.pi, 2 * math.pi))
def test_an_angle_with_all_its_digits_is_only_noted_if_it_was_typed_short(angle: float) -> None:
    robot = Robot([Revolute(a=0.3, theta=angle)])
    assert len(repr(angle)) < 16 or not any(slip.kind is SlipKind.ROUNDED for slip in robot.slips())


def test_a_joint_that_winds_up_many_times_is_noted() -> None:
    slips = of("type: revolute, a: 0.3, limits: {position: [-100, 3000]}", units="{angle: deg}")
    assert slips == [
        (
            "limits-beyond-turns",
            "joints[0].limits.position",
            "limits of 8.33 turns; a joint without limits is 'continuous'",
        )
    ]
    assert of("type: revolute, a: 0.3, limits: {position: [-1440, 1440]}", units="{angle: deg}") == []


def test_millimetres_in_a_file_of_metres_are_noted_once() -> None:
    [slip] = of("type: revolute, a: 431.8|type: revolute, a: 433")
    assert slip[0] == "unlikely-reach"
    assert slip[2].endswith("m is rare for a robot; if millimetres are meant, set 'units: {length: mm}'")
    [slip] = of("type: revolute, a: 0.4318|type: revolute, a: 0.433", units="{length: mm}")
    assert (slip[0], slip[2]) == (
        "unlikely-reach",
        "a reach of 0.0008648 m is rare for a robot; lengths of this file are in mm",
    )


def test_a_wrist_without_lengths_is_not_noted() -> None:
    assert find_slips(Robot([Revolute(alpha=1.1), Revolute(alpha=-0.9), Revolute()])) == ()


def test_a_mass_of_a_building_is_noted() -> None:
    [slip] = of("type: revolute, a: 0.3, link: {mass: 2.0e+5}")
    assert slip == (
        "unlikely-mass",
        "",
        "a moving mass of 2e+05 kg is rare for a robot; masses are in kg",
    )


def test_a_craig_table_that_claims_to_be_standard_is_noted() -> None:
    rows = "type: revolute, d: 0.4|type: revolute, alpha: pi/2|type: revolute, a: 0.3, alpha: pi/2"
    assert of(rows) == [
        (
            "other-convention",
            "joints[2].alpha",
            "the first row has neither a nor alpha, the last one has an alpha, "
            "as in a table of the modified convention",
        )
    ]
    assert of(rows, more="modified") == []


def test_a_standard_table_that_claims_to_be_modified_is_noted() -> None:
    rows = "type: revolute, d: 0.4, alpha: pi/2|type: revolute, a: 0.3|type: revolute"
    assert [(kind, path) for kind, path, _ in of(rows, more="modified")] == [("other-convention", "joints[0].alpha")]
    assert of(rows) == []


def test_robots_made_in_code_are_told_of_math_radians() -> None:
    robot = Robot([Revolute(alpha=90.0, d=0.1), Prismatic(limits=(0, 1))])
    [slip] = robot.slips()
    assert str(slip) == "joints[0].alpha: 90 rad is more than a full turn; if degrees are meant, use math.radians"
    assert slip.to_json() == {
        "rule": "degrees-in-rad",
        "path": "joints[0].alpha",
        "message": "90 rad is more than a full turn; if degrees are meant, use math.radians",
    }


@pytest.mark.parametrize("name", builtin_robots())
def test_robots_that_come_with_dh2sim_have_no_likely_slips(name: str) -> None:
    assert Robot.load(name).slips() == ()


# ---------------------------------------------------------------------------- on the command line


@pytest.mark.parametrize("command", ["info", "export", "validate"])
def test_notes_go_to_standard_error_and_change_no_exit_status(command: str, tmp_path: Path) -> None:
    robot = write(tmp_path, DEGREES_IN_RAD)
    options = {"export": ["--out", str(tmp_path / "out")], "validate": ["--samples", "3"]}.get(command, [])
    run = dh2sim(command, robot, *options)
    assert run.status == 0
    assert run.err == (
        f"{robot}:4:29: note: joints[0].alpha: 90 rad is more than a full turn; "
        "if degrees are meant, set 'units: {angle: deg}'\n"
        f"{robot}:4:60: note: joints[0].limits.position: limits of 27.1 turns; "
        "if degrees are meant, set 'units: {angle: deg}'; a joint without limits is 'continuous'\n"
    )


@pytest.mark.parametrize("command", ["info", "export", "validate", "view"])
def test_strict_makes_notes_errors_before_anything_is_written(command: str, tmp_path: Path) -> None:
    robot = write(tmp_path, DEGREES_IN_RAD)
    out = {"export": ("--out", "out"), "validate": ("--json", "report.json"), "view": ("--export", "page.html")}
    option, name = out.get(command, ("", ""))
    options = [option, str(tmp_path / name)] if option else []
    run = dh2sim(command, robot, "--strict", *options)
    assert (run.status, run.out) == (2, "")
    assert [line.split(": ")[1] for line in run.err.splitlines()] == ["joints[0].alpha", "joints[0].limits.position"]
    assert list(tmp_path.iterdir()) == [robot]


def test_json_lists_notes(tmp_path: Path) -> None:
    robot = write(tmp_path, DEGREES_IN_RAD)
    info = json.loads(dh2sim("info", robot, "--json").out)
    report = json.loads(dh2sim("validate", robot, "--samples", "3", "--json", "-").out)
    assert info["notes"] == report["robots"][0]["notes"]
    assert [(note["rule"], note["line"], note["column"]) for note in info["notes"]] == [
        ("degrees-in-rad", 4, 29),
        ("limits-beyond-turns", 4, 60),
    ]


def test_of_many_notes_alike_three_are_printed(tmp_path: Path) -> None:
    rows = "  - {type: revolute, a: 0.3, theta: 90}\n" * 6
    robot = write(tmp_path, f"name: arm\nconvention: standard\njoints:\n{rows}")
    lines = dh2sim("info", robot).err.splitlines()
    assert (len(lines), lines[-1]) == (4, f"{robot}: note: and 3 more like the last one")


def test_a_configuration_outside_the_limits_by_a_whole_turn_is_given_its_equal() -> None:
    text = "name: arm\nconvention: standard\nunits: {angle: deg}\njoints:\n"
    text += "  - {type: revolute, a: 0.3, limits: {position: [-170, 170]}}\nconfigurations: {home: [350]}\n"
    assert refusal(RobotFileError, parse_robot, text) == (
        "<string>:6:25: configurations.home[0]: 350.0 is outside the limits of joint_1: -170.0 to 170.0; "
        "-10 is the same angle"
    )
    assert not refusal(RobotFileError, parse_robot, text.replace("350", "180")).endswith("the same angle")


def test_slips_are_sorted_by_place() -> None:
    first = Slip(kind=SlipKind.MASS, file="a.yaml", line=1, column=1, path="", message="m")
    assert (
        sorted([Slip(kind=SlipKind.REACH, file="a.yaml", line=2, column=1, path="", message="m"), first])[0] is first
    )


def test_frames_far_from_the_arm_are_noted_with_what_moves_them(tmp_path: Path) -> None:
    text = robot_file_text(calibrated_ur5())
    [slip] = Robot.load(write(tmp_path, text)).slips()
    assert (slip.kind, slip.path) == (SlipKind.FAR_FRAMES, "joints[1].d")
    assert slip.line == text.splitlines().index("    d: 574.241384579456") + 1
    assert slip.message == (
        "DH frames 2 and 3 are 574.1 and 66.77 m away from the arm, which is 1.19 m long; "
        "'dh2sim convert ur5.yaml --to compact' rewrites the table without them"
    )
    run = dh2sim("info", tmp_path / "ur5.yaml")
    assert run.status == 0
    assert "--to compact" in run.err
    [in_code] = Robot.from_spec(calibrated_ur5()).slips()
    assert in_code.message.endswith("; convert('compact') rewrites the table without them")
    assert Robot.from_spec(calibrated_ur5()).convert("compact").slips() == ()
