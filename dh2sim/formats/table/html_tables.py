"""Tables of HTML, in a page or in Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html.parser import HTMLParser
from typing import Final

from dh2sim.formats.table.grid import Cell, Grid, SpannedRows, span_of

_KEPT: Final = ("sub", "sup")
"""Elements in a cell that mean something."""
_SPACES: Final = ("br", "p", "div")
_LONGEST: Final = 500_000
"""Characters, from the first table on, that are read."""


def html_grids(lines: Sequence[str]) -> Iterator[Grid]:
    """Yield the tables of a text that are written in HTML."""
    first = next((index for index, line in enumerate(lines) if "<table" in line.casefold()), None)
    if first is None:
        return
    parser = _TableParser(first)
    parser.feed("\n".join(lines[first:])[:_LONGEST])
    parser.finish()
    yield from parser.grids


class _TableParser(HTMLParser):
    """Collects the cells of tables; of a table in a cell only the outer one counts."""

    def __init__(self, first: int) -> None:
        super().__init__(convert_charrefs=True)
        self.grids: list[Grid] = []
        self._first = first
        self._depth = 0
        self._rows = SpannedRows()
        self._text: list[str] | None = None
        self._span = (1, 1)
        self._place = (1, 1)

    def finish(self) -> None:
        """Close what is open."""
        self._end_table()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        match tag:
            case "table":
                self._depth += 1
                if self._depth == 1:
                    self._rows = SpannedRows()
            case "tr" if self._depth == 1:
                self._end_cell()
                self._rows.next_row()
            case "td" | "th" if self._depth == 1:
                self._end_cell()
                values = dict(attrs)
                self._span = span_of(values.get("colspan")), span_of(values.get("rowspan"))
                line, column = self.getpos()
                tag_text = self.get_starttag_text() or ""
                if "\n" not in tag_text:
                    column += len(tag_text)
                self._place = (line + self._first, column + 1)
                self._text = []
            case _ if self._text is not None and tag in _KEPT:
                self._text.append(f"<{tag}>")
            case _ if self._text is not None and tag in _SPACES:
                self._text.append(" ")

    def handle_endtag(self, tag: str) -> None:
        match tag:
            case "table":
                self._depth -= 1
                if self._depth <= 0:
                    self._end_table()
            case "td" | "th" | "tr" if self._depth == 1:
                self._end_cell()
            case _ if self._text is not None and tag in _KEPT:
                self._text.append(f"</{tag}>")

    def handle_data(self, data: str) -> None:
        if self._text is not None:
            self._text.append(data)

    def _end_cell(self) -> None:
        if self._text is None:
            return
        text, (line, column) = " ".join("".join(self._text).split()), self._place
        self._text = None
        self._rows.add(Cell(text=text, line=line, column=column), columns=self._span[0], rows=self._span[1])

    def _end_table(self) -> None:
        self._end_cell()
        if rows := self._rows.rows():
            self.grids.append(Grid(rows=rows, separator="<", filled=True))
        self._rows, self._depth = SpannedRows(), 0
