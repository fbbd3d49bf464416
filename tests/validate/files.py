"""An exported robot, its files with one thing changed, and what a validation says of them."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.engines.files import PYBULLET
from tests.program import dh2sim

Change = Callable[[ET.Element], None]
Failures = dict[tuple[str, str], dict[str, Any]]
"""What failed, by engine and quantity."""

FILE_ENGINES = {
    "odd.urdf": ("mujoco-urdf", "yourdfpy", "pinocchio", *(["pybullet"] if PYBULLET else [])),
    "odd.xml": ("mujoco-mjcf",),
}
"""Which engines read a file."""


def change(path: Path, how: Change) -> None:
    """Change a file's elements."""
    tree = ET.parse(path)
    root = tree.getroot()
    assert root is not None
    before = ET.tostring(root)
    how(root)
    assert ET.tostring(root) != before
    tree.write(path)


def named(root: ET.Element, tag: str, name: str) -> ET.Element:
    """The element of a tag and a name."""
    [element] = [element for element in root.iter(tag) if element.get("name") == name]
    return element


def part(root: ET.Element, tag: str, name: str, child: str) -> ET.Element:
    """A child of a named element."""
    found = named(root, tag, name).find(child)
    assert found is not None
    return found


def remove(root: ET.Element, unwanted: Callable[[ET.Element], bool]) -> None:
    """Remove all elements of which something holds."""
    for parent in list(root.iter()):
        for element in list(parent):
            if unwanted(element):
                parent.remove(element)


def numbers(element: ET.Element, attribute: str, of: Callable[[list[float]], list[float]]) -> None:
    """Change the numbers of an attribute."""
    values = [float(text) for text in element.get(attribute, "").split()]
    element.set(attribute, " ".join(map(repr, of(values))))


def swap(left: ET.Element, right: ET.Element, *attributes: str) -> None:
    """Swap attributes of two elements."""
    for name in attributes:
        mine, other = left.get(name), right.get(name)
        assert mine is not None
        assert other is not None
        left.set(name, other)
        right.set(name, mine)


def validated(robot: Path, folder: Path | None = None, *options: str, samples: int = 20) -> dict[str, Any]:
    """The report of a validation; its exit status is what the report says."""
    where = () if folder is None else ("--dir", folder)
    run = dh2sim("validate", robot, *where, "--samples", str(samples), "--json", "-", *options)
    report: dict[str, Any] = json.loads(run.out, parse_constant=_refuse)
    assert run.status == (0 if report["ok"] else 1)
    return report


def _refuse(constant: str) -> None:
    raise AssertionError(f"{constant} is not JSON")


def failures(report: dict[str, Any]) -> Failures:
    """What failed of the only robot of a report."""
    [robot] = report["robots"]
    assert robot["ok"] is report["ok"]
    failed = {(entry["engine"], entry["quantity"]): entry for entry in robot["engines"] if entry["ok"] is False}
    assert bool(failed) is not report["ok"]
    return failed


def frames_from(row: int) -> set[str]:
    """The frames of the robot that move with a row."""
    return {*(f"dh_{i}" for i in range(row, 6)), "tool0"}
