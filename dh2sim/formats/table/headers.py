"""Headings as people write them: what a column holds, and so which part of a text is the table of DH parameters."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from dh2sim.formats.table.grid import Cell, Cells, Findings
from dh2sim.formats.table.notation import plain
from dh2sim.messages import closest, listed, shown
from dh2sim.robot.units import AngleUnit, LengthUnit


class Quantity(StrEnum):
    """What a column can hold."""

    THETA = "theta"
    D = "d"
    A = "a"
    ALPHA = "alpha"
    BETA = "beta"
    R = "r"
    """a in some books, d in Khalil's."""
    OFFSET = "offset"
    """Adds to the coordinate; in a table without d it is d."""
    TYPE = "type"
    NAME = "name"
    JOINT = "joint"
    """Numbers, names or types of the joints."""
    LOWER = "lower limit"
    UPPER = "upper limit"
    LIMITS = "limits"
    FLIP = "flip"
    SIGN = "sign"
    VARIABLE = "variable"
    """Which parameter of a row is its joint's coordinate, or the coordinate's name."""
    ANGLE = "angle"
    """Theta, where no other column is."""


PARAMETERS: Final = (Quantity.THETA, Quantity.D, Quantity.A, Quantity.ALPHA, Quantity.BETA, Quantity.R)
"""The columns by which a table of Denavit-Hartenberg parameters is recognised."""

ANGLE_WORDS: Final = {
    **dict.fromkeys(
        ("°", "deg", "degs", "degree", "degrees", "grad", "grados", "gradi", "degré", "degrés"), AngleUnit.DEG
    ),
    **dict.fromkeys(("rad", "rads", "radian", "radians"), AngleUnit.RAD),
}
LENGTH_WORDS: Final = {
    **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", "millimetres"), LengthUnit.MM),
    **dict.fromkeys(("cm", "centimeter", "centimeters", "centimetre", "centimetres"), LengthUnit.CM),
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), LengthUnit.M),
    **dict.fromkeys(("in", "inch", "inches"), LengthUnit.IN),
}
UNIT: Final = "°|" + "|".join(sorted((*ANGLE_WORDS.keys() - {"°"}, *LENGTH_WORDS), key=len, reverse=True))

_NAMES: Final = {
    Quantity.THETA: "theta|th|teta|tetha|thetha|thet|vartheta|joint angle|theta angle|angle theta|joint rotation",
    Quantity.D: "d|s|link offset|offset distance",
    Quantity.A: "a|link length|length",
    Quantity.ALPHA: "alpha|alp|twist|twist angle|link twist|link twist angle",
    Quantity.BETA: "beta|second twist",
    Quantity.R: "r",
    Quantity.OFFSET: "offset|off|joint offset|theta offset|thetaoffset|theta0|offset theta|q offset|angle offset",
    Quantity.TYPE: "type|joint type|jointtype|sigma|kind|r/p|rp|p/r",
    Quantity.NAME: "name|joint name|link name|jointname|joint names",
    Quantity.JOINT: "joint|joints|joint no|joint number|joint id|link|links|link no|link number|no|nr|num|number|#|"
    "axis|frame|row|idx|index|id|parameter|parameters|dh parameter|dh parameters",
    Quantity.LOWER: "min|lower|qmin|q min|q-|lower limit|min limit|limit min|limit lower|theta min|thetamin|"
    "joint min|lower bound|minimum|min angle|qlow",
    Quantity.UPPER: "max|upper|qmax|q max|q+|upper limit|max limit|limit max|limit upper|theta max|thetamax|"
    "joint max|upper bound|maximum|max angle|qhigh",
    Quantity.LIMITS: "limits|limit|range|joint limits|joint limit|joint range|position limits|motion range|"
    "range of motion|working range|qlim",
    Quantity.FLIP: "flip|flipped",
    Quantity.SIGN: "sign|direction|dir",
    Quantity.VARIABLE: "variable|variables|joint variable|joint variables|joint var|var|q|coordinate|"
    "joint coordinate|variable parameter|dh variable",
    Quantity.ANGLE: "angle|angles|phi|psi|gamma|rotation|rotation angle|angle of rotation|winkel|gelenkwinkel|angulo",
}
KNOWN: Final = {name: quantity for quantity, names in _NAMES.items() for name in names.split("|")}
_PHRASES: Final = ("link twist angle", "twist angle", "link twist", "link length", "link offset", "joint offset")
_PHRASES_TOO: Final = (
    "joint angle", "joint rotation", "rotation angle", "joint variable", "offset distance", "twist", "length",
    "offset", "rotation", "angle",
)  # fmt: skip
_BRACKETED: Final = re.compile(rf"\s*[\[({{<]\s*(?:in\s+)?({UNIT})\.?\s*[\])}}>]")
_TRAILING: Final = re.compile(rf"\s*[,/;:]\s*(?:in\s+)?({UNIT})\.?$|\s+in\s+({UNIT})\.?$|[\s_.]({UNIT})\.?$|\s*(°)$")
_INDEXED: Final = re.compile(r"(.*?)[\s_]*[\[(]?\s*([ijkn])\s*(-\s*1)?\s*[\])]?")


@dataclass(frozen=True, slots=True, kw_only=True)
class Heading:
    """A heading, read."""

    cell: Cell
    quantity: Quantity | None
    """None where it is not known."""
    index: int | None = None
    """0 for an index i, -1 for i - 1, None where the heading has none."""
    angle: AngleUnit | None = None
    length: LengthUnit | None = None


def read_heading(cell: Cell) -> Heading:
    r"""Return what a heading means: ``$\alpha_{i-1}$ (deg)`` is alpha, of index i - 1, in degrees."""
    name = plain(cell.text).casefold().rstrip("*:. ")
    name, unit = _split_unit(name)
    quantity, index = _quantity(name)
    return Heading(
        cell=cell, quantity=quantity, index=index, angle=ANGLE_WORDS.get(unit), length=LENGTH_WORDS.get(unit)
    )


def _split_unit(name: str) -> tuple[str, str]:
    """Return a heading without its unit, and the unit or nothing."""
    if name in KNOWN:
        return name, ""
    if found := _BRACKETED.search(name):
        return f"{name[: found.start()]} {name[found.end() :]}".strip(), found[1]
    if found := _TRAILING.search(name):
        return name[: found.start()].strip(), next(unit for unit in found.groups() if unit)
    return name, ""


def _quantity(name: str) -> tuple[Quantity | None, int | None]:
    """Return the quantity that a name without unit means, and its index."""
    quantity, index = _symbol(name)
    if quantity is not None or len(name) > 60:
        return quantity, index
    for phrase in (*_PHRASES, *_PHRASES_TOO):
        before, found, after = name.partition(phrase)
        if not found:
            continue
        rest = f"{before} {after}".strip(" ()[]:,=-_")
        other, index = _symbol(rest) if rest else (None, None)
        said = KNOWN.get(phrase)
        if said in (other, None) or not rest:
            return other or said, index
        if said in (Quantity.THETA, Quantity.ANGLE) and other in (*_OF_THETA, Quantity.JOINT):
            return (Quantity.THETA if Quantity.THETA in (said, other) else said), index
        if said is Quantity.ANGLE and other in (Quantity.ALPHA, Quantity.BETA):
            return other, index
        if said is Quantity.OFFSET and other in (Quantity.THETA, Quantity.VARIABLE, Quantity.D):
            return (Quantity.D if other is Quantity.D else Quantity.OFFSET), index
        if said is Quantity.A and other is Quantity.R:
            return Quantity.A, index
        return None, None
    return None, None


_OF_THETA: Final = (Quantity.THETA, Quantity.VARIABLE, Quantity.ANGLE)


def _symbol(name: str) -> tuple[Quantity | None, int | None]:
    words = " ".join(name.replace("_", " ").replace(".", " ").split())
    if words in KNOWN:
        return KNOWN[words], None
    if name in ("", "i", "j", "k", "n"):
        return Quantity.JOINT, None
    if (found := _INDEXED.fullmatch(name)) and (quantity := KNOWN.get(found[1].replace("_", " ").strip())):
        return quantity, -1 if found[3] else 0
    return None, None


_FEWEST_PARAMETERS: Final = 3
"""Parameters that make a row of cells the headings of a DH table."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Columns:
    """The columns that are used."""

    headings: tuple[Heading, ...] = field(repr=False)
    at: Mapping[Quantity, int]
    """Index of the column that holds a quantity."""

    def heading(self, quantity: Quantity) -> Heading | None:
        """Return the heading over a quantity, or None."""
        index = self.at.get(quantity)
        return None if index is None else self.headings[index]

    def cell(self, row: Cells, quantity: Quantity) -> Cell | None:
        """Return a row's cell for a quantity; None where the table has no such column."""
        index = self.at.get(quantity)
        return None if index is None else row[index]


def parameters_in(row: Sequence[Cell]) -> int:
    """Return how many different DH parameters a row of cells has as headings."""
    return len({read_heading(cell).quantity for cell in row} & set(PARAMETERS))


def are_headings(row: Sequence[Cell]) -> bool:
    """Whether a row of cells is the headings of a table of DH parameters."""
    return parameters_in(row) >= _FEWEST_PARAMETERS


_VARIABLES: Final = (
    (Quantity.THETA, re.compile(r"(?:theta|th|teta|phi|psi|angle|joint angle|rotation)[_ ]*(?:\d*|[ijkn])")),
    (Quantity.D, re.compile(r"(?:d|s|r|link offset|displacement|distance|length)[_ ]*(?:\d*|[ijkn])")),
    (Quantity.VARIABLE, re.compile(r"[qx]_?(?:\d*|[ijkn])")),
)
_NO_VARIABLE: Final = ("", "-", "--", "---", "none", "n/a", "na", "fixed", "0")


def variable_in(text: str) -> Quantity | None:
    """Return what a cell that names a row's variable means.

    Returns:
        Theta or d where it is one of them, such as ``θ1`` or ``d``; ``VARIABLE`` for a coordinate such as ``q3``,
        which may be either; None where it is not the name of a variable.
    """
    name = plain(text).casefold().strip(" *()")
    return next((quantity for quantity, pattern in _VARIABLES if pattern.fullmatch(name)), None)


def is_no_variable(text: str) -> bool:
    """Whether a cell says that a row has no variable: it is empty or a dash."""
    return plain(text).casefold() in _NO_VARIABLE


def find_columns(row: Cells, rows: Sequence[Cells], findings: Findings) -> Columns:
    """Return what the columns hold; what is missing, double or ambiguous goes to ``findings``.

    Args:
        row: The headings.
        rows: The rows below them, which need not be as long.
        findings: Takes problems and notes.
    """
    headings = [read_heading(cell) for cell in row]
    has_theta = any(heading.quantity is Quantity.THETA for heading in headings)
    at: dict[Quantity, int] = {}
    for index, heading in enumerate(headings):
        if heading.quantity is None:
            continue
        first = at.setdefault(heading.quantity, index)
        if first == index:
            continue
        if heading.quantity is not Quantity.JOINT and (heading.quantity not in _OF_THETA or not has_theta):
            message = f"two columns hold {heading.quantity}: this one, and the one headed {shown(row[first].text)}"
            findings.wrong(heading.cell, "", message)
    _decide_r(headings, at, findings)
    if Quantity.OFFSET in at and not at.keys() & {Quantity.D, Quantity.BETA}:
        at[Quantity.D] = at.pop(Quantity.OFFSET)
        findings.note(f"column {shown(row[at[Quantity.D]].text)} was read as d, since no other column is d")
    for quantity in (Quantity.ANGLE, Quantity.VARIABLE):
        if quantity in at and Quantity.THETA not in at and not _names_d(_column(rows, at[quantity])):
            at[Quantity.THETA] = at.pop(quantity)
            findings.note(
                f"column {shown(row[at[Quantity.THETA]].text)} was read as theta, since no other column is theta"
            )
    at.pop(Quantity.ANGLE, None)
    _check_missing(headings, at, findings)
    unused = [index for index, heading in enumerate(headings) if index not in at.values()]
    if Quantity.THETA not in at:
        _check_theta([(headings[index], _column(rows, index)) for index in unused], findings)
    if Quantity.VARIABLE in at and not _says_variables(_column(rows, at[Quantity.VARIABLE])):
        unused.append(at.pop(Quantity.VARIABLE))
    for index in sorted(unused):
        if plain(headings[index].cell.text):
            findings.note(f"column {shown(headings[index].cell.text)} was not used")
    return Columns(headings=tuple(headings), at=at)


def _column(rows: Sequence[Cells], index: int) -> list[str]:
    return [row[index].text for row in rows if index < len(row)]


def _names_d(cells: Sequence[str]) -> bool:
    return any(variable_in(text) is Quantity.D for text in cells)


def _says_variables(cells: Sequence[str]) -> bool:
    """Whether a column says which parameter is variable, or that a row has no variable."""
    found = [variable_in(text) for text in cells if not is_no_variable(text)]
    says = len(found) < len(cells) or any(quantity is not Quantity.VARIABLE for quantity in found)
    return bool(found) and None not in found and says


_OTHER: Final = re.compile(
    r"mass|weight|inertia|torque|speed|veloc|accel|effort|force|comment|remark|descr|note|cent(?:er|re)|payload|gear|"
    r"ratio|encoder|motor|servo|material|\bpin\b|limit|max|min|range|power|current|volt|damping|friction|stiff|kg|n.?m\b|%"
)
_ANGLE_OR_COORDINATE: Final = re.compile(r"[-+(]*(?:[\d.*]|pi\b|(?:theta|teta|th|t|q|phi|psi)_?[\dijkn]*\b(?!\w)).*")


def _check_theta(unused: Sequence[tuple[Heading, list[str]]], findings: Findings) -> None:
    """Complain of columns that may be theta, in a table that has no column known as theta."""
    for heading, texts in unused:
        cells = [cell for text in texts if not is_no_variable(cell := plain(text).casefold())]
        counted = cells and all(cell.isdigit() for cell in cells) and _counts([int(cell[:9]) for cell in cells])
        like = [cell for cell in cells if _ANGLE_OR_COORDINATE.fullmatch(cell)]
        if counted or 2 * len(like) <= len(cells) or _OTHER.search(plain(heading.cell.text).casefold()):
            continue
        message = (
            f"the column {shown(heading.cell.text)} holds angles or coordinates, and no column is known as theta"
        )
        findings.wrong(heading.cell, "", f"{message}: call it theta, or leave it out")
    findings.note(
        "no column is theta: joints were read as revolute, without offsets, where nothing else says how they move"
    )


def _counts(numbers: Sequence[int]) -> bool:
    return list(numbers) == list(range(numbers[0], numbers[0] + len(numbers)))


def _decide_r(headings: Sequence[Heading], at: dict[Quantity, int], findings: Findings) -> None:
    """Take a column r for a, unless it may be Khalil's r, which is d (and his d is a)."""
    index = at.pop(Quantity.R, None)
    if index is None:
        return
    alpha = at.get(Quantity.ALPHA)
    if Quantity.A in at and Quantity.D not in at:
        at[Quantity.D] = index
        findings.note(f"column {shown(headings[index].cell.text)} was read as d, since another column is a")
    elif Quantity.A not in at and alpha is not None and abs(alpha - index) == 1:
        at[Quantity.A] = index
    else:
        message = "r is a in some books and, after Khalil, d in others (whose d is a): name the columns a and d"
        findings.wrong(headings[index].cell, "", message)
        at.setdefault(Quantity.A, index)


def _check_missing(headings: Sequence[Heading], at: Mapping[Quantity, int], findings: Findings) -> None:
    along = Quantity.BETA if Quantity.BETA in at and Quantity.D not in at else Quantity.D
    missing = [quantity for quantity in (along, Quantity.A, Quantity.ALPHA) if quantity not in at]
    if not missing:
        return
    unknown = [heading for heading in headings if heading.quantity is None]
    names = {name: KNOWN[name] for name in KNOWN if KNOWN[name] in missing}
    guesses = [(heading, closest(plain(heading.cell.text), names)) for heading in unknown]
    for heading, guess in guesses:
        if guess is not None:
            message = f"unknown heading {shown(heading.cell.text)}. Did you mean {shown(guess)}?"
            findings.wrong(heading.cell, "", message)
    found = listed(shown(heading.cell.text) for heading in headings)
    message = f"no column for {' and '.join(missing)}; a DH table has columns for theta, d, a, alpha"
    findings.wrong(headings[0].cell, "", f"{message}. Found headings: {found}")
