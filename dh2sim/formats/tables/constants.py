"""Values of symbols that the text around a table gives, such as ``L1 = 0.4 m, a2 = 0.4318``."""

from __future__ import annotations

import re
from collections.abc import Container, Sequence
from dataclasses import replace
from typing import Final

from dh2sim.formats.tables.cells import Constant, canonical
from dh2sim.formats.tables.headers import ANGLE_WORDS, LENGTH_WORDS, UNIT
from dh2sim.formats.tables.plain import plain
from dh2sim.robot.expressions import FUNCTIONS, ExpressionError, evaluate
from dh2sim.robot.units import Units

_MOST_LINES: Final = 5000
_NUMBER: Final = r"(?:\d+(?:[.,]\d+)?|[.,]\d+)(?:[eE][-+]?\d+)?"
_VALUE: Final = rf"[-+]?(?:{_NUMBER}\s*\*?\s*)?(?:{_NUMBER}|pi)(?:\s*/\s*\d+)?"
_ASSIGNMENT: Final = re.compile(
    rf"(?<![\w.])([A-Za-z][A-Za-z_]*_?\d+[a-z]?|[A-Za-z])\s*=\s*((?>{_VALUE}))"
    rf"(?>\s*[\[(]?({UNIT})(?![A-Za-z0-9_])[\])]?)?+(?![\w%°\"']|[.,]\d|\s*[-+*/^(=])",
)
_GOES_ON: Final = re.compile(r"\s*(?!(?:and|is|are|for|where|with|which)\b)[A-Za-z]")
"""A word behind a number without unit that may be a unit of its own."""
_THOUSANDS: Final = re.compile(r"[1-9]\d{0,2},\d{3}")


def find_constants(lines: Sequence[str], table: Container[int]) -> dict[str, Constant]:
    """Return the symbols that a text gives a value, without the underscores in their names.

    Args:
        lines: The lines of the file.
        table: Numbers of lines, from 1, that are the table's own.
    """
    found: dict[str, Constant] = {}
    for number, line in enumerate(lines[:_MOST_LINES], start=1):
        if number in table or "=" not in line:
            continue
        for match in _ASSIGNMENT.finditer(plain(line)):
            if match[3] is None and _GOES_ON.match(match.string, match.end()):
                continue
            name, constant = canonical(match[1]), _constant(match, number)
            if constant is None or name in FUNCTIONS or name == "pi":
                continue
            first = found.setdefault(name, constant)
            if (first.value, first.unit) != (constant.value, constant.unit):
                problem = f"the symbol '{name}' has two values, on lines {first.line} and {number}; write the number"
                found[name] = replace(first, problem=problem)
    return found


def _constant(match: re.Match[str], line: int) -> Constant | None:
    text = match[2]
    if _THOUSANDS.search(text):
        return None
    try:
        value = evaluate(re.sub(r"(\d)\s*(?=pi)", r"\1*", text.replace(",", ".")), {})
    except ExpressionError:
        return None
    word = (match[3] or ("rad" if "pi" in text else "")).casefold()
    if angle := ANGLE_WORDS.get(word):
        return Constant(value=Units(angle=angle).radians(value), unit=type(angle).RAD, line=line)
    if length := LENGTH_WORDS.get(word):
        return Constant(value=Units(length=length).metres(value), unit=type(length).M, line=line)
    return Constant(value=value, unit=None, line=line)
