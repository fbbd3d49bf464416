"""Files that say what is random in rollouts."""

from __future__ import annotations

import os
from collections.abc import Iterator

from dh2sim.messages import Loc, shown
from dh2sim.robot.expressions import NumberError, to_number
from dh2sim.robot.yaml_tree import Node, Report, compose, decode, read_yaml_file
from dh2sim.simulate.quantities import NEEDS, Setting, checked_settings, key_parts

OTHERS = "others"
"""Stands in a mapping for the links, joints or rows that it does not name."""


def read_randomization(path: str | os.PathLike[str]) -> dict[str, Setting]:
    """Return what a file makes random, as ``RolloutOptions`` takes it.

    The file maps quantities to numbers or distributions; or, for each link, joint or row, to a mapping of names,
    among them ``others``, to these.

    Raises:
        RobotFileError: The file is wrong; the error holds everything that is, with its place.
        Dh2simError: It cannot be read.
    """
    data, report = read_yaml_file(path)
    root = compose(decode(data, report), report, needs="it maps quantities to numbers or distributions")
    found: dict[str, Setting] = {}
    for key, loc, node in _entries(root, report):
        value = node.value
        try:
            setting = value if isinstance(value, str) else to_number(value, None)
        except NumberError:
            report.add(node.line, node.column, loc, f"expected a number or a distribution, found {shown(value)}")
            continue
        # what a quantity needs besides itself is checked when all are known
        _, problems = checked_settings({key: setting} | dict.fromkeys(_needed(key), 1.0))
        for problem in problems:
            report.add(node.line, node.column, loc, problem)
        found[key] = setting
    if not report.problems:
        for problem in checked_settings(found)[1]:
            report.add(root.line, root.column, (), problem)
    if report.problems:
        raise report.error()
    return found


def _needed(key: str) -> list[str]:
    needed = NEEDS.get(key_parts(key)[0])
    return [] if needed is None else [needed]


def _entries(root: Node, report: Report) -> Iterator[tuple[str, Loc, Node]]:
    """Yield the keys of settings, their places, and what they are set to."""
    if not isinstance(root.value, dict):
        report.add(root.line, root.column, (), "expected a mapping of quantities to numbers or distributions")
        return
    for name, entry in root.value.items():
        if not isinstance(entry.value.value, dict):
            yield name, (name,), entry.value
            continue
        for label, inner in entry.value.value.items():
            yield (name if label == OTHERS else f"{name}[{label}]"), (name, label), inner.value
