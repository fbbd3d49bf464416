"""XML as every writer here makes it: exact numbers, safe comments, the same bytes everywhere."""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterable

from dh2sim.model.robot_model import RobotModel


def number(value: float) -> str:
    """Return a text that reads back as the same double; minus zero becomes zero.

    So do subnormal doubles, those below 2.3e-308: MuJoCo takes them for numbers that are too large.
    """
    value = float(value)
    return repr(0.0 if abs(value) < sys.float_info.min else value)


def numbers(values: Iterable[float]) -> str:
    """Return the texts of several numbers, separated by spaces."""
    return " ".join(number(value) for value in values)


def child(parent: ET.Element, tag: str, **attributes: str) -> ET.Element:
    """Append an element; an attribute name that is a Python keyword is given with a trailing underscore."""
    return ET.SubElement(parent, tag, {name.rstrip("_"): value for name, value in attributes.items()})


def document(root: ET.Element, header: Iterable[str]) -> str:
    """Serialise an element tree, indented, after a comment of the given lines."""
    ET.indent(root, space="  ")
    lines = "\n".join(f"  {line}" for line in header)
    return f"<!--\n{_comment(lines)}\n-->\n{ET.tostring(root, encoding='unicode')}\n"


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


def provenance(model: RobotModel) -> list[str]:
    """Return the lines that every exported file begins with: source, its hash, what was estimated."""
    source = model.spec.source_file
    origin = "a robot made in code" if source is None else f"{source.name} (SHA-256 {source.sha256})"
    return [
        f"{model.name}: made by dh2sim from {origin}.",
        "Do not edit: change the robot file and export again.",
        *(entry.sentence for entry in model.estimates),
    ]
