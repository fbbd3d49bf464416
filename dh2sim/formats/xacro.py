"""xacro in a URDF: what a file still needs it for, and its expansion by the package ``xacro``."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final, NamedTuple

from dh2sim.errors import ImportedFileError, MissingExtraError, Problem
from dh2sim.extras import require_extra
from dh2sim.formats.xml_read import Element, XmlReport, parse_xml
from dh2sim.limited_process import WorkerError, ask_worker
from dh2sim.messages import shown

DEFINITIONS: Final = ("property", "arg", "macro")
"""Elements of xacro that do nothing by themselves."""
_EXPANDED: Final = ("link", "joint", "material")
"""Elements of a robot whose attributes xacro fills in; others may keep ``$(...)`` for other programs."""


TIME_LIMIT: Final = 20
"""Seconds of processor time for an expansion."""
_WORKER: Final = "dh2sim.formats.xacro_worker"
NO_LINK: Final = "the file has no <link>, only definitions for xacro; import a file that uses them"


class Unexpanded(NamedTuple):
    """Something that only xacro can replace."""

    element: Element
    what: str
    """For messages."""


def unexpanded(robot: Element) -> Unexpanded | None:
    """Return the first thing in a URDF that xacro has to replace, or None.

    Definitions that xacro has left behind, or that nothing uses, need no replacement.

    Args:
        robot: The root element.
    """
    prefixes = _prefixes(robot)
    macros = {
        element.attributes.get("name", "")
        for element in robot.children
        if _name(element.tag, prefixes) == "macro"  # called without a prefix in old files
    }
    for child in (robot, *robot.children):
        for element in [robot] if child is robot else _outside_macros(child, prefixes):
            name = _name(element.tag, prefixes)
            if name in DEFINITIONS:
                continue
            if name is not None or element.tag in macros:
                return Unexpanded(element, f"<{element.tag[:60]}>")
            for text in element.attributes.values() if child is robot or child.tag in _EXPANDED else ():
                if "${" in text or "$(" in text:
                    return Unexpanded(element, shown(text))
    return None


def is_definition(element: Element, robot: Element) -> bool:
    """Whether an element of a URDF only defines something for xacro."""
    return _name(element.tag, _prefixes(robot)) in DEFINITIONS


def _prefixes(robot: Element) -> tuple[str, ...]:
    """Return the prefixes of xacro's elements, with the colon."""
    declared = [name[6:] for name, uri in robot.attributes.items() if name[:6] == "xmlns:" and "xacro" in uri]
    return tuple(f"{prefix}:" for prefix in ["xacro", *declared])


def _name(tag: str, prefixes: tuple[str, ...]) -> str | None:
    """Return the name of an element of xacro without its prefix; None for other elements."""
    return tag.partition(":")[2] if tag.startswith(prefixes) else None


def _outside_macros(element: Element, prefixes: tuple[str, ...]) -> Iterator[Element]:
    """Yield an element and those below it, but not what is in a macro's body."""
    waiting = [element]
    while waiting:
        found = waiting.pop()
        yield found
        if _name(found.tag, prefixes) not in DEFINITIONS:
            waiting += reversed(found.children)


class Expanded(NamedTuple):
    """A file that xacro has expanded."""

    robot: Element
    """The root element; it and those below it know where they were written."""
    messages: tuple[str, ...]
    """Warnings of xacro or of the file itself."""


def expand(data: bytes, *, file: str, path: Path, root: Path | None, arguments: Mapping[str, str]) -> Expanded:
    """Replace everything that xacro replaces.

    It is done in another process, in which expressions can reach nothing but the file's own symbols, and nothing
    outside of a folder is read (``xacro_worker``). ``$(find package)`` is a folder below it with a ``package.xml`` of
    that name; environment variables are not read.

    Args:
        data: The file's content.
        file: Its name, for messages.
        path: Where it is; relative names in it start from there.
        root: Folder outside of which no file is read; by default the file's own.
        arguments: Values of its ``xacro:arg``.

    Raises:
        ImportedFileError: xacro refuses the file, or it takes too long.
        MissingExtraError: xacro is not installed.
    """
    try:
        require_extra("xacro", "xacro", what="xacro")
    except MissingExtraError as error:
        found = unexpanded(parse_xml(data, file=file))
        line, column, what = (1, 1, file) if found is None else (found.element.line, found.element.column, found.what)
        raise MissingExtraError(f"{file}:{line}:{column}: found {what}: {error}") from None
    request = {
        "text": data.decode("latin-1"),
        "file": file,
        "path": os.path.abspath(path),
        "root": os.path.abspath(path.parent if root is None else root),
        "allowed": "the file's folder" if root is None else str(root),
        "arguments": dict(arguments),
    }
    try:
        answer = json.loads(ask_worker(_WORKER, json.dumps(request).encode(), seconds=TIME_LIMIT))
    except WorkerError as error:
        raise ImportedFileError(
            [Problem(file=file, line=1, column=1, path="", message=f"xacro cannot expand the file: {error}")]
        ) from None
    if "problems" in answer:
        raise ImportedFileError(Problem(**problem) for problem in answer["problems"])
    places = [(str(name), int(line), int(column)) for name, line, column in answer["places"]]
    robot = parse_xml(answer["text"].encode(), file=file, places=places)
    if robot.first("link") is None:
        raise XmlReport(file).failure(robot, "", NO_LINK)
    return Expanded(robot, tuple(answer["messages"]))
