"""Symbols that the text around a table gives a value: ``d_BS = 340 mm``, ``L := 0.1 + 0.2``, a table of values."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Final

from dh2sim.formats.table.cells import CellError, Constant, canonical, read_cell
from dh2sim.formats.table.dh_table import Table
from dh2sim.formats.table.grid import Cell, Grid
from dh2sim.formats.table.headers import UNIT, read_heading
from dh2sim.formats.table.notation import LONGEST_CELL, plain
from dh2sim.robot.expressions import FUNCTIONS
from dh2sim.robot.units import AngleUnit, LengthUnit, Units

_MAX_TEXT_LINES: Final = 5000
"""Lines that are searched for constants."""
_MAX_VALUES: Final = 20
"""Different values of one symbol that are looked at."""
_MAX_DEPTH: Final = 10
"""Symbols in the value of a symbol in the value of a symbol …"""
_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_NUMBER: Final = r"(?:\d+(?:[.,]\d+)?|[.,]\d+)(?:[eE][-+]?\d+)?"
_WITH_UNIT: Final = rf"{_NUMBER}(?:\s*\*?\s*pi(?![A-Za-z0-9_])|\s*(?:{UNIT})(?![A-Za-z0-9_]))?"
_OPERAND: Final = rf"[-+(\s]*(?:{_WITH_UNIT}|[A-Za-z][A-Za-z0-9_]*)(?:\s*\))*"
_SUM: Final = rf"(?>{_OPERAND}(?:\s*(?:\*\*|[-+*/])(?>{_OPERAND}))*+)"
_ASSIGNMENT: Final = re.compile(
    rf"(?<![\w.\\])([A-Za-z][A-Za-z0-9_]*)\s*(?::=|=|:|≈)\s*({_SUM}(?:\s*(?:=|≈)\s*{_SUM})*+)"
    rf"(?>\s*[\[(]?({UNIT})(?![A-Za-z0-9_])[\])]?)?+(?![\w%°\"'(^]|[.,]\d|\s*[-+*/^=])",
)
_GOES_ON: Final = re.compile(r"\s*(?!(?:and|or|is|are|for|where|with|which|from|to|the|as|in)\b)[A-Za-z]")
"""A word behind a number without unit that may be a unit of its own."""
_THOUSANDS: Final = re.compile(r"(?<![\d,.])[1-9]\d{0,2},\d{3}(?!\d)")
_SENTENCES: Final = re.compile(r"(?<=[.;])\s+")


def find_constants(lines: Sequence[str], table: Table, grids: Iterable[Grid]) -> dict[str, Constant]:
    """Return the symbols of a table that the text around it gives a value, without the underscores in their names.

    Args:
        lines: The lines of the file.
        table: The table, whose own lines are left out.
        grids: Other tables of the file, which may list symbols and values.
    """
    texts: dict[str, dict[str, int]] = {}
    for name, text, line in _assignments(lines, table.lines):
        values = texts.setdefault(canonical(name), {})
        if len(values) < _MAX_VALUES:
            values.setdefault(text, line)
    for name, text, line in _listed_values(grids):
        texts.setdefault(canonical(name), {}).setdefault(text, line)
    found: dict[str, Constant] = {}
    for row in table.rows:
        for cell in row:
            for name in _NAME.findall(plain(cell.text)):
                _resolve(canonical(name), texts, found, _MAX_DEPTH)
    return found


def _assignments(lines: Sequence[str], table: range) -> Iterator[tuple[str, str, int]]:
    """Yield names, values as text, and lines."""
    for number, line in enumerate(lines[:_MAX_TEXT_LINES], start=1):
        if number in table or not any(sign in line for sign in "=:≈"):
            continue
        for piece in _SENTENCES.split(line) if len(line) > LONGEST_CELL else (line,):
            for match in _ASSIGNMENT.finditer(plain(piece)):
                value, unit = match[2].strip(), match[3]
                bare = unit is None and not re.search(rf"(?:{UNIT}|[A-Za-z)])$", value)
                if bare and _GOES_ON.match(match.string, match.end()):
                    continue
                yield match[1], f"{value} {unit}" if unit else value, number


def _listed_values(grids: Iterable[Grid]) -> Iterator[tuple[str, str, int]]:
    """Yield names and values of tables that list them: a column of symbols, one of numbers, perhaps one of units."""
    for grid in grids:
        headings = [read_heading(cell) for cell in grid.rows[0]]
        for row in grid.rows[:1000]:
            name = plain(row[0].text)
            if not 2 <= len(row) <= 5 or not _NAME.fullmatch(name):
                continue
            texts = [plain(cell.text) for cell in row]
            value = next((i for i, text in enumerate(texts) if re.fullmatch(rf"[-+]?{_WITH_UNIT}", text)), None)
            if value is None:
                continue
            heading = headings[value] if value < len(headings) else None
            over = (heading.angle or heading.length) if heading is not None else None
            unit = next((text for text in texts[value + 1 :] if re.fullmatch(UNIT, text)), over)
            has_unit = re.search(rf"(?:{UNIT})$", texts[value]) is not None
            yield name, texts[value] if has_unit or unit is None else f"{texts[value]} {unit}", row[0].line


def _resolve(name: str, texts: dict[str, dict[str, int]], found: dict[str, Constant], depth: int) -> None:
    """Find the value of a symbol, and first those of the symbols in it."""
    if name in found or name not in texts or name in FUNCTIONS or name == "pi" or depth == 0:
        return
    for text, line in texts[name].items():
        for other in _NAME.findall(text):
            if canonical(other) != name:
                _resolve(canonical(other), texts, found, depth - 1)
        constant = _constant(text, line, found)
        if constant is None:
            continue
        first = found.setdefault(name, constant)
        if (first.value, first.unit) != (constant.value, constant.unit) and not first.problem:
            problem = f"the symbol '{name}' has two values, on lines {first.line} and {line}; write the number"
            found[name] = replace(first, problem=problem)


def _constant(text: str, line: int, known: dict[str, Constant]) -> Constant | None:
    """Return the value that a text such as ``0.33 + 0.42 = 0.75 m`` gives, or None where it gives none."""
    if _THOUSANDS.search(text):
        return None
    words = re.findall(rf"(?<=[\d.)i\s])({UNIT})(?![A-Za-z0-9_])", text)
    values = []
    for side in re.split("=|≈", text):
        value = _value(side, line, known)
        if value is not None and value.unit is None and words:
            value = _value(f"({side}) {words[-1]}", line, known) or value
        if value is not None:
            values.append(value)
    if not values:
        return None
    first = values[0]
    if any(not math.isclose(value.value, first.value, rel_tol=0.02, abs_tol=1e-9) for value in values):
        return replace(first, problem=f"the two sides of '{text.strip()}' on line {line} differ; write the number")
    return first


def _value(text: str, line: int, known: dict[str, Constant]) -> Constant | None:
    comma = "." not in text and re.search(r"\d,\d", text) is not None
    try:
        reading = read_cell(Cell(text=text.strip(), line=line, column=1), None, known, comma=comma)
    except CellError:
        return None
    if reading.empty or reading.starred:
        return None
    if isinstance(reading.unit, AngleUnit):
        return Constant(value=Units(angle=reading.unit).radians(reading.value), unit=AngleUnit.RAD, line=line)
    if isinstance(reading.unit, LengthUnit):
        return Constant(value=Units(length=reading.unit).metres(reading.value), unit=LengthUnit.M, line=line)
    return Constant(value=reading.value, unit=None, line=line)
