"""Tables of cells that know their place in the file, and the findings on them: problems and notes."""

from __future__ import annotations

import bisect
import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final, TypeAlias

from dh2sim.errors import ImportedFileError, Problem
from dh2sim.robot.magnitudes import MOST_ROWS

MAX_ROWS: Final = MOST_ROWS
MAX_COLUMNS: Final = 50
_MOST_CELLS: Final = 2 * MAX_COLUMNS
"""Of a row whose cells have spans."""

PREFIX: Final = re.compile(r"\s*(?:[%#>*]+|//+)?\s*")
"""What comes before a table inside a comment or a quotation."""
PIPES: Final = "|│┃║"
_PIPE: Final = re.compile(r"(?<!\\)[|│┃║]")
_DASHES: Final = frozenset("-=─━═")
_RULES: Final = _DASHES | frozenset("+:|│┌┐└┘├┤┬┴┼┃┏┓┗┛┣┫┳┻╋┠┨┯┷┿║╔╗╚╝╠╣╦╩╬ \t")
DELIMITER: Final = re.compile(r":?-+:?")
"""A cell of the row that Markdown has under the headings."""
_MARKDOWN_RULE: Final = re.compile(r"[-|:\s]*\|[-|:\s]*")
_OLD_MARK: Final = re.compile(r"\((?:std|mod)\)$")
"""Ends every row of the first toolboxes' printouts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """The text between two separators."""

    text: str
    """Without the spaces around it."""
    line: int
    """From 1."""
    column: int
    """Column of its first character, from 1."""


Cells: TypeAlias = tuple[Cell, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Grid:
    """Rows of cells: a table, of which no heading has been found yet."""

    rows: tuple[Cells, ...] = field(repr=False)
    separator: str
    """``|``, ``,``, ``;``, a tab or a space."""
    filled: bool = False
    """Whether rows may be shorter than the headings, as in Markdown, LaTeX and HTML."""
    problems: tuple[tuple[int, int, str], ...] = ()
    """Line, column and what is wrong with a line, such as a quote that is never closed."""

    @property
    def lines(self) -> range:
        """The lines from the first row to the last."""
        return range(self.rows[0][0].line, max(cell.line for cell in self.rows[-1]) + 1)


class SpannedRows:
    """Rows of cells that may be several columns wide and several rows high, as in HTML."""

    def __init__(self) -> None:
        """Start without a row."""
        self._rows: list[list[Cell | None]] = []
        self._row = -1

    def next_row(self) -> None:
        """Begin a row."""
        self._row += 1
        if self._row == len(self._rows):  # it is there already where a cell above is more than one row high
            self._rows.append([])

    def add(self, cell: Cell, *, columns: int = 1, rows: int = 1) -> None:
        """Put a cell into the first free place of the row; what follows it in its span is empty."""
        if self._row < 0:
            self.next_row()
        if len(self._rows) > MAX_ROWS + 10 or len(self._rows[self._row]) > _MOST_CELLS:
            return
        here = self._rows[self._row]
        at = next((k for k, other in enumerate(here) if other is None), len(here))
        for below in range(rows):
            if self._row + below >= len(self._rows):
                self._rows.append([])
            target = self._rows[self._row + below]
            target += [None] * (at - len(target))
            target[at : at + columns] = [
                cell if k == 0 else Cell(text="", line=cell.line, column=cell.column) for k in range(columns)
            ]

    def rows(self) -> tuple[Cells, ...]:
        """Return the rows in which something is written."""
        return tuple(_whole(row) for row in self._rows if any(cell is not None and cell.text for cell in row))


def _whole(row: Sequence[Cell | None]) -> Cells:
    known = next(cell for cell in row if cell is not None)
    if len(row) > 2 and len({(cell.line, cell.column) for cell in row if cell is not None}) == 1:
        return (known,)  # a title or a remark, across all columns
    return tuple(Cell(text="", line=known.line, column=known.column) if cell is None else cell for cell in row)


def span_of(text: str | None) -> int:
    """Return how many columns or rows an attribute of HTML says."""
    return min(max(int(text), 1), MAX_COLUMNS) if text is not None and text.isdecimal() and len(text) < 4 else 1


class TextPlaces:
    """Lines and columns of the offsets in a text whose lines are joined by line feeds."""

    def __init__(self, lines: Sequence[str]) -> None:
        """Find where the lines start."""
        self._starts = [0, *itertools.accumulate(len(line) + 1 for line in lines)]

    def offset(self, index: int) -> int:
        """Return where the line of an index, from 0, starts."""
        return self._starts[min(index, len(self._starts) - 1)]

    def at(self, offset: int) -> tuple[int, int]:
        """Return line and column of an offset, from 1."""
        line = max(bisect.bisect_right(self._starts, offset, hi=len(self._starts) - 1), 1)
        return line, offset - self._starts[line - 1] + 1


def pipe_grids(lines: Sequence[str]) -> Iterator[Grid]:
    """Yield the tables with pipes or the lines of a box between their cells, as in Markdown."""
    rows: list[Cells] = []
    markdown = False
    for number, line in enumerate([*lines, ""], start=1):
        body = line[_prefix(line) :]
        ruled = _is_rule(body)
        if ruled and len(rows) == 1:
            markdown = _MARKDOWN_RULE.fullmatch(body) is not None
        cells = () if ruled else _piped(line, number)
        if cells and not _is_pose_row(cells):
            rows.append(cells)
        elif not ruled and rows:
            yield Grid(rows=tuple(rows), separator="|", filled=markdown)
            rows, markdown = [], False


def _is_pose_row(cells: Cells) -> bool:
    """Whether a row is not of the table above it, but the base or the tool that a printout has behind it."""
    return len(cells) <= 2 and cells[0].text.casefold() in ("base", "tool")


def separated_grid(lines: Sequence[str], first: int, separator: str) -> Grid:
    """Return the table that starts at a line, its cells between separators.

    Args:
        lines: All lines of the file.
        first: Index of the heading's line.
        separator: ``,``, ``;``, a tab or a space.
    """
    rows: list[Cells] = []
    problems: list[tuple[int, int, str]] = []
    for index in range(first, len(lines)):
        line = lines[index]
        if not line.strip(f"{separator} \t") or (rows and is_comment(line)):
            continue
        try:
            cells = split(line, index + 1, separator, count=len(rows[0]) if rows else 0)
        except ValueError as error:
            problems.append((index + 1, len(line) - len(line.lstrip()) + 1, str(error)))
            continue
        if len(cells) < 2:
            break
        rows.append(cells)
        if len(rows) > MAX_ROWS + 1 or len(problems) > MAX_ROWS:
            break
    return Grid(rows=tuple(rows), separator=separator, problems=tuple(problems))


def is_comment(line: str) -> bool:
    """Whether a line is a comment: it starts with ``#``, ``%`` or ``//``."""
    return line.lstrip().startswith(("#", "%", "//"))


def split(line: str, number: int, separator: str, *, count: int = 0) -> Cells:
    """Return the cells of a line.

    Args:
        line: The line; a heading may follow a comment sign.
        number: Its number, from 1.
        separator: ``,``, ``;``, a tab or a space.
        count: How many cells are expected, or 0: a table between spaces may have spaces in its cells, and then
            two or more separate them.

    Raises:
        ValueError: A quote is never closed.
    """
    if separator == " ":
        return _spaced(line, number, count)
    start = _prefix(line) if is_comment(line) else 0
    quoted = separator in ",;\t" and '"' in line
    spans = list(_quoted(line, start, separator) if quoted else between(line, start, re.escape(separator)))
    while len(spans) > max(count, 1) and not line[spans[-1][0] : spans[-1][1]].strip():
        spans.pop()
    return tuple(_cell(line, number, start, end) for start, end in spans)


def _is_rule(body: str) -> bool:
    """Whether a line only draws: ``|---|:-:|``, or the edge of a box; a row of single dashes may be a row."""
    if not body.strip() or not _RULES.issuperset(body):
        return False
    return any(one in _DASHES and other in _DASHES for one, other in itertools.pairwise(body))


def _prefix(line: str) -> int:
    found = PREFIX.match(line)
    return found.end() if found else 0


def _piped(line: str, number: int) -> Cells:
    if not any(pipe in line for pipe in PIPES):
        return ()
    spans = list(between(line, 0, _PIPE.pattern))
    if not line[spans[0][0] : spans[0][1]].strip(" \t%#>*/"):
        spans = spans[1:]
    else:
        spans[0] = (_prefix(line), spans[0][1])
    if len(spans) > 1 and not line[spans[-1][0] : spans[-1][1]].strip():
        spans = spans[:-1]
    return tuple(_cell(line, number, start, end) for start, end in spans)


def between(line: str, start: int, pattern: str) -> Iterator[tuple[int, int]]:
    """Yield where the parts of a line are, from ``start`` on, that a pattern separates."""
    for found in re.compile(pattern).finditer(line, start):
        yield start, found.start()
        start = found.end()
    yield start, len(line)


def _quoted(line: str, start: int, separator: str) -> Iterator[tuple[int, int]]:
    """Yield where the cells are; a separator between double quotes does not count, and two quotes are one."""
    inside = False
    for position in range(start, len(line)):
        if line[position] == '"':
            inside = not inside
        elif line[position] == separator and not inside:
            yield start, position
            start = position + 1
    if inside:
        raise ValueError('a double quote is never closed on this line; write two of them, "", for one inside a cell')
    yield start, len(line)


def _spaced(line: str, number: int, count: int) -> Cells:
    body = _OLD_MARK.sub("", line.rstrip()).rstrip()
    start = _prefix(body) if is_comment(body) else len(body) - len(body.lstrip())
    gaps = [found.span() for found in re.finditer(r"\s+", body) if found.start() > start]
    wide, narrow = (
        tuple(zip([start, *(end for _, end in some)], [*(first for first, _ in some), len(body)], strict=True))
        for some in ([gap for gap in gaps if gap[1] - gap[0] > 1 or body[gap[0]] == "\t"], gaps)
    )
    spans = wide if len(wide) == count or (count and len(narrow) != count and len(wide) > 1) else narrow
    return tuple(_cell(body, number, start, end) for start, end in spans)


def _cell(line: str, number: int, start: int, end: int) -> Cell:
    text = line[start:end]
    lead = len(text) - len(text.lstrip())
    text = text.strip()
    if len(text) >= 2 and text[0] == text[-1] == '"':
        text, lead = text[1:-1].replace('""', '"').strip(), lead + 1
    return Cell(text=text, line=number, column=min(start + lead, len(line)) + 1)


class Findings:
    """Collects the problems and the notes of one file."""

    def __init__(self, file: str) -> None:
        """Start with none; ``file`` is the name in messages."""
        self.file = file
        self.problems: list[Problem] = []
        self.notes: list[str] = []

    def wrong(self, cell: Cell, path: str, message: str) -> None:
        """Note what is wrong with a cell; ``path`` is such as ``row 3, alpha``."""
        self.wrong_at(cell.line, cell.column, path, message)

    def wrong_at(self, line: int, column: int, path: str, message: str) -> None:
        """Note what is wrong at a place, counted from 1."""
        self.problems.append(Problem(file=self.file, line=line, column=column, path=path, message=message))

    def note(self, sentence: str) -> None:
        """Keep a sentence for the user, once."""
        if sentence not in self.notes:
            self.notes.append(sentence)

    def error(self) -> ImportedFileError:
        """Return all problems as one error, each of them once."""
        return ImportedFileError(dict.fromkeys(self.problems))

    def check(self) -> None:
        """Raise an ImportedFileError if anything is wrong."""
        if self.problems:
            raise self.error()
