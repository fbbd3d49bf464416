from __future__ import annotations

import dataclasses

import pytest

from dh2sim.kinematics.conversion import convert_rows
from dh2sim.robot.row import Convention
from tests.kinematics.arms import (
    KINDS,
    PURE,
    Q,
    arm,
    assert_same_arm,
    assert_same_numbers,
    numbers,
    pose_numbers,
    table,
)
from tests.sample_robots import HAYATI, MODIFIED, STANDARD


@pytest.mark.parametrize("to", KINDS)
def test_a_hayati_row_without_a_second_twist_is_a_standard_row(to: Convention) -> None:
    hayati, standard = (convert_rows(arm(kind, kind, kind, beta=0.0), to) for kind in (HAYATI, STANDARD))
    assert hayati.notes == ()
    assert [one.convention for one in hayati.spec.rows] == [to] * 3
    links = [[(one.a, one.alpha) for one in conversion.spec.rows] for conversion in (hayati, standard)]
    assert links[0] == links[1]


def test_rows_up_to_the_last_hayati_row_stay_distal() -> None:
    spec = arm(STANDARD, HAYATI, STANDARD, HAYATI, STANDARD, STANDARD, base=PURE)
    conversion = convert_rows(spec, MODIFIED)
    converted = conversion.spec
    assert [one.convention for one in converted.rows] == [STANDARD, HAYATI, STANDARD, HAYATI, MODIFIED, MODIFIED]
    assert table(converted)[:4] == table(spec)[:4]
    assert numbers(converted.rows[4])[:2] == (0.0, 0.0)
    assert pose_numbers(converted.base.pose) == pose_numbers(PURE)
    assert conversion.notes == (
        "j1 stays standard: j2, behind it, stays Hayati and cannot take over its a and alpha.",
        "j2 stays a Hayati row: its beta is 0.3 rad, and a modified row has no second twist.",
        "j3 stays standard: j4, behind it, stays Hayati and cannot take over its a and alpha.",
        "j4 stays a Hayati row: its beta is 0.3 rad, and a modified row has no second twist.",
    )
    assert_same_arm(spec, converted, Q[:, :6])


def test_rows_in_front_of_a_hayati_row_stay_standard_because_of_each_other() -> None:
    spec = arm(STANDARD, STANDARD, HAYATI)
    conversion = convert_rows(spec, MODIFIED)
    assert [one.convention for one in conversion.spec.rows] == [STANDARD, STANDARD, HAYATI]
    assert (
        conversion.notes[0]
        == "j1 stays standard: j2, behind it, stays standard and cannot take over its a and alpha."
    )
    assert_same_numbers(conversion.spec, spec)


def test_rows_in_front_of_a_hayati_row_that_lead_nowhere_become_modified() -> None:
    spec = arm(STANDARD, STANDARD, HAYATI, base=PURE)
    first, second, third = spec.rows
    spec = dataclasses.replace(spec, rows=(first, dataclasses.replace(second, a=0.0, alpha=0.0), third))
    conversion = convert_rows(spec, MODIFIED)
    assert [one.convention for one in conversion.spec.rows] == [MODIFIED, MODIFIED, HAYATI]
    assert len(conversion.notes) == 1
    assert_same_arm(spec, conversion.spec, Q[:, :3])


def test_modified_rows_behind_a_hayati_row_stay_modified() -> None:
    spec = arm(MODIFIED, HAYATI, MODIFIED, MODIFIED, STANDARD, MODIFIED, tool=PURE)
    conversion = convert_rows(spec, STANDARD)
    converted = conversion.spec
    assert [one.convention for one in converted.rows] == [STANDARD, HAYATI, MODIFIED, MODIFIED, STANDARD, STANDARD]
    assert table(converted)[1:4] == table(spec)[1:4]
    assert conversion.notes == (
        "j2 stays a Hayati row: its beta is 0.3 rad, and a standard row has no second twist.",
        "j3 stays modified: j2, before it, stays Hayati and cannot take over its a and alpha.",
        "j4 stays modified: j3, before it, stays modified and cannot take over its a and alpha.",
    )
    assert_same_arm(spec, converted, Q[:, :6])


def test_the_tool_behind_a_modified_row_that_stays_is_left_alone() -> None:
    spec = arm(HAYATI, MODIFIED, tool=PURE)
    assert_same_numbers(convert_rows(spec, STANDARD).spec, spec)
