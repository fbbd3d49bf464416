"""Cells of the table in the text of a robot file: found, and exchanged without touching anything else of the text.

So comments, parameters and the order of keys are still the author's when a table that was edited is saved.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final, TypeAlias

from ruamel.yaml import YAML, events

from dh2sim.robot.write import word
from dh2sim.robot.yaml_tree import resolve_plain

Cell: TypeAlias = tuple[int | None, str]
"""Row, from 0, and column; without a row a key of the whole file."""

_NUMBER: Final = re.compile(r"-?[0-9]+(?:\.[0-9]+)?(?:[eE][-+]?[0-9]+)?")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Span:
    """Where a value stands in the text."""

    key: int
    """Where its key begins."""
    start: int
    end: int
    value: str


@dataclass(slots=True, kw_only=True)
class _Row:
    """Where a row stands in the text."""

    start: int
    flow: bool
    indent: int
    cells: dict[str, _Span] = field(default_factory=dict)


@dataclass(slots=True, kw_only=True)
class _Places:
    """What can be exchanged in a text."""

    rows: list[_Row] = field(default_factory=list)
    top: dict[str, _Span] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    shared: bool = False
    """Whether parts of the text stand for several values, or have tags: then it cannot be edited in place."""


def written_cells(text: str) -> list[dict[str, str]]:
    """Return the values in the rows of a robot file's text as they are written, by key; only plain values.

    Args:
        text: Of a robot file that is right.
    """
    return [{key: span.value for key, span in row.cells.items()} for row in _places(text).rows]


def own_conventions(text: str) -> list[int]:
    """Return the rows, from 0, of a robot file's text that name a convention of their own."""
    return [index for index, row in enumerate(_places(text).rows) if "convention" in row.cells]


def can_be_edited(text: str) -> bool:
    """Whether every cell of the table stands in the text for itself alone; not so where there are anchors."""
    return not _places(text).shared


def unit_words(text: str) -> dict[str, str]:
    """Return what a robot file's text says of its units: 'angle', 'length', both or neither."""
    return _places(text).units


def with_cells(text: str, cells: Mapping[Cell, str | None]) -> str:
    """Return the text of a robot file with other texts in cells of its table.

    Args:
        text: Of a robot file that is right and ``can_be_edited``.
        cells: What is to stand there; any text, which cannot become more than the value of its key. None: nothing,
            not even the key.
    """
    places = _places(text)
    changes = sorted((_change(places, text, cell, typed) for cell, typed in cells.items()), reverse=True)
    for start, end, new in changes:  # from the end, so that the places before stay where they are
        text = text[:start] + new + text[end:]
    return text


def _change(places: _Places, text: str, cell: Cell, typed: str | None) -> tuple[int, int, str]:
    """Return from where to where the text is exchanged, and for what."""
    index, key = cell
    spans = places.top if index is None else places.rows[index].cells
    if typed is None:
        return (
            _removal(text, spans[key], flow=index is not None and places.rows[index].flow)
            if key in spans
            else (0, 0, "")
        )
    value = _as_value(typed)
    if key in spans:
        return spans[key].start, spans[key].end, value
    if index is None:
        raise KeyError(key)
    row = places.rows[index]
    if row.flow:
        start = text.index("{", row.start) + 1
        return start, start, f"{key}: {value}, "
    return row.start, row.start, f"{key}: {value}\n{' ' * row.indent}"


def _removal(text: str, span: _Span, *, flow: bool) -> tuple[int, int, str]:
    """Return how a key is taken out of a row that has others: with the comma or the line end behind it, or before."""
    behind = re.compile(r"\s*,\s*" if flow else r"[ \t]*\n[ \t]*").match(text, span.end)
    if behind:
        return span.key, behind.end(), ""
    before = re.compile(r"\s*,\s*$" if flow else r"\n[ \t]*$").search(text, 0, span.key)
    return (span.key if before is None else before.start()), span.end, ""


def _as_value(typed: str) -> str:
    """Return a text as a YAML value: a number as it is, anything else as a string."""
    if _NUMBER.fullmatch(typed) and isinstance(resolve_plain(typed), int | float):
        return typed
    return word(typed)


def _places(text: str) -> _Places:
    """Walk through the events of a text that is known to be right."""
    places = _Places()
    walk: Iterator[events.Event] = YAML(typ="safe", pure=True).parse(text)
    path: list[str | int | None] = []
    """Keys and indices that lead to what comes next; None in a mapping where a key comes next."""
    key = 0
    for event in walk:
        places.shared |= isinstance(event, events.AliasEvent) or any(
            getattr(event, name, None) for name in ("anchor", "tag")
        )
        match event:
            case events.ScalarEvent():
                start = event.start_mark.index
                key = start if path and path[-1] is None else key
                span = _Span(key=key, start=start, end=event.end_mark.index, value=event.value)
                _note(places, path, span)
                _step(path, event.value)
            case events.AliasEvent():
                _step(path, "")
            case events.MappingStartEvent():
                if path[:1] == ["joints"] and len(path) == 2:
                    mark = event.start_mark
                    places.rows.append(_Row(start=mark.index, flow=bool(event.flow_style), indent=mark.column))
                path.append(None)
            case events.SequenceStartEvent():
                path.append(0)
            case events.CollectionEndEvent():
                path.pop()
                _step(path, "")
    return places


def _step(path: list[str | int | None], value: str) -> None:
    """Move on behind a value, or from a key to its value."""
    if not path:
        return
    last = path[-1]
    path[-1] = value if last is None else last + 1 if isinstance(last, int) else None


def _note(places: _Places, path: list[str | int | None], span: _Span) -> None:
    match path:
        case [str(key)]:
            places.top[key] = span
        case ["units", str(key)]:
            places.units[key] = span.value
        case ["joints", int(), str(key)]:
            places.rows[-1].cells[key] = span
        case _:
            pass
