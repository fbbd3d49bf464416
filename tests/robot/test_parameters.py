"""Parameters are evaluated in the order in which they need each other."""

from __future__ import annotations

import math

import pytest

from tests.robot.files import complaints, robot, with_keys


def _parameters(text: str) -> dict[str, float]:
    return dict(robot(with_keys(f"parameters: {text}\n")).parameters)


def test_parameters_may_use_each_other_in_any_order() -> None:
    assert _parameters("{a: b + c, b: 2 * c, c: 3}") == {"a": 9.0, "b": 6.0, "c": 3.0}


def test_parameters_may_be_named_as_python_keywords_are() -> None:
    assert _parameters("{lambda: 2, x: lambda ** 2}") == {"lambda": 2.0, "x": 4.0}


def test_parameters_may_use_pi_and_functions() -> None:
    assert _parameters("{t: 'atan2(1, 2) + pi'}") == {"t": math.atan2(1, 2) + math.pi}


def test_parameters_keep_their_order() -> None:
    assert list(_parameters("{z: y, y: x, x: 1}")) == ["z", "y", "x"]


def test_a_long_chain_of_parameters_is_no_trouble() -> None:
    chain = "".join(f"  p{i}: p{i + 1} + 1\n" for i in range(3000))
    assert robot(with_keys(f"parameters:\n{chain}  p3000: 0\n")).parameters["p0"] == 3000


@pytest.mark.parametrize(
    ("parameters", "messages"),
    [
        ("{a: a + 1}", ["5:17: parameters.a: parameters need each other in a circle: a -> a"]),
        (
            "{a: 2 * b, b: c, c: a}",
            ["5:17: parameters.a: parameters need each other in a circle: a -> b -> c -> a"],
        ),
        (
            "{x: a, a: b, b: a, c: d, d: c}",
            [
                "5:23: parameters.a: parameters need each other in a circle: a -> b -> a",
                "5:35: parameters.c: parameters need each other in a circle: c -> d -> c",
            ],
        ),
        ("{l_1: 1, b: l1}", ["5:25: parameters.b: unknown name 'l1'. Did you mean 'l_1'? Known names: pi, l_1, b"]),
        ("{a: x, b: a, c: a + b}", ["5:17: parameters.a: unknown name 'x'. Known names: pi, a, b, c"]),
        ("{a: .nan}", ["5:17: parameters.a: expected a finite number, found nan"]),
        ("{a: 1e999}", ["5:17: parameters.a: expected a finite number, found inf"]),
        ("{a: true}", ["5:17: parameters.a: expected a number or an expression in a string, found true"]),
        ("{a: }", ["5:14: parameters.a: expected a number or an expression in a string, found nothing"]),
        ("{a: [1]}", ["5:17: parameters.a: expected a number or an expression in a string, found a list"]),
        ("{pi: 3}", ["5:14: parameters: a parameter cannot be named 'pi'; expressions know the name already"]),
        ("{sin: 3}", ["5:14: parameters: a parameter cannot be named 'sin'; expressions know the name already"]),
        (
            "{d-1: 3}",
            [
                "5:14: parameters: 'd-1' is not a name for a parameter: "
                "letters, digits and '_', not starting with a digit"
            ],
        ),
        ("[1]", ["5:13: parameters: expected a mapping of names to numbers, found a list"]),
        ("", ["5:1: parameters: expected a mapping of names to numbers, found nothing"]),
    ],
)
def test_wrong_parameters_are_reported(parameters: str, messages: list[str]) -> None:
    assert complaints(with_keys(f"parameters: {parameters}\n")) == [f"r.yaml:{m}" for m in messages]


@pytest.mark.parametrize("parameters", ["{a: x}", "{a: a}", "3", "{<<: {a: 1}}"])
def test_a_wrong_parameter_is_not_reported_again_where_it_is_used(parameters: str) -> None:
    joints = "joints:\n- {type: revolute, a: 2 * a, limits: {position: [a, -a]}, link: {mass: a}}\n"
    assert len(complaints(f"name: r\nconvention: standard\n{joints}parameters: {parameters}\n")) == 1
