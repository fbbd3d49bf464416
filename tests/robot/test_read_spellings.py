"""Spellings that people bring from textbooks and other programs are taken, or answered with the right one."""

from __future__ import annotations

import pytest

from dh2sim.robot.row import JointType
from tests.robot.files import complaints, robot, with_joint

VARIABLE = "looks like the joint variable; leave it out, or write 0: the joint coordinate adds to"


@pytest.mark.parametrize(
    ("letter", "kind"),
    [
        ("R", JointType.REVOLUTE),
        ("r", JointType.REVOLUTE),
        ("P", JointType.PRISMATIC),
        ("p", JointType.PRISMATIC),
        ("F", JointType.FIXED),
        ("f", JointType.FIXED),
        ("Revolute", None),
    ],
)
def test_joint_types_may_be_letters(letter: str, kind: JointType | None) -> None:
    if kind is None:
        (message,) = complaints(with_joint(f"{{type: {letter}}}"))
        assert "Did you mean 'revolute'?" in message
    else:
        assert robot(with_joint(f"{{type: {letter}}}")).rows[0].type is kind


def test_a_list_of_limits_is_that_of_positions() -> None:
    (row,) = robot(with_joint("{type: revolute, limits: [-1, 2]}")).rows
    assert row.limits.position == (-1.0, 2.0)
    assert complaints(with_joint("{type: revolute, limits: [2, 1]}")) == [
        "r.yaml:4:28: joints[0].limits.position: the lower limit 2.0 is not below the upper limit 1.0"
    ]


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("craig", "modified"),
        ("Craig", "modified"),
        ("mdh", "modified"),
        ("dh", "standard"),
        ("spong", "standard"),
        ("paul", "standard"),
        ("classic", "standard"),
    ],
)
def test_other_names_of_conventions_are_answered_with_the_name_used_here(name: str, meant: str) -> None:
    assert complaints(with_joint("{type: fixed}").replace("standard", name)) == [
        f"r.yaml:2:13: convention: found '{name}', which is called '{meant}' here. "
        "Allowed: standard, modified, hayati"
    ]


@pytest.mark.parametrize("name", ["q1", "theta1", "theta_1", "th1", "t1", "q_i", "q", "q1*", "θ1", "θ1*"])
def test_the_joint_variable_of_a_turning_row_is_left_out(name: str) -> None:
    for kind in ("revolute", "R", "continuous"):
        (message,) = complaints(with_joint(f"{{theta: {name}, type: {kind}}}"))
        assert message == f"r.yaml:4:11: joints[0].theta: '{name}' {VARIABLE} theta"


@pytest.mark.parametrize("name", ["d3", "d_3", "q3", "d3*"])
def test_the_joint_variable_of_a_sliding_row_is_left_out(name: str) -> None:
    (message,) = complaints(with_joint(f"{{d: {name}, type: prismatic}}"))
    assert message == f"r.yaml:4:7: joints[0].d: '{name}' {VARIABLE} d"


def test_what_is_added_to_the_joint_variable_stays() -> None:
    assert complaints(with_joint("{theta: q2 - pi / 2, type: revolute}")) == [
        "r.yaml:4:11: joints[0].theta: in 'q2 - pi / 2': 'q2' looks like the joint variable; leave it out: "
        "the joint coordinate adds to theta"
    ]


def test_names_like_joint_variables_may_be_parameters() -> None:
    assert complaints(with_joint("{theta: q1, d: d1, type: revolute}") + "parameters: {q1: 1, d1: 2}\n") == []
    (message,) = complaints(with_joint("{d: d1, type: revolute}"))
    assert message == "r.yaml:4:7: joints[0].d: unknown name 'd1'. Known names: pi"


@pytest.mark.parametrize(
    ("entry", "units", "message"),
    [
        (
            "alpha: 45deg",
            "{}",
            "'45deg' has a unit; angles of this file are in rad: write 45 * pi / 180, or set 'units: {angle: deg}' "
            "for all",
        ),
        ("alpha: 45deg", "{angle: deg}", "'45deg' has a unit; angles of this file are in deg: write 45"),
        ("alpha: -90°", "{angle: deg}", "'-90°' has a unit; angles of this file are in deg: write -90"),
        (
            "theta: 0.5 rad",
            "{angle: deg}",
            "'0.5 rad' has a unit; angles of this file are in deg: write 0.5 * 180 / pi, or set "
            "'units: {angle: rad}' for all",
        ),
        (
            "a: 400mm",
            "{}",
            "'400mm' has a unit; lengths of this file are in m: write 0.4, or set 'units: {length: mm}' for all",
        ),
        ("a: 400mm", "{length: mm}", "'400mm' has a unit; lengths of this file are in mm: write 400"),
        (
            "a: 10 inch",
            "{length: cm}",
            "'10 inch' has a unit; lengths of this file are in cm: write 25.4, or set 'units: {length: in}' for all",
        ),
        ("a: 45deg", "{}", "'45deg' has a unit; lengths of this file are in m, written as numbers alone"),
    ],
)
def test_the_error_of_a_number_with_a_unit_names_the_units_of_the_file(entry: str, units: str, message: str) -> None:
    text = with_joint(f"{{{entry}, type: revolute}}") + f"units: {units}\n"
    place = entry.index(":") + 6
    key = entry.partition(":")[0]
    assert complaints(text) == [f"r.yaml:4:{place}: joints[0].{key}: {message}"]


def test_the_error_of_a_limit_with_a_unit_names_the_unit_of_its_joint() -> None:
    limits = "limits: {position: [-90deg, 100mm]}"
    turning, sliding = (complaints(with_joint(f"{{type: {kind}, {limits}}}")) for kind in ("R", "P"))
    assert ["angles of this file are in rad" in message for message in turning] == [True, True]
    assert ["lengths of this file are in m" in message for message in sliding] == [True, True]


def test_a_number_in_si_units_is_written_without_them() -> None:
    assert complaints(with_joint("{type: fixed, link: {mass: 5kg}}")) == [
        "r.yaml:4:30: joints[0].link.mass: '5kg' has a unit; write the number alone, 5"
    ]
