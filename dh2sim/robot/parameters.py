"""Named constants of a robot file, evaluated in the order in which they need each other."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence

from dh2sim.robot.document import Entry, Node
from dh2sim.robot.expressions import CONSTANTS, FUNCTIONS, is_name, names_in
from dh2sim.robot.number import NumberError, to_number
from dh2sim.robot.report import Report
from dh2sim.robot.words import listed, shown


def evaluate_parameters(root: Node, report: Report) -> Mapping[str, float]:
    """Return every parameter's value; NaN for one that is wrong, which is then in ``report``.

    Where keys of ``parameters`` could not be read, every other name has the value NaN as well.
    """
    node = root.at("parameters")
    if node is None:
        return {}
    if not isinstance(node.value, dict):
        message = f"expected a mapping of names to numbers, found {shown(node.value)}"
        if not node.wrong:
            report.add(node.line, node.column, ("parameters",), message)
        return defaultdict(lambda: math.nan)
    for name, entry in node.value.items():
        if not is_name(name):
            report.add(entry.line, entry.column, ("parameters",), _name_message(name))
    entries = {name: entry for name, entry in node.value.items() if is_name(name)}
    values: dict[str, float] = defaultdict(lambda: math.nan) if node.wrong else {}
    values.update(dict.fromkeys(entries, math.nan))
    order, cycles = _order({name: _needs(entry, entries) for name, entry in entries.items()})
    for name in order:
        node = entries[name].value
        if node.wrong:
            continue
        try:
            values[name] = to_number(node.value, values)
        except NumberError as error:
            report.add(node.line, node.column, ("parameters", name), str(error))
    for cycle in cycles:
        node = entries[cycle[0]].value
        message = f"parameters need each other in a circle: {listed([*cycle, cycle[0]], ' -> ')}"
        report.add(node.line, node.column, ("parameters", cycle[0]), message)
    return values


def _name_message(name: str) -> str:
    taken = [*CONSTANTS, *FUNCTIONS]
    if name in taken:
        return f"a parameter cannot be named {shown(name)}; expressions know the name already"
    return f"{shown(name)} is no name for a parameter; letters, digits and '_', not starting with a digit"


def _needs(entry: Entry, entries: Mapping[str, Entry]) -> Sequence[str]:
    text = entry.value.value
    return [name for name in names_in(text) if name in entries] if isinstance(text, str) else []


def _order(needs: Mapping[str, Sequence[str]]) -> tuple[list[str], list[tuple[str, ...]]]:
    """Return names with every name after those it needs, and the cycles that keep others out."""
    waiting_for = {name: len(needed) for name, needed in needs.items()}
    needed_by: dict[str, list[str]] = {name: [] for name in needs}
    for name, needed in needs.items():
        for other in needed:
            needed_by[other].append(name)
    order = [name for name, count in waiting_for.items() if count == 0]
    for name in order:
        for other in needed_by[name]:
            waiting_for[other] -= 1
            if waiting_for[other] == 0:
                order.append(other)
    ordered = set(order)
    cycles: list[tuple[str, ...]] = []
    seen: set[str] = set()
    for start in needs:
        trail: dict[str, int] = {}
        name = start
        while name not in ordered and name not in seen:
            seen.add(name)
            trail[name] = len(trail)
            name = next(other for other in needs[name] if other not in ordered)
        if name in trail:
            cycles.append(tuple(trail)[trail[name] :])
    return order, cycles
