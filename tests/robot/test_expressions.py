"""Expressions are Python's arithmetic in doubles, and nothing else."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dh2sim.robot.expressions import FUNCTIONS, MAX_LENGTH, ExpressionError, evaluate, is_name, names_in

NAMES = {"a": 0.4318, "b2": -1.5, "lambda": 2.0}
ALLOWED = "Allowed: numbers, + - * / **, parentheses, parameters, pi, sqrt, sin, cos, tan, asin, acos, atan, atan2"


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1.0),
        (" 1.5e-3 ", 0.0015),
        (".5", 0.5),
        ("5.", 5.0),
        ("007", 7.0),
        ("2 + 3 * 4", 14.0),
        ("(2 + 3) * 4", 20.0),
        ("2 - 3 - 4", -5.0),
        ("8 / 4 / 2", 1.0),
        ("2 ** 3 ** 2", 512.0),
        ("-2 ** 2", -4.0),
        ("2 ** -1", 0.5),
        ("--1", 1.0),
        ("2 * -3", -6.0),
        ("pi / 2", math.pi / 2),
        ("sqrt(2)", math.sqrt(2)),
        ("atan2(1, -1)", math.atan2(1, -1)),
        ("sin(pi / 6) + cos(0)", math.sin(math.pi / 6) + 1),
        ("a * lambda", 0.8636),
        ("-b2", 1.5),
        ("1 +\n 2", 3.0),
        (" + ".join(["1"] * 250), 250.0),
    ],
)
def test_expression_has_the_value_that_python_gives(text: str, value: float) -> None:
    assert evaluate(text, NAMES) == value


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "in '': it is empty"),
        ("1 +", "in '1 +': it ends too early"),
        ("(1", "in '(1': it ends too early"),
        ("1)", "in '1)': unexpected ')' after '1'"),
        ("1 2", "in '1 2': unexpected '2' after '1'"),
        ("* 2", "in '* 2': unexpected '*'"),
        ("1,5", "in '1,5': unexpected ',' after '1'; write a decimal point as ."),
        ("2a", "in '2a': '2a' is not a number; a product needs *"),
        ("O.5", "'O.5' is not a number. Did you mean 0.5? It has the letter O in place of a digit"),
        ("2 * 1OO", "'2 * 1OO' is not a number. Did you mean 100? It has the letter O in place of a digit"),
        ("l0", "'l0' is not a number. Did you mean 10? It has the letter l in place of a digit"),
        ("l1", "unknown name 'l1'. Known names: pi, a, b2, lambda"),
        ("1j", "in '1j': '1j' is not a number; a product needs *"),
        ("1_000", "in '1_000': '1_000' is not a number; a product needs *"),
        ("1.2.3", "in '1.2.3': '1.2.3' is not a number; a product needs *"),
        ("c", "unknown name 'c'. Known names: pi, a, b2, lambda"),
        ("b", "unknown name 'b'. Did you mean 'b2'? Known names: pi, a, b2, lambda"),
        ("PI * 2", "in 'PI * 2': unknown name 'PI'. Did you mean 'pi'? Known names: pi, a, b2, lambda"),
        ("True", "unknown name 'True'. Known names: pi, a, b2, lambda"),
        ("sqrt", "'sqrt' is a function; write sqrt(...)"),
        ("sqrt * 2", "in 'sqrt * 2': 'sqrt' is a function; write sqrt(...)"),
        (
            "sine(1)",
            "in 'sine(1)': unknown function 'sine'. Did you mean 'sin'? "
            "Functions: sqrt, sin, cos, tan, asin, acos, atan, atan2",
        ),
        ("a(1)", "in 'a(1)': unknown function 'a'. Functions: sqrt, sin, cos, tan, asin, acos, atan, atan2"),
        ("sqrt()", "in 'sqrt()': unexpected ')' after '('"),
        ("sqrt(1, 2)", "in 'sqrt(1, 2)': 'sqrt' takes 1 argument, found 2"),
        ("atan2(1)", "in 'atan2(1)': 'atan2' takes 2 arguments, found 1"),
        ("sqrt(1", "in 'sqrt(1': it ends too early"),
        ("2 ^ 3", f"in '2 ^ 3': unexpected '^'; use ** for powers. {ALLOWED}"),
        ("1 < 2", f"in '1 < 2': unexpected '<'; comparisons are not allowed. {ALLOWED}"),
        ("a == 2", f"in 'a == 2': unexpected '='; comparisons are not allowed. {ALLOWED}"),
        ("\N{MINUS SIGN}1", f"in '\N{MINUS SIGN}1': unexpected '\N{MINUS SIGN}'; write -. {ALLOWED}"),
        ("90°", f"in '90°': unexpected '°'; angles are in the unit that 'units' names. {ALLOWED}"),
        ("5 % 2", f"in '5 % 2': unexpected '%'. {ALLOWED}"),
        ("'x'", f'in "\'x\'": unexpected "\'". {ALLOWED}'),
        ("a.real", f"in 'a.real': unexpected '.'. {ALLOWED}"),
        ("[1]", f"in '[1]': unexpected '['. {ALLOWED}"),
        ("7 // 2", "in '7 // 2': unexpected '/' after '/'"),
        ("__import__('os')", f'in "__import__(\'os\')": unexpected "\'". {ALLOWED}'),
        ("1 / 0", "in '1 / 0': division by zero"),
        ("0 ** -1", "in '0 ** -1': division by zero"),
        ("9 ** 9 ** 9 ** 9", "in '9 ** 9 ** 9 ** 9': the result is too large"),
        ("1e308 * 10", "in '1e308 * 10': the result is too large"),
        ("1e999", "in '1e999': the result is too large"),
        ("sqrt(-1)", "in 'sqrt(-1)': a function has no real value there"),
        ("asin(2)", "in 'asin(2)': a function has no real value there"),
        ("(-8) ** (1 / 3)", "in '(-8) ** (1 / 3)': a negative number has no real power of a fraction"),
        (
            "(" * 60 + "1" + ")" * 60,
            f"in {'(' * 57 + '...'!r}: nested deeper than 50 levels",
        ),
        ("-" * 900 + "1", f"in {'-' * 57 + '...'!r}: nested deeper than 50 levels"),
        (
            "1" * 1001,
            f"in {'1' * 57 + '...'!r}: the expression has 1001 characters; at most {MAX_LENGTH} are allowed",
        ),
    ],
)
def test_the_error_of_an_expression_says_what_is_wrong(text: str, message: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        evaluate(text, NAMES)
    assert str(caught.value) == message


def test_names_used_leave_functions_out_and_come_once() -> None:
    assert names_in("sqrt(a) + b * a + pi") == ("a", "b", "pi")
    assert names_in("a ^ b") == ()


def test_an_unknown_value_makes_the_result_unknown() -> None:
    assert math.isnan(evaluate("a ** 0", {"a": math.nan}))


@pytest.mark.parametrize(
    ("name", "usable"),
    [
        ("d1", True),
        ("_x", True),
        ("pi", False),
        ("sin", False),
        ("1d", False),
        ("d-1", False),
        ("", False),
        ("é", False),
    ],
)
def test_names_of_parameters_are_identifiers_that_are_not_taken(name: str, usable: bool) -> None:
    assert is_name(name) is usable


def _binary(operator: str) -> Callable[[tuple[str, str]], str]:
    return lambda pair: f"{pair[0]} {operator} {pair[1]}"


def _expressions() -> st.SearchStrategy[str]:
    numbers = st.floats(0, 1e6, allow_nan=False).map(repr)
    leaves = numbers | st.sampled_from(["a", "b2", "pi"])
    return st.recursive(
        leaves,
        lambda inner: (
            st.one_of(*(st.tuples(inner, inner).map(_binary(op)) for op in ("+", "-", "*", "/", "**")))
            | inner.map(lambda text: f"({text})")
            | inner.map(lambda text: f"-{text}")
            | st.tuples(st.sampled_from(["sqrt", "sin", "cos", "tan", "asin", "acos", "atan"]), inner).map(
                lambda pair: f"{pair[0]}({pair[1]})"
            )
            | st.tuples(inner, inner).map(lambda pair: f"atan2({pair[0]}, {pair[1]})")
        ),
        max_leaves=12,
    )


@given(_expressions())
@example("-2.0 ** -2.0 ** 0.5")
def test_expressions_agree_with_python(text: str) -> None:
    functions = {name: function for name, (_, function) in FUNCTIONS.items()}
    names = {"a": 0.4318, "b2": -1.5}
    try:
        expected = eval(text, {"__builtins__": {}, "pi": math.pi, **functions, **names})
    except (ArithmeticError, ValueError, TypeError):
        expected = math.nan
    try:
        value = evaluate(text, names)
    except ExpressionError:
        assert isinstance(expected, complex) or not math.isfinite(expected) or len(text) > 100
    else:
        assert value == expected


@given(st.text() | st.text(alphabet="0123456789.e+-*/(), absqrtinpi_^"))
def test_any_text_has_a_finite_value_or_an_error(text: str) -> None:
    with contextlib.suppress(ExpressionError):
        assert math.isfinite(evaluate(text, NAMES))
