"""Headings as people write them: what a column holds, and so which part of a text is the table of DH parameters."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import PurePath
from typing import Final

from dh2sim.formats.table.grid import (
    MAX_COLUMNS,
    Cell,
    Cells,
    Findings,
    Grid,
    is_comment,
    pipe_grids,
    separated_grid,
    split,
)
from dh2sim.formats.table.notation import plain
from dh2sim.messages import closest, listed, shown
from dh2sim.robot.spec import AngleUnit, LengthUnit


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


PARAMETERS: Final = (Quantity.THETA, Quantity.D, Quantity.A, Quantity.ALPHA, Quantity.BETA, Quantity.R)
"""The columns by which a table of Denavit-Hartenberg parameters is recognised."""

ANGLE_WORDS: Final = {
    **dict.fromkeys(("°", "deg", "degs", "degree", "degrees"), AngleUnit.DEG),
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
    Quantity.THETA: "theta|th|joint angle|theta angle",
    Quantity.D: "d|s|link offset|offset distance",
    Quantity.A: "a|link length|length",
    Quantity.ALPHA: "alpha|alp|twist|twist angle|link twist|link twist angle",
    Quantity.BETA: "beta|second twist",
    Quantity.R: "r",
    Quantity.OFFSET: "offset|off|joint offset|theta offset|thetaoffset|theta0|offset theta|q offset|angle offset",
    Quantity.TYPE: "type|joint type|jointtype|sigma|kind|r/p|rp|p/r",
    Quantity.NAME: "name|joint name|link name|jointname|joint names",
    Quantity.JOINT: "joint|joints|joint no|joint number|joint id|link|links|link no|link number|no|nr|num|number|#|"
    "axis|frame|row|idx|index|id",
    Quantity.LOWER: "min|lower|qmin|q min|q-|lower limit|min limit|limit min|limit lower|theta min|thetamin|"
    "joint min|lower bound|minimum|min angle|qlow",
    Quantity.UPPER: "max|upper|qmax|q max|q+|upper limit|max limit|limit max|limit upper|theta max|thetamax|"
    "joint max|upper bound|maximum|max angle|qhigh",
    Quantity.LIMITS: "limits|limit|range|joint limits|joint limit|joint range|position limits|motion range|"
    "range of motion|working range|qlim",
    Quantity.FLIP: "flip|flipped",
    Quantity.SIGN: "sign|direction|dir",
    Quantity.VARIABLE: "variable|joint variable|joint var|var|q|coordinate|joint coordinate",
}
KNOWN: Final = {name: quantity for quantity, names in _NAMES.items() for name in names.split("|")}
_PHRASES: Final = ("link twist angle", "twist angle", "link twist", "link length", "link offset", "joint offset")
_PHRASES_TOO: Final = ("joint angle", "joint variable", "offset distance", "twist", "length", "offset", "angle")
_BRACKETED: Final = re.compile(rf"\s*[\[(]\s*(?:in\s+)?({UNIT})\s*[\])]")
_TRAILING: Final = re.compile(rf"\s*[,/;]\s*(?:in\s+)?({UNIT})$|\s+in\s+({UNIT})$|[\s_]({UNIT})$|\s*(°)$")
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
        if said is Quantity.OFFSET and other in (Quantity.THETA, Quantity.VARIABLE, Quantity.D):
            return (Quantity.D if other is Quantity.D else Quantity.OFFSET), index
        if said is Quantity.A and other is Quantity.R:
            return Quantity.A, index
        return None, None
    return None, None


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


def parameters_in(row: Cells) -> int:
    """Return how many different DH parameters a row of cells has as headings."""
    return len({read_heading(cell).quantity for cell in row} & set(PARAMETERS))


def are_headings(row: Cells) -> bool:
    """Whether a row of cells is the headings of a table of DH parameters."""
    return parameters_in(row) >= _FEWEST_PARAMETERS


def find_columns(row: Cells, findings: Findings) -> Columns:
    """Return what the columns hold; what is missing, double or ambiguous goes to ``findings``."""
    headings = [read_heading(cell) for cell in row]
    at: dict[Quantity, int] = {}
    for index, heading in enumerate(headings):
        if heading.quantity is None:
            continue
        first = at.setdefault(heading.quantity, index)
        if first == index:
            continue
        if heading.quantity is Quantity.JOINT:
            _note_unused(heading, findings)
        else:
            message = f"two columns hold {heading.quantity}: this one, and the one headed {shown(row[first].text)}"
            findings.wrong(heading.cell, "", message)
    _decide_r(headings, at, findings)
    if Quantity.OFFSET in at and not at.keys() & {Quantity.D, Quantity.BETA}:
        at[Quantity.D] = at.pop(Quantity.OFFSET)
        findings.note(f"column {shown(row[at[Quantity.D]].text)} was read as d, since no other column is d")
    if Quantity.VARIABLE in at and Quantity.THETA not in at:
        at[Quantity.THETA] = at.pop(Quantity.VARIABLE)
        findings.note(
            f"column {shown(row[at[Quantity.THETA]].text)} was read as theta, since no other column is theta"
        )
    _check_missing(headings, at, findings)
    for index, heading in enumerate(headings):
        unused = heading.quantity in (None, Quantity.VARIABLE) and index not in at.values()
        if (unused or at.get(Quantity.VARIABLE) == index) and plain(heading.cell.text):
            _note_unused(heading, findings)
    return Columns(headings=tuple(headings), at=at)


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


def _note_unused(heading: Heading, findings: Findings) -> None:
    findings.note(f"column {shown(heading.cell.text)} was not used")


_SEPARATED: Final = (".csv", ".tsv", ".tab")
_MAX_HEADING_LINES: Final = 2000
"""Lines that are searched for the headings of a table between separators."""
_DELIMITER: Final = re.compile(r":?-+:?")
"""A cell of the row that Markdown has under the headings."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Table:
    """A table of DH parameters."""

    header: Cells
    rows: tuple[Cells, ...] = field(repr=False)
    grid: Grid = field(repr=False)
    pipes: tuple[Grid, ...] = field(repr=False)
    """All tables between pipes in the file."""

    @property
    def lines(self) -> range:
        """Numbers of its lines, from that of its headings to that of its last row."""
        return range(self.header[0].line, self.grid.lines.stop)


def locate(lines: Sequence[str], file: str) -> Table | None:
    """Return the first table of DH parameters in a text; failing that, the table that is most like one.

    Args:
        lines: The file's lines.
        file: Its name, whose ending decides where to look first.
    """
    pipes = tuple(pipe_grids(lines))
    if PurePath(file).suffix.casefold() in _SEPARATED:
        table = _between_separators(lines, pipes) or _between_pipes(pipes)
    else:
        table = _between_pipes(pipes) or _between_separators(lines, pipes)
    return table or _most_alike(lines, pipes)


def others(table: Table) -> Iterator[int]:
    """Yield the lines on which further tables of DH parameters start, which are not read."""
    for grid in table.pipes:
        if (
            grid.lines.start > table.lines.start
            and grid is not table.grid
            and any(are_headings(row) for row in grid.rows[:3])
        ):
            yield grid.lines.start


def _between_pipes(pipes: Sequence[Grid]) -> Table | None:
    for grid in pipes:
        for index, row in enumerate(grid.rows[:5]):
            if are_headings(row[:MAX_COLUMNS]):
                rows = grid.rows[index + 1 :]
                if rows and all(_DELIMITER.fullmatch(cell.text) for cell in rows[0]):
                    rows = rows[1:]
                return Table(header=row, rows=rows, grid=grid, pipes=tuple(pipes))
    return None


def _between_separators(lines: Sequence[str], pipes: Sequence[Grid]) -> Table | None:
    """Return the table under the first line that has headings; one in a comment only where no other has."""
    for comments in (False, True):
        for index, line in enumerate(lines[:_MAX_HEADING_LINES]):
            if is_comment(line) is not comments or not line.strip():
                continue
            grids = [
                separated_grid(lines, index, separator)
                for separator in "\t;, "
                if separator in line and _has_headings(line, separator)
            ]
            if grids:
                even = (grid for grid in grids if len({len(row) for row in grid.rows[:2]}) == 1)
                grid = next(even, grids[0])
                return Table(header=grid.rows[0], rows=grid.rows[1:], grid=grid, pipes=tuple(pipes))
    return None


def _has_headings(line: str, separator: str) -> bool:
    try:
        cells = split(line[:2000], 1, separator)
    except ValueError:
        return False
    return len(cells) <= MAX_COLUMNS and are_headings(cells)


def _most_alike(lines: Sequence[str], pipes: Sequence[Grid]) -> Table | None:
    candidates = [(parameters_in(grid.rows[0][:MAX_COLUMNS]), -i, grid) for i, grid in enumerate(pipes[:100])]
    for index, line in enumerate(lines[:_MAX_HEADING_LINES]):
        for separator in "\t;,":
            if separator in line[:2000] and not is_comment(line):
                grid = separated_grid(lines[: index + 1], index, separator)
                if grid.rows:
                    candidates.append((parameters_in(grid.rows[0][:MAX_COLUMNS]), -index, grid))
    best = max(candidates, key=lambda candidate: candidate[:2], default=None)
    if best is None or best[0] < 1:
        return None
    return Table(header=best[2].rows[0], rows=best[2].rows[1:], grid=best[2], pipes=tuple(pipes))
