"""Straight-line programs, by running an algorithm on tokens instead of numbers.

A token stands for a number that is known only when the program runs. Arithmetic on tokens is recorded, and simplified
as it is recorded: numbers are folded, zeros and ones vanish, equal operations are shared, signs are kept aside (they
cost nothing: a sum becomes a difference), and what depends on constants alone is set apart, to be done once.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, NamedTuple, TypeAlias, Union

Number: TypeAlias = Union[float, "Token"]
"""A number that is known, or a token."""

SUM: Final = "+"
DIFFERENCE: Final = "-"
PRODUCT: Final = "*"
COSINE: Final = "cos"
SINE: Final = "sin"
VARIABLE: Final = "variable"
CONSTANT: Final = "constant"
LITERAL: Final = "literal"


class Node(NamedTuple):
    """An operation of a trace, or one of its leaves."""

    kind: str
    """An operation: SUM, DIFFERENCE, PRODUCT, COSINE or SINE; or a leaf: VARIABLE, CONSTANT or LITERAL."""
    operands: tuple[int, ...] = ()
    """Indices of earlier nodes."""
    name: str = ""
    """Of a constant; of a variable, the argument of the program that it is an entry of."""
    value: float = 0.0
    """Of what no variable enters; of a variable, its place in the argument, from 0."""
    note: str = ""
    """What a constant is."""
    is_constant: bool = False
    """Whether no variable enters it."""


class Trace:
    """Records operations, each once."""

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self._known: dict[tuple[object, ...], int] = {}

    def variables(self, argument: str, count: int) -> list[Token]:
        """Return the tokens of an argument of the program, a vector."""
        return [self._leaf(Node(VARIABLE, name=argument, value=float(i))) for i in range(count)]

    def constant(self, name: str, value: float, note: str = "") -> Number:
        """Return the token of a named constant; -1, 0 and 1 need no name."""
        if value in (-1.0, 0.0, 1.0):
            return value + 0.0
        return self._leaf(Node(CONSTANT, name=name, value=value, note=note, is_constant=True))

    def _leaf(self, node: Node) -> Token:
        return Token(self, self._index((node.kind, node.name, node.value), node))

    def _literal(self, value: float) -> int:
        return self._index((LITERAL, value), Node(LITERAL, value=value, is_constant=True))

    def _index(self, key: tuple[object, ...], node: Node) -> int:
        index = self._known.get(key)
        if index is None:
            index = self._known[key] = len(self.nodes)
            self.nodes.append(node)
        return index

    def record(self, kind: str, *operands: int) -> int:
        """Return the index of an operation on nodes, a new one or the one recorded before."""
        index = self._known.get((kind, operands))
        if index is None:
            nodes = [self.nodes[i] for i in operands]
            constant = all(node.is_constant for node in nodes)
            value = _computed(kind, *(node.value for node in nodes)) if constant else 0.0
            index = self._index((kind, operands), Node(kind, operands, value=value, is_constant=constant))
        return index

    def value(self, number: Number) -> float:
        """Return the value of a number that no variable enters."""
        if not isinstance(number, Token):
            return number
        node = self.nodes[number.index]
        if not node.is_constant:
            raise ValueError("what depends on variables has no value before the program runs")
        return number.sign * node.value

    def split(self, value: Number) -> tuple[int, int]:
        """Return the index of a number's node and its sign; a number without token becomes a literal."""
        if isinstance(value, Token):
            return value.index, value.sign
        return self._literal(abs(float(value))), -1 if value < 0 else 1


def _computed(kind: str, left: float, right: float) -> float:
    match kind:
        case "+":
            return left + right
        case "-":
            return left - right
        case _:
            return left * right


class Token:
    """A number of a trace: plus or minus one of its nodes."""

    __slots__ = ("index", "sign", "trace")

    def __init__(self, trace: Trace, index: int, sign: int = 1) -> None:
        self.trace = trace
        self.index = index
        self.sign = sign

    @property
    def is_constant(self) -> bool:
        """Whether no variable enters it."""
        return self.trace.nodes[self.index].is_constant

    def __neg__(self) -> Token:
        """Return minus the token."""
        return Token(self.trace, self.index, -self.sign)

    def __add__(self, other: Number) -> Number:
        """Record a sum."""
        if not isinstance(other, Token) and other == 0:
            return self
        (left, sign), (right, sign_right) = (self.index, self.sign), self.trace.split(other)
        if left == right and sign != sign_right:
            return 0.0
        if right < left:
            left, sign, right, sign_right = right, sign_right, left, sign
        index = self.trace.record(SUM if sign == sign_right else DIFFERENCE, left, right)
        return Token(self.trace, index, sign)

    __radd__ = __add__

    def __sub__(self, other: Number) -> Number:
        """Record a difference."""
        return self + -other

    def __rsub__(self, other: Number) -> Number:
        """Record a difference."""
        return -self + other

    def __mul__(self, other: Number) -> Number:
        """Record a product."""
        if not isinstance(other, Token):
            if other == 0:
                return 0.0
            if abs(other) == 1:
                return self if other > 0 else -self
        left = self.index
        right, sign = (other.index, other.sign) if isinstance(other, Token) else self.trace.split(other)
        product = self.trace.record(PRODUCT, left, right) if left < right else self.trace.record(PRODUCT, right, left)
        return Token(self.trace, product, self.sign * sign)

    __rmul__ = __mul__


def cosine(angle: Token) -> Token:
    """Return the cosine of a token, rad."""
    return Token(angle.trace, angle.trace.record(COSINE, angle.index))


def sine(angle: Token) -> Token:
    """Return the sine of a token, rad."""
    return Token(angle.trace, angle.trace.record(SINE, angle.index), angle.sign)


def live_nodes(trace: Trace, outputs: Iterable[Number]) -> list[int]:
    """Return the indices of the nodes that outputs need, in the order in which they are computed."""
    pending = [value.index for value in outputs if isinstance(value, Token)]
    needed: set[int] = set()
    while pending:
        index = pending.pop()
        if index not in needed:
            needed.add(index)
            pending += trace.nodes[index].operands
    return sorted(needed)


@dataclass(frozen=True, slots=True, kw_only=True)
class Operations:
    """What one call of a program costs; operations on constants alone are done once and not counted."""

    multiplications: int
    additions: int
    """And subtractions."""
    functions: int
    """Sines and cosines."""

    @property
    def arithmetic(self) -> int:
        """Multiplications and additions together."""
        return self.multiplications + self.additions

    def __str__(self) -> str:
        """Return it in words."""
        return (
            f"{self.multiplications} multiplications, {self.additions} additions, {self.functions} sines and cosines"
        )


def count_operations(trace: Trace, outputs: Iterable[Number]) -> Operations:
    """Count the operations that outputs need at each call."""
    nodes = (trace.nodes[index] for index in live_nodes(trace, outputs))
    kinds = Counter(node.kind for node in nodes if not node.is_constant)
    return Operations(
        multiplications=kinds[PRODUCT],
        additions=kinds[SUM] + kinds[DIFFERENCE],
        functions=kinds[COSINE] + kinds[SINE],
    )
