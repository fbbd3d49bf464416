"""Tables of HTML, in a page or in Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html.parser import HTMLParser
from typing import Final

from dh2sim.formats.table.grid import MAX_COLUMNS, MAX_ROWS, Cell, Cells, Grid

_KEPT: Final = ("sub", "sup")
"""Elements in a cell that mean something."""
_SPACES: Final = ("br", "p", "div")
_LONGEST: Final = 500_000
"""Characters, from the first table on, that are read."""
_MOST_CELLS: Final = 2 * MAX_COLUMNS


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
        self._rows: list[list[Cell | None]] = []
        self._row = -1
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
                    self._rows, self._row = [], -1
            case "tr" if self._depth == 1:
                self._next_row()
            case "td" | "th" if self._depth == 1:
                self._end_cell()
                if self._row < 0:
                    self._next_row()
                values = dict(attrs)
                self._span = _number(values.get("colspan")), _number(values.get("rowspan"))
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

    def _next_row(self) -> None:
        self._end_cell()
        self._row += 1
        if self._row == len(self._rows):  # it is there already where a cell above is more than one row high
            self._rows.append([])

    def _end_cell(self) -> None:
        if self._text is None or not self._rows or len(self._rows) > MAX_ROWS + 10:
            return
        text, (line, column) = " ".join("".join(self._text).split()), self._place
        self._text = None
        row = self._row
        cells = self._rows[row]
        if len(cells) > _MOST_CELLS:
            return
        at = next((k for k, cell in enumerate(cells) if cell is None), len(cells))
        for below in range(self._span[1]):
            if row + below >= len(self._rows):
                self._rows.append([])
            target = self._rows[row + below]
            target += [None] * (at - len(target))
            target[at : at + self._span[0]] = [
                Cell(text=text if k == 0 else "", line=line, column=column) for k in range(self._span[0])
            ]

    def _end_table(self) -> None:
        self._end_cell()
        rows = [_whole(row) for row in self._rows if any(cell is not None and cell.text for cell in row)]
        if rows:
            self.grids.append(Grid(rows=tuple(rows), separator="<", filled=True))
        self._rows, self._row, self._depth, self._text = [], -1, 0, None


def _number(text: str | None) -> int:
    return min(max(int(text), 1), MAX_COLUMNS) if text is not None and text.isdecimal() and len(text) < 4 else 1


def _whole(row: Sequence[Cell | None]) -> Cells:
    known = next(cell for cell in row if cell is not None)
    if len(row) > 2 and len({(cell.line, cell.column) for cell in row if cell is not None}) == 1:
        return (known,)  # a title or a remark, across all columns
    return tuple(Cell(text="", line=known.line, column=known.column) if cell is None else cell for cell in row)
