"""A program: functions of joint vectors whose operations a trace holds, and their statements in any language.

All languages get the same names and the same expressions. What is used once is written where it is used, as far as a
line holds it; a sum of joint angles, and what is used twice, gets a name.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, NamedTuple

from dh2sim.kinematics.trace import (
    CONSTANT,
    COSINE,
    DIFFERENCE,
    LITERAL,
    PRODUCT,
    SINE,
    SUM,
    VARIABLE,
    Number,
    Operations,
    Token,
    Trace,
    count_operations,
    live_nodes,
)

_LONGEST_NAME: Final = 40
_MOST_OPERANDS: Final = 5
"""Names and numbers in an expression, beyond which a part of it gets a name."""


class What(StrEnum):
    """What there is code for."""

    POSE = "pose"
    JACOBIAN = "jacobian"
    INVERSE_DYNAMICS = "inverse-dynamics"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Function:
    """A function of a program."""

    name: str
    arguments: tuple[str, ...]
    """Vectors, each of a coordinate for every joint."""
    result: str
    shape: tuple[int, ...]
    values: tuple[Number, ...]
    """Of the result, row by row."""
    text: str
    """What it returns, in words."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Program:
    """Functions that share their constants."""

    name: str
    n: int
    """Number of joint coordinates."""
    trace: Trace
    functions: tuple[Function, ...]
    header: tuple[str, ...]
    """Lines that say what it is."""

    def operations(self, function: Function) -> Operations:
        """Count what a call costs."""
        return count_operations(self.trace, function.values)


class Statement(NamedTuple):
    """A name and what it stands for."""

    name: str
    expression: str
    note: str = ""


class Body(NamedTuple):
    """A function's statements."""

    arguments: dict[str, list[str | None]]
    """Names of the entries of each argument, None for one that is not used."""
    statements: list[Statement]
    results: list[str]
    """Expressions."""
    constants: list[str]
    """Names of the constants that are used."""


class Listing:
    """The statements of a program, in a language."""

    def __init__(
        self,
        program: Program,
        reserved: Collection[str],
        *,
        prefix: str = "",
        derived_in_functions: bool = False,
    ) -> None:
        """Name the constants.

        Args:
            program: The program.
            reserved: Names that mean something else in the language or in the file.
            prefix: Put before ``cos`` and ``sin``.
            derived_in_functions: Whether what is computed from constants alone is computed in the functions.
        """
        self._program = program
        nodes = program.trace.nodes
        own = {name for f in program.functions for name in (f.name, f.result, *f.arguments)}
        self._file = _Names(program.trace, own | set(reserved), prefix)
        live = live_nodes(program.trace, [value for f in program.functions for value in f.values])
        self.constants = [
            Statement(self._file.name(i, nodes[i].name), repr(nodes[i].value), nodes[i].note)
            for i in live
            if nodes[i].kind == CONSTANT
        ]
        """The named constants."""
        self.derived: list[Statement] = []
        """What is computed from them once, for all functions."""
        self._derived_in_functions = derived_in_functions
        if not derived_in_functions:
            self.derived = self._file.statements(*self._derived(live, program.functions))

    def body(self, function: Function) -> Body:
        """Return the statements of a function."""
        trace, names = self._program.trace, self._file.copy()
        nodes = trace.nodes
        live = live_nodes(trace, function.values)
        arguments: dict[str, list[str | None]] = {name: [None] * self._program.n for name in function.arguments}
        for i in live:
            if nodes[i].kind == VARIABLE:
                place = int(nodes[i].value)
                arguments[nodes[i].name][place] = names.name(i, f"{nodes[i].name}{place + 1}")
        statements: list[Statement] = []
        if self._derived_in_functions:
            statements += names.statements(*self._derived(live, [function]))
        uses = Counter(operand for i in live for operand in nodes[i].operands)
        uses.update(value.index for value in function.values if isinstance(value, Token))
        statements += names.statements([i for i in live if not nodes[i].is_constant and nodes[i].operands], uses)
        return Body(
            arguments=arguments,
            statements=statements,
            results=[names.signed(value) for value in function.values],
            constants=[names.text(i) for i in live if nodes[i].kind == CONSTANT],
        )

    def _derived(self, live: Iterable[int], functions: Iterable[Function]) -> tuple[list[int], Counter[int]]:
        """Return the operations on constants alone, and their uses; what a function uses counts twice."""
        nodes = self._program.trace.nodes
        uses: Counter[int] = Counter()
        wanted = [i for i in live if nodes[i].is_constant and nodes[i].operands]
        for i in live:
            uses.update(nodes[i].operands * (1 if nodes[i].is_constant else 2))
        uses.update(2 * [value.index for f in functions for value in f.values if isinstance(value, Token)])
        return wanted, uses


class _Names:
    """What the nodes of a trace are called, or written as."""

    def __init__(self, trace: Trace, taken: set[str], prefix: str) -> None:
        self._trace = trace
        self._taken = taken
        self._prefix = prefix
        self._texts: dict[int, tuple[str, str, int]] = {}
        """Text, kind of operation (empty for a name) and number of operands."""
        self._next: dict[str, int] = {}
        """Number that the next name with a letter has at least."""
        self._angles = {node.operands[0] for node in trace.nodes if node.kind in (COSINE, SINE)}

    def copy(self) -> _Names:
        """Return names to which others can be added."""
        other = _Names(self._trace, set(self._taken), self._prefix)
        other._texts, other._next = dict(self._texts), dict(self._next)
        return other

    def name(self, index: int, wanted: str) -> str:
        """Give a node a name: the one that is wanted, or one like it that is free."""
        name = start = identifier(wanted)
        while name in self._taken:
            number = self._next.get(start, 1)
            self._next[start] = number + 1
            name = f"{start}_" if number == 1 else f"{start}_{number}"
        self._taken.add(name)
        self._texts[index] = name, "", 1
        return name

    def statements(self, indices: Iterable[int], uses: Counter[int]) -> list[Statement]:
        """Return statements that compute operations; one that is used once may become part of another."""
        made: list[Statement] = []
        for index in indices:
            kind = self._trace.nodes[index].kind
            text, size = self._expression(index)
            if kind in (COSINE, SINE):
                angle = self._trace.nodes[index].operands[0]
                made.append(Statement(self.name(index, kind[0] + self._joints(angle)), text))
            elif uses[index] > 1 or size > _MOST_OPERANDS:
                made.append(Statement(self._numbered(index), text))
            else:
                self._texts[index] = text, kind, size
        return made

    def text(self, index: int) -> str:
        """Return what a node is written as."""
        return self._written(index)[0]

    def signed(self, value: Number) -> str:
        """Return what a number is written as."""
        if not isinstance(value, Token):
            return repr(float(value) + 0.0)
        text, kind, _ = self._written(value.index)
        if value.sign > 0:
            return text
        return f"-({text})" if kind in (SUM, DIFFERENCE) else f"-{text}"

    def _numbered(self, index: int) -> str:
        if index in self._angles:
            return self.name(index, "q" + self._joints(index))
        letter = "k" if self._trace.nodes[index].is_constant else "x"
        number = self._next.get(letter, 1)
        while f"{letter}{number}" in self._taken:
            number += 1
        self._next[letter] = number + 1
        return self.name(index, f"{letter}{number}")

    def _joints(self, index: int) -> str:
        """Return the numbers of the joints whose coordinates make an angle, such as ``23``."""
        nodes = self._trace.nodes
        found: list[str] = []
        pending = [(index, "")]
        while pending:
            i, sign = pending.pop()
            if nodes[i].kind == VARIABLE:
                found.append(f"{sign}{int(nodes[i].value) + 1}")
            elif nodes[i].operands:
                left, right = nodes[i].operands
                flipped = "m" if nodes[i].kind == DIFFERENCE else ""
                pending += [(right, "m" if sign != flipped else ""), (left, sign)]
        found.sort(key=lambda part: (part.startswith("m"), int(part.removeprefix("m"))))
        return ("" if all(len(part) == 1 for part in found) else "_").join(found)

    def _written(self, index: int) -> tuple[str, str, int]:
        node = self._trace.nodes[index]
        return (repr(node.value), "", 1) if node.kind == LITERAL else self._texts[index]

    def _expression(self, index: int) -> tuple[str, int]:
        """Return an operation as it is written, evaluated from the left, and how many names it has."""
        node = self._trace.nodes[index]
        operands = [self._written(i) for i in node.operands]
        size = sum(operand[2] for operand in operands)
        sums = (SUM, DIFFERENCE)
        if node.kind in (COSINE, SINE):
            return f"{self._prefix}{node.kind}({operands[0][0]})", size
        (left, left_kind, _), (right, right_kind, _) = operands
        if node.kind == PRODUCT:
            if right_kind == PRODUCT and left_kind != PRODUCT:  # the same product
                left, left_kind, right, right_kind = right, right_kind, left, left_kind
            left = f"({left})" if left_kind in sums else left
            return f"{left}*{f'({right})' if right_kind else right}", size
        if node.kind == SUM and right_kind in sums and left_kind not in sums:  # the same sum
            left, right, right_kind = right, left, left_kind
        return f"{left} {node.kind} {f'({right})' if right_kind in sums else right}", size


def identifier(name: str) -> str:
    """Return a name that every language takes for one, like ``name``."""
    plain = re.sub(r"_+", "_", re.sub(r"[^A-Za-z0-9_]", "_", name)).strip("_")[:_LONGEST_NAME]
    return plain if plain[:1].isalpha() else f"p_{plain}".rstrip("_")
