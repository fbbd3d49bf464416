"""Forms as LaTeX: a document that compiles as it stands, or formulas for a page that can show them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from typing import Final

from dh2sim.symbolic.angles import Angle, rate_row, slide_row, trig_of
from dh2sim.symbolic.form import Condition, Equation, Form, moving_angles, used_letters
from dh2sim.symbolic.notation import decimal, is_long_run, is_simple_quotient, written
from dh2sim.symbolic.polynomial import Atom, Rational, magnitude
from dh2sim.symbolic.table import Letter, SymbolicTable

PAGE: Final = 44.0
"""Width of a line of formulas in em: A4 with margins of 2 cm at 10 pt leaves 48."""
_MOST_BEFORE_ZERO: Final = 22.0
"""Width of an expression that is written in front of ``= 0``, em; a wider one is behind, where it can be broken."""
_MOST_ALIGNED: Final = 60
"""Lines that are aligned with one another: TeX keeps all of them in memory."""
_NEW_LINE: Final = " \\\\\n"
_GREEK: Final = frozenset(
    "alpha beta gamma delta epsilon zeta eta theta kappa lambda mu xi phi psi rho tau".split()  # noqa: SIM905
)


class LatexNotation:
    """Writes cosines as c with an index, and names of sums as sigma with a number, as MATLAB has them."""

    times = r"\,"

    def __init__(self, table: SymbolicTable, joint_names: str) -> None:
        """``joint_names`` is 'theta', with sliding coordinates d_i, or 'q'."""
        self._joint = joint_names
        self._turns = [row.type.turns for row in table.spec.rows]
        self._letters: dict[str, str] = {}
        for name in table.letters:
            written_ = latex_name(name)
            self._letters[name] = _verbatim(name) if written_ in self._letters.values() else written_
        self._taken = set(self._letters.values())
        self._separator = "," if len(table.spec.rows) > 9 else ""

    def atom(self, atom: Atom) -> str:
        """Return an atom as it is written."""
        if atom.startswith("#"):
            return rf"\sigma_{{{atom[1:]}}}"
        row = slide_row(atom)
        if row is not None:
            return self.coordinate(row, turns=False)
        row = rate_row(atom)
        if row is not None:
            name = self.coordinate(row, turns=self._turns[row - 1])
            return rf"\dot{{{name[: name.index('_')]}}}{name[name.index('_') :]}"
        if atom.startswith("sqrt("):
            return rf"\sqrt{{{atom[5:-1]}}}"
        trig = trig_of(atom)
        return self.letter(atom) if trig is None else self.trig(trig.function, trig.angle)

    def letter(self, name: str) -> str:
        """Return a constant as it is written: a_2 for a2, unless another one is written like that."""
        return self._letters.get(name) or latex_name(name)

    def trig(self, function: str, angle: Angle) -> str:
        """Return c_{12} for plain sums of coordinates, a cosine in full for other angles."""
        plain = not angle.names and not angle.degrees and all(n == 1 for _, n in angle.coordinates)
        if plain and angle.coordinates:
            numbers = [row for row, _ in angle.coordinates]
            if is_long_run(numbers):
                return rf"{function[0]}_{{{numbers[0]}\dots{numbers[-1]}}}"
            rows = self._separator.join(map(str, numbers))
            name = f"{function[0]}_{{{rows}}}"
            if name not in self._taken:
                return name
        return rf"\{function}({self.angle(angle)})"

    def coordinate(self, row: int, *, turns: bool) -> str:
        """Return what the coordinate of a row is called."""
        usual = (r"\theta" if turns else "d") if self._joint == "theta" else "q"
        candidates = [f"{letter}_{{{row}}}" for letter in (usual, "q", r"\tilde{q}")]
        return next(name for name in candidates if name not in self._taken)

    def angle(self, angle: Angle) -> str:
        """Return an angle in full, without spaces."""
        parts = [(self.coordinate(row, turns=True), n) for row, n in angle.coordinates]
        plain = not angle.names and not angle.degrees and all(n == 1 for _, n in angle.coordinates)
        if plain and is_long_run([row for row, _ in angle.coordinates]):
            return rf"{parts[0][0]}+\dots+{parts[-1][0]}"
        parts += [(self.letter(name), n) for name, n in angle.names]
        text = ""
        for name, n in parts:
            body = name if abs(n) == 1 else rf"{self.number(magnitude(n))}\,{name}"
            text += ("-" if n < 0 else "+" if text else "") + body
        if angle.degrees:
            text += f"{'+' if text else ''}{self.number(angle.degrees)}^\\circ"
        return text

    def number(self, number: Rational) -> str:
        """Return a decimal fraction, or a quotient."""
        if not is_simple_quotient(number):
            return decimal(number)
        return rf"\tfrac{{{number.numerator}}}{{{number.denominator}}}"

    def power(self, base: str, exponent: int) -> str:
        """Return a power."""
        return f"{base}^{{{exponent}}}" if "^" not in base else f"({base})^{{{exponent}}}"

    def parenthesized(self, text: str) -> str:
        """Return a sum as a factor."""
        return f"({text})"


def latex_name(name: str) -> str:
    """Return a letter with its number as an index: a2, alpha_2, base_x; lc2 and Ixx2 as dynamics has them."""
    inertial = re.fullmatch(r"([lI])(c|xx|yy|zz)([0-9]+)", name)
    if inertial is not None:
        return f"{inertial[1]}_{{{inertial[2]}{inertial[3]}}}"
    found = re.fullmatch(r"([A-Za-z]+)_?([A-Za-z0-9_]*?)_*", name)
    if found is None:
        return _verbatim(name)
    word, index = found[1], found[2].replace("_", r"\_")
    head = rf"\{word}" if word in _GREEK else word if len(word) == 1 else rf"\mathrm{{{word}}}"
    if not index:
        return head
    return f"{head}_{{{index}}}" if index.isdigit() else rf"{head}_{{\mathrm{{{index}}}}}"


def _verbatim(name: str) -> str:
    escaped = name.replace("_", r"\_")
    return rf"\mathrm{{{escaped}}}"


def latex_document(form: Form, title: str) -> str:
    """Return a whole LaTeX document, which needs amsmath and geometry."""
    lines = [
        r"\documentclass[10pt,a4paper]{article}",
        r"\usepackage[utf8]{inputenc}",
        r"\usepackage{amsmath}",
        r"\usepackage[margin=2cm]{geometry}",
        r"\allowdisplaybreaks",
        r"\setlength{\parindent}{0pt}",
        r"\begin{document}",
        rf"\section*{{{_escaped(title)}}}",
    ]
    for heading, formulas in latex_parts(form):
        if heading:
            lines += ["", _escaped(heading)]
        for block in _aligned_blocks(formulas):
            lines += [r"\begin{align*}", block, r"\end{align*}"]
    lines += [line for note in form.notes for line in ("", _escaped(note))]
    return "\n".join([*lines, r"\end{document}"]) + "\n"


def _aligned_blocks(formulas: Sequence[str]) -> Iterator[str]:
    text = "\n".join(formulas)
    rows = [text] if r"\begin{bmatrix}" in text else text.split(_NEW_LINE)
    for first in range(0, len(rows), _MOST_ALIGNED):
        yield _NEW_LINE.join(rows[first : first + _MOST_ALIGNED])


def latex_parts(form: Form) -> Iterator[tuple[str, list[str]]]:
    """Yield headings and lines for an ``align*`` or ``aligned`` environment."""
    notation = LatexNotation(form.table, form.joint_names)
    for equation in form.equations:
        yield equation.meaning, list(_equation_lines(equation, notation))
    if form.conditions:
        yield "Singular where", _rows([_condition(condition, notation) for condition in form.conditions])
    if form.named:
        lines = [_broken(notation.atom(name), written(sum_, notation)) for name, sum_ in form.named.items()]
        yield "with", _rows(lines)
    legend = list(_legend(form, notation))
    if legend:
        yield "where", _rows(legend)


def _equation_lines(equation: Equation, notation: LatexNotation) -> Iterator[str]:
    cells = [[written(entry, notation) for entry in row] for row in equation.entries]
    name = _equation_name(equation.name)
    if not equation.entry_names:
        yield _broken(name, cells[0][0])
        return
    columns = list(zip(*cells, strict=True))
    if sum(max(map(_width, column)) + 1.0 for column in columns) + _width(name) + 3.0 <= PAGE:
        yield f"{name} &= \\begin{{bmatrix}}"
        yield from _rows([" & ".join(row) for row in cells])
        yield r"\end{bmatrix}"
        return
    zeros = sum(cell == "0" for row in cells for cell in row) > 4
    lines = [
        _broken(_entry_name(entry), cell)
        for names, row in zip(equation.entry_names, cells, strict=True)
        for entry, cell in zip(names, row, strict=True)
        if entry and not (zeros and cell == "0")
    ]
    if zeros:
        lines.append(r"& \text{and all other entries are } 0")
    yield from _rows(lines)


def _rows(lines: Sequence[str]) -> list[str]:
    return [rf"{line} \\" for line in lines[:-1]] + list(lines[-1:])


def _broken(name: str, text: str) -> str:
    """Return an equation, broken between terms where it is wider than the page."""
    room = PAGE - _width(name) - 2.0
    lines: list[str] = []
    for piece in re.split(r" (?=[+-] )", text):
        if lines and _width(f"{lines[-1]} {piece}") <= room - (2.0 if len(lines) > 1 else 0.0):
            lines[-1] += f" {piece}"
        else:
            lines.append(piece)
    return f"{name} &= " + " \\\\\n  &\\qquad {} ".join(lines)


_PIECES: Final = re.compile(r"\\(?:tfrac|sqrt|mathrm)|\\[a-z]+|\\,|_\{[^{}]*\}|\^\{[^{}]*\}|[+-]|[{}& ]|.")


def _width(text: str) -> float:
    """Return about how wide a formula is, em."""
    width = 0.0
    for piece in _PIECES.findall(text):
        if piece in ("\\tfrac", "\\sqrt", "\\mathrm") or piece in "{}& ":
            continue
        if piece == "\\,":
            width += 0.17
        elif piece in ("\\cos", "\\sin"):
            width += 1.5
        elif piece.startswith(("_", "^")):
            width += 0.38 * (len(piece) - 3)
        elif piece in "+-":
            width += 1.25
        else:
            width += 0.55
    return width


def _equation_name(name: str) -> str:
    """Return the name of a matrix with its indices: of T_0_6 the first one raised in front."""
    if name.startswith("det J"):
        return r"\det J" + (rf"_{{{name[6:-1].replace(', ', ',')}}}" if name != "det J" else "")
    head, *indices = name.split("_")
    words = [index if index.isdigit() else rf"\mathrm{{{index}}}" for index in indices]
    if len(words) == 2:
        return rf"{{}}^{{{words[0]}}}{head}_{{{words[1]}}}"
    return f"{head}_{{{words[0]}}}" if words else head


def _entry_name(name: str) -> str:
    return rf"{name[0]}_{{{name[1:]}}}"


def _condition(condition: Condition, notation: LatexNotation) -> str:
    expression = written(condition.expression, notation)
    text = f"{expression} &= 0" if _width(expression) <= _MOST_BEFORE_ZERO else _broken("0", expression)
    if condition.name:
        text += rf" \quad\text{{({condition.name})}}"
    if condition.angle is not None and condition.degrees:
        values = r"\text{ or }".join(f"{value:.6g}^\\circ" for value in condition.degrees)
        text += rf" \quad {notation.angle(condition.angle)} = {values}"
    return text


def _legend(form: Form, notation: LatexNotation) -> Iterator[str]:
    short = [a for a in moving_angles(form.atoms) if notation.trig("cos", a).startswith("c_")]
    if short:
        example = max(short, key=lambda a: len(a.coordinates))
        c, s, text = notation.trig("cos", example), notation.trig("sin", example), notation.angle(example)
        yield rf"{c} &= \cos({text}), \quad {s} = \sin({text})"
    for letter in used_letters(form.table, form.atoms):
        if math.isnan(letter.value):
            continue
        yield _letter(letter, form.table, notation)


def _letter(letter: Letter, table: SymbolicTable, notation: LatexNotation) -> str:
    name = notation.letter(letter.name)
    if letter.kind == "angle":
        return rf"{name} &= {math.degrees(letter.value):.10g}^\circ"
    power = {"length": "", "acceleration": "/s^2"}.get(letter.kind)
    unit = "" if power is None else rf"\,\mathrm{{{table.unit.value}{power}}}"
    return f"{name} &= {letter.value:.12g}{unit}"


def _escaped(text: str) -> str:
    """Return words with the characters that LaTeX reads as commands escaped."""
    text = re.sub(r"([&%$#_{}])", r"\\\1", text.replace("\\", r"\textbackslash "))
    return text.replace("^", r"\^{}").replace("~", r"\~{}").replace("θ", r"$\theta$").replace("°", r"$^\circ$")


def latex_fragment(form: Form) -> str:
    """Return formulas between dollar signs, for a notebook."""
    parts = ["\n".join([r"\begin{aligned}", *formulas, r"\end{aligned}"]) for _, formulas in latex_parts(form)]
    return "\n".join(f"$${part}$$" for part in parts)


def markdown(form: Form, title: str) -> str:
    """Return Markdown with formulas that GitHub and notebooks show."""
    lines = [f"## {title}"]
    for heading, formulas in latex_parts(form):
        if heading:
            lines += ["", f"{_markdown_escaped(heading)}:"]
        lines += ["", "$$", r"\begin{aligned}", *formulas, r"\end{aligned}", "$$"]
    lines += [line for note in form.notes for line in ("", _markdown_escaped(note))]
    return "\n".join(lines) + "\n"


def _markdown_escaped(text: str) -> str:
    return re.sub(r"([\\`*_{}\[\]<>#|])", r"\\\1", text)
