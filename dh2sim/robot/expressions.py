"""Arithmetic in strings: numbers, names, + - * / **, parentheses and a few functions.

Grammar and precedence are Python's own; everything is computed in doubles and nothing is ever passed to
Python's parser or evaluator.

    sum     = term   { ("+" | "-") term }
    term    = factor { ("*" | "/") factor }
    factor  = ("+" | "-") factor | power
    power   = primary [ "**" factor ]
    primary = number | name | function "(" sum { "," sum } ")" | "(" sum ")"
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Collection, Mapping
from typing import Final, Generic, NamedTuple, Protocol, Self, TypeAlias, TypeVar

from dh2sim.messages import did_you_mean, listed, shown

MAX_LENGTH: Final = 1000
MAX_DEPTH: Final = 50

FUNCTIONS: Final[Mapping[str, tuple[int, Callable[..., float]]]] = {
    "sqrt": (1, math.sqrt),
    "sin": (1, math.sin),
    "cos": (1, math.cos),
    "tan": (1, math.tan),
    "asin": (1, math.asin),
    "acos": (1, math.acos),
    "atan": (1, math.atan),
    "atan2": (2, math.atan2),
}
"""Number of arguments and function; angles in radians."""
CONSTANTS: Final[Mapping[str, float]] = {"pi": math.pi}

_TOKEN: Final = re.compile(
    r"(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*)"
    r"|(?P<operator>\*\*|[-+*/(),])"
)
_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_NOT_A_NUMBER: Final = re.compile(r"[A-Za-z0-9_.]+")
_NUMBER: Final = re.compile(r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][0-9]+)?")
_LIKE_DIGITS: Final = str.maketrans("OoIl", "0011")
_SYMBOL: Final = re.compile(r"[Il]|[OoIl][1-9][0-9]*")
"""A name that is likely meant as one, such as l1."""
_HINTS: Final = {
    "^": "use ** for powers",
    "\N{MINUS SIGN}": "write -",
    "\N{EN DASH}": "write -",
    "\N{MULTIPLICATION SIGN}": "write *",
    "\N{MIDDLE DOT}": "write *",
    "\N{GREEK SMALL LETTER PI}": "write pi",
    "\N{DEGREE SIGN}": "angles are in the unit that 'units' names",
    "<": "comparisons are not allowed",
    ">": "comparisons are not allowed",
    "=": "comparisons are not allowed",
    "!": "comparisons are not allowed",
}
_ALLOWED: Final = f"Allowed: numbers, + - * / **, parentheses, parameters, pi, {listed(FUNCTIONS)}"


class ExpressionError(ValueError):
    """A text that is not an arithmetic expression, or has no finite real value."""


class Operand(Protocol):
    """What expressions compute with."""

    def __add__(self, other: Self, /) -> Self: ...
    def __sub__(self, other: Self, /) -> Self: ...
    def __mul__(self, other: Self, /) -> Self: ...
    def __truediv__(self, other: Self, /) -> Self: ...
    def __neg__(self) -> Self: ...


Value = TypeVar("Value", bound=Operand)


class Arithmetic(Protocol[Value]):
    """What the pieces of an expression stand for: floats, or anything else that can be added and multiplied."""

    def number(self, text: str) -> Value:
        """Return what a number stands for."""

    def name(self, name: str) -> Value:
        """Return what a name stands for.

        Raises:
            KeyError: There is no such name.
        """

    def call(self, function: str, arguments: list[Value]) -> Value:
        """Return the value of one of ``FUNCTIONS``, of as many arguments as it takes."""

    def power(self, base: Value, exponent: Value) -> Value:
        """Return ``base ** exponent``."""


class _Token(NamedTuple):
    kind: str
    text: str


_END: Final = _Token("end", "")
_Tokens: TypeAlias = list[_Token]


def evaluate(text: str, names: Mapping[str, float]) -> float:
    """Return the value of an expression.

    Args:
        text: The expression.
        names: Values of the parameters; NaN for one that is wrong itself, of which enough has been said.

    Returns:
        A finite number, or NaN where a parameter used is NaN.

    Raises:
        ExpressionError: With a message that says what is wrong, fit for a user.
    """
    doubles = _Doubles(names)
    try:
        value = _Parser(_tokens(text), doubles, names).whole()
    except ExpressionError as error:
        if hint := digit_hint(text, names):
            raise ExpressionError(f"{shown(text)} is not a number.{hint}") from None
        raise (error if _NAME.fullmatch(text.strip()) else _within(text, error)) from None
    except ZeroDivisionError:
        raise _within(text, "division by zero") from None
    except OverflowError:
        raise _within(text, "the result is too large") from None
    except ValueError:
        raise _within(text, "a function has no real value there") from None
    if doubles.used_unknown_value:
        return math.nan
    if not math.isfinite(value):
        raise _within(text, "the result is too large")
    return value


def evaluate_in(text: str, arithmetic: Arithmetic[Value]) -> Value:
    """Return the value of an expression in an arithmetic of one's own.

    Raises:
        ExpressionError: The text is not an expression.
    """
    return _Parser(_tokens(text), arithmetic, ()).whole()


class _Doubles:
    """Floats, as Python computes with them."""

    def __init__(self, names: Mapping[str, float]) -> None:
        self.used_unknown_value = False
        self._names = names

    def number(self, text: str) -> float:
        return float(text)

    def name(self, name: str) -> float:
        value = CONSTANTS[name] if name in CONSTANTS else self._names[name]
        self.used_unknown_value |= math.isnan(value)
        return value

    def call(self, function: str, arguments: list[float]) -> float:
        return FUNCTIONS[function][1](*arguments)

    def power(self, base: float, exponent: float) -> float:
        result: float | complex = base**exponent
        if isinstance(result, complex):
            raise ExpressionError("a negative number has no real power of a fraction")
        return result


def names_in(text: str) -> tuple[str, ...]:
    """Return the names an expression uses, functions left out; none where it is not an expression."""
    try:
        tokens = _tokens(text)
    except ExpressionError:
        return ()
    return tuple(dict.fromkeys(t.text for t in tokens if t.kind == "name" and t.text not in FUNCTIONS))


def digit_hint(text: str, names: Collection[str]) -> str:
    """Return a guess, to follow a full stop, at the number in which a letter is in a digit's place; else nothing.

    Args:
        text: What was found, such as ``O.5``.
        names: Names that stand for something.
    """
    for word in _NOT_A_NUMBER.findall(text):
        number = word.translate(_LIKE_DIGITS)
        if number != word and word not in names and _NUMBER.fullmatch(number) and not _SYMBOL.fullmatch(word):
            letter = next(a for a, b in zip(word, number, strict=True) if a != b)
            return f" Did you mean {number}? It has the letter {letter} in place of a digit"
    return ""


def is_name(text: str) -> bool:
    """Return whether expressions can use ``text`` as the name of a parameter."""
    return _NAME.fullmatch(text) is not None and text not in FUNCTIONS and text not in CONSTANTS


def _within(text: str, error: object) -> ExpressionError:
    return ExpressionError(f"in {shown(text)}: {error}")


def _tokens(text: str) -> _Tokens:
    if len(text) > MAX_LENGTH:
        raise ExpressionError(f"the expression has {len(text)} characters; at most {MAX_LENGTH} are allowed")
    tokens: _Tokens = []
    position = 0
    while position < len(text):
        if text[position].isspace():
            position += 1
            continue
        found = _TOKEN.match(text, position)
        if found is None:
            character = text[position]
            hint = f"; {_HINTS[character]}" if character in _HINTS else ""
            raise ExpressionError(f"unexpected {character!r}{hint}. {_ALLOWED}")
        kind = found.lastgroup or ""
        position = found.end()
        if kind == "number" and (rest := _NOT_A_NUMBER.match(text, position)):
            raise ExpressionError(f"{shown(found.group() + rest.group())} is not a number; a product needs *")
        tokens.append(_Token(kind, found.group()))
    return tokens


class _Parser(Generic[Value]):
    """Reads tokens from the left and computes as it goes."""

    def __init__(self, tokens: _Tokens, arithmetic: Arithmetic[Value], names: Collection[str]) -> None:
        self._tokens = tokens
        self._arithmetic = arithmetic
        self._names = names
        self._position = 0
        self._depth = 0

    def whole(self) -> Value:
        """Return the value of all tokens."""
        value = self._sum()
        if self._next is not _END:
            raise self._unexpected()
        return value

    @property
    def _next(self) -> _Token:
        return self._tokens[self._position] if self._position < len(self._tokens) else _END

    def _take(self, *texts: str) -> str | None:
        """Step over the next token if it is one of these operators, and return it."""
        token = self._next
        if token.kind != "operator" or token.text not in texts:
            return None
        self._position += 1
        return token.text

    def _unexpected(self) -> ExpressionError:
        if self._next is _END:
            return ExpressionError("it ends too early" if self._tokens else "it is empty")
        after = f" after {self._tokens[self._position - 1].text!r}" if self._position else ""
        hint = "; write a decimal point as ." if self._next.text == "," else ""
        return ExpressionError(f"unexpected {shown(self._next.text)}{after}{hint}")

    def _sum(self) -> Value:
        value = self._term()
        while operator := self._take("+", "-"):
            right = self._term()
            value = value + right if operator == "+" else value - right
        return value

    def _term(self) -> Value:
        value = self._factor()
        while operator := self._take("*", "/"):
            right = self._factor()
            value = value * right if operator == "*" else value / right
        return value

    def _factor(self) -> Value:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise ExpressionError(f"nested deeper than {MAX_DEPTH} levels")
        sign = self._take("+", "-")
        value = self._factor() if sign else self._power()
        self._depth -= 1
        return -value if sign == "-" else value

    def _power(self) -> Value:
        value = self._primary()
        if self._take("**") is None:
            return value
        return self._arithmetic.power(value, self._factor())

    def _primary(self) -> Value:
        token = self._next
        if token.kind == "number":
            self._position += 1
            return self._arithmetic.number(token.text)
        if token.kind == "name":
            self._position += 1
            return self._call(token.text) if self._take("(") else self._name(token.text)
        if self._take("("):
            value = self._sum()
            if self._take(")") is None:
                raise self._unexpected()
            return value
        raise self._unexpected()

    def _name(self, name: str) -> Value:
        if name in FUNCTIONS:
            raise ExpressionError(f"'{name}' is a function; write {name}(...)")
        if name.casefold() in ("nan", "inf", "infinity") and name not in self._names:
            raise ExpressionError(f"{shown(name)} is not a finite number")
        try:
            return self._arithmetic.name(name)
        except KeyError:
            hint = did_you_mean(name, itertools.chain(CONSTANTS, FUNCTIONS, self._names))
            known = listed(itertools.chain(CONSTANTS, self._names))
            raise ExpressionError(f"unknown name {shown(name)}.{hint} Known names: {known}") from None

    def _call(self, name: str) -> Value:
        if name not in FUNCTIONS:
            hint = did_you_mean(name, FUNCTIONS)
            raise ExpressionError(f"unknown function {shown(name)}.{hint} Functions: {listed(FUNCTIONS)}")
        count, _ = FUNCTIONS[name]
        arguments = [self._sum()]
        while self._take(","):
            arguments.append(self._sum())
        if self._take(")") is None:
            raise self._unexpected()
        if len(arguments) != count:
            takes = "1 argument" if count == 1 else f"{count} arguments"
            raise ExpressionError(f"'{name}' takes {takes}, found {len(arguments)}")
        return self._arithmetic.call(name, arguments)


class NumberError(ValueError):
    """A value that is not a finite number; the text is fit for a user."""


def to_number(value: object, names: Mapping[str, float] | None) -> float:
    """Return the number that a value stands for.

    Args:
        value: A number, or an expression in a string.
        names: Values of the parameters; None where expressions are not allowed.

    Returns:
        A finite number; NaN where the expression uses a parameter that is wrong itself.

    Raises:
        NumberError: With what was found and what is allowed.
    """
    if type(value) is float and math.isfinite(value):  # most of them
        return value
    match value:
        case str() if names is not None:
            try:
                return evaluate(value, names)
            except ExpressionError as error:
                raise NumberError(str(error)) from None
        case int() | float() if not isinstance(value, bool):
            try:
                number = float(value)
            except OverflowError:
                number = math.inf
            if math.isfinite(number):
                return number
            raise NumberError(f"expected a finite number, found {shown(value)}")
        case _:
            expected = "a number" if names is None else "a number or an expression in a string"
            raise NumberError(f"expected {expected}, found {shown(value)}")


def parameter_name_problem(name: object) -> str:
    """Return why a parameter cannot have a name of which ``is_name`` says so."""
    taken = [*CONSTANTS, *FUNCTIONS]
    if name in taken:
        return f"a parameter cannot be named {shown(name)}; expressions know the name already"
    return f"{shown(name)} is not a name for a parameter: letters, digits and '_', not starting with a digit"
