"""YAML text as a tree of nodes that know their places in it, and the report of problems at such places.

Only what a robot file needs is accepted: one document of mappings with text keys, lists and scalars of YAML 1.2's
core schema. Size, depth and the number of nodes with aliases expanded are bounded, so that no file takes long to
refuse.
"""

from __future__ import annotations

import codecs
import functools
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple, NoReturn, TypeAlias

from dh2sim.errors import Dh2simError, Problem, RobotFileError
from dh2sim.input_files import read_input, utf16_hint
from dh2sim.messages import Loc, path_of, shown


class Report:
    """Collects the problems of one file."""

    def __init__(self, file: str) -> None:
        """Start with none; ``file`` is the name that messages begin with."""
        self.file = file
        self.problems: list[Problem] = []

    def add(self, line: int, column: int, loc: Loc, message: str) -> None:
        """Note a problem at a line and column, both counted from 1."""
        self.problems.append(Problem(file=self.file, line=line, column=column, path=path_of(loc), message=message))

    def error(self) -> RobotFileError:
        """Return all of them as one error, each once."""
        return RobotFileError(dict.fromkeys(self.problems))


Scalar: TypeAlias = str | int | float | bool | None

_NULL: Final = frozenset({"", "~", "null", "Null", "NULL"})
_BOOL: Final = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
_OCTAL_OR_HEX: Final = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_DECIMAL: Final = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_INF: Final = re.compile(r"[-+]?\.(?:inf|Inf|INF)")
_NAN: Final = frozenset({".nan", ".NaN", ".NAN"})
_MOST_DIGITS: Final = 400
"""Longer integers become doubles, that is infinity: Python's own conversion takes ever longer."""


def resolve_plain(text: str) -> Scalar:
    """Return what a plain (unquoted) scalar stands for in YAML 1.2's core schema (section 10.3.2)."""
    if not text or text[0] not in "+-.0123456789":
        return None if text in _NULL else _BOOL.get(text, text)
    if _DECIMAL.fullmatch(text):
        fraction = "." in text or "e" in text or "E" in text
        return float(text) if fraction or len(text) > _MOST_DIGITS else int(text)
    if _OCTAL_OR_HEX.fullmatch(text):
        return int(text, 0) if len(text) <= _MOST_DIGITS else float("inf")
    if _INF.fullmatch(text):
        return float(text.replace(".", ""))
    if text in _NAN:
        return float("nan")
    return text


MAX_BYTES: Final = 1_000_000
MAX_LINE: Final = 100_000

NOT_PRINTABLE: Final = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x84\x86-\x9f\ud800-\udfff\ufffe\uffff]")
"""What YAML allows nowhere. (Its complement, the printable characters, takes ten times as long to compile.)"""


class Entry(NamedTuple):
    """A key of a mapping and its value."""

    line: int
    """Line of the key, from 1."""
    column: int
    """Column of the key, from 1."""
    start: int
    """Where the key starts in the text, in characters."""
    value: Node


Value: TypeAlias = Scalar | list["Node"] | dict[str, Entry]


@dataclass(slots=True, eq=False)
class Node:
    """A value and its place in the text."""

    line: int
    """From 1, as the column."""
    column: int
    value: Value = field(repr=False)
    wrong: bool = False
    """Whether a problem was reported: nothing more is to be said of the value, nor of keys missing in it."""
    start: int = 0
    """In characters from the start of the text, as the end."""
    end: int = 0
    """Of a scalar; 0 for collections."""
    text: str = field(default="", repr=False)
    """Of a scalar: as it is written, without quotes."""
    flow: bool = False
    """Whether it is a collection in brackets."""
    anchor: bool = False
    """Whether other parts of the text may stand for it too."""

    def at(self, *loc: str | int) -> Node | None:
        """Return the node at a place below this one, or None."""
        node: Node | None = self
        for part in loc:
            match node.value if node else None:
                case dict() as entries if isinstance(part, str):
                    entry = entries.get(part)
                    node = entry.value if entry else None
                case list() as items if isinstance(part, int):
                    node = items[part] if part < len(items) else None
                case _:
                    return None
        return node

    def entry(self, *loc: str | int) -> Entry | None:
        """Return the mapping entry at a place whose last part is a key, or None."""
        parent = self.at(*loc[:-1])
        if parent is None or not isinstance(parent.value, dict) or not isinstance(loc[-1], str):
            return None
        return parent.value.get(loc[-1])


def check_size(size: int, report: Report) -> None:
    """Raise a RobotFileError if a file of ``size`` bytes is too large."""
    if size > MAX_BYTES:
        report.add(1, 1, (), f"the file has {size} bytes; at most {MAX_BYTES} are allowed")
        raise report.error()


def read_yaml_file(path: str | os.PathLike[str]) -> tuple[bytes, Report]:
    """Return the content of a file that the user names, and a report for its problems.

    Raises:
        RobotFileError: It is too large.
        Dh2simError: It cannot be read.
    """
    file = os.fspath(path)
    try:
        data = read_input(Path(path), MAX_BYTES)
    except OSError as error:
        raise Dh2simError(f"{file}: cannot be read: {error.strerror or error}") from error
    report = Report(file)
    check_size(len(data), report)
    return data, report


def decode(data: bytes, report: Report) -> str:
    """Return the text of a file, every line ended by a line feed.

    Raises:
        RobotFileError: Too large, not UTF-8, a control character, or a line that is too long.
    """
    check_size(len(data), report)
    data = data.removeprefix(codecs.BOM_UTF8)
    try:
        text = data.decode().replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        before = data[: error.start].decode()
        message = f"not UTF-8: byte 0x{data[error.start]:02x}{utf16_hint(data)}"
        _fail_at(report, before, len(before), message)
    if found := NOT_PRINTABLE.search(text):
        _fail_at(report, text, found.start(), f"control character U+{ord(found.group()):04X} is not allowed")
    for number, line in enumerate(text.split("\n"), start=1):
        if len(line) > MAX_LINE:
            report.add(number, 1, (), f"the line has {len(line)} characters; at most {MAX_LINE} are allowed")
            raise report.error()
    return text


def _fail_at(report: Report, text: str, offset: int, message: str) -> NoReturn:
    line = text.count("\n", 0, offset) + 1
    report.add(line, offset - text.rfind("\n", 0, offset), (), message)
    raise report.error() from None


MAX_DEPTH: Final = 32
MAX_NODES: Final = 50_000


def compose(text: str, report: Report, needs: str = "a robot needs at least name, convention and joints") -> Node:
    """Return the tree of a YAML document; problems that leave a tree are noted in ``report``.

    Args:
        text: The document.
        report: Where problems are noted.
        needs: What an empty file is reported to need.

    Raises:
        RobotFileError: The text has no tree; the error holds all problems noted so far.
    """
    root = _fast(text)
    if root is not None:
        return root
    composer = _Composer(report)
    for event in _events(text, report):
        composer.take(event)
    if composer.root is None:
        report.add(1, 1, (), f"the file is empty; {needs}")
        raise report.error()
    return composer.root


@functools.lru_cache(maxsize=2)  # an editor asks several things of one text
def _fast(text: str) -> Node | None:
    """Return the tree that libyaml finds; None where it is not installed, or for any problem.

    It takes a twentieth of the time. Problems are reported by the other parser, whose messages and places are better,
    and so are texts that YAML 1.1, which libyaml reads, may take differently.
    """
    if _OTHER_IN_YAML_1_1.search(text):
        return None
    try:
        from yaml import YAMLError
        from yaml.cyaml import CParser  # type: ignore[attr-defined]
    except ImportError:
        return None
    report = Report("")
    composer = _Composer(report)
    try:
        parser = CParser(text)
        while (event := parser.get_event()) is not None:
            composer.take(event)
    except (YAMLError, RobotFileError, ValueError):
        return None
    return None if report.problems or composer.parsers_differ else composer.root


_OTHER_IN_YAML_1_1: Final = re.compile(r"[\x85\u2028\u2029\ufeff]|^%|\t", re.MULTILINE)
"""Line breaks of YAML 1.1, directives, and tabs, which parsers differ about."""


def _events(text: str, report: Report) -> Iterator[Any]:
    """Yield ruamel's events; whatever it raises becomes a problem of the file."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError

    mark: Any = None
    try:
        for event in YAML(typ="safe", pure=True).parse(text):
            mark = event.start_mark
            yield event
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark or mark
        message = ", ".join(" ".join(str(part).split()) for part in (error.problem, error.context) if part)
    except Exception:  # ruamel lets some of Python's own through, such as chr()'s for "\Uffffffff"
        message = "an invalid escape or character"
    else:
        return
    line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
    lines = text.split("\n")
    if line <= len(lines) and re.match(r" *\t", lines[line - 1]):
        message = "a tab in the indentation; YAML is indented with spaces"
    report.add(line, column, (), f"not valid YAML: {message}")
    raise report.error() from None


@dataclass(slots=True)
class _Frame:
    """A collection that is still open."""

    node: Node
    anchor: str | None
    key: tuple[str | None, Node] | None = None
    """Key whose value comes next; its name is None where the key is wrong."""
    size: int = 1
    height: int = 1

    def part(self) -> Loc:
        """Return the key or index of what comes next; nothing where a key comes next."""
        if isinstance(self.node.value, list):
            return (len(self.node.value),)
        return () if self.key is None else (self.key[0] or str(self.key[1].value),)


class _Composer:
    """Turns events into nodes, without recursion."""

    def __init__(self, report: Report) -> None:
        self.root: Node | None = None
        self._report = report
        self._stack: list[_Frame] = []
        self._anchors: dict[str, tuple[Node, int, int] | None] = {}
        """Node, size and height; None while the anchored node is still open."""
        self._total = 0
        self.parsers_differ = False
        """Whether there is an empty value without a key, which some mark lines further down than others."""

    def take(self, event: Any) -> None:
        """Take the next event, of either parser."""
        match type(event).__name__:
            case "ScalarEvent":  # most of them
                self._attach(self._scalar(event), event.anchor, 1, 1)
            case "DocumentStartEvent":
                if self.root is not None:
                    self._fail(event, "a second YAML document; a robot file holds one")
                if getattr(event, "version", None) not in (None, (1, 2)):
                    self._fail(event, "only YAML 1.2 is read")
            case "AliasEvent":
                self._alias(event)
            case "MappingStartEvent":
                self._open(event, {})
            case "SequenceStartEvent":
                self._open(event, [])
            case "MappingEndEvent" | "SequenceEndEvent":
                frame = self._stack.pop()
                self._attach(frame.node, frame.anchor, frame.size, frame.height)

    def _loc(self) -> Loc:
        return tuple(part for frame in self._stack for part in frame.part())

    def _fail(self, event: Any, message: str) -> NoReturn:
        mark = event.start_mark
        self._report.add(mark.line + 1, mark.column + 1, self._loc(), message)
        raise self._report.error()

    def _count(self, event: Any, size: int, height: int) -> None:
        self._total += size
        if self._total > MAX_NODES:
            self._fail(event, f"more than {MAX_NODES} values (aliases counted each time)")
        if len(self._stack) + height > MAX_DEPTH:
            self._fail(event, f"nested deeper than {MAX_DEPTH} levels")

    def _node(self, event: Any, value: Value, end: int = 0, text: str = "", *, flow: bool = False) -> Node:
        if self._total >= MAX_NODES or len(self._stack) >= MAX_DEPTH:
            self._count(event, 1, 1)
        self._total += 1
        mark = event.start_mark
        tag = getattr(event, "tag", None)
        if tag is not None:
            written = shown(tag.replace("tag:yaml.org,2002:", "!!"))
            self._fail(event, f"tag {written} is not allowed; write the value alone")
        anchor = event.anchor is not None
        return Node(mark.line + 1, mark.column + 1, value, False, mark.index, end, text, flow, anchor)

    def _scalar(self, event: Any) -> Node:
        text, plain = event.value, not event.style
        node = self._node(event, resolve_plain(text) if plain else text, event.end_mark.index, text)
        if plain and not text:
            if self._stack and (key := self._stack[-1].key):
                node.line, node.column, node.start, node.end = key[1].line, key[1].column, key[1].start, key[1].start
            else:
                self.parsers_differ = True
        if not plain and (found := NOT_PRINTABLE.search(text)):
            self._fail(event, f"control character U+{ord(found.group()):04X} is not allowed")
        return node

    def _open(self, event: Any, value: Value) -> None:
        if event.anchor:
            self._anchors[event.anchor] = None
        node = self._node(event, value, flow=bool(event.flow_style))
        self._stack.append(_Frame(node, event.anchor))

    def _alias(self, event: Any) -> None:
        if event.anchor not in self._anchors:
            self._fail(event, f"alias {shown(event.anchor)} has no anchor before it")
        anchored = self._anchors[event.anchor]
        if anchored is None:
            self._fail(event, f"alias {shown(event.anchor)} is inside its own anchor")
        node, size, height = anchored
        self._count(event, size, height)
        self._attach(node, None, size, height, event)

    def _attach(self, node: Node, anchor: str | None, size: int, height: int, at: Any = None) -> None:
        if anchor:
            self._anchors[anchor] = (node, size, height)
        if not self._stack:
            self.root = node
            return
        frame = self._stack[-1]
        frame.size += size
        if height >= frame.height:
            frame.height = height + 1
        match frame.node.value:
            case list() as items:
                items.append(node)
            case dict() as entries if frame.key is not None:
                (name, key), frame.key = frame.key, None
                if name is not None:
                    entries[name] = Entry(key.line, key.column, key.start, node)
            case dict() as entries:
                if at is not None:
                    node = Node(at.start_mark.line + 1, at.start_mark.column + 1, node.value)
                frame.key = (self._key_name(frame, entries, node), node)

    def _key_name(self, frame: _Frame, entries: dict[str, Entry], key: Node) -> str | None:
        """Return the name of a key, or note what is wrong with it and return None."""
        if not isinstance(key.value, str):
            hint = "; put it in quotes" if isinstance(key.value, bool | int | float) else ""
            message = f"a key must be text, found {shown(key.value)}{hint}"
        elif key.value == "<<":
            message = "merge keys ('<<') are not supported; write the keys out"
        elif key.value in entries:
            first = entries[key.value].line
            message = f"duplicate key {shown(key.value)}; it is on line {first} already"
            self._report.add(key.line, key.column, self._loc(), message)
            return None
        else:
            return key.value
        frame.node.wrong = True
        self._report.add(key.line, key.column, self._loc(), message)
        return None
