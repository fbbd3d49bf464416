"""Each case of how axes lie, and each free choice, on the smallest arm that shows it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim.kinematics.frame_assignment.lines import Case
from dh2sim.kinematics.frame_assignment.recover import recover_table
from dh2sim.kinematics.frame_assignment.result import Assignment, BaseRule, FootRule, SenseRule, SlideRule, TipRule
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.typing import Array
from tests.kinematics.frame_assignment.chains import Axis, chain_of, pose, turn, unit

X, Y, Z = np.eye(3)
O = np.zeros(3)  # noqa: E741
SLIDES = JointType.PRISMATIC


def _at(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Array:
    return np.array([x, y, z])


def _assigned(
    axes: list[Axis], tip: Array | None = None, convention: Convention = Convention.STANDARD
) -> tuple[tuple[Row, ...], Assignment]:
    T_base_tip = pose(np.eye(3), axes[-1].point) if tip is None else tip
    recovery = recover_table(chain_of(axes, T_base_tip), convention=convention)
    assert recovery.residual.largest < 1e-12
    return recovery.spec.rows, recovery.assignment


def _degrees(row: Row) -> tuple[float, float]:
    return round(math.degrees(row.alpha), 9), round(math.degrees(row.theta), 9)


@pytest.mark.parametrize(
    ("point", "direction", "case", "antiparallel"),
    [
        (_at(), Z, Case.COINCIDENT, False),
        (_at(z=0.3), -Z, Case.COINCIDENT, True),
        (_at(x=0.3), Z, Case.PARALLEL, False),
        (_at(x=0.3), -Z, Case.PARALLEL, True),
        (_at(z=0.3), -Y, Case.INTERSECTING, False),
        (_at(z=0.3), unit([0.0, -1.0, 0.5]), Case.INTERSECTING, False),
        (_at(x=0.3, z=0.1), -Y, Case.SKEW, False),
        (_at(x=0.3), unit([1e-5, 0.0, 1.0]), Case.NEARLY_PARALLEL, False),
        (_at(x=0.3), unit([1e-5, 0.0, -1.0]), Case.NEARLY_PARALLEL, True),
    ],
    ids=[
        "coincident",
        "coincident, antiparallel",
        "parallel",
        "antiparallel",
        "intersecting at a right angle",
        "intersecting obliquely",
        "skew",
        "nearly parallel",
        "nearly antiparallel",
    ],
)
def test_a_case_is_known_for_what_it_is(point: Array, direction: Array, case: Case, antiparallel: bool) -> None:
    [step] = _assigned([Axis(O, Z), Axis(point, direction)])[1].steps
    assert (step.case, step.antiparallel) == (case, antiparallel)
    assert step.angle == pytest.approx(math.acos(float(direction @ Z)), abs=1e-12)


def test_antiparallel_axes_have_a_twist_of_exactly_180_degrees() -> None:
    rows, _ = _assigned([Axis(O, Z), Axis(_at(x=0.3), -Z)])
    assert (rows[0].a, rows[0].alpha, rows[0].theta) == (0.3, math.pi, 0.0)


def test_between_parallel_axes_x_begins_at_the_previous_origin_and_the_last_d_takes_all() -> None:
    axes = [Axis(O, Z), Axis(_at(z=0.2), -Y), Axis(_at(x=0.4, y=-0.1, z=0.2), -Y), Axis(_at(0.4, -0.3, 0.2), Z)]
    rows, assignment = _assigned(axes)
    assert [row.d for row in rows] == [0.2, 0.0, 0.3, 0.0]
    assert assignment.steps[1].foot_rule is FootRule.SAME_ORIGIN


def test_the_height_of_a_column_is_in_the_first_row() -> None:
    rows, assignment = _assigned([Axis(O, Z), Axis(_at(x=0.4, z=0.5), Z)])
    assert (rows[0].d, rows[1].d) == (0.5, 0.0)
    assert assignment.steps[0].foot_rule is FootRule.NEXT_JOINT


def test_before_a_sliding_joint_the_turning_one_takes_the_height() -> None:
    axes = [Axis(O, X), Axis(O, Z), Axis(_at(z=0.4), Z, SLIDES)]
    rows, _ = _assigned(axes, pose(np.eye(3), _at(z=0.4)))
    assert (rows[1].d, rows[2].d) == (0.4, 0.0)


@pytest.mark.parametrize(
    ("next_point", "a", "theta", "rule"),
    [
        (_at(x=0.3), 0.3, 0.0, SenseRule.LEAST_THETA),
        (_at(x=-0.3), -0.3, 0.0, SenseRule.LEAST_THETA),
        (_at(x=0.3, y=0.3), 0.3 * math.sqrt(2), 45.0, SenseRule.LEAST_THETA),
        (_at(x=-0.3, y=0.3), -0.3 * math.sqrt(2), -45.0, SenseRule.LEAST_THETA),
        (_at(y=0.3), 0.3, 90.0, SenseRule.TOWARDS_NEXT),
        (_at(y=-0.3), 0.3, -90.0, SenseRule.TOWARDS_NEXT),
    ],
    ids=["ahead", "behind", "ahead and left", "behind and left", "left", "right"],
)
def test_x_points_the_way_that_leaves_theta_the_smaller(
    next_point: Array, a: float, theta: float, rule: SenseRule
) -> None:
    rows, assignment = _assigned([Axis(O, Z), Axis(next_point, Z)])
    assert rows[0].a == pytest.approx(a, abs=1e-15)
    assert _degrees(rows[0])[1] == theta
    assert assignment.steps[0].sense_rule is rule


@pytest.mark.parametrize("direction", [X, -X], ids=["along x", "against x"])
def test_where_theta_is_a_right_angle_either_way_it_is_a_positive_one(direction: Array) -> None:
    rows, assignment = _assigned([Axis(O, Z), Axis(O, direction)])
    assert _degrees(rows[0])[1] == 90.0
    assert assignment.steps[0].sense_rule is SenseRule.QUARTER_TURN


def test_of_coincident_axes_x_stays_where_it_was() -> None:
    rows, assignment = _assigned([Axis(O, Z), Axis(O, -Y), Axis(O, -Y), Axis(O, Z)])
    assert (rows[1].a, rows[1].d, *_degrees(rows[1])) == (0.0, 0.0, 0.0, 0.0)
    assert assignment.steps[1].sense_rule is SenseRule.FREE


# --- sliding joints: only the direction of their axes matters


def _slide(axes: list[Axis], tip: Array | None = None) -> tuple[tuple[Row, ...], list[SlideRule]]:
    rows, assignment = _assigned(axes, tip)
    return rows, [slide.rule for slide in assignment.slides]


def test_a_sliding_axis_lies_on_the_next_axis_where_that_is_parallel() -> None:
    rows, rules = _slide([Axis(O, Z), Axis(_at(5, 7, 9), Z, SLIDES), Axis(_at(x=0.3), Z)])
    assert rules == [SlideRule.NEXT_AXIS]
    assert [row.a for row in rows] == [0.3, 0.0, 0.0]


def test_a_sliding_axis_lies_on_the_previous_one_where_that_is_parallel() -> None:
    axes = [Axis(O, Z), Axis(_at(5, 7, 0.4), Z, SLIDES), Axis(_at(z=0.4), X)]
    rows, rules = _slide(axes)
    assert rules == [SlideRule.PREVIOUS_AXIS]
    assert [row.a for row in rows] == [0.0, 0.0, 0.0]


def test_the_last_sliding_axis_goes_through_the_tip() -> None:
    rows, rules = _slide([Axis(O, Z), Axis(_at(5, 7, 9), X, SLIDES)], pose(np.eye(3), _at(0.3, 0.0, 0.5)))
    assert rules == [SlideRule.TIP]
    assert (rows[0].a, rows[0].d, rows[1].a, rows[1].d) == (0.0, 0.5, 0.0, 0.3)


def test_a_sliding_axis_meets_both_neighbours_where_a_line_can() -> None:
    axes = [Axis(O, Z), Axis(_at(5, 7, 9), X, SLIDES), Axis(_at(0.6, 0.0, 0.7), Y)]
    rows, rules = _slide(axes)
    assert rules == [SlideRule.MEETS_BOTH]
    assert [row.a for row in rows] == [0.0, 0.0, 0.0]
    assert (rows[0].d, rows[1].d) == (0.7, 0.6)


def test_a_sliding_axis_goes_through_the_previous_origin_where_nothing_else_holds() -> None:
    axes = [Axis(O, Z), Axis(_at(5, 7, 9), X, SLIDES), Axis(_at(0.6, 0.2, 0.7), Z)]  # no line along x meets both
    rows, rules = _slide(axes)
    assert rules == [SlideRule.PREVIOUS_ORIGIN]
    assert (rows[0].a, rows[0].d) == (0.0, 0.0)


def test_the_first_sliding_axis_goes_through_the_base() -> None:
    rows, rules = _slide([Axis(_at(5, 7, 9), Z, SLIDES), Axis(_at(x=0.3, z=0.4), X)])
    assert rules == [SlideRule.BASE_ORIGIN]
    assert rows[0].theta == math.pi / 2


def test_a_gantry_has_its_tip_on_the_last_frame() -> None:
    axes = [Axis(O, X, SLIDES), Axis(O, Y, SLIDES), Axis(O, -Z, SLIDES)]
    recovery = recover_table(chain_of(axes, pose(np.diag([1.0, -1.0, -1.0]), _at(0.1, 0.2, 0.3))))
    assert [row.a for row in recovery.spec.rows] == [0.0, 0.0, 0.0]
    assert [abs(row.d) for row in recovery.spec.rows] == [0.1, 0.2, 0.3]
    assert not recovery.spec.tool.xyz.any()


# --- the first frame


def test_frame_0_is_the_base_where_the_first_axis_is_its_z() -> None:
    recovery = recover_table(chain_of([Axis(_at(z=0.7), Z), Axis(_at(z=0.7), X)], np.eye(4)))
    assert recovery.assignment.base_rule is BaseRule.BASE_X
    assert not recovery.spec.base.pose.xyz.any()
    assert not recovery.spec.base.pose.rpy.any()
    assert recovery.spec.rows[0].d == 0.7


def test_frame_0_stands_beneath_a_first_axis_that_is_beside_the_base() -> None:
    recovery = recover_table(chain_of([Axis(_at(0.1, 0.2, 0.7), Z)], pose(np.eye(3), _at(0.1, 0.2, 0.7))))
    assert recovery.spec.base.pose.xyz.tolist() == [0.1, 0.2, 0.0]


def test_where_the_first_axis_is_the_bases_x_frame_0_takes_the_bases_y() -> None:
    recovery = recover_table(chain_of([Axis(O, X)], np.eye(4)))
    assert recovery.assignment.base_rule is BaseRule.BASE_Y
    assert np.degrees(recovery.spec.base.pose.rpy) == pytest.approx([90.0, 0.0, 90.0])


def test_where_the_first_axis_is_oblique_theta_1_is_zero() -> None:
    oblique = unit([0.3, -0.5, 0.8])
    recovery = recover_table(chain_of([Axis(O, oblique), Axis(_at(0.1, 0.4, 0.2), Z)], np.eye(4)))
    assert recovery.assignment.base_rule is BaseRule.FIRST_NORMAL
    assert recovery.spec.rows[0].theta == 0.0


def test_a_modified_table_reaches_a_horizontal_first_axis_by_its_first_row() -> None:
    rows, assignment = _assigned([Axis(_at(x=0.2), -Y)], convention=Convention.MODIFIED)
    assert assignment.base_rule is BaseRule.FIRST_LINK
    assert (rows[0].a, _degrees(rows[0])[0]) == (0.2, 90.0)


def test_but_not_one_that_is_beside_the_bases_x() -> None:
    recovery = recover_table(chain_of([Axis(_at(z=0.2), -Y)], np.eye(4)), convention=Convention.MODIFIED)
    assert recovery.assignment.base_rule is BaseRule.BASE_X
    assert (recovery.spec.rows[0].a, recovery.spec.rows[0].alpha) == (0.0, 0.0)


# --- the last frame


def _tipped(R: Array, p: Array, convention: Convention = Convention.STANDARD) -> tuple[Row, TipRule, Array, Array]:
    recovery = recover_table(chain_of([Axis(O, Z)], pose(R, p)), convention=convention)
    tool = recovery.spec.tool
    return recovery.spec.rows[0], recovery.assignment.tip_rule, tool.xyz, tool.rpy


def test_the_last_standard_row_reaches_a_tip_that_a_row_can_reach() -> None:
    row, rule, xyz, rpy = _tipped(turn(Z, 0.5) @ turn(X, 0.7), turn(Z, 0.5) @ _at(x=0.2, z=0.3))
    assert rule is TipRule.TIP
    assert not xyz.any()
    assert not rpy.any()
    assert (row.a, row.d) == (0.2, 0.3)
    assert row.theta == pytest.approx(0.5)
    assert row.alpha == pytest.approx(0.7)


def test_a_tip_beside_the_axis_is_left_to_the_tool_but_not_its_axes() -> None:
    row, rule, xyz, rpy = _tipped(np.eye(3), _at(0.1, 0.2, 0.3))
    assert rule is TipRule.TIP_AXES
    assert (row.a, row.d, row.theta) == (0.0, 0.3, 0.0)
    assert xyz.tolist() == [0.1, 0.2, 0.0]
    assert not rpy.any()


def test_a_tip_on_the_axis_that_is_turned_anyhow_gives_its_height_to_the_row() -> None:
    row, rule, xyz, rpy = _tipped(turn(unit([1, 2, 3]), 0.4), _at(z=0.3))
    assert rule is TipRule.TIP_HEIGHT
    assert (row.d, row.theta) == (0.3, 0.0)
    assert not xyz.any()
    assert rpy.all()


def test_a_tip_that_is_anywhere_is_left_to_the_tool() -> None:
    row, rule, xyz, _ = _tipped(turn(unit([1, 2, 3]), 0.4), _at(0.1, 0.2, 0.3))
    assert rule is TipRule.TOOL
    assert (row.a, row.alpha, row.d, row.theta) == (0.0, 0.0, 0.0, 0.0)
    assert xyz.tolist() == [0.1, 0.2, 0.3]


def test_the_last_modified_row_has_nothing_behind_its_joint() -> None:
    row, rule, xyz, rpy = _tipped(turn(X, 0.7), _at(x=0.2, z=0.3), Convention.MODIFIED)
    assert rule is TipRule.TOOL
    assert (row.a, row.alpha, row.d) == (0.0, 0.0, 0.0)
    assert xyz.tolist() == [0.2, 0.0, 0.3]
    assert rpy[0] == pytest.approx(0.7)
