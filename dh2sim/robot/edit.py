"""Cells and parameters in the text of a robot file: found, and exchanged without touching anything else of the text.

So comments, parameters and the order of keys are still the author's when a table that was edited is saved.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final, TypeAlias

from dh2sim.robot.yaml_text import word
from dh2sim.robot.yaml_tree import Entry, Node, Report, compose, resolve_plain

PARAMETERS: Final = "parameters"
Cell: TypeAlias = tuple[int | str | None, str]
"""Row, from 0, and column; ``PARAMETERS`` and a parameter's name; None and a key of the whole file."""

_NUMBER: Final = re.compile(r"-?[0-9]+(?:\.[0-9]+)?(?:[eE][-+]?[0-9]+)?")


def written_cells(text: str) -> list[dict[str, str]]:
    """Return the single values in the rows of a valid robot file's text as they are written, by key."""
    return [{key: entry.value.text for key, entry in _cells(row).items()} for row in _rows(_tree(text))]


def written_parameters(text: str) -> dict[str, str]:
    """Return the parameters of a valid robot file's text as they are written, by name."""
    node = _tree(text).at(PARAMETERS)
    return {} if node is None else {name: entry.value.text for name, entry in _cells(node).items()}


def own_conventions(text: str) -> list[int]:
    """Return the rows, from 0, of a valid robot file's text that name a convention of their own."""
    return [index for index, row in enumerate(_rows(_tree(text))) if "convention" in _cells(row)]


def can_be_edited(text: str) -> bool:
    """Return whether each cell of the table is written for itself alone; not so where there are anchors."""
    return not _has_anchors(_tree(text))


def unit_words(text: str) -> dict[str, str]:
    """Return what a valid robot file's text says of its units: 'angle', 'length', both or neither."""
    units = _tree(text).at("units")
    return {} if units is None else {key: entry.value.text for key, entry in _cells(units).items()}


def with_cells(text: str, cells: Mapping[Cell, str | None]) -> str:
    """Return the text of a robot file with other texts in cells of its table.

    Args:
        text: Of a valid robot file that ``can_be_edited``.
        cells: What is to be written there: any text, which cannot become more than the value of its key; None removes
            the key.
    """
    root = _tree(text)
    changes = sorted((_change(root, text, cell, typed) for cell, typed in cells.items()), reverse=True)
    for start, end, new in changes:  # from the end, so that the places before stay where they are
        text = text[:start] + new + text[end:]
    return text


def _tree(text: str) -> Node:
    return compose(text, Report(""))


def _rows(root: Node) -> list[Node]:
    joints = root.at("joints")
    return joints.value if joints is not None and isinstance(joints.value, list) else []


def _cells(node: Node) -> dict[str, Entry]:
    """Return the entries of a mapping that have a single value."""
    entries = node.value if isinstance(node.value, dict) else {}
    return {key: entry for key, entry in entries.items() if not isinstance(entry.value.value, dict | list)}


def _has_anchors(node: Node) -> bool:
    match node.value:
        case dict() as entries:
            inner = [entry.value for entry in entries.values()]
        case list() as inner:
            pass
        case _:
            inner = []
    return node.anchor or any(map(_has_anchors, inner))


def _change(root: Node, text: str, cell: Cell, typed: str | None) -> tuple[int, int, str]:
    """Return from where to where the text is exchanged, and for what."""
    index, key = cell
    mapping = _mapping(root, index)
    entry = _cells(mapping).get(key)
    if typed is None:
        return (0, 0, "") if entry is None else _removal(text, entry, flow=mapping.flow)
    value = _as_value(typed)
    if entry is not None:
        return entry.value.start, entry.value.end, value
    if not isinstance(index, int):
        raise KeyError(key)
    if mapping.flow:
        start = text.index("{", mapping.start) + 1
        return start, start, f"{key}: {value}, "
    return mapping.start, mapping.start, f"{key}: {value}\n{' ' * (mapping.column - 1)}"


def _mapping(root: Node, index: int | str | None) -> Node:
    """Return the mapping that a cell is in."""
    match index:
        case int():
            return _rows(root)[index]
        case str():
            found = root.at(index)
            if found is None:
                raise KeyError(index)
            return found
        case None:
            return root


def _removal(text: str, entry: Entry, *, flow: bool) -> tuple[int, int, str]:
    """Return how a key is removed from a row that has others: with the comma or line end after it, or before it."""
    behind = re.compile(r"\s*,\s*" if flow else r"[ \t]*\n[ \t]*").match(text, entry.value.end)
    if behind:
        return entry.start, behind.end(), ""
    before = re.compile(r"\s*,\s*$" if flow else r"\n[ \t]*$").search(text, 0, entry.start)
    return (entry.start if before is None else before.start()), entry.value.end, ""


def _as_value(typed: str) -> str:
    """Return a text as a YAML value: a number as it is, anything else as a string."""
    if _NUMBER.fullmatch(typed) and isinstance(resolve_plain(typed), int | float):
        return typed
    return word(typed)
