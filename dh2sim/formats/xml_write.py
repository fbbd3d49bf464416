"""XML as every writer here makes it: exact numbers, safe comments, the same bytes everywhere."""

from __future__ import annotations

import math
import re
import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from typing import Final

from dh2sim.errors import NotFiniteError
from dh2sim.model.mechanism import MechanismModel
from dh2sim.model.robot_model import RobotModel

_LEAST: Final = sys.float_info.min
_MOST: Final = sys.float_info.max


class _NotFinite(str):
    """Text of numbers of which one is not finite: ``document``, which knows its place, refuses it."""

    __slots__ = ()


def number(value: float) -> str:
    """Return a text that reads back as the same double; minus zero becomes zero.

    So do subnormal doubles, those below 2.3e-308: MuJoCo takes them for numbers that are too large. A document does
    not take the text of a number that is not finite.
    """
    value = float(value)
    if not math.isfinite(value):
        return _NotFinite(value)
    return repr(0.0 if abs(value) < _LEAST else value)


def numbers(values: Iterable[float]) -> str:
    """Return the texts of several numbers, separated by spaces."""
    texts = [repr(v) if _LEAST <= abs(v) <= _MOST else number(v) for v in map(float, values)]
    text = " ".join(texts)
    return _NotFinite(text) if _NotFinite in map(type, texts) else text


def child(parent: ET.Element, tag: str, **attributes: str) -> ET.Element:
    """Append an element; its attribute ``class``, a keyword of Python's, is given as ``class_``."""
    if "class_" in attributes:
        attributes = {name.rstrip("_"): value for name, value in attributes.items()}
    return ET.SubElement(parent, tag, attributes)


def document(root: ET.Element, header: Iterable[str]) -> str:
    """Serialise an element tree, indented, after a comment of the given lines.

    Raises:
        NotFiniteError: A number in it is NaN or infinite.
    """
    comment = _comment("\n".join(f"  {line}" for line in header))
    lines = [f"<!--\n{comment}\n-->\n"]
    _serialise(root, "", (), lines)
    return "".join(lines)


def _serialise(element: ET.Element, indent: str, parents: tuple[ET.Element, ...], lines: list[str]) -> None:
    """Append the lines of an element: the bytes of ElementTree, sooner, as there are no namespaces and texts."""
    start = f"{indent}<{element.tag}"
    for name, text in element.attrib.items():
        if text.__class__ is _NotFinite:
            raise NotFiniteError(f"{_path((*parents, element))}.{name}", text)
        start += f' {name}="{text.translate(_ESCAPED) if _special(text) else text}"'
    if not len(element):
        lines.append(f"{start} />\n")
        return
    lines.append(f"{start}>\n")
    parents, deeper = (*parents, element), f"{indent}  "
    for inner in element:
        _serialise(inner, deeper, parents, lines)
    lines.append(f"{indent}</{element.tag}>\n")


_special: Final = re.compile(r'[&<>"\r\n\t]').search
_ESCAPED: Final = str.maketrans(
    {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "\r": "&#13;", "\n": "&#10;", "\t": "&#09;"}
)


def _path(elements: tuple[ET.Element, ...]) -> str:
    names = [element.get("name") or element.get("class") for element in elements[1:]]
    inner = (
        f".{each.tag}[{name}]" if name else f".{each.tag}" for each, name in zip(elements[1:], names, strict=True)
    )
    return elements[0].tag + "".join(inner)


def _comment(text: str) -> str:
    """Return a text fit for a comment: XML forbids two hyphens there, control characters and surrogates anywhere."""
    while "--" in text:
        text = text.replace("--", "- -")
    if text.endswith("-"):
        text += " "
    return "".join(
        c if c in "\n\t" or (c >= " " and not "\ud800" <= c <= "\udfff" and c not in "\ufffe\uffff") else " "
        for c in text
    )


def provenance(model: RobotModel | MechanismModel) -> list[str]:
    """Return the lines that every exported file begins with: source, its hash, what was estimated."""
    source = model.spec.source_file
    origin = "a robot made in code" if source is None else f"{source.name} (SHA-256 {source.sha256})"
    return [
        f"{model.name}: made by dh2sim from {origin}.",
        "Do not edit: change the robot file and export again.",
        *(entry.sentence for entry in model.estimates),
    ]
