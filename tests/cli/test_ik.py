"""``dh2sim ik``: ways to ask for a pose, what is printed, and what is refused."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from tests.program import Outcome, dh2sim, shell
from tests.sample_robots import robot

STANFORD = ("20", "40", "0.5", "-30", "45", "-10")


def found(*arguments: str | Path) -> dict[str, Any]:
    run = dh2sim("ik", *arguments, "--json")
    assert (run.status, run.err) == (0, "")
    answer: dict[str, Any] = json.loads(run.out)
    return answer


def refused(*arguments: str | Path) -> str:
    run = dh2sim("ik", *arguments)
    assert (run.status, run.out) == (2, "")
    return run.err


def pose_file(folder: Path, content: object, name: str = "goal.json") -> Path:
    file = folder / name
    file.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return file


def assert_reached(answer: dict[str, Any], name: str = "stanford") -> None:
    """By the oracle, every solution reaches the target."""
    assert answer["solutions"]
    for solution in answer["solutions"]:
        T = table_tool_pose(robot(name), np.array(solution["q"]))
        assert np.array(answer["target"]) == pytest.approx(T, abs=1e-9)
        assert solution["residual"] <= 1e-10
        assert solution["sigma_min"] >= 0.0
        assert isinstance(solution["branch"], str)


def test_at_takes_the_pose_that_joint_coordinates_reach() -> None:
    answer = found("stanford", "--at", *STANFORD)
    q = np.deg2rad([20, 40, 0, -30, 45, -10])
    q[2] = 0.5
    assert np.array(answer["target"]) == pytest.approx(table_tool_pose(robot("stanford"), q), abs=1e-12)
    assert answer["solutions"][0]["q"] == pytest.approx(q, abs=1e-9)
    assert_reached(answer)
    assert set(answer) >= {"robot", "target", "complete", "solutions", "curves", "notes"}


@pytest.mark.parametrize("words", [["home"], ["--", "30"]], ids=["name", "two dashes"])
def test_at_ends_where_the_next_option_begins(words: list[str]) -> None:
    run = dh2sim("ik", "stanford", "--at", *words)
    assert run.status == (0 if words == ["home"] else 2)


def test_the_same_goal_in_four_ways(tmp_path: Path) -> None:
    pose = json.loads(dh2sim("fk", "stanford", *STANFORD, "--json").out)
    by_hand = dh2sim("fk", "stanford", *STANFORD).out.splitlines()
    xyz, rpy, quaternion = (line.split()[1 : 1 + count] for line, count in zip(by_hand[-3:], (3, 3, 4), strict=True))
    near = ("--near", *STANFORD)
    answers = [
        found("stanford", "--at", *STANFORD),
        found("stanford", "--pose", pose_file(tmp_path, pose), *near),
        found("stanford", "--pose", pose_file(tmp_path, pose["pose"], "bare.json"), *near),
        found("stanford", "--xyz", *xyz, "--rpy", *rpy, *near),
        found("stanford", "--xyz", *xyz, "--quaternion", *quaternion, *near),
    ]
    for answer in answers:
        # fk prints nine places, and angles in deg
        assert np.array(answer["target"]) == pytest.approx(np.array(pose["pose"]), abs=1e-8)
        assert answer["solutions"][0]["q"] == pytest.approx(pose["q"], abs=1e-6)


def test_what_fk_prints_goes_straight_in() -> None:
    run = shell("$DH2SIM fk stanford 20 40 0.5 -30 45 -10 --json | $DH2SIM ik stanford --pose - --json")
    assert (run.status, run.err) == (0, "")
    assert_reached(json.loads(run.out))


def test_numbers_may_be_expressions_and_quaternions_of_any_length() -> None:
    one = found("puma560", "--xyz", "1/2", "-0.1", "0.2", "--quaternion", "0", "sqrt(2)", "sqrt(2)", "0")
    other = found("puma560", "--xyz", "0.5", "-0.1", "0.2", "--rpy", "180", "0", "90")
    assert np.array(one["target"]) == pytest.approx(np.array(other["target"]), abs=1e-12)


def test_a_position_without_orientation_leaves_it_open() -> None:
    answer = found("planar_2r", "--xyz", "0.6", "0.4", "0")
    assert answer["free"] == "rotation"
    q = np.array(answer["solutions"][0]["q"])
    assert table_tool_pose(robot("planar_2r"), q)[:3, 3] == pytest.approx([0.6, 0.4, 0.0], abs=1e-9)


def test_with_the_roll_free_tool0_points_where_the_goal_does() -> None:
    answer = found(
        "arm_5r", "--at", "10", "-20", "60", "30", "50", "--free", "roll", "--near", "0", "0", "90", "0", "0"
    )
    T, goal = table_tool_pose(robot("arm_5r"), np.array(answer["solutions"][0]["q"])), np.array(answer["target"])
    assert goal[:3, 2:] == pytest.approx(T[:3, 2:], abs=1e-9)


def test_a_locked_joint_stays_at_its_value() -> None:
    answer = found("franka_panda", "--at", "home", "--lock", "joint_7=0.5")
    assert [solution["q"][6] for solution in answer["solutions"]] == [0.5] * len(answer["solutions"])
    assert_reached(answer, "franka_panda")


def test_another_frame_gets_there_and_joints_behind_it_stay() -> None:
    spec = robot("stanford")
    answer = found("stanford", "--at", *STANFORD, "--frame", "dh_4")
    assert answer["frame"] == "dh_4"
    for solution in answer["solutions"]:
        frames = table_frame_poses(spec, np.array(solution["q"]))
        assert np.array(answer["target"]) == pytest.approx(frames[4], abs=1e-9)
        assert solution["q"][4:] == pytest.approx(np.deg2rad([45, -10]))


def test_a_pose_file_of_another_frame_is_a_goal_for_that_frame(tmp_path: Path) -> None:
    pose = json.loads(dh2sim("fk", "stanford", *STANFORD, "--frame", "dh_4", "--json").out)
    assert found("stanford", "--pose", pose_file(tmp_path, pose))["frame"] == "dh_4"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["puma560", "--xyz", "2", "0", "0"], r"out of reach by 1\.\d+ m"),
        (["planar_2r", "--xyz", "0.5", "0.5", "0.2"], r"out of reach by 0\.2 m: tool0 moves in a plane"),
        (
            ["arm_5r", "--xyz", "0.3", "0.1", "0.2", "--rpy", "10", "20", "30"],
            r"orientation unreachable with 5 joints, nearest by [\d.]+ degrees",
        ),
        (["stanford", "--xyz", "3", "0", "0"], r"only outside limits: joint_3 by [\d.]+ m"),
    ],
    ids=["range", "plane", "orientation", "limits"],
)
def test_without_a_solution_the_reason_is_printed_and_the_exit_status_is_1(arguments: list[str], reason: str) -> None:
    run = dh2sim("ik", *arguments)
    assert (run.status, run.err) == (1, "")
    text = " ".join(run.out.split())
    assert re.match(rf"{arguments[0]}: no joint vector reaches the pose: {reason}", text)
    as_json = dh2sim("ik", *arguments, "--json")
    answer = json.loads(as_json.out)
    assert as_json.status == 1
    assert not any(solution["within_limits"] for solution in answer["solutions"])
    assert re.fullmatch(reason, answer["reason"])
    if not answer["solutions"]:
        assert len(answer["nearest"]) == len(robot(arguments[0]).moving_rows)


def test_what_exceeds_limits_is_printed_behind_what_keeps_them() -> None:
    answer = found("puma560", "--at", "10", "-20", "30", "40", "50", "60")
    inside = [solution["within_limits"] for solution in answer["solutions"]]
    assert inside == sorted(inside, reverse=True)
    assert len({solution["branch"] for solution in answer["solutions"]}) == 8
    text = dh2sim("ik", "puma560", "--at", "10", "-20", "30", "40", "50", "60").out
    assert "puma560: 8 joint vectors reach the pose, 3 within limits; 1 more by whole turns\n" in text
    assert "outside limits: joint_4 by 30 degrees" in " ".join(text.split())
    assert "left, above, no flip · sigma_min 0.266 · residual" in text


def test_numeric_finds_one_solution_or_the_nearest_configuration() -> None:
    answer = found("puma560", "--at", "home", "--numeric")
    assert (len(answer["solutions"]), answer["complete"]) == (1, False)
    assert_reached(answer, "puma560")
    run = dh2sim("ik", "puma560", "--xyz", "2", "0", "0", "--numeric", "--json")
    nearest = json.loads(run.out)["nearest"]
    assert run.status == 1
    # stretched towards the goal as far as the arm reaches
    T = table_tool_pose(robot("puma560"), np.array(nearest))
    assert T[0, 3] == pytest.approx(np.linalg.norm(T[:3, 3]), rel=1e-2)


@pytest.mark.slow
def test_the_self_motions_of_seven_joints_are_curves_that_hold_the_pose() -> None:
    answer = found("franka_panda", "--at", "home")
    assert_reached(answer, "franka_panda")
    assert len(answer["curves"]) == len(answer["solutions"]) > 1
    for curve in answer["curves"]:
        T = table_tool_pose(robot("franka_panda"), np.array(curve["q"]))
        assert np.abs(T - np.array(answer["target"])).max() <= 1e-10
    text = dh2sim("ik", "franka_panda", "--at", "home").out
    assert "curve 1: self-motion, open, joint_1 from " in text


def test_a_joint_to_spare_leaves_a_curve() -> None:
    arguments = ("arm_5r", "--at", "home", "--free", "roll")
    [first, *_] = found(*arguments)["curves"]
    assert (first["kind"], first["closed"]) == ("self-motion", False)
    axes = table_tool_pose(robot("arm_5r"), np.array(first["q"]))[:, :3, 2:]
    assert np.abs(axes - axes[0]).max() <= 1e-10
    assert "curve 1: self-motion, open, joint_5 from -17" in dh2sim("ik", *arguments).out


def test_a_curve_along_which_a_joint_turns_round_is_a_whole_turn_long(tmp_path: Path) -> None:
    table = "".join(
        f"  - {{name: joint_{i}, type: revolute, a: {a}, alpha: 0, d: 0, theta: 0}}\n"
        for i, a in enumerate((1.0, 0.8, 0.0), start=1)
    )
    file = tmp_path / "planar_3r.yaml"
    file.write_text(f"name: planar_3r\nconvention: standard\njoints:\n{table}", encoding="utf-8")
    text = dh2sim("ik", file, "--xyz", "1", "0.5", "0").out
    ends = re.findall("curve [12]: self-motion, closed, joint_3 from (.*) to (.*) rad", text)
    assert [round(float(high) - float(low), 5) for low, high in ends] == [6.28319, 6.28319]


def test_the_textbooks_steps_are_printed_with_explain() -> None:
    text = dh2sim("ik", "planar_2r", "--xyz", "0.6", "0.4", "0", "--explain").out
    assert "by the law of cosines" in text
    assert found("planar_2r", "--xyz", "0.6", "0.4", "0", "--explain")["explanation"]


def test_the_derivation_in_json_has_a_value_for_every_symbol_of_every_branch() -> None:
    answer = found("stanford", "--at", *STANFORD, "--explain")
    derivation = answer["derivation"]
    assert len(derivation["branches"]) == 8
    assert {key for step in derivation["steps"] for key in step} == {"title", "formulas", "remark", "lines"}
    lines = [line for step in derivation["steps"] for line in step["lines"]]
    for branch in derivation["branches"]:
        T = table_tool_pose(robot("stanford"), np.array(branch["q"]))
        assert np.abs(T - answer["target"]).max() <= 1e-12
        signs = branch["signs"].items()
        values = {line["symbol"]: line["value"] for line in lines if line["signs"].items() <= signs}
        assert [values[f"q{i}"] for i in range(1, 7)] == pytest.approx(branch["q"], abs=1e-12)


@pytest.mark.slow
def test_why_there_is_no_derivation_is_in_the_json_too() -> None:
    derivation = found("franka_panda", "--at", "home", "--explain")["derivation"]
    assert (derivation["form"], derivation["steps"]) == ("", [])
    assert derivation["reason"] == "Textbooks solve arms of 2 to 6 joints in closed form; this one has 7."


def test_no_limits_are_kept_with_no_limits() -> None:
    answer = found("stanford", "--xyz", "3", "0", "0", "--no-limits")
    assert any(not solution["within_limits"] for solution in answer["solutions"])


def test_output_fits_a_terminal_of_80_columns_with_seven_joints_too() -> None:
    for arguments in (["puma560"], ["franka_panda", "--lock", "joint_7=0.6"], ["ssrms", "--lock", "joint_7=9"]):
        run = dh2sim("ik", *arguments, "--at", "home")
        assert run.status == 0
        assert max(map(len, run.out.splitlines())) <= 80


ROTATED = [[1.0, 0.0, 0.0, 0.3], [0.0, 1.0, 0.0, 0.2], [0.0, 0.0, 1.0, 0.5], [0.0, 0.0, 0.0, 1.0]]


def changed(row: int, column: int, value: object) -> list[list[object]]:
    T: list[list[object]] = [list(line) for line in ROTATED]
    T[row][column] = value
    return T


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (ROTATED[:3], "1:1: expected 4 rows, found 3 rows"),
        ({"pose": [ROTATED[0][:3], *ROTATED[1:]]}, "1:11: pose[0]: expected 4 numbers, found 3 numbers"),
        (changed(1, 3, "x"), "1:40: [1][3]: expected a finite number, found x"),
        (changed(1, 3, float("nan")), "1:40: [1][3]: expected a finite number, found NaN"),
        (changed(1, 3, None), "1:40: [1][3]: expected a finite number, found null"),
        (
            changed(0, 0, 1.2),
            "1:1: the upper left 3x3 part is not a rotation: R Rᵀ differs from the identity by 0.44",
        ),
        (
            changed(0, 0, -1.0),
            "1:1: the upper left 3x3 part is a reflection, not a rotation: its determinant is -1",
        ),
        (changed(3, 0, 2.0), "1:1: the last row of a pose is 0, 0, 0, 1, found 2, 0, 0, 1"),
        ({"x": 1}, "1:1: expected a 4x4 matrix, alone or under 'pose' or 'target'; found x"),
        (
            {"from": "dh_2", "pose": ROTATED},
            "1:10: from: the pose must be given in base_link, found 'dh_2'",
        ),
        ("", "1:1: the file is empty; a pose has four rows of four numbers"),
        ("{", None),
    ],
    ids=[
        "rows",
        "columns",
        "text",
        "nan",
        "null",
        "scaled",
        "mirrored",
        "last row",
        "keys",
        "from",
        "empty",
        "syntax",
    ],
)
def test_a_wrong_pose_file_is_refused_with_the_place(tmp_path: Path, content: object, message: str | None) -> None:
    file = pose_file(tmp_path, content)
    err = refused("stanford", "--pose", file)
    assert err.startswith(f"{file}:1:")
    if message is not None:
        assert err == f"{file}:{message}\n"


def test_all_numbers_that_are_wrong_are_reported_at_once(tmp_path: Path) -> None:
    err = refused(
        "stanford", "--pose", pose_file(tmp_path, [["a", 0, 0, 0], [0, 1, 0, 0], [0, 0, "b", 0], [0, 0, 0, 1]])
    )
    assert [line.split(": ")[1] for line in err.splitlines()] == ["[0][0]", "[2][2]"]


def test_a_pose_file_may_be_indented_with_tabs(tmp_path: Path) -> None:
    T = table_tool_pose(robot("stanford"), np.array([0.1, 0.2, 0.5, 0.3, 0.4, 0.5])).tolist()
    assert found("stanford", "--pose", pose_file(tmp_path, json.dumps(T, indent="\t")))["target"] == T


@pytest.mark.parametrize(
    ("arguments", "messages"),
    [
        ([], ["no goal given; give one of --pose, --xyz and --at"]),
        (
            ["--xyz", "1", "2", "3", "--at", "home"],
            ["--xyz and --at exclude each other; give one of --pose, --xyz and --at"],
        ),
        (["--at", "home", "--rpy", "1", "2", "3"], ["--rpy needs --xyz"]),
        (["--xyz", "1", "2", "3", "--quaternion", "0", "0", "0", "0"], ["--quaternion has length zero"]),
        (["--xyz", "1", "x", "1/0"], ["--xyz unknown name 'x'. Known names: pi", "--xyz in '1/0': division by zero"]),
        (
            ["--at", "1", "2"],
            [
                "--at stanford has 6 joint coordinates, got 2: joint_1 (deg), joint_2 (deg), joint_3 (m), "
                "joint_4 (deg), joint_5 (deg), joint_6 (deg)"
            ],
        ),
        (
            ["--at", "home", "--lock", "joint_9=1", "joint_1", "joint_2=200", "joint_2=3", "joint_2=4"],
            [
                "--lock stanford has no joint 'joint_9' that moves. Did you mean 'joint_6'? Joints: joint_1, "
                "joint_2, joint_3, joint_4, joint_5, joint_6",
                "--lock expected JOINT=VALUE, got 'joint_1'",
                "--lock joint_2 is 30 degrees outside its limits; --no-limits ignores them",
                "--lock joint_2 is given twice",
                "--lock joint_2 is given twice",
            ],
        ),
        (["--xyz", "1", "2", "1e300"], ["--xyz is a pose farther away than 1e+12 m"]),
        (["--at", "home", "--free", "pitch"], ["--free must be one of rotation, roll, got 'pitch'"]),
        (
            ["--at", "home", "--frame", "dh_7"],
            ["--frame must be one of tool0, dh_1, dh_2, dh_3, dh_4, dh_5, dh_6, got 'dh_7'. Did you mean 'dh_6'?"],
        ),
        (
            ["--at", "home", "--frame", "dh_2", "--lock", "joint_5=1"],
            ["--lock joint_5 is behind dh_2, and does not move anyway"],
        ),
    ],
    ids=[
        "none", "two", "rpy", "quaternion", "expressions", "count", "locks", "far", "free", "frame", "behind",
    ],
)  # fmt: skip
def test_wrong_options_are_all_reported(arguments: list[str], messages: list[str]) -> None:
    assert refused("stanford", *arguments).splitlines() == [f"dh2sim: {message}" for message in messages]


def test_a_robot_without_moving_joints_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "stick.yaml"
    file.write_text("{name: stick, convention: standard, joints: [{type: fixed, a: 0.5}]}\n", encoding="utf-8")
    for goal in (["--at", "home"], ["--xyz", "0.5", "0", "0"], ["--xyz", "0.5", "0", "0", "--numeric"]):
        run = dh2sim("ik", file, *goal)
        assert (run.status, run.err) == (2, "dh2sim: stick has no joint that moves\n")


def test_at_a_singular_pose_the_given_joint_vector_comes_first() -> None:
    answer = found("puma560", "--at", "10", "20", "30", "40", "0", "60")
    assert np.rad2deg(answer["solutions"][0]["q"]) == pytest.approx([10, 20, 30, 40, 0, 60], abs=1e-9)
    assert [curve["kind"] for curve in answer["curves"]] == ["wrist singularity"]
    assert_reached(answer, "puma560")


def test_what_exceeds_limits_is_printed_at_a_singular_pose_too() -> None:
    goal = ("puma560", "--at", "10 20 30 40 0 60")
    branches = [solution["branch"] for solution in found(*goal)["solutions"]]
    anywhere = [solution["branch"] for solution in found(*goal, "--no-limits")["solutions"]]
    assert set(branches) == set(anywhere)
    assert len(anywhere) == 7
    assert "left, below, flip" in branches


def test_a_file_that_is_not_there_is_reported_beside_wrong_options() -> None:
    assert dh2sim("ik", "stanford", "--pose", "missing.json", "--free", "x") == Outcome(
        status=2,
        out="",
        err="dh2sim: missing.json: cannot be read: No such file or directory\n"
        "dh2sim: --free must be one of rotation, roll, got 'x'\n",
    )


@pytest.mark.slow
def test_every_example_of_the_help_reaches_its_pose() -> None:
    lines = [line.strip() for line in dh2sim("ik", "--help").out.split("Examples:\n")[1].splitlines()]
    examples = [line.split("#")[0].split()[1:] for line in lines if line.startswith("dh2sim ik")]
    assert len(examples) == 5
    assert [example for example in examples if dh2sim(*example).status != 0] == []
