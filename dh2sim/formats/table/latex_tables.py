r"""Tables of LaTeX: ``tabular``, ``array`` and their kin, or bare rows of cells between ``&``, ended by ``\\``."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final

from dh2sim.formats.table.grid import MAX_COLUMNS, MAX_ROWS, Cell, Cells, Grid, TextPlaces

_BEGIN: Final = re.compile(
    r"\\begin\s*\{((?:[a-z]*tabular[*xy]?|longtable|longtabu|tabu|NiceTabular|tblr|longtblr|array|[bpvBV]?matrix))\}"
)
_COMMENT: Final = re.compile(r"(?<!\\)%[^\n]*")
_ARGUMENT: Final = re.compile(r"\s*(?:\[[^\[\]]*\]|\{(?:[^{}]|\{(?:[^{}]|\{[^{}]*\})*\})*\})")
_ROW: Final = re.compile(r"\\\\(?:\s*\*)?(?:\s*\[[^\[\]&]*\])?|\\tabularnewline\b")
_CELL: Final = re.compile(r"(?<!\\)&")
_RULES: Final = re.compile(
    r"\\(?:hline|toprule|midrule|bottomrule|endhead|endfirsthead|endfoot|endlastfoot|centering|raggedright|small|"
    r"footnotesize|normalsize|arraybackslash)(?![A-Za-z])"
    r"|\\(?:cline|cmidrule|Xhline|noalign|rowcolor|cellcolor|label|addlinespace|specialrule)\s*(?:\([^()]*\))?"
    r"(?:\[[^\[\]]*\])?(?:\s*\{[^{}]*\})*"
)
_SPANNING: Final = re.compile(r"^\s*\\multicolumn\s*\{\s*(\d{1,2})\s*\}\s*\{[^{}]*(?:\{[^{}]*\}[^{}]*)*\}")
_TALL: Final = re.compile(r"\\multirow\s*(?:\[[^\[\]]*\])?\s*\{[^{}]*\}\s*(?:\[[^\[\]]*\])?\s*\{[^{}]*\}")
_SEVERAL_LINES: Final = re.compile(r"\\(?:makecell|thead|shortstack|parbox)\s*(?:\[[^\[\]]*\])?(?=\s*\{)")


def latex_grids(lines: Sequence[str]) -> Iterator[Grid]:
    """Yield the tables of a text that are written in LaTeX."""
    if not any("&" in line for line in lines):
        return
    text = _COMMENT.sub(lambda found: " " * len(found.group()), "\n".join(lines))
    places = TextPlaces(lines)
    found_any = False
    position = 0
    while found := _BEGIN.search(text, position):
        found_any = True
        end = text.find(f"\\end{{{found[1]}}}", found.end())
        end = len(text) if end < 0 else end
        start = found.end()
        for _ in range(0 if "matrix" in found[1] else 2 if found[1] in ("tabularx", "tabular*", "tabulary") else 1):
            while argument := _ARGUMENT.match(text, start):
                start = argument.end()
                if argument.group().lstrip().startswith("{"):
                    break
        yield from _grid(text, start, min(end, len(text)), places)
        position = max(end, found.end())
    if not found_any:
        yield from _bare_rows(text, lines, places)


def _bare_rows(text: str, lines: Sequence[str], places: TextPlaces) -> Iterator[Grid]:
    """Yield the rows that no environment surrounds: lines with an ``&``, one after the other."""
    start: int | None = None
    for index, line in enumerate([*lines, ""]):
        inside = bool(_CELL.search(line)) or (
            start is not None and _RULES.sub("", line).strip() == "" != line.strip()
        )
        if inside and start is None:
            start = index
        elif not inside and start is not None:
            begin, end = places.offset(start), places.offset(index)
            if "\\\\" in text[begin:end]:
                yield from _grid(text, begin, end, places)
            start = None


def _grid(text: str, start: int, end: int, places: TextPlaces) -> Iterator[Grid]:
    rows: list[Cells] = []
    for begin, stop in _between_matches(_ROW, text, start, end):
        cells = _cells(text, begin, stop, places)
        if any(cell.text for cell in cells):
            rows.append(cells)
        if len(rows) > MAX_ROWS + 10:
            break
    if rows:
        yield Grid(rows=tuple(rows), separator="&", filled=True)


def _cells(text: str, start: int, end: int, places: TextPlaces) -> Cells:
    cells: list[Cell] = []
    for begin, stop in _between_matches(_CELL, text, start, end):
        raw = _RULES.sub(lambda found: " " * len(found.group()), text[begin:stop])
        spanned = _SPANNING.match(raw)
        body = raw[spanned.end() :] if spanned else raw
        inner = _SEVERAL_LINES.sub("", _TALL.sub("", body))
        line, column = places.at(begin + len(raw) - len(raw.lstrip()))
        cells.append(Cell(text=" ".join(_unwrapped(inner.strip()).split()), line=line, column=column))
        width = min(int(spanned[1]), MAX_COLUMNS) if spanned else 1
        if (begin, stop) == (start, end) and width > 2:  # a remark under the table, and no row of it
            break
        cells += [Cell(text="", line=line, column=column)] * (width - 1)
        if len(cells) > 2 * MAX_COLUMNS:
            break
    return tuple(cells)


def _unwrapped(text: str) -> str:
    """Return the text of a cell without braces around all of it."""
    while text.startswith("{") and text.endswith("}") and _ARGUMENT.fullmatch(text):
        text = text[1:-1].strip()
    return text


def _between_matches(pattern: re.Pattern[str], text: str, start: int, end: int) -> Iterator[tuple[int, int]]:
    for found in pattern.finditer(text, start, end):
        yield start, found.start()
        start = found.end()
    yield start, end
