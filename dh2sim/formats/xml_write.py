"""XML as every writer here makes it: exact numbers, safe comments, the same bytes everywhere."""

from __future__ import annotations

import math
import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterable

from dh2sim.errors import NotFiniteError
from dh2sim.model.mechanism import MechanismModel
from dh2sim.model.robot_model import RobotModel


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
    return repr(0.0 if abs(value) < sys.float_info.min else value)


def numbers(values: Iterable[float]) -> str:
    """Return the texts of several numbers, separated by spaces."""
    texts = [number(value) for value in values]
    text = " ".join(texts)
    return _NotFinite(text) if any(isinstance(each, _NotFinite) for each in texts) else text


def child(parent: ET.Element, tag: str, **attributes: str) -> ET.Element:
    """Append an element; an attribute name that is a Python keyword is given with a trailing underscore."""
    return ET.SubElement(parent, tag, {name.rstrip("_"): value for name, value in attributes.items()})


def document(root: ET.Element, header: Iterable[str]) -> str:
    """Serialise an element tree, indented, after a comment of the given lines.

    Raises:
        NotFiniteError: A number in it is NaN or infinite.
    """
    _require_finite(root, root.tag)
    ET.indent(root, space="  ")
    lines = "\n".join(f"  {line}" for line in header)
    return f"<!--\n{_comment(lines)}\n-->\n{ET.tostring(root, encoding='unicode')}\n"


def _require_finite(element: ET.Element, path: str) -> None:
    for name, text in element.attrib.items():
        if isinstance(text, _NotFinite):
            raise NotFiniteError(f"{path}.{name}", text)
    for inner in element:
        own = inner.get("name") or inner.get("class")
        _require_finite(inner, f"{path}.{inner.tag}" + (f"[{own}]" if own else ""))


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
