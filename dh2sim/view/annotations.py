"""A row of the table explained in the scene: its axes, its common normal, and every number as what it measures."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from numpy.typing import ArrayLike

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.robot.spec import Convention, RobotSpec
from dh2sim.robot.units import AngleUnit
from dh2sim.typing import Array
from dh2sim.view.annotations_marks import label_place, step_marks, vector
from dh2sim.view.annotations_steps import Step, row_steps
from dh2sim.view.items import Color, Item, Label, Path, Scene
from dh2sim.view.notation import Quantity, subscript

COLORS: Final[Mapping[Quantity, Color]] = MappingProxyType(
    {
        Quantity.A: (0.12, 0.49, 0.31),
        Quantity.ALPHA: (0.80, 0.15, 0.52),
        Quantity.D: (0.75, 0.38, 0.00),
        Quantity.THETA: (0.43, 0.20, 0.78),
        Quantity.BETA: (0.05, 0.52, 0.60),
    }
)
"""Of the table's columns, in the scene and wherever else they are shown."""
AXIS_COLOR: Final[Color] = (0.35, 0.40, 0.50)
"""Of joint axes and of the common normal."""
_AXIS = 3.0
"""How far axes go on beyond frames and offsets; like all that follows a share of the size that is asked for."""
_NORMAL = 0.6
"""How far the common normal goes on beyond the axes."""


def row_annotations(
    spec: RobotSpec,
    chain: KinematicChain,
    row: int,
    q: ArrayLike,
    size: float,
    angle: AngleUnit = AngleUnit.DEG,
) -> Scene:
    """Explain a row of the table at a configuration.

    The arrows and arcs, put together in the order of the row's product, lead from DH frame i - 1 to DH frame i:
    theta, d, a, alpha (standard), a, alpha, theta, d (modified), theta, d, a, alpha, beta (Hayati). What is zero has
    a label, but nothing is drawn for it.

    Args:
        spec: The robot.
        chain: Of the same robot.
        row: Of the table, from 0.
        q: Joint vector, rad and m, shape (n,).
        size: Length of the axes that frames are drawn with, m; everything is drawn in proportion.
        angle: Unit of the angles in labels.

    Returns:
        Items below ``/row/``, placed in base_link: ``axis_before`` and ``axis_behind``, the z axes of frames i - 1
        and i; ``normal``, the line of a, which is the common normal of those axes unless a Hayati row has a beta; of
        each quantity its arrow, or its arc with ``_tip``, ``_from`` and ``_to``; and labels, ``…_label``.

    Raises:
        IndexError: There is no such row.
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """
    steps = row_steps(spec, chain, row, q)
    axes, ends = _axes(steps, spec.rows[row].convention, size)
    items: dict[str, Item] = {**axes, "normal": _normal(steps, size)}
    for step in steps:
        color = COLORS[step.quantity]
        if step.is_drawn:
            items.update(step_marks(step, color, size))
        place = vector(label_place(step, size))
        items[f"{step.quantity.value}_label"] = Label(position=place, text=step.text(angle), color=color)
    for name, number in (("axis_before", row), ("axis_behind", row + 1)):
        items[f"{name}_label"] = Label(position=vector(ends[name]), text=f"z{subscript(number)}", color=AXIS_COLOR)
    return {f"/row/{name}": item for name, item in items.items()}


def _axes(steps: tuple[Step, ...], convention: Convention, size: float) -> tuple[dict[str, Item], dict[str, Array]]:
    """Return the z axes of the frames before and behind, and their upper ends; each goes on along its offset d."""
    d = next(step.value for step in steps if step.quantity is Quantity.D)
    of_behind = convention is Convention.MODIFIED
    spans = {
        "axis_before": (steps[0].T_before, 0.0 if of_behind else d),
        "axis_behind": (steps[-1].T_after, -d if of_behind else 0.0),
    }
    lines: dict[str, Item] = {}
    ends = {}
    for name, (T, offset) in spans.items():
        low, high = _extended(offset, _AXIS * size)
        lines[name] = _line(T, 2, low, high)
        ends[name] = T[:3, 3] + (high + 0.2 * size) * T[:3, 2]
    return lines, ends


def _normal(steps: tuple[Step, ...], size: float) -> Path:
    step = next(step for step in steps if step.quantity is Quantity.A)
    return _line(step.T_before, 0, *_extended(step.value, _NORMAL * size))


def _extended(length: float, margin: float) -> tuple[float, float]:
    return min(0.0, length) - margin, max(0.0, length) + margin


def _line(T: Array, axis: int, low: float, high: float) -> Path:
    origin, way = T[:3, 3], T[:3, axis]
    return Path(points=(vector(origin + low * way), vector(origin + high * way)), color=AXIS_COLOR, width=1.0)
