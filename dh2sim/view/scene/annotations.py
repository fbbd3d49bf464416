"""A row of the table explained in the scene: its axes, its common normal, and every number as what it measures.

How the quantities of a row are written: letters and indices as in the textbooks.

A row of the table as elementary steps: what is turned or slid, by how much, from which frame.

What a step of a row is drawn with: an arrow for a length, an arc for an angle.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.forward import frame_poses
from dh2sim.kinematics.transforms import compose, joint_part, link_part, second_twist
from dh2sim.robot.spec import AngleUnit, Convention, RobotSpec
from dh2sim.typing import Array, read_only
from dh2sim.view.scene.items import Arrow, Color, Item, Label, Polyline, Scene, Vector

_SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


class Quantity(StrEnum):
    """A column of the table."""

    A = "a"
    ALPHA = "alpha"
    D = "d"
    THETA = "theta"
    BETA = "beta"

    @property
    def turns(self) -> bool:
        """Whether it is an angle."""
        return self not in (Quantity.A, Quantity.D)

    @property
    def axis(self) -> int:
        """Of the frame at hand, about or along which it goes: 0 for x, 1 for y, 2 for z."""
        return {Quantity.A: 0, Quantity.ALPHA: 0, Quantity.BETA: 1}.get(self, 2)


_LETTERS = {Quantity.ALPHA: "α", Quantity.THETA: "θ", Quantity.BETA: "β"}


def symbol(quantity: Quantity, convention: Convention, row: int) -> str:
    """Return letter and index of a quantity, such as ``a₂``.

    The index is that of the row; a and alpha of a modified row carry one less, as in J. J. Craig, Introduction to
    Robotics.

    Args:
        quantity: A column of the table.
        convention: Of the row.
        row: From 0.
    """
    before = convention is Convention.MODIFIED and quantity in (Quantity.A, Quantity.ALPHA)
    return f"{_LETTERS.get(quantity, quantity.value)}{subscript(row if before else row + 1)}"


def subscript(number: int) -> str:
    """Return a number in small figures below the line."""
    return str(number).translate(_SUBSCRIPTS)


NOTHING = 1e-9
"""m or rad: what is smaller is rounding, as 0.3 * cos(pi / 2) is; it is told as 0 and not drawn."""


ORDER = {
    Convention.STANDARD: (Quantity.THETA, Quantity.D, Quantity.A, Quantity.ALPHA),
    Convention.MODIFIED: (Quantity.A, Quantity.ALPHA, Quantity.THETA, Quantity.D),
    Convention.HAYATI: (Quantity.THETA, Quantity.D, Quantity.A, Quantity.ALPHA, Quantity.BETA),
}
"""In which order a row of each convention goes from frame i - 1 to frame i."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Step:
    """A step of a row; it leads from one frame to the next."""

    quantity: Quantity
    symbol: str
    """Letter and index, such as ``a₂``."""
    value: float
    """m or rad, with the joint coordinate."""
    moves: bool
    """Whether the joint coordinate is in it."""
    T_before: Array = field(repr=False)
    """Pose of the frame that it starts from, in base_link, shape (4, 4)."""
    T_after: Array = field(repr=False)
    """Pose of the frame that it leads to."""

    @property
    def is_drawn(self) -> bool:
        """Whether there is something to see."""
        return abs(self.value) > NOTHING

    def text(self, unit: AngleUnit) -> str:
        """Return name, index and value, such as ``a₂ = 0.4318 m``; a star marks what moves."""
        return f"{self.symbol}{'*' if self.moves else ''} = {self._told(unit)}"

    def _told(self, unit: AngleUnit) -> str:
        if not self.moves and not self.is_drawn:
            return "0"
        if not self.quantity.turns:
            return f"{_number(self.value, 3 if self.moves else None)} m"
        if unit is AngleUnit.DEG:
            return f"{_number(math.degrees(self.value), 1 if self.moves else None)}°"
        return f"{_number(self.value, 3 if self.moves else None)} rad"


def row_steps(spec: RobotSpec, chain: KinematicChain, row: int, q: ArrayLike) -> tuple[Step, ...]:
    """Return the steps from DH frame i - 1 to DH frame i, in the order of the row's product.

    Args:
        spec: The robot.
        chain: Of the same robot.
        row: Of the table, from 0.
        q: Joint vector, rad and m, shape (n,).

    Raises:
        IndexError: There is no such row.
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """
    if not 0 <= row < len(spec.rows):
        raise IndexError(f"{spec.name} has rows 0 to {len(spec.rows) - 1}, not {row}")
    T = read_only(frame_poses(chain, q)[row])
    entry = spec.rows[row]
    coordinate = _coordinate(spec, row, q)
    steps = []
    for quantity in ORDER[entry.convention]:
        moves = entry.type.moves and quantity is (Quantity.THETA if entry.type.turns else Quantity.D)
        value = getattr(entry, quantity.value) + (coordinate if moves else 0.0)
        T_after = compose(T, _transform(quantity, value))
        name = symbol(quantity, entry.convention, row)
        steps.append(Step(quantity=quantity, symbol=name, value=value, moves=moves, T_before=T, T_after=T_after))
        T = T_after
    return tuple(steps)


def _coordinate(spec: RobotSpec, row: int, q: ArrayLike) -> float:
    if not spec.rows[row].type.moves:
        return 0.0
    place = sum(before.type.moves for before in spec.rows[:row])
    value = float(read_only(q)[place])
    return -value if spec.rows[row].flip else value


def _transform(quantity: Quantity, value: float) -> Array:
    match quantity:
        case Quantity.A:
            return link_part(value, 0.0)
        case Quantity.ALPHA:
            return link_part(0.0, value)
        case Quantity.D:
            return joint_part(0.0, value)
        case Quantity.THETA:
            return joint_part(value, 0.0)
        case Quantity.BETA:
            return second_twist(value)


def _number(value: float, decimals: int | None) -> str:
    """Write a number; one that changes all the time keeps its decimals, so that it does not jump about."""
    return f"{value:.6g}" if decimals is None else f"{round(value, decimals) + 0.0:.{decimals}f}"


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
        f"{name}_{end}": Polyline(points=(centre, vector(_on_arc(step, at, _LEG * size))), color=color, width=1.0)
        for end, at in (("from", 0.0), ("to", angle))
    }
    return {
        name: Polyline(points=tuple(map(vector, arc)), color=color, width=3.0),
        f"{name}_tip": Polyline(points=_tip(step, angle, radius, size), color=color, width=3.0),
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


def _normal(steps: tuple[Step, ...], size: float) -> Polyline:
    step = next(step for step in steps if step.quantity is Quantity.A)
    return _line(step.T_before, 0, *_extended(step.value, _NORMAL * size))


def _extended(length: float, margin: float) -> tuple[float, float]:
    return min(0.0, length) - margin, max(0.0, length) + margin


def _line(T: Array, axis: int, low: float, high: float) -> Polyline:
    origin, way = T[:3, 3], T[:3, axis]
    return Polyline(points=(vector(origin + low * way), vector(origin + high * way)), color=AXIS_COLOR, width=1.0)
