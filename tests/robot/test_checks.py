"""Parts of a robot file that do not go together are reported, also where other parts are wrong."""

from __future__ import annotations

import pytest

from tests.robot.files import complaints

HEAD = "name: r\nconvention: standard\njoints:\n"


def _complaints(*joints: str, more: str = "") -> list[str]:
    """Return the complaints about rows that stand from line 4 on at column 3."""
    return complaints(HEAD + "".join(f"- {joint}\n" for joint in joints) + more)


def test_joint_names_are_unique() -> None:
    assert _complaints("{type: fixed, name: a}", "{type: fixed, name: b}", "{type: fixed, name: a}") == [
        "r.yaml:6:23: joints[2].name: duplicate joint name 'a'; joints[0] on line 4 has it already"
    ]


def test_a_given_name_may_not_be_the_default_of_another_row() -> None:
    assert _complaints("{type: fixed}", "{type: fixed, name: joint_1}") == [
        "r.yaml:5:23: joints[1].name: duplicate joint name 'joint_1'; joints[0] on line 4 has it already"
    ]
    assert _complaints("{type: fixed, name: joint_2}", "{type: fixed}") == [
        "r.yaml:5:3: joints[1]: duplicate default joint name 'joint_2'; joints[0] on line 4 has it already"
    ]


@pytest.mark.parametrize(
    "name", ["base_link-base", "flange-tool0", "base_link-dh_0", "link_6-flange", "link_12-dh_12"]
)
def test_names_of_the_exports_own_joints_are_reserved(name: str) -> None:
    assert _complaints(f"{{type: fixed, name: {name}}}") == [
        f"r.yaml:4:23: joints[0].name: '{name}' is the name of a fixed joint in the exports; choose another"
    ]


@pytest.mark.parametrize("name", ["base_link", "flange", "link_1", "dh_0", "link_6-flange-x", "link_x-dh_1"])
def test_other_names_are_free(name: str) -> None:
    assert _complaints(f"{{type: fixed, name: {name}}}") == []


def test_position_limits_of_a_continuous_joint_are_refused() -> None:
    assert _complaints("{type: continuous, limits: {velocity: 1, position: [0, 1]}}") == [
        "r.yaml:4:44: joints[0].limits.position: a continuous joint has no position limits; "
        "make it revolute or remove them"
    ]


@pytest.mark.parametrize(
    ("key", "value"), [("limits", "{}"), ("dynamics", "{}"), ("actuator", "{}"), ("flip", "true")]
)
def test_a_fixed_row_takes_nothing_of_a_joint(key: str, value: str) -> None:
    assert _complaints(f"{{type: fixed, {key}: {value}}}") == [
        f"r.yaml:4:17: joints[0].{key}: a fixed row does not move: it takes no '{key}'"
    ]


def test_a_fixed_row_may_say_that_it_is_not_flipped() -> None:
    assert _complaints("{type: fixed, flip: false}") == []


@pytest.mark.parametrize("kind", ["revolute", "continuous", "fixed"])
def test_a_hayati_row_that_does_not_slide_takes_no_d(kind: str) -> None:
    place = 12 + len(kind)
    assert _complaints(f"{{type: {kind}, d: 0.1, convention: hayati}}") == [
        f"r.yaml:4:{place}: joints[0].d: a {kind} Hayati row takes no 'd', which nearly parallel axes leave free; "
        "use 'a' and 'beta', or another convention for this row"
    ]


def test_the_files_own_convention_counts_where_a_row_names_none() -> None:
    text = "name: r\nconvention: hayati\njoints:\n- {type: revolute, beta: 1, d: 2}\n"
    assert complaints(text) == [
        "r.yaml:4:29: joints[0].d: a revolute Hayati row takes no 'd', which nearly parallel axes leave free; "
        "use 'a' and 'beta', or another convention for this row"
    ]
    assert complaints(text.replace("{type", "{convention: standard, type")) == [
        "r.yaml:4:42: joints[0].beta: a standard row takes no 'beta', the second twist of a row of "
        "'convention: hayati'"
    ]


def test_a_hayati_row_that_slides_takes_a_d() -> None:
    assert _complaints("{type: prismatic, convention: hayati, a: 1, alpha: 0.1, beta: 0.2, d: 3}") == []


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_only_a_hayati_row_takes_a_second_twist(convention: str) -> None:
    assert _complaints(
        "{type: fixed, convention: hayati, beta: 1}", f"{{beta: x, type: fixed, convention: {convention}}}"
    ) == [
        "r.yaml:5:4: joints[1].beta: a " + convention + " row takes no 'beta', the second twist of a row of "
        "'convention: hayati'",
        "r.yaml:5:10: joints[1].beta: unknown name 'x'. Known names: pi",
    ]


@pytest.mark.parametrize(
    "wrong", ["{type: screw, convention: hayati, d: 1}", "{type: fixed, convention: craig, beta: 1}"]
)
def test_only_the_unknown_type_or_convention_of_a_row_is_reported(wrong: str) -> None:
    (message,) = _complaints(wrong)
    assert ": found '" in message


def test_a_configuration_has_a_value_for_each_moving_row() -> None:
    joints = ["{type: revolute}", "{type: fixed}", "{type: prismatic, name: slide}"]
    expected = "expected 2 numbers, one for each moving row (joint_1, slide), found a list of"
    assert _complaints(*joints, more="configurations: {a: [1], b: [1, 2], c: [1, 2, 3], d: []}\n") == [
        f"r.yaml:7:21: configurations.a: {expected} 1",
        f"r.yaml:7:40: configurations.c: {expected} 3",
        f"r.yaml:7:54: configurations.d: {expected} 0",
    ]


def test_many_moving_rows_are_not_all_listed() -> None:
    (message,) = _complaints(*["{type: revolute}"] * 50, more="configurations: {a: []}\n")
    assert message.endswith("joint_39, joint_40, ...), found a list of 0")


def test_a_robot_without_moving_rows_has_empty_configurations() -> None:
    assert _complaints("{type: fixed}", more="configurations: {a: []}\n") == []
    assert _complaints("{type: fixed}", more="configurations: {a: [1]}\n") == [
        "r.yaml:5:21: configurations.a: expected 0 numbers, one for each moving row (none), found a list of 1"
    ]


def test_configurations_lie_within_the_limits() -> None:
    joints = [
        "{type: revolute, limits: {position: [-1, 1]}}",
        "{type: prismatic, limits: {position: [0, 1 / 2]}}",
    ]
    assert _complaints(*joints, more="configurations: {a: [1, 0], b: [1.1, -0.1]}\n") == [
        "r.yaml:6:33: configurations.b[0]: 1.1 is outside the limits of joint_1: -1.0 to 1.0",
        "r.yaml:6:38: configurations.b[1]: -0.1 is outside the limits of joint_2: 0.0 to 0.5",
    ]


def test_configurations_may_pass_a_limit_by_a_rounding_error() -> None:
    joint = "{type: revolute, limits: {position: [-0.3, 0.3]}}"
    assert _complaints(joint, more="configurations: {a: [0.1 + 0.2], b: [-0.1 - 0.2]}\n") == []


def test_names_of_configurations_are_names() -> None:
    assert _complaints("{type: fixed}", more="configurations: {x y: [], 1st: []}\n") == [
        "r.yaml:5:18: configurations: the name of a configuration is made of letters, digits, '_' and '-', "
        "starting with a letter; found 'x y'",
        "r.yaml:5:27: configurations: the name of a configuration is made of letters, digits, '_' and '-', "
        "starting with a letter; found '1st'",
    ]


def test_an_actuator_takes_only_the_gains_of_its_type() -> None:
    assert _complaints("{type: revolute}", more="actuators: {type: velocity, kp: 1, kv: 1}\n") == [
        "r.yaml:5:29: actuators.kp: an actuator of type 'velocity' takes no kp; kp is for position"
    ]
    assert _complaints("{type: revolute, actuator: {type: motor, kp: 1, kv: 2}}") == [
        "r.yaml:4:44: joints[0].actuator.kp: an actuator of type 'motor' takes no kp; kp is for position",
        "r.yaml:4:51: joints[0].actuator.kv: an actuator of type 'motor' takes no kv; "
        "kv is for position and velocity",
    ]


def test_a_position_servo_may_have_no_damping_and_a_velocity_servo_must_have_a_gain() -> None:
    assert _complaints("{type: revolute, actuator: {kp: 5, kv: 0}}") == []
    assert _complaints("{type: revolute, actuator: {type: velocity, kv: 0}}") == [
        "r.yaml:4:51: joints[0].actuator.kv: must be greater than 0 for an actuator of type 'velocity', found 0"
    ]
    assert _complaints("{type: revolute, actuator: {kv: 0}}", more="actuators: {type: velocity}\n") == [
        "r.yaml:4:35: joints[0].actuator.kv: must be greater than 0 for an actuator of type 'velocity', found 0"
    ]


def test_a_joint_without_an_actuator_type_has_that_of_the_file() -> None:
    assert _complaints("{type: revolute, actuator: {kv: 1}}", more="actuators: {type: none}\n") == [
        "r.yaml:4:31: joints[0].actuator.kv: an actuator of type 'none' takes no kv; kv is for position and velocity"
    ]
    assert _complaints("{type: revolute, actuator: {kp: 1}}") == []


@pytest.mark.parametrize(
    ("joints", "more"),
    [
        ("- {type: revolut}\n- {type: revolute}\n", "configurations: {a: [1]}\n"),
        ("- {type: fixed, name: a b}\n- {type: fixed, name: ab}\n", ""),
        ("- {type: revolute, limits: {position: [0, x]}}\n", "configurations: {a: [1]}\n"),
        ("- {type: revolute, limits: {position: [1, 0]}}\n", "configurations: {a: [2]}\n"),
        ("- {type: revolute, limits: {position: 3}}\n", "configurations: {a: [2]}\n"),
        ("- {type: continuous, limits: {position: [0, 1]}}\n", "configurations: {a: [2]}\n"),
        ("- {type: revolute, limits: {position: [0, 1]}}\n", "configurations: {a: [x]}\n"),
        ("- {type: revolute, actuator: {kp: 1}}\n", "actuators: {type: pd}\n"),
        ("- {type: revolute, actuator: {type: x, kp: 1}}\n", ""),
        ("- {type: revolute, flip: 2}\n", "configurations: {a: [1]}\n"),
        ("- revolute\n", "configurations: {a: [1]}\n"),
        ("  3\n", "configurations: {a: [1]}\n"),
    ],
)
def test_one_mistake_makes_one_message(joints: str, more: str) -> None:
    assert len(complaints(HEAD + joints + more)) == 1
