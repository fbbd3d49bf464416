"""XML from outside as an immutable tree of elements that know their line and column.

Uses expat itself, because the tree builders of the standard library forget where an element was. Nothing outside the
text is ever opened, and nothing in it is expanded: a document type that declares anything is refused.
"""

from __future__ import annotations

import codecs
import dataclasses
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final, TypeAlias
from xml.parsers import expat

from dh2sim.errors import ImportedFileError, Problem
from dh2sim.messages import did_you_mean, listed, shown

MAX_BYTES: Final = 50_000_000
MAX_DEPTH: Final = 500
MAX_ELEMENTS: Final = 200_000
MAX_ATTRIBUTES: Final = 200
"""Of one element."""
MAX_ATTRIBUTE: Final = 1_000_000
"""Characters of one attribute; an MJCF can hold a whole mesh in one."""
MAX_PROLOG: Final = 1_000_000
"""Bytes before the first element."""
MAX_PROBLEMS: Final = 100
"""Problems reported of one file."""

ENCODINGS: Final = ("utf-8", "us-ascii", "iso-8859-1", "utf-16", "utf-16le", "utf-16be", "windows-1252")

MAX_JOINED: Final = 20
"""Attributes without a blank before them, which other readers accept."""

_PIECE: Final = 65_536
_INVALID_TOKEN: Final = expat.errors.codes[expat.errors.XML_ERROR_INVALID_TOKEN]
_JOINED: Final = re.compile(rb"[\"'][A-Za-z_]")
_BEFORE_DECLARATION: Final = re.compile(r"((?:[ \t\r\n]|<!--.*?-->)+)(<\?xml[ \t\r\n].*?\?>)", re.DOTALL)
_LATER_MARK: Final = re.compile("^([ \t\r\n]*)(?:\ufeff|\xef\xbb\xbf)")
"""A second byte order mark, or one behind blanks; that of UTF-8 read as Latin-1."""
_COMMENT: Final = re.compile(r"<!--(.*?)-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>", re.DOTALL)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Element:
    """An element, without its text."""

    tag: str
    """With its prefix, as in the file."""
    attributes: Mapping[str, str] = field(repr=False)
    children: tuple[Element, ...] = field(repr=False)
    line: int
    """Of its start tag, counted from 1."""
    column: int
    """Of its start tag, counted from 1."""
    file: str = ""
    """What messages call the file it is in, where that is not the one that was parsed."""

    def all(self, tag: str) -> tuple[Element, ...]:
        """Return the children of this tag."""
        return tuple(child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Element | None:
        """Return the first child of this tag, or None."""
        return next((child for child in self.children if child.tag == tag), None)

    def walk(self) -> Iterator[Element]:
        """Yield this element and everything below it, in the order of the file."""
        waiting = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting += reversed(element.children)


class XmlReport:
    """Collects the problems of one XML file."""

    def __init__(self, file: str) -> None:
        """Start with none; ``file`` is the name in messages."""
        self.file = file
        self.problems: list[Problem] = []

    def add(self, element: Element, path: str, message: str) -> None:
        """Note a problem of an element, or of the attribute that ``path`` ends with."""
        self.problems.append(
            Problem(
                file=element.file or self.file, line=element.line, column=element.column, path=path, message=message
            )
        )

    def guess(self, name: str, known: Iterable[str]) -> str:
        """Return ``" Did you mean 'x'?"``; empty where there is no guess, or too many problems to show it."""
        return did_you_mean(name, known) if len(self.problems) < MAX_PROBLEMS else ""

    def check(self) -> None:
        """Raise an ImportedFileError if there is a problem."""
        if self.problems:
            raise self._error()

    def failure(self, element: Element, path: str, message: str) -> ImportedFileError:
        """Note a last problem and return all of them, to be raised."""
        self.add(element, path, message)
        return self._error()

    def _error(self) -> ImportedFileError:
        """Return all problems, each of them once; of very many the first in the file."""
        problems = sorted(dict.fromkeys(self.problems))
        if len(problems) > MAX_PROBLEMS:
            more = f"... and {len(problems) - MAX_PROBLEMS} more problems"
            problems = problems[:MAX_PROBLEMS]
            # "~" sorts it behind a problem at the same place
            problems.append(dataclasses.replace(problems[-1], path="~", message=more))
        return ImportedFileError(problems)


Place: TypeAlias = tuple[str, int, int]
"""File, line and column of an element."""


def parse_xml(data: bytes, *, file: str, places: Sequence[Place] = ()) -> Element:
    """Return the root element of an XML file.

    Args:
        data: The file's content.
        file: Its name, for messages.
        places: Where its elements come from, in the order of the text, if they were not written here.

    Raises:
        ImportedFileError: Not well-formed; in an encoding that is not read; with a document type that declares
            anything, such as entities; or larger than the limits above.
    """
    if len(data) > MAX_BYTES:
        raise _error(file, 1, 1, f"the file has {len(data)} bytes; at most {MAX_BYTES} are read")
    data = tolerated(data)
    for _ in range(MAX_JOINED + 1):
        builder = _Builder(places)
        try:
            _feed(builder, data)
        except _RefusedError as error:
            raise _error(file, error.line, error.column, error.message) from None
        except expat.ExpatError as error:
            at = builder.parser.ErrorByteIndex
            if error.code == _INVALID_TOKEN and _JOINED.match(data, max(at - 1, 0)):
                data = data[:at] + b" " + data[at:]
                continue
            message = _not_utf_8(builder, data) or _of_markup(builder, data)
            message = message or f"not well-formed XML: {expat.ErrorString(error.code)}"
            raise _error(file, error.lineno, error.offset + 1, message) from None
        return builder.root()
    raise _error(file, 1, 1, f"more than {MAX_JOINED} attributes without a blank before them")


def tolerated(data: bytes) -> bytes:
    """Return a file with what expat alone refuses made right, every element at its place.

    MuJoCo, urdfdom and other readers of robots accept blanks and comments before the declaration, and ``--`` in
    comments. A byte order mark would count as a column.
    """
    data = data.removeprefix(codecs.BOM_UTF8)
    is_utf_16 = data[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
    if not is_utf_16 and data[:1] not in b" \t\r\n\xef" and b"<!--" not in data:
        return data
    encoding = "utf-16" if is_utf_16 else "latin-1"  # which keeps every byte
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        return data
    text = _LATER_MARK.sub(r"\1", text)
    return _COMMENT.sub(_without_dashes, _declared_first(text)).encode(encoding)


def _declared_first(text: str) -> str:
    """Return a text with its declaration moved to the front, and blanks in its place."""
    found = _BEFORE_DECLARATION.match(text)
    if found is None:
        return text
    before, declaration = found.groups()
    on_line_1 = not any(end in before + declaration for end in "\r\n")
    blanks = "" if on_line_1 else re.sub(r"[^\r\n]", " ", declaration)
    return re.sub(r"\s", " ", declaration) + before + blanks + text[found.end() :]


def _without_dashes(comment: re.Match[str]) -> str:
    inside = comment.group(1)
    if inside is None or not ("--" in inside or inside.endswith("-")):
        return comment.group()
    return f"<!--{inside.replace('-', ' ')}-->"


def _feed(builder: _Builder, data: bytes) -> None:
    """Give expat the text: piece by piece up to the root element, so that a document type is seen before it acts.

    An exception of a handler is raised only when expat has gone through all it was given.
    """
    fed = 0
    while not builder.began and fed < len(data):
        if fed >= MAX_PROLOG:
            raise _RefusedError(1, 1, f"no element in the first {MAX_PROLOG} bytes")
        builder.parser.Parse(data[fed : fed + _PIECE], False)
        fed += _PIECE
    builder.parser.Parse(data[fed:], True)


class _RefusedError(Exception):
    """The file is refused for something at a place."""

    def __init__(self, line: int, column: int, message: str) -> None:
        super().__init__(message)
        self.line, self.column, self.message = line, column, message


@dataclass(slots=True, eq=False)
class _Open:
    """An element that has begun."""

    tag: str
    attributes: Mapping[str, str]
    place: Place
    children: list[Element] = field(default_factory=list)

    def closed(self) -> Element:
        return Element(
            tag=self.tag,
            attributes=MappingProxyType(self.attributes),
            children=tuple(self.children),
            file=self.place[0],
            line=self.place[1],
            column=self.place[2],
        )


class _Builder:
    """Makes the tree from what expat sees."""

    def __init__(self, places: Sequence[Place]) -> None:
        self._places = places
        self.parser = parser = expat.ParserCreate()
        parser.XmlDeclHandler = self._declaration
        parser.StartDoctypeDeclHandler = self._doctype
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        self.encoding: str | None = None
        self.began = False
        self._count = 0
        self._open = [_Open("", {}, ("", 1, 1))]

    def root(self) -> Element:
        return self._open[0].children[0]

    def _refuse(self, message: str) -> None:
        raise _RefusedError(self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1, message)

    def _declaration(self, _version: str, encoding: str | None, _standalone: int) -> None:
        self.encoding = encoding
        if encoding is not None and encoding.lower() not in ENCODINGS:
            self._refuse(f"the encoding {shown(encoding)} is not read. Allowed: {listed(ENCODINGS)}")

    def _doctype(self, name: str, system: str | None, public: str | None, has_internal_subset: int) -> None:
        if has_internal_subset or system is not None or public is not None:
            what = f"<!DOCTYPE {name if len(name) < 50 else '...'} ...>"
            self._refuse(f"{what} with declarations is refused: entities and external files are never read")

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self.began = True
        self._count += 1
        if self._count > MAX_ELEMENTS:
            self._refuse(f"more than {MAX_ELEMENTS} elements")
        if len(self._open) > MAX_DEPTH:
            self._refuse(f"elements are nested more than {MAX_DEPTH} deep")
        if len(attributes) > MAX_ATTRIBUTES:
            self._refuse(f"an element of {len(attributes)} attributes; at most {MAX_ATTRIBUTES} are read")
        for name, value in attributes.items():
            if len(name) > MAX_ATTRIBUTE or len(value) > MAX_ATTRIBUTE:
                length = max(len(name), len(value))
                message = f"an attribute of {length} characters; at most {MAX_ATTRIBUTE} are read"
                self._refuse(message)
        parser = self.parser
        place = ("", parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)
        if self._count <= len(self._places):
            place = self._places[self._count - 1]
        self._open.append(_Open(tag, attributes, place))

    def _end(self, _tag: str) -> None:
        element = self._open.pop().closed()
        self._open[-1].children.append(element)


def _not_utf_8(builder: _Builder, data: bytes) -> str | None:
    """Return the message where expat's "invalid token" means a byte of another encoding, else None."""
    if (builder.encoding or "utf-8").lower() != "utf-8" or data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return None
    at = builder.parser.ErrorByteIndex
    try:
        data.decode()
    except UnicodeDecodeError as error:
        if error.start == at:
            declaration = '<?xml version="1.0" encoding="iso-8859-1"?>'
            return f"not UTF-8: byte 0x{data[at]:02x}; name the file's encoding: {declaration}"
    return None


def _of_markup(builder: _Builder, data: bytes) -> str | None:
    """Return the message where a comment is what is wrong, or a merge, else None."""
    at = builder.parser.ErrorByteIndex
    if data[data.rfind(b"\n", 0, at) + 1 :].startswith(b"<<<<<<< "):
        return "not well-formed XML: a line of a merge that was not resolved"
    start = data.rfind(b"<!--", 0, at + 4)
    if start >= 0 and b"-->" not in data[start + 4 :]:
        line = data.count(b"\n", 0, start) + 1
        return f"not well-formed XML: the comment that begins on line {line} has no end '-->'"
    if data.startswith(b"<!--", at):
        return "not well-formed XML: a comment cannot be inside a tag"
    if re.search(rb"<!(?!--)[ \t]*-", data[max(at - 3, 0) : at + 3]):
        return "not well-formed XML: a comment begins with '<!--'"
    return None


def _error(file: str, line: int, column: int, message: str) -> ImportedFileError:
    return ImportedFileError([Problem(file=file, line=max(line, 1), column=max(column, 1), path="", message=message)])


def place(tag: str, name: str) -> str:
    """Return the start of the path of a problem, such as ``joint[elbow]``."""
    plain = name.isprintable() and 0 < len(name) <= 60
    return f"{tag}[{name if plain else shown(name)}]"
