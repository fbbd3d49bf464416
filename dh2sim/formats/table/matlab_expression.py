"""Expressions of MATLAB: numbers, matrices, indices, calls; computed as they are read, never run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Protocol

from dh2sim.formats.table.matlab_tokens import END, Token
from dh2sim.formats.table.toolbox import (
    MAX_ITEMS,
    NUMBERS,
    NumberArray,
    ScriptError,
    ToolboxLink,
    Unknown,
    elementwise,
    number,
    power,
    product,
    transform,
)
from dh2sim.messages import shown

_MAX_DEPTH: Final = 40


class Names(Protocol):
    """What names stand for in a script."""

    values: dict[str, object]

    def call(self, token: Token, arguments: list[object]) -> object:
        """Return what the function that a word names gives."""


class _All:
    """The colon of ``DH(2, :)``."""


class MatlabParser:
    """Computes an expression of MATLAB, tokens from the left."""

    def __init__(self, names: Names, tokens: Sequence[Token], end: float | None = None) -> None:
        self._names = names
        self._tokens = tokens
        self._position = 0
        self._depth = 0
        self._in_matrix = False
        self._end = end

    @property
    def next(self) -> Token:
        """The next token."""
        return self._tokens[self._position] if self._position < len(self._tokens) else END

    @property
    def rest(self) -> Sequence[Token]:
        """The tokens that are not read yet."""
        return self._tokens[self._position :]

    def _take(self, *texts: str) -> Token | None:
        token = self.next
        if token.kind == "operator" and token.text in texts:
            self._position += 1
            return token
        return None

    def _wanted(self, text: str) -> None:
        if self._take(text) is None:
            token = self.next
            found = shown(token.text) if token is not END else "the end"
            raise ScriptError(f"expected {shown(text)}, found {found}", token.line, token.column)

    def sum(self) -> object:
        """Return the value of a sum."""
        value = self._product()
        while self.next.text in ("+", "-") and self.next.kind == "operator" and not self._starts_element():
            operator = self._take("+", "-")
            other = self._product()
            sign = 1.0 if operator is not None and operator.text == "+" else -1.0
            value = elementwise(lambda a, b, sign=sign: a + sign * b, value, other)
        return value

    def _starts_element(self) -> bool:
        """Whether a sign belongs to the next element of a matrix: a space before it and none behind."""
        following = self._tokens[self._position + 1] if self._position + 1 < len(self._tokens) else END
        return self._in_matrix and self.next.spaced and not following.spaced

    def _product(self) -> object:
        value = self._unary()
        while operator := self._take("*", "/", ".*", "./"):
            other = self._unary()
            if operator.text == "*" and (isinstance(value, tuple) or isinstance(other, tuple)):
                value = product(transform(value), transform(other))
            elif operator.text.endswith("*"):
                both = isinstance(value, list) and isinstance(other, list) and operator.text == "*"
                value = (
                    Unknown("a product of matrices is not read")
                    if both
                    else elementwise(lambda a, b: a * b, value, other)
                )
            else:
                value = elementwise(lambda a, b: a / b, value, other)
        return value

    def _unary(self) -> object:
        self._depth += 1
        if self._depth > _MAX_DEPTH:
            raise ScriptError("nested too deep", self.next.line, self.next.column)
        sign = self._take("+", "-")
        value = self._unary() if sign else self._power()
        self._depth -= 1
        return elementwise(lambda a: -a, value) if sign and sign.text == "-" else value

    def _power(self) -> object:
        value = self._primary()
        while self._take("^", ".^"):
            sign = self._take("+", "-")
            other = self._primary()
            factor = -1.0 if sign and sign.text == "-" else 1.0
            value = elementwise(lambda a, b, factor=factor: power(a, factor * b), value, other)
        return value

    def _primary(self) -> object:
        token = self.next
        self._position += 1
        match token.kind:
            case "number":
                return float(token.text.translate(str.maketrans("dD", "ee")))
            case "string":
                return token.text
            case "name":
                return self._transposed(self._named(token))
            case "operator" if token.text == "(":
                inside, self._in_matrix = self._in_matrix, False
                value = self.sum()
                self._wanted(")")
                self._in_matrix = inside
                return self._transposed(value)
            case "operator" if token.text in "[{":
                return self._transposed(self._matrix("]" if token.text == "[" else "}"))
            case _:
                found = shown(token.text) if token is not END else "the end"
                raise ScriptError(f"unexpected {found}", token.line, token.column)

    def _transposed(self, value: object) -> object:
        while self.next.text == "'" and not self.next.spaced:
            self._position += 1
            if isinstance(value, tuple) or (isinstance(value, list) and value and isinstance(value[0], list)):
                value = Unknown("a matrix that is transposed is not read")
        return value

    def _matrix(self, close: str) -> object:
        inside, self._in_matrix = self._in_matrix, True
        rows: list[list[object]] = [[]]
        while not (self.next.kind == "operator" and self.next.text == close):
            if self.next is END:
                raise ScriptError("a bracket is never closed", *self._place())
            if self.next.kind == "newline" or self.next.text == ";":
                self._position += 1
                if rows[-1]:
                    rows.append([])
            elif self._take(",") is None:
                value = self.sum()
                rows[-1] += (
                    value if isinstance(value, list) and not (value and isinstance(value[0], list)) else [value]
                )
                if sum(map(len, rows[-2:])) > MAX_ITEMS or len(rows) > MAX_ITEMS:
                    raise ScriptError(f"more than {MAX_ITEMS} elements", *self._place())
        self._position += 1
        self._in_matrix = inside
        rows = [row for row in rows if row]
        if any(isinstance(item, ToolboxLink) for row in rows for item in row):
            return NumberArray(item for row in rows for item in row)
        if len(rows) <= 1:
            return NumberArray(rows[0] if rows else [])
        return NumberArray(NumberArray(row) for row in rows)

    def _place(self) -> tuple[int, int]:
        token = self._tokens[min(self._position, len(self._tokens) - 1)]
        return token.line, token.column

    def _named(self, token: Token) -> object:
        name = token.text
        if name == "end" and self._end is not None:
            return self._end
        while self.next.text == "." and self.next.kind == "operator" and not (self._in_matrix and self.next.spaced):
            following = self._tokens[self._position + 1] if self._position + 1 < len(self._tokens) else END
            if following.kind != "name":
                break
            self._position += 2
            name = f"{name}.{following.text}"
        called = (
            self.next.kind == "operator"
            and self.next.text in ("(", "{")
            and not (self._in_matrix and self.next.spaced)
        )
        if name in self._names.values:
            value = self._names.values[name]
            return self._element(name, value) if called else value
        last = name.rpartition(".")[2]
        if "." in name and isinstance(link := self._names.values.get(name.partition(".")[0]), ToolboxLink):
            return link.numbers.get(last, Unknown(f"{shown(name)} is not known"))
        if called:
            return self._names.call(token._replace(text=last), self._arguments())
        if last in ("Link", "SE3"):
            return self._names.call(token._replace(text=last), [])
        if name in NUMBERS:
            return NUMBERS[name]
        if name in ("true", "false"):
            return name == "true"
        return Unknown(f"{shown(name)} has no value; give it one above, such as {name} = 0.4;")

    def _arguments(self) -> list[object]:
        close = ")" if self.next.text == "(" else "}"
        self._position += 1
        inside, self._in_matrix = self._in_matrix, False
        arguments: list[object] = []
        while self._take(close) is None:
            if self.next is END:
                raise ScriptError("a bracket is never closed", *self._place())
            if self.next.kind == "newline" or self._take(","):
                self._position += self.next.kind == "newline"
            elif self.next.text == ":" and self.next.kind == "operator":
                self._position += 1
                arguments.append(_All())
            else:
                arguments.append(self.sum())
        self._in_matrix = inside
        return arguments

    def _element(self, name: str, value: object) -> object:
        end, self._end = self._end, float(len(value)) if isinstance(value, list) else None
        indices = self._arguments()
        self._end = end
        if isinstance(value, Unknown):
            return value
        for index in indices:
            if isinstance(index, _All):
                if len(indices) == 2 and index is indices[0] and isinstance(value, list):
                    column = int(number(indices[1]))
                    rows = [row for row in value if isinstance(row, list)]
                    if not rows or not all(0 < column <= len(row) for row in rows):
                        return Unknown(f"{shown(name)} has no column {column}")
                    return NumberArray(row[column - 1] for row in rows)
                continue
            place = number(index)
            if not isinstance(value, list) or place != int(place) or not 0 < place <= len(value):
                if isinstance(value, float | int) and place == 1:
                    continue
                if isinstance(value, list) and len(indices) == 2 and index is indices[0] and place == 1:
                    continue
                return Unknown(f"{shown(name)} has no element {place:g}")
            value = value[int(place) - 1]
        if self.next.text == "." and isinstance(value, ToolboxLink):
            self._position += 1
            key = self.next.text
            self._position += 1
            return value.numbers.get(key, Unknown(f"{shown(key)} of the link is not known"))
        return value
