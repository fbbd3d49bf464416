"""Tables of MediaWiki, as in Wikipedia's articles: from ``{|`` to ``|}``."""

from __future__ import annotations

import html
import re
from collections.abc import Iterator, Sequence
from typing import Final

from dh2sim.formats.table.grid import MAX_COLUMNS, MAX_ROWS, Cell, Cells, Grid, SpannedRows, between, span_of

_START: Final = re.compile(r"[\s:*#]*\{\|")
_END: Final = re.compile(r"\s*\|\}")
_LONGEST: Final = MAX_ROWS * MAX_COLUMNS
"""Lines of a table that are read."""
_WIDEST: Final = 10_000
"""Characters of a line that are read."""
_LINK: Final = re.compile(r"\[\[(?:[^\[\]|]*\|)?([^\[\]|]*)\]\]")
_MARKUP: Final = re.compile(r"'{2,}|<ref\b[^>]*/>|<ref\b.*?</ref>|<!--.*?-->|<nowiki\s*/?>|</nowiki>", re.IGNORECASE)
_MATH: Final = re.compile(r"<math\b[^>]*>(.*?)</math>", re.IGNORECASE)
_TEMPLATE: Final = re.compile(r"\{\{\s*(?:math|mvar|var|nowrap|val)\s*\|([^{}|]*)\}\}", re.IGNORECASE)
_BREAK: Final = re.compile(r"<br\s*/?>", re.IGNORECASE)
_ATTRIBUTES: Final = re.compile(r"[^|\[\]{}<>]*=[^|\[\]{}<>]*\|(?!\|)")
"""Before the text of a cell, such as ``style="text-align: left" |``."""
_SPAN: Final = re.compile(r"\b(colspan|rowspan)\s*=\s*[\"']?(\d{1,3})")


def wiki_grids(lines: Sequence[str]) -> Iterator[Grid]:
    """Yield the tables of a text that are written in MediaWiki's markup."""
    index = 0
    while index < len(lines):
        if _START.match(lines[index]) is None:
            index += 1
            continue
        stop = next((k for k in range(index + 1, min(len(lines), index + _LONGEST)) if _END.match(lines[k])), None)
        if stop is None:
            return
        rows = _rows(lines, index + 1, stop)
        if rows:
            yield Grid(rows=rows, separator="!", filled=True)
        index = stop + 1


def _rows(lines: Sequence[str], start: int, stop: int) -> tuple[Cells, ...]:
    rows = SpannedRows()
    for index, line in _joined(lines, start, stop):
        at = len(line) - len(line.lstrip()) + 1
        if line.startswith("|-", at - 1):
            rows.next_row()
        elif line[at : at + 1] != "+":
            for first, last in between(line, at, r"\|\||!!" if line[at - 1] == "!" else r"\|\|"):
                _add(rows, line[first:last], index + 1, first)
    return rows.rows()


def _joined(lines: Sequence[str], start: int, stop: int) -> list[tuple[int, str]]:
    """Return the lines that begin rows and cells, with their indices; lines that continue a cell are added to it."""
    found: list[tuple[int, str]] = []
    for index in range(start, stop):
        line = lines[index]
        if line.lstrip().startswith(("|", "!")):
            found.append((index, line[:_WIDEST]))
        elif found and not found[-1][1].lstrip().startswith(("|-", "|+")):
            found[-1] = (found[-1][0], f"{found[-1][1]} {line.strip()}"[:_WIDEST])
    return found


def _add(rows: SpannedRows, text: str, line: int, column: int) -> None:
    attributes = _ATTRIBUTES.match(text)
    start = attributes.end() if attributes else 0
    spans = dict(_SPAN.findall(text[:start].casefold()))
    body = text[start:]
    column += start + len(body) - len(body.lstrip()) + 1
    rows.add(
        Cell(text=_plain(body), line=line, column=column),
        columns=span_of(spans.get("colspan")),
        rows=span_of(spans.get("rowspan")),
    )


def _plain(text: str) -> str:
    """Return a cell without markup; formulas stay LaTeX, between dollars."""
    text = _MATH.sub(lambda found: f"${found[1].strip()}$", _MARKUP.sub("", text))
    return " ".join(html.unescape(_BREAK.sub(" ", _TEMPLATE.sub(r"\1", _LINK.sub(r"\1", text)))).split())
