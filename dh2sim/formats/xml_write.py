"""XML as every writer here makes it: exact numbers, safe comments, the same bytes everywhere."""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterable

from dh2sim.model.robot_model import JointModel, LinkModel, RobotModel


def number(value: float) -> str:
    """Text that reads back as the same double; minus zero is written as zero.

    So are the doubles below 2.3e-308, the subnormal ones: MuJoCo takes them for numbers that are too large.
    """
    value = float(value)
    return repr(0.0 if abs(value) < sys.float_info.min else value)


def numbers(values: Iterable[float]) -> str:
    """Several numbers, separated by spaces."""
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
    """XML forbids two hyphens in a row in a comment, and control characters and lone surrogates anywhere."""
    while "--" in text:
        text = text.replace("--", "- -")
    if text.endswith("-"):
        text += " "
    return "".join(
        c if c in "\n\t" or (c >= " " and not "\ud800" <= c <= "\udfff" and c not in "\ufffe\uffff") else " "
        for c in text
    )


def provenance(model: RobotModel) -> list[str]:
    """The lines that every exported file begins with: source, its hash, what was estimated."""
    source = model.spec.source_file
    origin = "a robot made in code" if source is None else f"{source.name} (SHA-256 {source.sha256})"
    lines = [
        f"{model.name}: made by dh2sim from {origin}.",
        "Do not edit: change the robot file and export again.",
    ]
    lines += estimates(model.links)
    return lines


def estimates(links: Iterable[LinkModel]) -> list[str]:
    """One line for each set of properties that was estimated, naming the links."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for link in links:
        if link.estimated:
            groups.setdefault(link.estimated, []).append(link.name)
    return [
        f"Estimated from the shapes, not measured: {', '.join(properties)} of {_spans(names)}."
        for properties, names in groups.items()
    ]


def assumptions(joints: Iterable[JointModel]) -> list[str]:
    """One line for each set of limits that was assumed, naming the joints."""
    moving = [joint for joint in joints if joint.joint.type.moves]
    groups: dict[tuple[str, ...], list[str]] = {}
    for joint in moving:
        if joint.assumed:
            groups.setdefault(joint.assumed, []).append(joint.name)
    return [
        f"Assumed, not given: {', '.join(quantities)} limits of "
        f"{'all joints' if len(names) == len(moving) else ', '.join(names)}."
        for quantities, names in groups.items()
    ]


def _spans(names: list[str]) -> str:
    """link_1, link_2, link_3, link_5 -> link_1 … link_3, link_5."""
    runs: list[list[str]] = []
    for name in names:
        if runs and int(name.rsplit("_", 1)[1]) == int(runs[-1][-1].rsplit("_", 1)[1]) + 1:
            runs[-1].append(name)
        else:
            runs.append([name])
    return ", ".join(" to ".join(dict.fromkeys((run[0], run[-1]))) for run in runs)
