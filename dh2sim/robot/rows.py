"""What can be told of each row of the table, or of each axis, even where other parts of the file are wrong."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

from dh2sim.robot.document import Node
from dh2sim.robot.fields import name_problem
from dh2sim.robot.number import NumberError, to_number
from dh2sim.robot.report import Loc
from dh2sim.robot.spec import JointType

Choice = TypeVar("Choice", bound=StrEnum)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RowView:
    """A row of the table, or an axis; None or NaN where the file is wrong."""

    key: str
    """Of the list that it stands in."""
    index: int
    """From 0."""
    node: Node
    name: str | None
    """The name given, or the default one."""
    type: JointType | None
    position: tuple[float, float] | None
    """Limits in the file's units; None where there are none."""

    @property
    def loc(self) -> Loc:
        """Where the row stands."""
        return (self.key, self.index)


def number_at(node: Node | None, names: Mapping[str, float]) -> float:
    """Return a number, or NaN where there is none or a wrong one."""
    try:
        return math.nan if node is None else to_number(node.value, names)
    except NumberError:
        return math.nan


def choice_at(node: Node | None, choices: type[Choice]) -> Choice | None:
    """Return a member of an enumeration, or None where there is none or a wrong one."""
    value = None if node is None else node.value
    return next((choice for choice in choices if choice.value == value), None)


def row_views(root: Node, names: Mapping[str, float], key: str = "joints") -> list[RowView]:
    """Return a view of every entry of the list that stands at ``key``."""
    joints = root.at(key)
    items = joints.value if joints is not None and isinstance(joints.value, list) else []
    return [_view(key, index, node, names) for index, node in enumerate(items)]


def default_name(index: int) -> str:
    """Return the name of a row that is given none; ``index`` counts from 0, the name from 1."""
    return f"joint_{index + 1}"


def _view(key: str, index: int, node: Node, names: Mapping[str, float]) -> RowView:
    name_node = node.at("name")
    name: object = default_name(index) if name_node is None else name_node.value
    limits = node.at("limits", "position")
    lower, upper = (number_at(node.at("limits", "position", side), names) for side in (0, 1))
    return RowView(
        key=key,
        index=index,
        node=node,
        name=name if isinstance(name, str) and name_problem(name) is None else None,
        type=choice_at(node.at("type"), JointType),
        position=None if limits is None else (lower, upper),
    )
