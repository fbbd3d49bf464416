"""How rows move, what they are called, and their limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim.robot.row import ActuatorType, Convention, JointType
from dh2sim.robot.units import AngleUnit
from tests.formats.table.samples import STANDARD, complaints, imported, numbers, tool_poses, types

MARK = "mark the joint's coordinate with a star, as in theta1* or d3*, or add a column type with R or P"


def _rows(*rows: str, head: str = "theta,d,a,alpha") -> str:
    return "\n".join([head, *rows, ""])


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        (["q1,0,1,0", "q2,0,1,0"], "rr"), (["θ1*,0,1,0", "0,d2*,1,0"], "rp"), (["0,q1,0,0", "pi/2,q2,0,0"], "pp"),
        (["θ1,0,0,0", "0,d2,0,0"], "rp"), (["θ1,0,0,0", "0,0.1,0,0"], "rf"), (["*,0,0,0", "0,*,0,0"], "rp"),
        (["0,1,0,0", "0,2,0,0"], "rr"), (["-,1,0,0", ",2,0,0"], "rr"), (["-,1,0,0", ",2*,0,0"], "rp"),
        (["θi,0,0,0", "0,di,0,0", "θi,0,0,0"], "rpr"), (["0*,0,0,0", "0,0.2*,0,0"], "rp"),
    ],
)  # fmt: skip
def test_the_variable_cell_says_how_a_row_moves(rows: list[str], expected: str) -> None:
    assert types(imported(_rows(*rows), "t.csv", **STANDARD).spec) == expected


@pytest.mark.parametrize(
    "words", ["RPCF", "0p", ["Revolute", "prismatic"], ["rotary", "linear", "Fixed"], ["0", "1", "2"]]
)
def test_a_column_for_types_says_it_too(words: list[str]) -> None:
    text = _rows(*(f"{word},0,0,0,0" for word in words), head="type,theta,d,a,alpha")
    kinds = {"r": "r", "0": "r", "p": "p", "l": "p", "1": "p", "c": "c", "f": "f", "2": "f"}
    assert types(imported(text, "t.csv", **STANDARD).spec) == "".join(kinds[word[0].lower()] for word in words)


def test_a_column_headed_joint_may_hold_types() -> None:
    text = _rows("R,0,0.1,0,pi/2", "P,0,0.2,0,0", head="joint,theta,d,a,alpha")
    spec = imported(text, "t.csv", **STANDARD).spec
    assert (types(spec), [row.name for row in spec.rows]) == ("rp", ["joint_1", "joint_2"])
    assert spec.rows[1].d == 0.2


def test_rows_above_the_headings_are_no_part_of_the_table() -> None:
    text = "| Robot | | | |\n|---|---|---|---|\n| θ | d | a | α |\n| θ1 | 0 | 1 m | 0 |\n"
    found = imported(text, **STANDARD)
    assert numbers(found.spec) == [(0, 0, 1, 0)]


def test_a_fixed_row_is_noted_and_has_no_actuator() -> None:
    found = imported(_rows("q1,0,1,0", "0.5,0,0,0", "0.5,1,0,0"), "t.csv", **STANDARD, angle=AngleUnit.RAD)
    assert [row.actuator.type for row in found.spec.rows] == [
        ActuatorType.POSITION,
        ActuatorType.NONE,
        ActuatorType.NONE,
    ]
    assert "rows 2, 3 have no variable: they were read as fixed" in found.notes


def test_what_contradicts_itself_in_a_row_is_refused() -> None:
    text = _rows("R,0,d1*,0,0", "P,q2,0,0,0", "F,q3,0,0,0", "x,q4,0,0,0", ",q5,q6,0,0", head="type,theta,d,a,alpha")
    assert complaints(text, "t.csv", **STANDARD) == [
        "t.csv:2:5: row 1, d: 'd1*' is variable, but the row's joint is revolute",
        "t.csv:3:3: row 2, theta: 'q2' is variable, but the row's joint is prismatic",
        "t.csv:4:3: row 3, theta: 'q3' is variable, but the row's joint is fixed",
        "t.csv:5:1: row 4, type: found 'x'. Allowed: revolute (R, 0), prismatic (P, 1), continuous, fixed",
        "t.csv:6:5: row 5, d: two variables in one row, 'q5' and 'q6'; a row has one joint: write two rows, one with "
        "only the second",
    ]


def test_symbols_without_a_value_are_refused_all_at_once() -> None:
    text = _rows("θ1,d1,a1,pi/2", "θ2*,0,L2,alpha2", "θ3,d3*,0,0")
    asked = "has no value; write the number, or give its value in the text around the table, such as"
    assert complaints(text, "t.csv", **STANDARD) == [
        f"t.csv:2:4: row 1, d: the symbol 'd1' {asked} 'd1 = 0.4 m'; if it is the joint's coordinate, mark it "
        "with a star: "
        "d1*",
        f"t.csv:2:7: row 1, a: the symbol 'a1' {asked} 'a1 = 0.4 m'",
        f"t.csv:3:7: row 2, a: the symbol 'L2' {asked} 'L2 = 0.4 m'",
        f"t.csv:3:10: row 2, alpha: the symbol 'alpha2' {asked} 'alpha2 = 30°'",
        f"t.csv:4:1: row 3, theta: the symbol 'theta3' {asked} 'theta3 = 30°'; if it is the joint's "
        "coordinate, mark it "
        "with a star: theta3*",
    ]


def test_values_in_the_text_are_used_and_noted() -> None:
    text = "# d1 = 40 cm, $a_{2}$ = 0.3; L = 200 mm\n" + _rows("θ1,d1,L,0", "θ2,0,-a_2/2,0")
    found = imported(text, "t.csv", **STANDARD, angle=AngleUnit.RAD)
    assert numbers(found.spec) == [(0, 0.4, 0.2, 0), (0, 0, -0.15, 0)]
    assert found.notes == (
        "a length without a unit was read in m, the unit of other cells",
        "line 1 gives d1 its value",
        "line 1 gives L its value",
        "line 1 gives a2 its value",
    )


def test_a_symbol_with_two_values_has_none() -> None:
    text = "# a1 = 0.4\n# a1 = 0.5\n" + _rows("θ1,0,a1,0")
    assert complaints(text, "t.csv", **STANDARD) == [
        "t.csv:4:6: row 1, a: the symbol 'a1' has two values, on lines 1 and 2; write the number"
    ]


def test_an_example_pose_in_the_text_does_not_fix_a_joint() -> None:
    text = "# at q1 = 0.5, θ2 = 30° the tool is at x = 1\n" + _rows("q1,0,1,0", "θ2,0,1,0")
    assert types(imported(text, "t.csv", **STANDARD).spec) == "rr"


def test_d_that_may_be_a_length_or_a_coordinate_is_refused() -> None:
    assert complaints("# d1 = 0.4\n" + _rows("0,d1,0,0"), "t.csv", **STANDARD) == [
        f"t.csv:3:3: row 1, d: 'd1' may be the joint's coordinate or the number given on line 1; {MARK}, or "
        "write the "
        "number"
    ]
    assert complaints("i,a,alpha,d\n1,0,0,d1\n", "t.csv", **STANDARD) == [
        f"t.csv:2:7: row 1, d: 'd1' may be the joint's coordinate or a length; {MARK}, or write the number"
    ]


def test_a_coordinate_belongs_to_one_row_and_its_number_may_be_out_of_order() -> None:
    assert complaints(_rows("θ1,0,1,0", "θ_1,0,1,0"), "t.csv", **STANDARD) == [
        "t.csv:3:1: row 2, theta: 'theta1' is the coordinate of row 1 already; every row has its own"
    ]
    notes = imported(_rows("θ2,0,1,0", "θ1,0,1,0"), "t.csv", **STANDARD).notes
    assert "the coordinates are not numbered in the order of the rows; a joint vector follows the rows" in notes


def test_a_flipped_joint_runs_backwards() -> None:
    text = "theta,d,a,alpha,sign,flip\n-q1,0,1,0,,\nq2,0,1,0,-1,no\n-q3,0,1,0,1,yes\nq4,0,1,0,+,1\n"
    assert [row.flip for row in imported(text, "t.csv", **STANDARD).spec.rows] == [True, True, False, True]
    assert complaints(text.replace("-1,no", "2,maybe"), "t.csv", **STANDARD) == [
        "t.csv:3:10: row 2, sign: found '2'. Allowed: '-1' or '-' or '1' or '+1' or '+'",
        "t.csv:3:12: row 2, flip: found 'maybe'. Allowed: 'true' or 'yes' or '1' or 'false' or 'no' or '0' or '-'",
    ]


def test_an_offset_adds_to_the_coordinate() -> None:
    text = "theta,d,a,alpha,offset (deg)\nq1 + 0.1 rad,0,1,0,90\n-q2,0,1,0,45\n"
    thetas = [row.theta for row in imported(text, "t.csv", **STANDARD).spec.rows]
    assert thetas == pytest.approx([0.1 + math.pi / 2, math.pi / 4])
    text = "theta,d,a,alpha,offset\n0,q1 + 0.1,1,0,0.2\n0,0,1,0,0.3\n"
    assert complaints(text, "t.csv", **STANDARD) == [
        "t.csv:3:9: row 2, offset: '0.3' is an angle, and nothing says in which unit; write the unit in the "
        "heading, or pass "
        "angle='deg' or angle='rad'",
        "t.csv:3:9: row 2, offset: an offset belongs to a joint's coordinate; this row is fixed",
    ]
    assert imported(text.replace("0.3", "0"), "t.csv", **STANDARD).spec.rows[0].d == pytest.approx(0.3)


@pytest.mark.parametrize(
    "cell",
    ["[-170, 170]", "-170..170", "-170 to 170", "-170° … +170°", "±170", "+/-170", "(-170; 170)", "-170 – 170",
     "[-170,170]", "-170 / 170", "-170 170", "−170 ~ 170", "[-170, 170] °", "$\\pm 170^\\circ$"],
)  # fmt: skip
def test_limits_in_one_column_are_read_as_people_write_them(cell: str) -> None:
    text = f"| θ | d | a | α (deg) | limits |\n|---|---|---|---|---|\n| q1 | 0 | 0 | 90 | {cell} |\n"
    position = imported(text, **STANDARD).spec.rows[0].limits.position
    assert position == (math.radians(-170), math.radians(170))


def test_limits_in_two_columns_follow_the_joint() -> None:
    text = _rows(
        "q1,0,0,pi/2,-pi,pi", "0,q2,0,0,0,300 mm", "q3,0,0,0,-,", "q4,0,0,0,-inf,inf", "q5,0,0,0,-1,",
        head="theta,d,a,alpha,min,max",
    )  # fmt: skip
    found = imported(text, "t.csv", **STANDARD)
    limits = [row.limits.position for row in found.spec.rows]
    assert limits == [(-math.pi, math.pi), (0, 0.3), None, None, None]
    assert "row 5 has only one limit, '-1': it was left out" in found.notes


def test_wrong_limits_are_refused_and_needless_ones_left_out() -> None:
    head = "type,theta,d,a,alpha (deg),min,max\n"
    assert complaints(head + "R,q1,0,0,0,10,-10\nR,q2,0,0,0,x,1\n", "t.csv", **STANDARD) == [
        "t.csv:2:12: row 1, lower limit: the lower limit is not below the upper one: '10' and '-10'",
        "t.csv:3:12: row 2, lower limit: the symbol 'x' has no value; write the number, or give its value in "
        "the text "
        "around the table, such as 'x = 0.4 m'",
    ]
    assert complaints("theta,d,a,alpha (deg),limits\nq1,0,0,0,often\n", "t.csv", **STANDARD) == [
        "t.csv:2:10: row 1, limits: 'often' is not a pair of limits; write it as '[-170, 170]', '-170 to 170' or "
        "'±170'"
    ]
    found = imported(head + "C,0,0,0,0,-10°,10°\nF,0,0,0,0,-10°,10°\n", "t.csv", **STANDARD)
    assert [row.limits.position for row in found.spec.rows] == [None, None]
    assert found.notes == (
        "row 1 is continuous: its limits were left out", "row 2 is fixed: its limits were left out",
    )  # fmt: skip


def test_names_are_used_where_a_robot_file_allows_them() -> None:
    text = "name,theta,d,a,alpha\nshoulder_pan,q1,0,0,0\nupper arm,q2,0,0,0\n3,q3,0,0,0\n,q4,0,0,0\n"
    found = imported(text, "t.csv", **STANDARD, angle=AngleUnit.RAD)
    assert [row.name for row in found.spec.rows] == ["shoulder_pan", "joint_2", "joint_3", "joint_4"]
    assert found.notes == ("'upper arm' is not allowed as the name of a joint: it is called joint_2",)


def test_names_that_two_joints_have_are_left_out() -> None:
    text = "name,theta,d,a,alpha\njoint_2,q1,0,0,0\n,q2,0,0,0\n"
    found = imported(text, "t.csv", **STANDARD, angle=AngleUnit.RAD)
    assert [row.name for row in found.spec.rows] == ["joint_1", "joint_2"]
    assert found.notes == ("the names of the joints were left out, since two are the same",)


def test_rows_that_are_missing_or_in_another_order_are_refused() -> None:
    assert complaints("i,theta,d,a,alpha\n1,q1,0,0,0\n3,q3,0,0,0\n2,q2,0,0,0\n", "t.csv", **STANDARD) == [
        "t.csv:3:1: row 2: this row is numbered 3, and the one before it 1; rows go from the base to the "
        "tool, each once"
    ]


def test_rows_with_beta_are_hayatis() -> None:
    spec = imported("| θ | a | α | β |\n|---|---|---|---|\n| q1 | 0.4 | 0 | 0.3° |\n| q2 | 0.3 | 0 | 0 |\n").spec
    assert spec.convention is Convention.HAYATI
    assert [row.convention for row in spec.rows] == [Convention.HAYATI] * 2
    q, beta = (0.7, -0.2), math.radians(0.3)
    expected = _z(q[0]) @ _x(0.4) @ _y(beta) @ _z(q[1]) @ _x(0.3)
    np.testing.assert_allclose(tool_poses(spec, [q])[0], expected, atol=1e-15)


def test_in_a_table_with_d_only_rows_whose_beta_is_not_zero_are_hayatis() -> None:
    text = "theta,d,a,alpha,beta (deg)\nq1,0.1,0.4,0,0\nq2,0,0.3,0,0.2\n0,q3,0.3,0,0.2\n"
    spec = imported(text, "t.csv", **STANDARD).spec
    assert [row.convention.value for row in spec.rows] == ["standard", "hayati", "hayati"]
    assert spec.rows[2].type is JointType.PRISMATIC
    assert complaints(text.replace("q2,0,", "q2,0.5,"), "t.csv", **STANDARD) == [
        "t.csv:3:4: row 2, d: a row with beta, after Hayati, has no d unless its joint is prismatic"
    ]


def _z(angle: float) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    s, c = math.sin(angle), math.cos(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def _y(angle: float) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    s, c = math.sin(angle), math.cos(angle)
    return np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]])


def _x(length: float) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    T = np.eye(4)
    T[0, 3] = length
    return T


@pytest.mark.parametrize(
    ("heading", "cells", "expected"),
    [
        ("Variable", ("θ", "θ", "d"), "rrp"), ("Joint variable", ("θ1", "$\\theta_2$", "d3"), "rrp"),
        ("q", ("theta_1", "theta_2", "d_3"), "rrp"), ("var", ("θ1*", "d2*", "-"), "rpf"),
        ("Variable", ("q1", "q2", "-"), "rrf"), ("Variable", ("d1", "", "θ3"), "pfr"),
    ],
)  # fmt: skip
def test_a_column_that_names_the_variable_says_how_rows_move(
    heading: str, cells: tuple[str, str, str], expected: str
) -> None:
    head = f"| a [m] | α [rad] | d [m] | θ [rad] | {heading} |\n|---|---|---|---|---|\n"
    rows = ("0 | -π/2 | 0.4 | 0.1", "0 | π/2 | 0.15 | 0", "0 | 0 | 0.2 | -π/2")
    text = head + "".join(f"| {row} | {cell} |\n" for row, cell in zip(rows, cells, strict=True))
    found = imported(text, **STANDARD)
    assert types(found.spec) == expected
    assert numbers(found.spec) == [(0.1, 0.4, 0, -math.pi / 2), (0, 0.15, 0, math.pi / 2), (-math.pi / 2, 0.2, 0, 0)]


def test_a_column_that_names_the_variable_may_stand_for_theta_too() -> None:
    text = "i,a,alpha,d,Variable\n1,0,pi/2,0.4,θ1\n2,0,0,0.2,d2\n"
    assert types(imported(text, "t.csv", **STANDARD).spec) == "rp"


def test_a_variable_that_is_not_of_the_rows_type_is_refused() -> None:
    text = "type,theta,d,a,alpha,variable\nR,0,0.1,0,0,d1\nP,0,0.1,0,0,d2\n"
    assert complaints(text, "t.csv", **STANDARD) == [
        "t.csv:2:13: row 1, variable: 'd1' is not a variable of a revolute joint"
    ]


@pytest.mark.parametrize("empty", ["", "-", "—", "none", "N/A"])
@pytest.mark.parametrize("theta", ["0", "q1"])
def test_a_row_without_type_in_a_column_of_types_is_fixed(empty: str, theta: str) -> None:
    text = _rows(f"1,R,0,90,0.1,{theta}", "2,P,0.3,0,0,0", f"tool,{empty},0,0,0.12,45",
                 head="joint,type,a,alpha (deg),d,theta (deg)")  # fmt: skip
    found = imported(text, "t.csv", **STANDARD)
    assert types(found.spec) == "rpf"
    assert found.spec.rows[2].theta == math.pi / 4
    assert "row 3 has no variable: it was read as fixed" in found.notes


def test_a_column_of_types_that_is_empty_throughout_says_nothing() -> None:
    text = "type,theta,d,a,alpha\n,q1,0.1,0,0\n,q2,0.1,0,0\n"
    assert types(imported(text, "t.csv", **STANDARD).spec) == "rr"
