"""xacro in a URDF: what a file still needs it for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

from dh2sim.formats.xml_read import Element
from dh2sim.messages import shown

DEFINITIONS: Final = ("property", "arg", "macro")
"""Elements of xacro that do nothing by themselves."""
_EXPANDED: Final = ("link", "joint", "material")
"""Elements of a robot whose attributes xacro fills in; others may keep ``$(...)`` for other programs."""


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
