"""Checks between parts of an axes file; each works on what is well-formed and leaves the rest alone."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from dh2sim.robot.axes.schema import AxisEntry
from dh2sim.robot.checks import check_actuators, check_configurations, check_names, check_type
from dh2sim.robot.document import Node
from dh2sim.robot.report import Report
from dh2sim.robot.rows import RowView, row_views
from dh2sim.robot.spec import JointType
from dh2sim.robot.words import closest


def check_axes(root: Node, names: Mapping[str, float], report: Report) -> None:
    """Note in ``report`` what does not go together; ``names`` are the evaluated parameters."""
    axes = [_never_fixed(axis) for axis in row_views(root, names, "axes")]
    check_names(axes, report)
    for axis in axes:
        check_type(axis, report)
        _check_point(axis, report)
    check_configurations(root, axes, names, report, each="axis")
    check_actuators(root, axes, report)


def _never_fixed(axis: RowView) -> RowView:
    """Return a view whose type is unknown where it is one that only a row of a table can have."""
    return dataclasses.replace(axis, type=None) if axis.type is JointType.FIXED else axis


def _check_point(axis: RowView, report: Report) -> None:
    """A turning joint has a point that its axis goes through; a misspelt one has been told."""
    keys = axis.node.value
    if axis.type is None or not axis.type.turns or not isinstance(keys, dict) or axis.node.wrong:
        return
    allowed = AxisEntry.model_fields
    if "point" not in keys and all(key in allowed or closest(key, allowed) != "point" for key in keys):
        message = f"missing key 'point': a {axis.type} joint needs a point of its axis; only a prismatic one does not"
        report.add(axis.node.line, axis.node.column, axis.loc, message)
