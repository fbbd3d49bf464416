"""What a step of a row is drawn with: an arrow for a length, an arc for an angle."""

from __future__ import annotations

import math

import numpy as np

from dh2sim.typing import Array
from dh2sim.view.annotations_steps import Step
from dh2sim.view.items import Arrow, Color, Item, Path, Vector

ARC_RADIUS = 0.8
"""Of an angle's arc; like all that follows a share of the size that is asked for."""
_LEG = 1.0
"""Of the lines from an arc's centre through its ends."""
_TIP = 0.16
_THICKNESS = 0.05
_BESIDE = 0.3
"""Between a mark and its label."""
_ARC_STEP = math.radians(3.0)
_TIP_ANGLE = math.radians(25.0)


def step_marks(step: Step, color: Color, size: float) -> dict[str, Item]:
    """Draw a step that is not zero.

    An arrow runs from the origin of the frame before to that of the frame behind. An arc runs, in the plane across
    the axis of the turn, from an axis of the frame before to where the turn takes it: x for theta, z for alpha and
    beta.
    It goes once around, and then on, for angles beyond a full turn.

    Args:
        step: The step.
        color: Of all of it.
        size: m.

    Returns:
        An arrow named as the quantity, or an arc named so, with its ``…_tip``, ``…_from`` and ``…_to``; in base_link.
    """
    name = step.quantity.value
    if not step.quantity.turns:
        start, end = vector(step.T_before[:3, 3]), vector(step.T_after[:3, 3])
        return {name: Arrow(start=start, end=end, color=color, thickness=_THICKNESS * size)}
    angle, radius = _drawn_angle(step.value), ARC_RADIUS * size
    count = max(2, math.ceil(abs(angle) / _ARC_STEP))
    arc = [_on_arc(step, angle * k / count, radius) for k in range(count + 1)]
    centre = vector(step.T_before[:3, 3])
    legs = {
        f"{name}_{end}": Path(points=(centre, vector(_on_arc(step, at, _LEG * size))), color=color, width=1.0)
        for end, at in (("from", 0.0), ("to", angle))
    }
    return {
        name: Path(points=tuple(map(vector, arc)), color=color, width=3.0),
        f"{name}_tip": Path(points=_tip(step, angle, radius, size), color=color, width=3.0),
        **legs,
    }


def label_place(step: Step, size: float) -> Array:
    """Return where the label of a step would best stand, m in base_link, shape (3,)."""
    if step.quantity.turns:
        angle = _drawn_angle(step.value) if step.is_drawn else 0.0
        return _on_arc(step, 0.5 * angle, (ARC_RADIUS + _BESIDE) * size)
    beside = step.T_before[:3, (step.quantity.axis + 1) % 3]
    middle = 0.5 * (step.T_before[:3, 3] + step.T_after[:3, 3])
    return np.asarray(middle + _BESIDE * size * beside)


def vector(point: Array) -> Vector:
    """Return a point of shape (3,) as a tuple."""
    x, y, z = (float(component) for component in point)
    return x, y, z


def _drawn_angle(angle: float) -> float:
    turn = 2.0 * math.pi
    return angle if abs(angle) <= turn else math.copysign(turn + math.fmod(abs(angle), turn), angle)


def _on_arc(step: Step, angle: float, radius: float) -> Array:
    """Return a point on a step's circle, shape (3,), ``angle`` behind the axis that it starts from."""
    axes = step.T_before[:3, :3]
    match step.quantity.axis:
        case 0:
            first, second = axes[:, 2], -axes[:, 1]
        case 1:
            first, second = axes[:, 2], axes[:, 0]
        case _:
            first, second = axes[:, 0], axes[:, 1]
    return np.asarray(step.T_before[:3, 3] + radius * (math.cos(angle) * first + math.sin(angle) * second))


def _tip(step: Step, angle: float, radius: float, size: float) -> tuple[Vector, ...]:
    """Return the two strokes of an arrowhead at the end of an arc."""
    end = _on_arc(step, angle, radius)
    length = min(_TIP * size, 0.5 * abs(angle) * radius)
    outwards = (end - step.T_before[:3, 3]) / radius
    onwards = math.copysign(1.0, angle) * (_on_arc(step, angle + 0.5 * math.pi, 1.0) - step.T_before[:3, 3])
    back, aside = -length * math.cos(_TIP_ANGLE) * onwards, length * math.sin(_TIP_ANGLE) * outwards
    return vector(end + back + aside), vector(end), vector(end + back - aside)
