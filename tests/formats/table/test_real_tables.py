"""Tables as makers, books and students print them move as the product of their matrices does."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from dh2sim.robot.row import Convention, JointType
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.typing import Array
from tests.formats.table.samples import STANDARD, complaints, imported, modified, standard, tool_poses, types

H = math.pi / 2

PANDA = """\
# Denavit–Hartenberg parameters

The Denavit–Hartenberg parameters for the arm's kinematic chain are derived following Craig's convention.

| Joint | $a\\;(\\mathrm{m})$ | $d\\;(\\mathrm{m})$ | $\\alpha\\;(\\mathrm{rad})$ | $\\theta\\;(\\mathrm{rad})$ |
|:-----:|:----:|:-----:|:------------------:|:----------:|
| Joint 1 | 0 | 0.333 | 0 | $\\theta_1$ |
| Joint 2 | 0 | 0 | $-\\frac{\\pi}{2}$ | $\\theta_2$ |
| Joint 3 | 0 | 0.316 | $\\frac{\\pi}{2}$ | $\\theta_3$ |
| Joint 4 | 0.0825 | 0 | $\\frac{\\pi}{2}$ | $\\theta_4$ |
| Joint 5 | -0.0825 | 0.384 | $-\\frac{\\pi}{2}$ | $\\theta_5$ |
| Joint 6 | 0 | 0 | $\\frac{\\pi}{2}$ | $\\theta_6$ |
| Joint 7 | 0.088 | 0 | $\\frac{\\pi}{2}$ | $\\theta_7$ |
| Flange | 0 | 0.107 | 0 | 0 |
"""
UR5 = """\
Kinematics,theta [rad],a [m],d [m],alpha [rad],Mass [kg]
Joint 1,0,0,0.089159,π/2,3.7
Joint 2,0,-0.425,0,0,8.393
Joint 3,0,-0.39225,0,0,2.33
Joint 4,0,0,0.10915,π/2,1.219
Joint 5,0,0,0.09465,-π/2,1.219
Joint 6,0,0,0.0823,0,0.1879
"""
STANFORD = """\
Table 3.4: DH parameters for the Stanford manipulator (standard). * joint variable

| Link | d_i | a_i | α_i | θ_i |
|---|---|---|---|---|
| 1 | 0 | 0 | −90 | θ1* |
| 2 | d2 | 0 | +90 | θ2* |
| 3 | d3* | 0 | 0 | 0 |
| 4 | 0 | 0 | −90 | θ4* |
| 5 | 0 | 0 | +90 | θ5* |
| 6 | d6 | 0 | 0 | θ6* |

Here d2 = 0.154 and d6 = 0.263 m; angles are in degrees.
"""
SCARA = """\
link\ta_i\talpha_i\td_i\ttheta_i
1\t0.325\t0\t0.387\tq1
2\t0.275\tpi\t0\tq2
3\t0\t0\tq3\t0
4\t0\t0\t0.05\tq4
"""
KUKA = """\
Gelenk;Typ;theta [°];d [mm];a [mm];alpha [°];min [°];max [°]
A1;R;0;-400;25;90;-170;170
A2;R;0;0;455;0;-190;45
A3;R;-90;0;35;90;-120;156
A4;R;0;-420;0;-90;-185;185
A5;R;0;0;0;90;-120;120
A6;R;180;-80,5;0;180;-350;350
"""
STUDENT = """\
### DH Table
| Links | \\alpha_{i-1} | a_{i-1} | \\theta_i | d_i
| -- | -- | -- | -- | -- |
|1| 0 | 0 | \\theta_1 | 243.3 |
|2| 90 | 0 | 90 + \\theta_2 | 30 |
|3| 180| 280 | 90 + \\theta_3 | 20 |
|4| 90 | 0 | 90 + \\theta_4 | 245 |
|5| 90 | 0 | 180 + \\theta_5 | 57 |
|6| 90 | 0 | 90 + \\theta_6 | 235 |
"""
WRIST_IN_COMMENTS = """\
% | i    | $a_{i-1}$ | $\\alpha_{i-1}$ | $d_i $ | $\\theta_i$           |
% | ---- | --------- | -------------- | ------ | -------------------- |
% | 3    | 0         | $\\pi/2$        | h      | $\\theta_3^* + \\pi/2$ |
% | 4    | 0         | $\\pi/2$       | 0      | $\\theta_4^* + \\pi/2$ |
% | 5    | 0         | $\\pi/2$       | l      | $\\theta_5^* $        |
function T_RPY = RPY_DH(t3_input, t4_input, t5_input)
h = 15;
l = 20;
"""


def _product(rows: Sequence[Array]) -> Array:
    T = np.eye(4)
    for row in rows:
        T = T @ row
    return T


def _check(text: str, expected: Sequence[Array], q: Sequence[float], file: str = "t.md", **said: object) -> None:
    found = imported(text, file, **said)
    np.testing.assert_allclose(tool_poses(found.spec, [q])[0], _product(expected), atol=5e-15)


def test_the_panda_of_its_makers_documents_is_craigs() -> None:
    q = (0.3, -0.5, 0.2, -1.4, 0.7, 1.9, -0.4)
    table = [
        (0, 0.333, 0), (0, 0, -H), (0, 0.316, H), (0.0825, 0, H), (-0.0825, 0.384, -H), (0, 0, H), (0.088, 0, H),
    ]  # fmt: skip
    rows = [modified(theta, d, a, alpha) for theta, (a, d, alpha) in zip(q, table, strict=True)]
    _check(PANDA, [*rows, modified(0, 0.107, 0, 0)], q)
    found = imported(PANDA)
    assert found.spec.convention is Convention.MODIFIED
    assert (found.spec.rows[0].name, found.spec.rows[7].name) == ("joint_1", "Flange")
    assert found.spec.rows[7].type is JointType.FIXED
    assert found.notes == ("row 8 has no variable: it was read as fixed",)


def test_the_ur5_of_its_maker_has_no_variables_marked_and_is_all_revolute() -> None:
    q = (0.1, -0.9, 1.3, 0.4, -0.7, 2.1)
    table = [(0, 0.089159, H), (-0.425, 0, 0), (-0.39225, 0, 0), (0, 0.10915, H), (0, 0.09465, -H), (0, 0.0823, 0)]
    rows = [standard(theta, d, a, alpha) for theta, (a, d, alpha) in zip(q, table, strict=True)]
    _check(UR5, rows, q, "ur5.csv", **STANDARD)
    assert imported(UR5, "ur5.csv", **STANDARD).notes == (
        "column 'Kinematics' was not used",
        "column 'Mass [kg]' was not used",
        "no cell is marked as variable: every joint was read as revolute, its theta as an offset; mark the joint's "
        "coordinate with a star, as in theta1* or d3*, or add a column type with R or P",
    )


def test_a_table_of_numbers_asks_for_its_convention() -> None:
    assert complaints(UR5, "ur5.csv") == [
        "ur5.csv:1:1: nothing says which convention the table is in; pass convention='standard' or "
        "convention='modified'. Headings a_(i-1), alpha_(i-1) would say modified; docs/conventions.md shows how to "
        "find out"
    ]


def test_the_stanford_arm_of_a_book_has_symbols_whose_values_are_below_it() -> None:
    q = (0.4, -0.8, 0.5, 1.2, 0.9, -0.3)
    rows = [
        standard(q[0], 0, 0, -H),
        standard(q[1], 0.154, 0, H),
        standard(0, q[2], 0, 0),
        standard(q[3], 0, 0, -H),
        standard(q[4], 0, 0, H),
        standard(q[5], 0.263, 0, 0),
    ]
    _check(STANFORD, rows, q)
    found = imported(STANFORD)
    assert types(found.spec) == "rrprrr"
    assert found.notes == (
        "a length without a unit was read in m, the unit of other cells",
        "line 12 gives d2 its value",
        "line 12 gives d6 its value",
    )


def test_a_scara_between_tabs_with_q3_in_the_column_of_d() -> None:
    q = (0.7, -1.1, 0.12, 0.4)
    rows = [
        standard(q[0], 0.387, 0.325, 0),
        standard(q[1], 0, 0.275, math.pi),
        standard(0, q[2], 0, 0),
        standard(q[3], 0.05, 0, 0),
    ]
    _check(SCARA, rows, q, "scara.tsv")
    assert imported(SCARA, "scara.tsv").notes == (
        "no unit of lengths is given: they were read in m",
        "nothing but the headings' index i says the convention: it was read as standard; a table after Craig is "
        "modified",
    )


def test_a_kuka_in_mm_and_degrees_with_semicolons_and_decimal_commas() -> None:
    text = KUKA.replace("Gelenk", "Joint").replace("Typ", "Type")
    q = (0.2, -1.0, 0.8, 0.3, -0.6, 1.5)
    table = [
        (0, -0.4, 0.025, H), (0, 0, 0.455, 0), (-H, 0, 0.035, H), (0, -0.42, 0, -H), (0, 0, 0, H),
        (math.pi, -0.0805, 0, math.pi),
    ]  # fmt: skip
    rows = [standard(angle + theta, d, a, alpha) for angle, (theta, d, a, alpha) in zip(q, table, strict=True)]
    _check(text, rows, q, "kuka.csv", **STANDARD)
    found = imported(text, "kuka.csv", **STANDARD)
    assert [row.name for row in found.spec.rows] == ["A1", "A2", "A3", "A4", "A5", "A6"]
    assert found.spec.rows[1].limits.position == (math.radians(-190), math.radians(45))
    assert (found.units.angle, found.units.length) == (AngleUnit.DEG, LengthUnit.MM)
    assert found.notes == ()


def test_a_students_table_without_units_asks_for_both() -> None:
    assert complaints(STUDENT) == [
        "t.md:4:24: row 1, d: '243.3' is a length, and nothing says in which unit; write the unit in the heading, or "
        "pass length='m' or length='mm'",
        "t.md:5:14: row 2, theta: '90 + \\\\theta_2' is an angle, and nothing says in which unit; write the unit in "
        "the heading, or pass angle='deg' or angle='rad'",
    ]


def test_a_students_table_is_read_once_its_units_are_said() -> None:
    q = (0.2, -1.0, 0.8, 0.3, -0.6, 1.5)
    table = [
        (0, 0, 0, 0.2433), (H, 0, H, 0.03), (math.pi, 0.28, H, 0.02), (H, 0, H, 0.245), (H, 0, math.pi, 0.057),
        (H, 0, H, 0.235),
    ]  # fmt: skip
    rows = [modified(angle + theta, d, a, alpha) for angle, (alpha, a, theta, d) in zip(q, table, strict=True)]
    _check(STUDENT, rows, q, angle=AngleUnit.DEG, length=LengthUnit.MM)


def test_a_table_in_the_comments_of_a_program_takes_its_lengths_from_the_program() -> None:
    rows = [modified(0.1 + H, 0.015, 0, H), modified(0.2 + H, 0, 0, H), modified(0.3, 0.02, 0, H)]
    _check(WRIST_IN_COMMENTS, rows, (0.1, 0.2, 0.3), "RPY_DH.m", length=LengthUnit.MM)


@pytest.mark.parametrize("separator", [",", ";", "\t", "  ", " "])
def test_the_same_table_reads_the_same_between_any_separators(separator: str) -> None:
    rows = ["i theta d a alpha", "1 q1 0.1 0 pi/2", "2 q2-pi/2 0 0.3 0", "3 0.5 q3 0 -pi/2"]
    text = "\n".join(separator.join(row.split()) for row in rows)
    _check(
        text,
        [standard(0.3, 0.1, 0, H), standard(0.4 - H, 0, 0.3, 0), standard(0.5, 0.6, 0, -H)],
        (0.3, 0.4, 0.6),
        "t.txt",
        **STANDARD,
        angle=AngleUnit.RAD,
    )
