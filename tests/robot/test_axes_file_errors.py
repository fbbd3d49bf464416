"""Everything that is wrong in an axes file is reported at once, with its place and what is allowed."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.errors import ImportedFileError
from dh2sim.robot.axes_file import read_axes

TOP = "name, description, source, convention, units, parameters, axes, tool, gravity, configurations, actuators"
AXIS = "name, type, point, direction, limits, dynamics, actuator"
GOOD = "{type: revolute, point: [0, 0, 0], direction: [0, 0, 1]}"
NUMBER = "expected a number or an expression in a string"


def _complaints(text: str | bytes) -> list[str]:
    data = text.encode() if isinstance(text, str) else text
    try:
        read_axes(data, file="a.yaml", directory=Path())
    except ImportedFileError as error:
        return str(error).split("\n")
    return []


def _with_axes(*axes: str, more: str = "") -> str:
    """Return an axes file whose axes stand from line 3 on at column 3."""
    return "name: r\naxes:\n" + "".join(f"- {axis}\n" for axis in axes) + more


def test_a_good_axis_is_no_cause_for_complaint() -> None:
    assert _complaints(_with_axes(GOOD)) == []


@pytest.mark.parametrize(
    ("axis", "message"),
    [
        (
            "{type: prismatic, direction: [0, 0, 0]}",
            "3:32: axes[0].direction: the direction is of length 0; any other vector along the axis is allowed",
        ),
        (
            "{type: prismatic, direction: [0, 1 - 1, -0.0]}",
            "3:32: axes[0].direction: the direction is of length 0; any other vector along the axis is allowed",
        ),
        (
            "{type: prismatic, direction: [0, 1]}",
            "3:32: axes[0].direction: expected a list of 3 numbers (x, y, z), found a list of 2",
        ),
        (
            "{type: prismatic, direction: z}",
            "3:32: axes[0].direction: expected a list of 3 numbers (x, y, z), found 'z'",
        ),
        ("{type: prismatic, direction: [0, 0, ~]}", f"3:39: axes[0].direction[2]: {NUMBER}, found nothing"),
        ("{type: prismatic, direction: [0, h, 0]}", "3:36: axes[0].direction[1]: unknown name 'h'. Known names: pi"),
        ("{type: prismatic}", "3:3: axes[0]: missing key 'direction'"),
        (
            "{type: revolute, direction: [0, 0, 1]}",
            "3:3: axes[0]: missing key 'point': a revolute joint needs a point of its axis; "
            "only a prismatic one does not",
        ),
        (
            "{type: continuous, direction: [0, 0, 1]}",
            "3:3: axes[0]: missing key 'point': a continuous joint needs a point of its axis; "
            "only a prismatic one does not",
        ),
        (
            "{type: revolute, pont: [0, 0, 0], direction: [0, 0, 1]}",
            f"3:20: axes[0]: unknown key 'pont'. Did you mean 'point'? Allowed keys: {AXIS}",
        ),
        (
            "{type: revolute, point: , direction: [0, 0, 1]}",
            "3:20: axes[0].point: expected a list of 3 numbers (x, y, z), found nothing",
        ),
        (
            "{type: prismatic, direction: [0, 0, 1], alpha: 90}",
            f"3:43: axes[0]: unknown key 'alpha'. Allowed keys: {AXIS}",
        ),
        (
            "{type: fixed, direction: [0, 0, 1], limits: {effort: 1}}",
            "3:10: axes[0].type: found 'fixed'. Allowed: revolute, continuous, prismatic",
        ),
        (
            "{type: revolut, direction: [0, 0, 1]}",
            "3:10: axes[0].type: found 'revolut'. Did you mean 'revolute'? Allowed: revolute, continuous, prismatic",
        ),
        ("{direction: [0, 0, 1]}", "3:3: axes[0]: missing key 'type'"),
        ("7", f"3:3: axes[0]: expected a mapping with the keys {AXIS}, found 7"),
        (
            "{type: prismatic, direction: [0, 0, 1], limits: {position: [2, 1]}}",
            "3:62: axes[0].limits.position: the lower limit 2.0 is not below the upper limit 1.0",
        ),
        (
            "{type: prismatic, direction: [0, 0, 1], limits: {lower: 0}}",
            "3:52: axes[0].limits: unknown key 'lower'. Allowed keys: position, velocity, effort, acceleration, jerk",
        ),
        (
            "{type: continuous, point: [0, 0, 0], direction: [0, 0, 1], limits: {position: [0, 1]}}",
            "3:71: axes[0].limits.position: a continuous joint has no position limits; "
            "make it revolute or remove them",
        ),
        (
            "{type: prismatic, direction: [0, 0, 1], actuator: {type: motor, kp: 3}}",
            "3:67: axes[0].actuator.kp: an actuator of type 'motor' takes no kp; kp is for position",
        ),
        (
            "{type: prismatic, direction: [0, 0, 1], name: 2nd}",
            "3:49: axes[0].name: a name is made of letters, digits, '_' and '-', starting with a letter; found '2nd'",
        ),
        (
            "{type: prismatic, direction: [0, 0, 1], name: flange-tool0}",
            "3:49: axes[0].name: 'flange-tool0' is the name of a fixed joint in the exports; choose another",
        ),
    ],
)
def test_a_wrong_axis_is_reported(axis: str, message: str) -> None:
    assert _complaints(_with_axes(axis)) == [f"a.yaml:{message}"]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("joints: []\n", f"4:1: unknown key 'joints'. Allowed keys: {TOP}"),
        ("convention: hayati\n", "4:13: convention: found 'hayati'. Allowed: standard, modified"),
        (
            "convention: modifed\n",
            "4:13: convention: found 'modifed'. Did you mean 'modified'? Allowed: standard, modified",
        ),
        ("units: {angle: degrees}\n", "4:16: units.angle: found 'degrees'. Did you mean 'deg'? Allowed: rad, deg"),
        ("tool: {xyz: [1, 2]}\n", "4:13: tool.xyz: expected a list of 3 numbers (x, y, z), found a list of 2"),
        ("tool: {pose: 1}\n", "4:8: tool: unknown key 'pose'. Allowed keys: xyz, rpy"),
        ("gravity: -9.81\n", "4:10: gravity: expected a list of 3 numbers (x, y, z), found -9.81"),
        (
            "configurations: {home: [0, 0]}\n",
            "4:24: configurations.home: expected 1 numbers, one for each axis (joint_1), found a list of 2",
        ),
        ("parameters: {a: b, b: a}\n", "4:17: parameters.a: parameters need each other in a circle: a -> b -> a"),
        (
            "actuators: {type: velocity, kp: 1}\n",
            "4:29: actuators.kp: an actuator of type 'velocity' takes no kp; kp is for position",
        ),
    ],
)
def test_a_wrong_value_at_the_top_of_an_axes_file_is_reported(more: str, message: str) -> None:
    assert _complaints(_with_axes(GOOD, more=more)) == [f"a.yaml:{message}"]


def test_a_missing_point_is_reported_along_with_unknown_keys() -> None:
    assert _complaints(_with_axes("{type: revolute, direction: [0, 0, 1], alpha: 90}")) == [
        "a.yaml:3:3: axes[0]: missing key 'point': a revolute joint needs a point of its axis; "
        "only a prismatic one does not",
        f"a.yaml:3:42: axes[0]: unknown key 'alpha'. Allowed keys: {AXIS}",
    ]


def test_names_are_unique() -> None:
    named = "{name: %s, type: prismatic, direction: [0, 0, 1]}"
    assert _complaints(_with_axes(named % "a", GOOD, named % "a", named % "joint_2")) == [
        "a.yaml:5:10: axes[2].name: duplicate joint name 'a'; axes[0] on line 3 has it already",
        "a.yaml:6:10: axes[3].name: duplicate joint name 'joint_2'; axes[1] on line 4 has it already",
    ]


def test_configurations_are_within_the_limits() -> None:
    limited = "{type: prismatic, direction: [0, 0, 1], limits: {position: [0, 1]}}"
    assert _complaints(_with_axes(GOOD, limited, more="configurations: {home: [7, 1.5]}\n")) == [
        "a.yaml:5:28: configurations.home[1]: 1.5 is outside the limits of joint_2: 0.0 to 1.0"
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "1:1: the file is empty; axes need at least name and axes"),
        ("# nothing\n", "1:1: the file is empty; axes need at least name and axes"),
        ("[1]", f"1:1: expected a mapping with the keys {TOP}, found a list"),
        ("name: r\naxes: []\n", "2:7: axes: the list is empty; at least one entry is needed"),
        ("name: r\naxes: 3\n", "2:7: axes: expected a list, found 3"),
        ("name: r\n", "1:1: missing key 'axes'"),
        ("name: r\naxis: [1]\n", f"2:1: unknown key 'axis'. Did you mean 'axes'? Allowed keys: {TOP}"),
        (b"name: \xff\n", "1:7: not UTF-8: byte 0xff"),
    ],
)
def test_a_file_that_is_not_an_axes_file_is_refused(text: str | bytes, message: str) -> None:
    assert _complaints(text) == [f"a.yaml:{message}"]


def test_all_mistakes_of_an_axes_file_are_reported_in_its_order() -> None:
    text = """\
name: 3r
convention: hayati
parameters: {a: x}
axes:
- {type: revolute, direction: [0, 0, 0], limits: {position: [2, 1]}}
- {type: fixed, direction: [0, a]}
- {type: prismatic, dir: [0, 0, 1]}
- {type: continuous, point: [0, 0, a], direction: [a, 0, 0], limits: {position: [0, 1]}}
"""
    assert _complaints(text) == [
        "a.yaml:1:7: name: a name is made of letters, digits, '_' and '-', starting with a letter; found '3r'",
        "a.yaml:2:13: convention: found 'hayati'. Allowed: standard, modified",
        "a.yaml:3:17: parameters.a: unknown name 'x'. Known names: pi, a",
        "a.yaml:5:3: axes[0]: missing key 'point': a revolute joint needs a point of its axis; "
        "only a prismatic one does not",
        "a.yaml:5:31: axes[0].direction: the direction is of length 0; any other vector along the axis is allowed",
        "a.yaml:5:61: axes[0].limits.position: the lower limit 2.0 is not below the upper limit 1.0",
        "a.yaml:6:10: axes[1].type: found 'fixed'. Allowed: revolute, continuous, prismatic",
        "a.yaml:6:28: axes[1].direction: expected a list of 3 numbers (x, y, z), found a list of 2",
        "a.yaml:7:3: axes[2]: missing key 'direction'",
        f"a.yaml:7:21: axes[2]: unknown key 'dir'. Allowed keys: {AXIS}",
        "a.yaml:8:71: axes[3].limits.position: a continuous joint has no position limits; "
        "make it revolute or remove them",
    ]


@given(
    st.text("axes: {}[]-,point\n0123'\"~&*"),
    st.sampled_from(
        ["name", "axes", "type", "point", "direction", "limits", "position", "tool", "home", "[0, 0, 1]"]
    ),
)
def test_an_axes_file_with_a_piece_replaced_is_read_or_refused(piece: str, place: str) -> None:
    limited = "{type: revolute, point: [0, 0, 0], direction: [0, 0, 1], limits: {position: [-1, 1]}}"
    text = _with_axes(limited, GOOD, more="tool: {xyz: [0, 0, 1]}\nconfigurations: {home: [0, 1]}\n")
    assert _complaints(text) == []
    problems = _complaints(text.replace(place, piece, 1))  # any other error than ImportedFileError fails
    assert all(problem.startswith("a.yaml:") for problem in problems)
