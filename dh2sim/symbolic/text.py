"""Forms as plain text for a terminal: matrices in columns where they fit, entry by entry where they do not."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Iterator, Sequence
from typing import Final

from dh2sim.symbolic.angles import Angle, rate_row, slide_row, trig_of
from dh2sim.symbolic.form import Condition, Equation, Form, moving_angles, used_letters
from dh2sim.symbolic.notation import decimal, is_long_run, is_simple_quotient, written
from dh2sim.symbolic.polynomial import Atom, Rational, magnitude
from dh2sim.symbolic.table import Letter, SymbolicTable

WIDTH: Final = 80
_TALLEST: Final = 4
"""Lines that a row of a matrix may take in columns."""
_FACTORS: Final = re.compile(r"(?:(?:cos|sin)\([^()]*\)|\*\*|[^*])+\*?")
"""Factors of a term, with the signs behind them; cosines of constants are whole."""


class TextNotation:
    """Writes c1, s23 for cosines and sines, d3 for the coordinate of a sliding row."""

    times = "*"
    _in_full = False
    """Whether long sums of coordinates are written without dots."""

    def __init__(self, table: SymbolicTable, joint_names: str) -> None:
        """``joint_names`` is 'theta', with sliding coordinates d_i, or 'q'."""
        self._joint = joint_names
        self._turns = [row.type.turns for row in table.spec.rows]
        self._taken = set(table.letters)
        self._separator = "_" if len(table.spec.rows) > 9 else ""

    def atom(self, atom: Atom) -> str:
        """Return an atom as it is called."""
        row = slide_row(atom)
        if row is not None:
            return self.coordinate(row, turns=False)
        row = rate_row(atom)
        if row is not None:
            turns = self._turns[row - 1]
            return f"d{self.coordinate(row, turns=turns)}"
        trig = trig_of(atom)
        if trig is None:
            return atom
        if trig.angle.is_constant:
            return f"{trig.function}({self.angle(trig.angle).replace(' ', '')})"
        return self.short(trig.function[0], trig.angle)

    def short(self, letter: str, angle: Angle) -> str:
        """Return c12 for plain sums of coordinates, c(1-2) for other angles."""
        if self.is_plain(angle):
            rows = [row for row, _ in angle.coordinates]
            long = is_long_run(rows)
            name = f"{letter}{rows[0]}..{rows[-1]}" if long else letter + self._separator.join(map(str, rows))
            if name not in self._taken:
                return name
        return f"{letter}({angle})"

    @staticmethod
    def is_plain(angle: Angle) -> bool:
        """Whether an angle is a sum of coordinates and nothing else."""
        return not angle.names and not angle.degrees and all(n == 1 for _, n in angle.coordinates)

    def coordinate(self, row: int, *, turns: bool) -> str:
        """Return what the coordinate of a row is called."""
        name = f"q{row}"
        if self._joint == "theta":
            name = f"theta_{row}" if turns else f"d{row}"
        for candidate in (name, f"q{row}", f"q_{row}"):
            if candidate not in self._taken:
                return candidate
        return f"{name}_"

    def angle(self, angle: Angle) -> str:
        """Return an angle in full."""
        parts = [(self.coordinate(row, turns=True), n) for row, n in angle.coordinates] + list(angle.names)
        if self.is_plain(angle) and is_long_run([row for row, _ in angle.coordinates]) and not self._in_full:
            return f"{parts[0][0]} + … + {parts[-1][0]}"
        text = ""
        for name, n in parts:
            body = name if abs(n) == 1 else f"{self.number(magnitude(n))}*{name}"
            text += (f" {'-' if n < 0 else '+'} " if text else "-" if n < 0 else "") + body
        if angle.degrees:
            text += f"{' + ' if text else ''}{self.number(angle.degrees)}°"
        return text

    def number(self, number: Rational) -> str:
        """Return a decimal fraction, or a quotient."""
        return str(number) if is_simple_quotient(number) else decimal(number)

    def power(self, base: str, exponent: int) -> str:
        """Return a power."""
        return f"{base}^{exponent}"

    def parenthesized(self, text: str) -> str:
        """Return a sum as a factor."""
        return f"({text})"


def form_text(form: Form) -> str:
    """Return a form as text that is at most ``WIDTH`` characters wide; what has no sum to wrap at may be wider."""
    notation = TextNotation(form.table, form.joint_names)
    blocks = ["\n".join(_equation_lines(equation, notation)) for equation in form.equations]
    if form.named:
        lines = [
            line for name, sum_ in form.named.items() for line in _wrapped(f"{name} = ", written(sum_, notation))
        ]
        blocks.append("\n".join(["with", *lines]))
    legend = "\n".join(_legend_lines(form, notation))
    if legend:
        blocks.append(legend)
    if form.conditions:
        blocks.insert(len(form.equations), "\n".join(_condition_lines(form.conditions, notation)))
    blocks += [textwrap.fill(note, WIDTH, break_long_words=False, break_on_hyphens=False) for note in form.notes]
    return "\n\n".join(blocks)


def _legend_lines(form: Form, notation: TextNotation) -> Iterator[str]:
    """Yield lines that say what cosines, coordinates and letters mean."""
    atoms = form.atoms
    moving = moving_angles(atoms)
    items = []
    if moving:
        plain = [a for a in moving if notation.is_plain(a)]
        if plain:
            example = max(plain, key=lambda a: len(a.coordinates))
            c, text = notation.short("c", example), notation.angle(example)
            items += [f"{c} = cos({text})", f"{notation.short('s', example)} = sin({text})"]
        items += [f"{notation.short('c', a)} = cos({notation.angle(a)})" for a in moving if not notation.is_plain(a)]
    rows = sorted(row for atom in atoms if (row := slide_row(atom)) is not None)
    items += [
        f"{notation.coordinate(row, turns=False)}: coordinate of {form.table.spec.rows[row - 1].name}" for row in rows
    ]
    rates = sorted(row for atom in atoms if (row := rate_row(atom)) is not None)
    if rates:
        name = notation.coordinate(rates[0], turns=form.table.spec.rows[rates[0] - 1].type.turns)
        items.append(f"d{name}: velocity of {name}")
    items += [text for letter in used_letters(form.table, atoms) if (text := letter_text(letter, form.table))]
    yield from _listed(items)


def letter_text(letter: Letter, table: SymbolicTable) -> str:
    """Return what a letter stands for: ``a2 = 0.4318 m``."""
    definition = f" = {letter.definition}" if letter.definition else ""
    if letter.kind == "angle":
        return f"{letter.name}{definition} = {math.degrees(letter.value):.10g}°"
    if math.isnan(letter.value):
        return ""
    unit = {"length": f" {table.unit.value}", "acceleration": f" {table.unit.value}/s²"}.get(letter.kind, "")
    return f"{letter.name}{definition} = {letter.value:.12g}{unit}"


def _condition_lines(conditions: Sequence[Condition], notation: TextNotation) -> Iterator[str]:
    yield "singular where"
    for condition in conditions:
        text = f"{written(condition.expression, notation)} = 0"
        details = condition_text(condition, notation)
        yield from _wrapped("", f"{text}{details}")


def condition_text(condition: Condition, notation: TextNotation) -> str:
    """Return what is known of a condition: ``  (wrist): theta_5 = 0° or 180°``."""
    text = f" ({condition.name})" if condition.name else ""
    if condition.angle is not None and condition.degrees:
        values = " or ".join(f"{value:.6g}°" for value in condition.degrees)
        text += f": {notation.angle(condition.angle)} = {values}"
    elif condition.angle is not None:
        text += ": nowhere"
    return text


def _equation_lines(equation: Equation, notation: TextNotation) -> Iterator[str]:
    """Yield a heading and a matrix, or an equation for each entry."""
    cells = [[written(entry, notation) for entry in row] for row in equation.entries]
    if not equation.entry_names:
        yield from _wrapped(f"{equation.name} = ", cells[0][0], indent="")
        return
    yield f"{equation.name} =" if not equation.meaning else f"{equation.name}, {equation.meaning}"
    grid = _matrix_lines(cells)
    if grid is not None:
        yield from grid
        return
    zeros = sum(cell == "0" for row in cells for cell in row) > 4
    label = max(len(name) for row in equation.entry_names for name in row)
    for names, row in zip(equation.entry_names, cells, strict=False):
        for name, cell in zip(names, row, strict=True):
            if not name or (zeros and cell == "0"):
                continue
            yield from _wrapped(f"{name:{label}} = ", cell)
    if zeros:
        yield "  and all other entries are 0"


def _matrix_lines(cells: Sequence[Sequence[str]]) -> list[str] | None:
    """Return a matrix in columns, entries wrapped between terms; None where it would not fit or be too tall."""
    columns = list(zip(*cells, strict=True))
    room = WIDTH - 6 - 3 * (len(columns) - 1)
    least = [max(max(map(len, pieces(cell))) for cell in column) for column in columns]
    whole = [max(map(len, column)) for column in columns]
    if sum(least) > room:
        return None
    widths = list(least)
    for lines in range(1, _TALLEST + 1):
        wanted = [
            next(w for w in range(low, high + 1) if all(len(_filled_cell(cell, w)) <= lines for cell in column))
            if any(len(_filled_cell(cell, low)) > lines for cell in column)
            else low
            for column, low, high in zip(columns, least, whole, strict=True)
        ]
        if sum(wanted) <= room:
            widths = wanted
            break
    else:
        return None
    result = []
    tall = any(len(_filled_cell(cell, w)) > 1 for row in cells for cell, w in zip(row, widths, strict=True))
    for k, row in enumerate(cells):
        parts = [_filled_cell(cell, w) for cell, w in zip(row, widths, strict=True)]
        height = max(map(len, parts))
        if tall and k:
            result.append(f"  [ {' ' * (sum(widths) + 3 * (len(widths) - 1))} ]")
        for line in range(height):
            texts = [part[line] if line < len(part) else "" for part in parts]
            body = "   ".join(f"{text:<{w}}" for text, w in zip(texts, widths, strict=True))
            result.append(f"  [ {body} ]")
    return result


def pieces(text: str) -> list[str]:
    """Return an expression cut before every sign between terms."""
    return re.split(r" (?=[+-] )", text)


def _filled_cell(text: str, width: int) -> list[str]:
    """Return an expression in lines, cut between terms; a term that is too long by itself is cut after a ``*``."""
    lines: list[str] = []
    for piece in pieces(text):
        if len(piece) > width:
            lines += _cut(piece, width)
        elif lines and len(lines[-1]) + 1 + len(piece) <= width:
            lines[-1] += f" {piece}"
        else:
            lines.append(piece)
    return lines


def _cut(term: str, width: int) -> list[str]:
    lines = [""]
    for factor in _FACTORS.findall(term):
        if lines[-1] and len(lines[-1]) + len(factor) > width:
            lines.append("")
        lines[-1] += factor
    return lines


def _wrapped(head: str, text: str, indent: str = "  ") -> Iterator[str]:
    """Yield an assignment in lines, cut between terms."""
    first, *rest = _filled_cell(text, WIDTH - len(indent) - len(head))
    yield f"{indent}{head}{first}"
    for line in rest:
        yield " " * (len(indent) + len(head)) + line


def _listed(items: Sequence[str]) -> Iterator[str]:
    """Yield items in lines, separated by commas and broken between them; what is longer than a line is wrapped."""
    line = ""
    for item in items:
        if line and len(line) + len(item) + 3 > WIDTH:
            yield line + ","
            line = ""
        if len(item) >= WIDTH:
            *whole, item = textwrap.wrap(item, WIDTH - 1, subsequent_indent="  ", break_on_hyphens=False)
            yield from whole
        line += f", {item}" if line else item
    if line:
        yield line
