from __future__ import annotations

import inspect
import json
import math
from dataclasses import replace

import numpy as np
import pytest

from dh2sim.errors import ConfigurationError
from dh2sim.inverse.solver import inverse_kinematics
from dh2sim.inverse.textbook import Explanation, explain_inverse_kinematics
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot_facade import Robot
from dh2sim.typing import Array
from tests.inverse.disguised_arms import CLASSES, disguised, random_configuration, textbook_table
from tests.robots import closed_forms
from tests.sample_robots import ODD_ROBOT, robot


def size_of(spec: RobotSpec) -> float:
    return sum(abs(row.a) + abs(row.d) for row in spec.rows)


def closed_form_pose(name: str, q: Array) -> Array:
    """Return a robot's pose by the course's closed form, shape (4, 4)."""
    form = closed_forms.ROBOTS[name]
    letters = [
        p.name for p in inspect.signature(form).parameters.values() if p.kind is inspect.Parameter.KEYWORD_ONLY
    ]
    return np.asarray(form(*q.tolist(), **{letter: robot(name).parameters[letter] for letter in letters}))


def angle_between(spec: RobotSpec, q: Array, other: Array) -> float:
    """Greatest difference of coordinates, angles modulo whole turns, slides as a share of the arm's size."""
    turns = np.array([row.type.turns for row in spec.moving_rows])
    gap = np.asarray(q) - np.asarray(other)
    return float(np.abs(np.where(turns, np.angle(np.exp(1j * gap)), gap / size_of(spec))).max())


def missed_by(spec: RobotSpec, q: Array, T: Array) -> float:
    """Greatest difference of entries between the table's pose and a goal, lengths as a share of the arm's size."""
    gap = np.abs(table_tool_pose(spec, q) - T)
    gap[:3, 3] /= size_of(spec) + float(np.abs(T[:3, 3]).max())
    return float(gap.max())


@pytest.mark.parametrize("name", CLASSES)
def test_an_arm_in_any_disguise_is_recognised_and_its_own_configuration_is_among_the_branches(name: str) -> None:
    for seed in range(4):
        plain = textbook_table(name, seed)
        for spec in (plain, disguised(plain, seed)):
            q = random_configuration(spec, seed)
            T = table_tool_pose(spec, q)
            explanation = explain_inverse_kinematics(spec, T)
            assert explanation.form, explanation.reason
            assert min(angle_between(spec, branch.q, q) for branch in explanation.branches) < 1e-7
            for branch in explanation.branches:
                assert missed_by(spec, branch.q, T) < 1e-12


@pytest.mark.parametrize("name", CLASSES)
def test_branches_differ_from_each_other_in_signs_names_and_coordinates(name: str) -> None:
    most = 0
    for seed in range(20):
        spec = disguised(textbook_table(name, seed), seed + 100)
        branches = explain_inverse_kinematics(spec, table_tool_pose(spec, random_configuration(spec, seed))).branches
        most = max(most, len(branches))
        assert len({branch.signs for branch in branches}) == len(branches)
        assert len({branch.name for branch in branches}) == len(branches)
        for i, one in enumerate(branches):
            assert all(angle_between(spec, one.q, other.q) > 1e-4 for other in branches[:i])
        if seed >= 3 and most == CLASSES[name]:
            break
    assert most == CLASSES[name]


@pytest.mark.parametrize(("name", "count"), [("stanford", 8), ("stanford_shoulder_origin", 8), ("scara", 2)])
def test_all_branches_of_stanford_and_scara_reach_the_pose_by_the_courses_closed_forms(name: str, count: int) -> None:
    spec = robot(name)
    for seed in range(20):
        q = random_configuration(spec, seed)
        T = closed_form_pose(name, q)
        branches = explain_inverse_kinematics(spec, T).branches
        assert len(branches) == count
        assert min(angle_between(spec, branch.q, q) for branch in branches) < 1e-9
        for branch in branches:
            np.testing.assert_allclose(closed_form_pose(name, branch.q), T, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize(
    "name", ["puma560", "planar_2r", "cylindrical", "spherical_wrist", "cylindrical_wrist", "arm_5r"]
)
def test_all_branches_of_the_courses_other_arms_reach_the_pose_by_its_closed_forms(name: str) -> None:
    spec = robot(name)
    q = random_configuration(spec, 3)
    T = closed_form_pose(name, q)
    branches = explain_inverse_kinematics(spec, T).branches
    assert min(angle_between(spec, branch.q, q) for branch in branches) < 1e-9
    for branch in branches:
        np.testing.assert_allclose(closed_form_pose(name, branch.q), T, rtol=0.0, atol=1e-13)


def test_the_scara_branches_are_those_of_the_textbooks_formulas() -> None:
    # Spong, Hutchinson, Vidyasagar, section 3.3.2, with both signs of the root
    spec, (a1, a2, d4) = robot("scara"), (0.325, 0.275, 0.05)
    T = closed_form_pose("scara", np.array([-0.4, 1.1, 0.12, 0.7]))
    x, y, z = T[:3, 3]
    cosine = (x * x + y * y - a1 * a1 - a2 * a2) / (2 * a1 * a2)
    expected = []
    for sign in (1.0, -1.0):
        q2 = math.atan2(sign * math.sqrt(1 - cosine * cosine), cosine)
        q1 = math.atan2(y, x) - math.atan2(a2 * math.sin(q2), a1 + a2 * math.cos(q2))
        expected.append([q1, q2, -z - d4, q1 + q2 - math.atan2(T[1, 0], T[0, 0])])
    for branch, by_hand in zip(explain_inverse_kinematics(spec, T).branches, expected, strict=True):
        assert angle_between(spec, branch.q, np.array(by_hand)) < 1e-12


@pytest.mark.parametrize("name", ["puma560", "stanford", "cylindrical_wrist"])
def test_a_stretched_wrist_is_called_singular_and_only_the_sum_of_its_outer_joints_is_determined(name: str) -> None:
    spec = robot(name)
    q = np.array([0.4, -0.7, 0.5, 0.3, 0.0, 0.8])
    explanation = explain_inverse_kinematics(spec, table_tool_pose(spec, q))
    own = [branch for branch in explanation.branches if abs(branch.q[4]) < 1e-9]
    assert len(own) == 1
    assert own[0].q[3] == 0.0
    assert own[0].q[5] == pytest.approx(1.1, abs=1e-9)
    assert any("Wrist singular" in note and "only q4 + q6 is determined" in note for note in explanation.notes)
    assert all(missed_by(spec, branch.q, table_tool_pose(spec, q)) < 1e-12 for branch in explanation.branches)


def test_a_wrist_centre_on_axis_1_is_called_shoulder_singular() -> None:
    spec = textbook_table("elbow alone", 1)
    spec = replace(spec, rows=(spec.rows[0], replace(spec.rows[1], d=0.0), spec.rows[2]))
    l2, l3 = (abs(row.a) for row in spec.rows[1:])
    # the elbow's two links fold back to above the shoulder
    q3 = 2.0
    over = math.atan2(l3 * math.sin(q3), l2 + l3 * math.cos(q3))
    signs = [math.copysign(1.0, row.a) for row in spec.rows[1:]]
    q = np.array([0.6, -math.pi / 2 - over, q3 if signs[0] == signs[1] else q3 + math.pi])
    T = table_tool_pose(spec, q)
    assert np.abs(T[:2, 3]).max() < 1e-12
    explanation = explain_inverse_kinematics(spec, T)
    assert any(note.startswith("Shoulder singular") for note in explanation.notes)
    for found in (*explanation.branches, *explanation.position_only):
        assert np.abs(table_tool_pose(spec, found.q)[:3, 3] - T[:3, 3]).max() < 1e-12


@pytest.mark.parametrize("name", ["puma", "stanford", "cylindrical", "scara with wrist", "scara", "spherical wrist"])
def test_wherever_an_arm_is_singular_some_branch_reaches_the_pose(name: str) -> None:
    rng = np.random.default_rng(5)
    angles, slides = [0.0, math.pi / 2, -math.pi / 2, math.pi, 0.3, 1e-9, 1e-7, 1e-5], [0.0, 0.3, 1e-9]
    for seed in range(25):
        spec = textbook_table(name, seed % 5)
        q = np.array([rng.choice(angles if row.type.turns else slides) for row in spec.rows])
        T = table_tool_pose(spec, q)
        branches = explain_inverse_kinematics(spec, T).branches
        assert branches
        assert max(missed_by(spec, branch.q, T) for branch in branches) < 1e-8


def test_a_singular_offset_wrist_keeps_axis_4_within_reach() -> None:
    spec = robot("ur5e")
    q = np.array([0.3, -1.2, 1.1, 0.4, 0.0, 0.7])
    T = table_tool_pose(spec, q)
    explanation = explain_inverse_kinematics(spec, T)
    assert any("Wrist singular" in note and "q6 is free within reach" in note for note in explanation.notes)
    singular = [branch for branch in explanation.branches if abs(branch.q[4]) < 1e-9]
    assert len(singular) == 2
    assert all(missed_by(spec, branch.q, T) < 1e-12 for branch in explanation.branches)


def test_a_straight_elbow_gives_one_branch_where_it_bends_to_two() -> None:
    spec = robot("scara")
    q = np.array([0.3, 0.0, 0.1, 0.2])
    explanation = explain_inverse_kinematics(spec, table_tool_pose(spec, q))
    assert len(explanation.branches) == 1
    assert any(note.startswith("Elbow straight") for note in explanation.notes)
    assert angle_between(spec, explanation.branches[0].q, q) < 1e-6


@pytest.mark.parametrize(
    ("name", "x", "note"),
    [
        ("scara", 0.8, "Out of reach by 0.2000 m: the point is 0.8000 m away, and l1 + l2 = 0.6000 m."),
        ("planar_2r", 0.2, "Out of reach by 0.1000 m: the point is 0.2000 m away, and l1 - l2 = 0.3000 m."),
    ],
)
def test_out_of_reach_is_said_with_the_distance(name: str, x: float, note: str) -> None:
    T = np.array(table_tool_pose(robot(name), np.zeros(len(robot(name).moving_rows))))
    T[0, 3] = x
    explanation = explain_inverse_kinematics(robot(name), T)
    assert explanation.branches == ()
    assert note in explanation.notes


def test_a_point_nearer_to_axis_1_than_the_shoulders_offset_is_out_of_reach() -> None:
    T = np.eye(4)
    T[:3, 3] = [0.05, 0.0, 0.9]
    explanation = explain_inverse_kinematics(robot("puma560"), T)
    assert explanation.branches == ()
    assert explanation.notes == (
        "Out of reach: the wrist centre is 0.0500 m from axis 1, the arm's plane never nearer than 0.1500 m: "
        "0.1000 m too near.",
    )


def test_the_other_elbow_of_a_planar_arm_reaches_the_position_alone() -> None:
    spec = robot("planar_2r")
    q = np.array([0.4, 1.1])
    explanation = explain_inverse_kinematics(spec, table_tool_pose(spec, q))
    assert [branch.name for branch in explanation.branches] == ["elbow down"]
    assert [branch.name for branch in explanation.position_only] == ["elbow up"]
    assert explanation.position_only[0].position_error < 1e-12
    assert any(
        note.startswith("σ2 = -1 reaches the goal's position, turned from its orientation by")
        for note in explanation.notes
    )


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("ssrms", "Textbooks solve arms of 2 to 6 joints in closed form; this one has 7."),
        ("rpr", "Its first three joints (R P R) are not an elbow"),
    ],
)
def test_an_arm_without_a_closed_form_gives_the_reason(name: str, reason: str) -> None:
    explanation = explain_inverse_kinematics(robot(name), np.eye(4))
    assert not explanation
    assert explanation.steps == ()
    assert explanation.branches == ()
    assert explanation.reason.startswith(reason)
    assert explanation.text.startswith(f"{name}: no closed form of the textbooks.")


def test_odd_twists_have_no_closed_form() -> None:
    assert not explain_inverse_kinematics(ODD_ROBOT, np.eye(4))


def test_rounded_right_angles_are_taken_for_right_and_what_they_cost_is_said() -> None:
    spec = robot("puma560")
    rounded = replace(spec, rows=tuple(replace(row, alpha=round(row.alpha, 6)) for row in spec.rows))
    T = table_tool_pose(rounded, [0.3, -0.7, 0.5, 1.1, 0.6, -0.4])
    explanation = explain_inverse_kinematics(rounded, T)
    assert len(explanation.branches) == 8
    assert 1e-9 < max(branch.rotation_error for branch in explanation.branches) < 1e-5
    assert any("as rounded numbers do" in note for note in explanation.notes)


@pytest.mark.parametrize("goal", [np.eye(3), np.full((4, 4), np.nan)])
def test_what_is_no_pose_is_refused(goal: Array) -> None:
    with pytest.raises(ConfigurationError, match="a pose must be an array of finite numbers of shape"):
        explain_inverse_kinematics(robot("scara"), goal)


def the_stanford_explanation() -> Explanation:
    return explain_inverse_kinematics(
        robot("stanford"), closed_form_pose("stanford", np.array([0.3, -0.7, 0.5, 1.1, 0.6, -0.4]))
    )


@pytest.mark.parametrize("name", [*CLASSES])
def test_text_fits_into_80_columns(name: str) -> None:
    spec = disguised(textbook_table(name, 4), 4)
    spec = replace(spec, base=textbook_table(name, 4).base)
    explanation = explain_inverse_kinematics(spec, table_tool_pose(spec, random_configuration(spec, 4)))
    assert max(len(line) for line in explanation.lines) <= 80


@pytest.mark.parametrize("name", ["puma", "elbow with offsets", "stanford", "cylindrical", "offset wrist"])
def test_the_closed_form_has_the_branches_that_the_complete_solver_finds(name: str) -> None:
    for seed in range(2):
        spec = disguised(textbook_table(name, seed), seed + 20)
        T = table_tool_pose(spec, random_configuration(spec, seed))
        by_hand = [branch.q for branch in explain_inverse_kinematics(spec, T).branches]
        solved = inverse_kinematics(spec, T, limits=False)
        assert len(solved) == len(by_hand)
        for q in solved:
            assert min(angle_between(spec, q, other) for other in by_hand) < 1e-8


def test_the_text_has_formulas_in_letters_then_with_numbers_and_a_table_of_branches() -> None:
    lines = the_stanford_explanation().lines
    assert "      q1 = atan2(y, x) - atan2(d, r)" in lines
    assert "      d  = 0.1500 m   d2 in the file" in lines
    assert "      p_w = p - d6 z6" in lines
    assert "      q3 = σ3 sqrt(u² + v²),  σ3 = +1 or -1" in lines
    table = lines[lines.index("Branches, by the signs of σ1 σ3 σ5") + 1 :]
    assert sum(line.endswith("flip") for line in table) == 8
    assert any("17.19" in line and "-40.11" in line and "0.5000" in line for line in table)


def test_the_steps_are_plain_data() -> None:
    explanation = the_stanford_explanation()
    data = json.loads(json.dumps(explanation.as_json()))
    assert data["form"].startswith("spherical arm")
    assert [step["title"] for step in data["steps"]][1] == "The wrist centre"
    assert len(data["branches"]) == 8
    line = data["steps"][2]["lines"][1]
    assert line["symbol"] == "q1"
    assert line["unit"] == "rad"
    assert line["signs"] == {"σ1": 1}
    assert line["value"] == pytest.approx(data["branches"][0]["q"][0], abs=1e-12)


def test_every_coordinate_of_a_branch_is_the_last_line_that_its_signs_lead_to() -> None:
    explanation = the_stanford_explanation()
    for branch in explanation.branches:
        for joint, coordinate in enumerate(branch.q.tolist(), start=1):
            values = [
                line.value
                for step in explanation.steps
                for line in step.lines
                if line.symbol == f"q{joint}" and set(line.signs) <= set(branch.signs)
            ]
            assert len(values) == 1
            assert values[0] == pytest.approx(coordinate, abs=1e-12)


def test_a_robot_explains_itself_as_the_function_does() -> None:
    arm = Robot.load("stanford")
    T = arm.fk("home")
    assert str(arm.explain_ik(T)) == explain_inverse_kinematics(robot("stanford"), T).text
