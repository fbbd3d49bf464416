"""What Corke's Robotics Toolboxes print becomes the robot that the toolbox itself computes with."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from dh2sim.robot.row import Convention
from dh2sim.robot.units import AngleUnit, LengthUnit
from tests.formats.table.samples import complaints, imported, modified, numbers, standard, tool_poses, types

FOLDER = Path(__file__).parent / "printouts"
"""Printouts of Robotics Toolbox for Python 1.4.4, verbatim, and poses by its own ``fkine``, base left out."""
POSES = json.loads((FOLDER / "poses.json").read_text(encoding="utf-8"))

EXACT = 2e-11
PRINTED = {
    "puma560": 1e-4,
    "ur5": 1e-4,
    "p8": 1e-4,
    "jaco": 1e-5,
    "al5d": 2e-3,
    "panda": 4e-3,
    "lwr4": 4e-3,
    "mix": 2e-2,
    "mix_modified_ascii": 2e-2,
}
"""Robots whose printout rounds lengths to four digits, offsets to three and tools to two."""

PUMA_MATLAB = """\
p560 =

Puma 560 [Unimation]:: 6 axis, RRRRRR, stdDH, fastRNE
 - viscous friction; params of 8/95;
+---+-----------+-----------+-----------+-----------+-----------+
| j |     theta |         d |         a |     alpha |    offset |
+---+-----------+-----------+-----------+-----------+-----------+
|  1|         q1|          0|          0|     1.5708|          0|
|  2|         q2|          0|     0.4318|          0|          0|
|  3|         q3|    0.15005|     0.0203|    -1.5708|          0|
|  4|         q4|     0.4318|          0|     1.5708|          0|
|  5|         q5|          0|          0|    -1.5708|          0|
|  6|         q6|          0|          0|          0|          0|
+---+-----------+-----------+-----------+-----------+-----------+
"""
ARM_MATLAB = """\
% Three joints, the second one slides
%arm:: 3 axis, RPR, modDH, slowRNE
%+---+-----------+-----------+-----------+-----------+-----------+
%| j |     theta |         d |         a |     alpha |    offset |
%+---+-----------+-----------+-----------+-----------+-----------+
%|  1|         q1|        0.4|        0.1|        0.3|        0.2|
%|  2|        0.7|         q2|        0.2|       -1.2|       0.05|
%|  3|         q3|          0|          0|        0.5|       -1.5|
%+---+-----------+-----------+-----------+-----------+-----------+
%tool:    t = (0.1, 0.2, 0.3), RPY/xyz = (10, 20, 30) deg
"""
PINCHER_MATLAB = """\
R2 (4 axis, RRRR, stdDH, fastRNE)

+---+-----------+-----------+-----------+-----------+-----------+
| j |     theta |         d |         a |     alpha |    offset |
+---+-----------+-----------+-----------+-----------+-----------+
|  1|         q1|         14|          0|      1.571|          0|
|  2|         q2|          0|       10.5|          0|      1.571|
|  3|         q3|          0|       10.5|          0|          0|
|  4|         q4|          0|          0|          0|          0|
+---+-----------+-----------+-----------+-----------+-----------+

grav =    0  base = 1  0  0  0   tool =   0           0           1         8.5
          0         0  1  0  0           -1           0           0           0
       9.81         0  0  1  0            0          -1           0           0
                    0  0  0  1            0           0           0           1
"""
PUMA_FIRST_TOOLBOX = """\
puma560 (6 axis, RRRRRR)
\t\tUnimation
\t\tgrav = [0.00 0.00 9.81]\t\tstandard D&H parameters

  alpha\t\t A\t\t theta\t D\t\tR/P
  1.570796\t 0.000000\t 0.000000\t 0.000000\tR\t(std)
  0.000000\t 0.431800\t 0.000000\t 0.000000\tR\t(std)
 -1.570796\t 0.020300\t 0.000000\t 0.150050\tR\t(std)
"""


def _printed(name: str) -> str:
    return (FOLDER / f"{name}.txt").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", sorted(POSES))
def test_a_printout_of_the_python_toolbox_moves_as_the_toolbox_says(name: str) -> None:
    found = imported(_printed(name), "robot.txt")
    T = tool_poses(found.spec, POSES[name]["q"])[:, :3]
    assert np.abs(T - np.array(POSES[name]["T"])).max() < PRINTED.get(name, EXACT)
    assert found.units.angle is AngleUnit.DEG
    assert "numbers are as printed, and a printout rounds them: poses are no better than its digits" in found.notes


@pytest.mark.parametrize("name", ["panda", "lwr4", "al5d", "mix", "mix_modified_ascii"])
def test_a_printout_is_read_with_the_pose_of_its_tool(name: str) -> None:
    """Without the tool, or with its angles in another order, the poses above would be further off than rounding."""
    found = imported(_printed(name), "robot.txt")
    assert (
        "the pose of the tool is as printed, rounded: give it in the robot file if you know it better" in found.notes
    )
    bare = imported(_printed(name).partition(" tool ")[0], "robot.txt")
    T = tool_poses(bare.spec, POSES[name]["q"])[:, :3]
    assert np.abs(T - np.array(POSES[name]["T"])).max() > 3 * PRINTED[name]


def test_limits_names_and_configurations_of_a_printout_are_read() -> None:
    found = imported(_printed("cobra600"), "robot.txt")
    spec = found.spec
    assert types(spec) == "rrpr"
    assert [row.name for row in spec.rows] == ["joint_1", "joint_2", "joint_3", "joint_4"]
    assert spec.rows[0].limits.position == (math.radians(-50), math.radians(50))
    assert spec.rows[2].limits.position == (0.0, 0.21)
    assert {name: vector.tolist() for name, vector in spec.configurations.items()} == {"qz": [0] * 4, "qr": [0] * 4}
    assert (spec.name, spec.description, spec.source) == ("r", "Cobra600", "robot.txt, line 3")


def test_a_configuration_outside_the_limits_is_left_out_and_noted() -> None:
    found = imported(_printed("puma560"), "robot.txt")
    assert sorted(found.spec.configurations) == ["qr", "qs", "qz"]
    assert found.spec.configurations["qr"].tolist() == [0, math.radians(90), math.radians(-90), 0, 0, 0]
    assert "the configuration 'qn' was left out: '180°' is outside the limits of joint_3" in found.notes


def test_a_base_that_the_toolbox_does_not_print_is_noted() -> None:
    assert "the printout names a base without its pose: it was left out" in imported(_printed("p8")).notes


def test_flipped_joints_of_a_printout_stay_flipped() -> None:
    assert [row.flip for row in imported(_printed("jaco")).spec.rows] == [True] + [False] * 5
    assert [row.flip for row in imported(_printed("mix_modified_ascii")).spec.rows] == [False, True, True, True]


def test_the_thick_frames_of_older_versions_are_read_too() -> None:
    thin = _printed("puma560").partition("\n\n")[0]
    thick = thin.translate(str.maketrans("┌┬┐├┼┤└┴┘│─", "┏┳┓┣╋┫┗┻┛┃━"))
    assert numbers(imported(thick).spec) == numbers(imported(thin).spec)


def test_a_printout_in_a_fenced_block_of_a_readme_is_read() -> None:
    text = "# My robot\n\nSee the [model](x).\n\n```\n" + _printed("ur5") + "```\n\n| a | b |\n|---|---|\n| 1 | 2 |\n"
    assert numbers(imported(text).spec) == numbers(imported(_printed("ur5")).spec)


def test_a_printout_of_the_matlab_toolbox_is_in_radians_and_as_printed() -> None:
    found = imported(PUMA_MATLAB, "p560.txt")
    assert numbers(found.spec) == [
        (0, 0, 0, 1.5708),
        (0, 0, 0.4318, 0),
        (0, 0.15005, 0.0203, -1.5708),
        (0, 0.4318, 0, 1.5708),
        (0, 0, 0, -1.5708),
        (0, 0, 0, 0),
    ]
    assert found.spec.convention is Convention.STANDARD
    assert found.spec.description == "Puma 560"
    assert found.units.angle is AngleUnit.RAD
    assert found.notes == (
        "no unit of lengths is given: they were read in m",
        "numbers are as printed, and a printout rounds them: poses are no better than its digits",
        "the toolbox for MATLAB does not print which joints are flipped, and 1.5708 stays 1.5708: write pi/2 for a "
        "right angle",
    )


def test_the_offset_column_adds_to_theta_or_d_and_a_modified_printout_has_its_tool() -> None:
    spec = imported(ARM_MATLAB, "arm.m").spec
    assert types(spec) == "rpr"
    q1, q2, q3 = 0.3, -0.4, 1.1
    roll, pitch, yaw = (math.radians(angle) for angle in (10, 20, 30))
    tool = modified(0, 0, 0, yaw) @ _about_y(pitch) @ modified(roll, 0, 0, 0)
    tool[:3, 3] = (0.1, 0.2, 0.3)
    expected = (
        modified(q1 + 0.2, 0.4, 0.1, 0.3) @ modified(0.7, q2 + 0.05, 0.2, -1.2) @ modified(q3 - 1.5, 0, 0, 0.5) @ tool
    )
    np.testing.assert_allclose(tool_poses(spec, [[q1, q2, q3]])[0], expected, atol=1e-14)


def _about_y(angle: float) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    s, c = math.sin(angle), math.cos(angle)
    return np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]])


def test_the_tool_matrix_of_an_older_matlab_toolbox_is_read_in_the_unit_of_the_table() -> None:
    spec = imported(PINCHER_MATLAB, length=LengthUnit.CM).spec
    q = (0.1, 0.2, 0.3, 0.4)
    tool = np.array([[0, 0, 1, 0.085], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    expected = (
        standard(q[0], 0.14, 0, 1.571)
        @ standard(q[1] + 1.571, 0, 0.105, 0)
        @ standard(q[2], 0, 0.105, 0)
        @ standard(q[3], 0, 0, 0)
        @ tool
    )
    np.testing.assert_allclose(tool_poses(spec, [q])[0], expected, atol=1e-14)


def test_a_printout_in_centimetres_asks_for_the_unit() -> None:
    assert complaints(PINCHER_MATLAB) == [
        "t.md:6:27: row 1, d: '14' is a length, and nothing says in which unit; write the unit in the heading, or "
        "pass length='m' or length='mm'"
    ]


def test_a_table_of_the_first_matlab_toolbox_is_read() -> None:
    found = imported(PUMA_FIRST_TOOLBOX)
    assert types(found.spec) == "rrr"
    assert numbers(found.spec) == [(0, 0, 0, 1.570796), (0, 0, 0.4318, 0), (0, 0.15005, 0.0203, -1.570796)]
    assert found.spec.convention is Convention.STANDARD


def test_a_printout_that_lost_a_row_is_refused() -> None:
    text = PUMA_MATLAB.replace("|  6|         q6|          0|          0|          0|          0|\n", "")
    assert complaints(text) == [
        "t.md:6:3: the printout's first line says RRRRRR, but the joints of the table are RRRRR"
    ]


def test_an_option_against_the_printout_is_refused() -> None:
    assert complaints(PUMA_MATLAB, convention=Convention.MODIFIED) == [
        "t.md:6:3: convention='modified' says modified, but the printout's first line says standard; correct the one "
        "that is wrong"
    ]


SUBCLASS = """\
DHRobot.Elbow3: Elbow3 (by me), 3 joints (RRR), standard DH parameters
┌───────────┬─────┬──────┬───────┬─────────┬────────┐
│    θⱼ     │ dⱼ  │  aⱼ  │  ⍺ⱼ   │   q⁻    │   q⁺   │
├───────────┼─────┼──────┼───────┼─────────┼────────┤
│  q1       │ 0.3 │    0 │ 90.0° │ -114.6° │ 114.6° │
│  q2       │   0 │  0.4 │  0.0° │ -114.6° │ 114.6° │
│  q3 + 30° │   0 │ 0.25 │  0.0° │ -114.6° │ 114.6° │
└───────────┴─────┴──────┴───────┴─────────┴────────┘

┌──────┬──────────────────────────────────────────┐
│ tool │ t = 0.05, 0, 0.12; rpy/xyz = 0°, 90°, 0° │
└──────┴──────────────────────────────────────────┘

┌──────┬─────┬──────┬─────┐
│ name │ q0  │ q1   │ q2  │
├──────┼─────┼──────┼─────┤
│   qr │  0° │  30° │  0° │
└──────┴─────┴──────┴─────┘
"""
"""What Robotics Toolbox for Python 1.5 prints for a user's own class."""
ADJACENT = """\
DHRobot: twolink, 2 joints (RR), standard DH parameters
┏━━━━━┳━━━━━┳━━━━━┳━━━━━━━┓
┃ θⱼ  ┃ dⱼ  ┃ aⱼ  ┃  ⍺ⱼ   ┃
┣━━━━━╋━━━━━╋━━━━━╋━━━━━━━┫
┃ q1  ┃ 0.1 ┃ 0   ┃ 90.0° ┃
┃ q2  ┃ 0   ┃ 0.3 ┃ 0.0°  ┃
┗━━━━━┻━━━━━┻━━━━━┻━━━━━━━┛
│base │ t = 0, 0, 0.5; rpy/xyz = 0°, 90°, 0°  │
│tool │ t = 0, -0.005, 0; rpy/xyz = 0°, 0°, 0° │
"""
TITLES = [
    "DHRobot.Elbow3: Elbow3 (by me), 3 joints (RRR), standard DH parameters",
    "Elbow3: Elbow3, 3 joints (RRR), geometry, standard DH parameters",
    "my.package.Elbow3: , 3 joints (RRR), dynamics, geometry, standard DH parameters",
    "# DHRobot: Elbow3, 3 joints (RRR), standard DH parameters",
    "My arm, in standard DH",
    "Standard DH parameters\nof an arm that nobody named",
]


def _subclass_pose(q: tuple[float, float, float]) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    tool = _about_y(math.pi / 2)
    tool[:3, 3] = (0.05, 0, 0.12)
    h = math.pi / 2
    return standard(q[0], 0.3, 0, h) @ standard(q[1], 0, 0.4, 0) @ standard(q[2] + math.pi / 6, 0, 0.25, 0) @ tool


@pytest.mark.parametrize("title", TITLES)
def test_a_tool_and_configurations_are_read_whatever_the_title_above_the_table(title: str) -> None:
    found = imported(SUBCLASS.replace(SUBCLASS.partition("\n")[0], title))
    q = (0.3, -0.5, 0.7)
    np.testing.assert_allclose(tool_poses(found.spec, [q])[0], _subclass_pose(q), atol=1e-14)
    assert found.spec.configurations["qr"].tolist() == [0, math.radians(30), 0]
    assert (
        "the pose of the tool is as printed, rounded: give it in the robot file if you know it better" in found.notes
    )


def test_a_printout_of_a_subclass_keeps_its_name() -> None:
    assert imported(SUBCLASS).spec.description == "Elbow3"


def test_a_tool_above_the_table_is_read_and_that_of_the_next_printout_is_not() -> None:
    tool = "tool: t = 0.05, 0, 0.12; rpy/xyz = 0°, 90°, 0°"
    bare = SUBCLASS.partition("\n\n")[0]
    other = bare.replace("0.4", "0.6") + "\ntool: t = 1, 2, 3; rpy/xyz = 0°, 0°, 0°\n"
    q = (0.3, -0.5, 0.7)
    for text in (f"{tool}\n\n{bare}\n\n{other}", f"{bare}\n{tool}\n\n{other}"):
        np.testing.assert_allclose(tool_poses(imported(text).spec, [q])[0], _subclass_pose(q), atol=1e-14)


def test_base_and_tool_directly_under_a_table_are_not_rows() -> None:
    found = imported(ADJACENT)
    q = (0.3, -0.5)
    base, tool = _about_y(math.pi / 2), np.eye(4)
    base[2, 3], tool[1, 3] = 0.5, -0.005
    expected = base @ standard(q[0], 0.1, 0, math.pi / 2) @ standard(q[1], 0, 0.3, 0) @ tool
    np.testing.assert_allclose(tool_poses(found.spec, [q])[0], expected, atol=1e-15)
    ascii_only = ADJACENT.translate(str.maketrans("┏┳┓┣╋┫┗┻┛━┃│", "+++++++++-||"))
    np.testing.assert_allclose(tool_poses(imported(ascii_only).spec, [q])[0], expected, atol=1e-15)


@pytest.mark.parametrize(
    "line",
    [
        "tool: xyz = 0, 0, 0.1, rpy = 0, 0, 0",
        "robot.tool = SE3(0, 0, 0.1)",
        "base = transl(0, 0, 0.5)",
        "The flange is at (0, 0, 0.107) from frame 7.",
        "| tool | 0, 0, 0.1 |",
    ],
)
def test_a_line_that_may_hold_a_pose_and_cannot_be_read_is_noted(line: str) -> None:
    word = next(word for word in ("tool", "base", "flange") if word in line)
    text = f"Standard DH\n\n| θ | d | a | α |\n|---|---|---|---|\n| q1 | 0.1 | 0 | 90° |\n\n{line}\n"
    note = next(note for note in imported(text).notes if "was not read" in note)
    assert note.startswith(f"line 7 may give the pose of the {word} and was not read: ")


def test_prose_about_tools_is_not_noted() -> None:
    text = "Standard DH\n\n| θ | d | a | α |\n|---|---|---|---|\n| q1 | 0.1 | 0 | 90° |\n\nThe tool has 2 fingers.\n"
    assert imported(text).notes == ("no unit of lengths is given: they were read in m",)
