"""Mappings and lists as lines of YAML: in braces where they fit on a line, a table's numbers below each other."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Final, TypeAlias

from dh2sim.robot.writing.text import WIDTH

Tree: TypeAlias = "str | list[str] | dict[str, Tree]"
"""Texts as they stand in the file, in lists and mappings."""

_WORDS: Final = ("name", "type")
_NUMBERS: Final = ("a", "alpha", "beta", "d", "theta")


def inline(tree: Tree) -> str:
    """Return a tree on one line."""
    match tree:
        case str():
            return tree
        case list():
            return f"[{', '.join(tree)}]"
        case dict():
            return f"{{{', '.join(f'{key}: {inline(value)}' for key, value in tree.items())}}}"


def entry_lines(key: str, tree: Tree, indent: int = 0) -> list[str]:
    """Return the lines of a key: one, unless the value is a mapping that is too long for it."""
    line = f"{' ' * indent}{key}: {inline(tree)}"
    if len(line) <= WIDTH or not isinstance(tree, dict):
        return [line]
    return [f"{' ' * indent}{key}:", *block_lines(tree, indent + 2)]


def block_lines(tree: Mapping[str, Tree], indent: int) -> list[str]:
    """Return the lines of a mapping's keys."""
    return [line for key, value in tree.items() for line in entry_lines(key, value, indent)]


def table_lines(rows: Sequence[dict[str, Tree]]) -> list[str]:
    """Return the lines of a list of rows.

    A row takes one line where it fits and says nothing of a link. Such rows have their columns aligned, where
    they fit then, too.
    """
    simple = {index: row for index, row in enumerate(rows) if "link" not in row and len(_line(row)) <= WIDTH}
    aligned = _aligned(list(simple.values()))
    if all(len(line) <= WIDTH for line in aligned):
        lines = dict(zip(simple, aligned, strict=True))
    else:
        lines = {index: _line(row) for index, row in simple.items()}
    return [line for index, row in enumerate(rows) for line in ([lines[index]] if index in lines else _item(row))]


def _line(row: dict[str, Tree]) -> str:
    return f"  - {inline(row)}"


def _item(row: Mapping[str, Tree]) -> list[str]:
    """Return the lines of a row that has a line for each of its keys."""
    first, *others = block_lines(row, 4)
    return [f"  - {first[4:]}", *others]


def _aligned(rows: Sequence[dict[str, Tree]]) -> list[str]:
    """Return one line a row; words stand to the left in their columns, numbers to the right.

    The words come first in a row, then the numbers, then what has no columns.
    """
    cells = [[(key, inline(value)) for key, value in row.items()] for row in rows]
    tables = [[cell for cell in row if cell[0] in (*_WORDS, *_NUMBERS)] for row in cells]
    columns = itertools.zip_longest(*tables, fillvalue=("", ""))
    widths = [max(len(key) + len(text) for key, text in column) for column in columns]
    lines = []
    for row, table in zip(cells, tables, strict=True):
        parts = [_cell(key, text, width) for (key, text), width in zip(table, widths, strict=False)]
        parts += [f"{key}: {text}, " for key, text in row[len(table) :]]
        lines.append(f"  - {{{''.join(parts).rstrip(', ')}}}")
    return lines


def _cell(key: str, text: str, width: int) -> str:
    """Return a key, its value and a comma; ``width`` is that of the longest key and value of the column."""
    if key in _NUMBERS:
        return f"{key}: {text:>{width - len(key)}}, "
    return f"{key}: {text}, ".ljust(width + len(": , "))
