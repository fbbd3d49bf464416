"""Which convention a table is in, from its headings and the text around it; never guessed."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from dh2sim.formats.table.grid import PIPES, Findings
from dh2sim.formats.table.headers import Columns, Quantity
from dh2sim.messages import shown
from dh2sim.robot.row import Convention

_ABOVE: Final = 12
_BELOW: Final = 4
"""Lines around a table that count as its caption."""


def _word(pattern: str) -> re.Pattern[str]:
    """Return a pattern of a whole word; an underscore is not part of one."""
    return re.compile(rf"(?<![A-Za-z])(?:{pattern})(?![A-Za-z])", re.IGNORECASE)


_SUBJECT: Final = _word("m?dh|d-h|d&h|denavit|hartenberg|conventions?|notation")
_WORDS: Final = {
    Convention.STANDARD: (
        _word("distal|stddh|std dh|dhstd"),
        _word("standard|classic|classical|conventional|paul|spong"),
    ),
    Convention.MODIFIED: (_word("proximal|moddh|mod dh|dhmod|mdh|craig|craig's"), _word("modified|khalil")),
}
"""Words that decide by themselves, and words that decide in a line about DH tables."""
_HOW: Final = (
    "pass convention='standard' or convention='modified'. Headings a_(i-1), alpha_(i-1) would say modified; "
    "docs/conventions.md shows how to find out"
)


@dataclass(frozen=True, slots=True)
class Evidence:
    """A convention, and the evidence for it."""

    convention: Convention
    by: str
    """Such as ``the heading 'a_(i-1)'``."""


def decide_convention(
    option: Convention | None,
    printed: Evidence | None,
    columns: Columns,
    lines: Sequence[str],
    table: range,
    findings: Findings,
) -> Convention | None:
    """Return the convention of a table's rows, or None where it is ambiguous (``findings`` has the problem then).

    Args:
        option: The user's choice.
        printed: From the first line of a toolbox's printout, or from a script.
        columns: The columns; headings of index i - 1 mean modified, headings of index i throughout standard.
        lines: The file.
        table: Numbers of the table's lines, counted from 1.
        findings: Takes problems and notes.
    """
    wrong_before = len(findings.problems)
    first = columns.headings[0].cell
    said = [] if printed is None else [printed]
    asked = option if option in (Convention.STANDARD, Convention.MODIFIED) else None
    said += _by_headings(columns, asked, findings)
    said += [] if printed is not None else _by_words(lines, table)
    wanted = [Evidence(asked, f"convention='{asked}'")] if asked is not None else []
    for one, other in itertools.pairwise([*wanted, *said]):
        if one.convention is not other.convention:
            message = f"{one.by} says {one.convention}, but {other.by} says {other.convention}"
            findings.wrong(first, "", f"{message}; correct the one that is wrong")
            return None
    if wanted or said:
        return (wanted or said)[0].convention
    if len(findings.problems) > wrong_before:
        return None
    if _indexed_throughout(columns):
        findings.note(
            "nothing but the headings' index i says the convention: it was read as standard; a table after Craig is "
            "modified"
        )
        return Convention.STANDARD
    findings.wrong(first, "", f"nothing says which convention the table is in; {_HOW}")
    return None


def caption(lines: Sequence[str], table: range) -> list[str]:
    """Return the lines around a table that may be about it."""
    return [lines[number - 1] for number in (*_above(lines, table), *_below(lines, table))]


def _by_headings(columns: Columns, asked: Convention | None, findings: Findings) -> list[Evidence]:
    indices = {
        quantity: heading.index
        for quantity in (Quantity.A, Quantity.ALPHA, Quantity.D, Quantity.THETA)
        if (heading := columns.heading(quantity)) and heading.index is not None
    }
    shifted = [quantity for quantity in indices if indices[quantity] == -1]
    if not shifted:
        return []
    link = [quantity for quantity in shifted if quantity in (Quantity.A, Quantity.ALPHA)]
    straight = [quantity for quantity in (Quantity.A, Quantity.ALPHA) if indices.get(quantity) == 0]
    heading = columns.heading(link[0] if link else shifted[0])
    if heading is not None and (len(shifted) > len(link) or straight):
        if asked is not None:
            findings.note(f"the headings' indices contradict each other: the table was read as {asked}, as asked for")
            return []
        message = "a and alpha have index i - 1 in a modified table and i in a standard one, d and theta always i"
        how = "correct them, or pass convention='modified' or convention='standard'"
        findings.wrong(heading.cell, "", f"the headings' indices contradict each other: {message}; {how}")
        return []
    return [] if heading is None else [Evidence(Convention.MODIFIED, f"the heading {shown(heading.cell.text)}")]


def _indexed_throughout(columns: Columns) -> bool:
    headings = [columns.heading(quantity) for quantity in (Quantity.A, Quantity.ALPHA, Quantity.THETA)]
    return all(heading is not None and heading.index == 0 for heading in headings)


def _by_words(lines: Sequence[str], table: range) -> list[Evidence]:
    """Return the evidence in the caption, the words above the table before those below; both if contradictory."""
    for numbers in (_above(lines, table), _below(lines, table)):
        said: dict[Convention, Evidence] = {}
        for number in numbers:
            line = lines[number - 1][:1000]
            for convention, (strong, weak) in _WORDS.items():
                found = strong.search(line) or (weak.search(line) if _SUBJECT.search(line) else None)
                if found:
                    said.setdefault(convention, Evidence(convention, f"{shown(found.group())} on line {number}"))
        if said:
            return list(said.values())
    return []


def _above(lines: Sequence[str], table: range) -> Iterator[int]:
    for number in range(table.start - 1, max(0, table.start - 1 - _ABOVE), -1):
        if _is_table(lines[number - 1]):
            return
        yield number
        if lines[number - 1].lstrip().startswith("#") and not lines[number - 1].lstrip().startswith("# "):
            return


def _below(lines: Sequence[str], table: range) -> Iterator[int]:
    for number in range(table.stop, min(len(lines) + 1, table.stop + _BELOW)):
        if _is_table(lines[number - 1]) or lines[number - 1].lstrip().startswith("#"):
            return
        yield number


def _is_table(line: str) -> bool:
    return sum(line.count(pipe) for pipe in PIPES) >= 2
