"""Which column of a table holds what."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from dh2sim.formats.tables.findings import Findings
from dh2sim.formats.tables.grid import Cell, Cells
from dh2sim.formats.tables.headers import KNOWN, PARAMETERS, Heading, Quantity, read_heading
from dh2sim.formats.tables.plain import plain
from dh2sim.robot.words import closest, listed, shown

_ONE_OF: Final = "theta, d, a, alpha"
_WORTH: Final = 3
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
    """Return whether a row of cells is the headings of a table of DH parameters."""
    return parameters_in(row) >= _WORTH


def find_columns(row: Cells, findings: Findings) -> Columns:
    """Return what the columns hold; what is missing, double or cannot be told goes to ``findings``."""
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
    _settle_r(headings, at, findings)
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


def _settle_r(headings: Sequence[Heading], at: dict[Quantity, int], findings: Findings) -> None:
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
    message = f"no column for {' and '.join(missing)}; a DH table has columns for {_ONE_OF}. Found headings: {found}"
    findings.wrong(headings[0].cell, "", message)


def _note_unused(heading: Heading, findings: Findings) -> None:
    findings.note(f"column {shown(heading.cell.text)} was not used")
