"""A row of the table explained in the scene: its axes, its common normal, and what each number measures.

A row is a product of elementary steps, each a rotation or a translation by one number of the table. A length is drawn
as an arrow, an angle as an arc, both labelled with letter and index as in the textbooks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.forward import frame_poses
from dh2sim.kinematics.transforms import compose, joint_part, link_part, second_twist
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit
from dh2sim.typing import Array, read_only
from dh2sim.view.scene.items import ORIGIN, Arrow, Color, Item, Label, Placed, Polyline, Scene, Triad, vector
from dh2sim.view.scene.solids import orientation_of, position_of

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
        """Axis of the rotation or translation: 0 for x, 1 for y, 2 for z."""
        return {Quantity.A: 0, Quantity.ALPHA: 0, Quantity.BETA: 1}.get(self, 2)


LETTERS = {Quantity.ALPHA: "α", Quantity.THETA: "θ", Quantity.BETA: "β"}


def symbol(quantity: Quantity, convention: Convention, row: int) -> str:
    """Return letter and index of a quantity, such as ``a₂``.

    The index is the row's number; for a and alpha of a modified row it is one less, as in J. J. Craig, Introduction
    to Robotics.

    Args:
        quantity: A column of the table.
        convention: Of the row.
        row: From 0.
    """
    number = row if is_indexed_before(quantity, convention) else row + 1
    return f"{LETTERS.get(quantity, quantity.value)}{subscript(number)}"


def is_indexed_before(quantity: Quantity, convention: Convention) -> bool:
    """Return whether a quantity of row i has the index i - 1."""
    return convention is Convention.MODIFIED and quantity in (Quantity.A, Quantity.ALPHA)


def subscript(number: int) -> str:
    """Return a number in subscript digits."""
    return str(number).translate(_SUBSCRIPTS)


ZERO = 1e-9
"""m or rad: smaller values are rounding errors, as of 0.3 * cos(pi / 2), and count as 0."""
ORDER = {
    Convention.STANDARD: (Quantity.THETA, Quantity.D, Quantity.A, Quantity.ALPHA),
    Convention.MODIFIED: (Quantity.A, Quantity.ALPHA, Quantity.THETA, Quantity.D),
    Convention.HAYATI: (Quantity.THETA, Quantity.D, Quantity.A, Quantity.ALPHA, Quantity.BETA),
}
"""Order of the steps from frame i - 1 to frame i in each convention."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Step:
    """An elementary step of a row, from one frame to the next."""

    quantity: Quantity
    symbol: str
    """Letter and index, such as ``a₂``."""
    value: float
    """m or rad, including the joint coordinate."""
    moves: bool
    """Whether it includes the joint coordinate."""
    T_before: Array = field(repr=False)
    """Pose of the frame before the step in base_link, shape (4, 4)."""
    T_after: Array = field(repr=False)
    """Pose of the frame after it."""

    @property
    def is_drawn(self) -> bool:
        """Whether it is more than zero."""
        return abs(self.value) > ZERO

    def begun(self, share: float) -> Step:
        """Return the step as far as a share of it, from 0 to 1, is done."""
        value = share * self.value
        return replace(self, value=value, T_after=compose(self.T_before, _transform(self.quantity, value)))

    def text(self, unit: AngleUnit) -> str:
        """Return symbol and value, such as ``a₂ = 0.4318 m``; a star marks the joint variable."""
        return f"{self.symbol}{'*' if self.moves else ''} = {self._value_text(unit)}"

    def _value_text(self, unit: AngleUnit) -> str:
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
        ConfigurationError: ``q`` has the wrong shape or is not finite.
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
    index = sum(before.type.moves for before in spec.rows[:row])
    value = float(read_only(q)[index])
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
    """Return a number as text; one that changes all the time has fixed decimals, so that the text does not jump."""
    return f"{value:.6g}" if decimals is None else f"{round(value, decimals) + 0.0:.{decimals}f}"


ARC_RADIUS = 0.8
"""Of an angle's arc; like all that follows a share of the ``size`` argument."""
_LEG = 1.0
"""Length of the lines from an arc's centre through its ends."""
_TIP = 0.16
_THICKNESS = 0.05
_BESIDE = 0.3
"""Distance between a mark and its label."""
_ARC_STEP = math.radians(3.0)
_TIP_ANGLE = math.radians(25.0)


def step_marks(step: Step, color: Color, size: float) -> dict[str, Item]:
    """Return the drawing of a step that is not zero.

    An arrow goes from the origin of the frame before to that of the frame after. An arc goes, in the plane normal to
    the axis of rotation, from an axis of the frame before to its image: x for theta, z for alpha and beta. For angles
    beyond a full turn it goes once around, and then on.

    Args:
        step: The step.
        color: Of the whole drawing.
        size: m.

    Returns:
        An arrow or arc named after the quantity, an arc with its ``…_tip``, ``…_from`` and ``…_to``; in the frame
        before.
    """
    name, axis = step.quantity.value, step.quantity.axis
    if not step.quantity.turns:
        end = vector(step.value * np.eye(3)[axis])
        return {name: Arrow(start=ORIGIN, end=end, color=color, thickness=_THICKNESS * size)}
    angle, radius = _drawn_angle(step.value), ARC_RADIUS * size
    count = max(2, math.ceil(abs(angle) / _ARC_STEP))
    lines = {
        name: (3.0, [_on_circle(axis, angle * k / count, radius) for k in range(count + 1)]),
        f"{name}_tip": (3.0, _tip(axis, angle, radius, size)),
        f"{name}_from": (1.0, [np.zeros(3), _on_circle(axis, 0.0, _LEG * size)]),
        f"{name}_to": (1.0, [np.zeros(3), _on_circle(axis, angle, _LEG * size)]),
    }
    return {
        line: Polyline(points=tuple(map(vector, points)), color=color, width=width)
        for line, (width, points) in lines.items()
    }


def label_place(step: Step, size: float) -> Array:
    """Return the best place for the label of a step, m in base_link, shape (3,)."""
    if step.quantity.turns:
        angle = _drawn_angle(step.value) if step.is_drawn else 0.0
        beside = _on_circle(step.quantity.axis, 0.5 * angle, (ARC_RADIUS + _BESIDE) * size)
        return np.asarray(step.T_before[:3, :3] @ beside + step.T_before[:3, 3])
    beside = step.T_before[:3, (step.quantity.axis + 1) % 3]
    middle = 0.5 * (step.T_before[:3, 3] + step.T_after[:3, 3])
    return np.asarray(middle + _BESIDE * size * beside)


def _drawn_angle(angle: float) -> float:
    turn = 2.0 * math.pi
    return angle if abs(angle) <= turn else math.copysign(turn + math.fmod(abs(angle), turn), angle)


def _on_circle(axis: int, angle: float, radius: float) -> Array:
    """Return a point on a step's circle in the frame before, shape (3,), at ``angle`` from where the arc starts."""
    x, y, z = np.eye(3)
    first, second = {0: (z, -y), 1: (z, x), 2: (x, y)}[axis]
    return np.asarray(radius * (math.cos(angle) * first + math.sin(angle) * second))


def _tip(axis: int, angle: float, radius: float, size: float) -> list[Array]:
    """Return the two strokes of an arrowhead at the end of an arc."""
    end = _on_circle(axis, angle, radius)
    length = min(_TIP * size, 0.5 * abs(angle) * radius)
    outward = end / radius
    along = math.copysign(1.0, angle) * _on_circle(axis, angle + 0.5 * math.pi, 1.0)
    back, aside = -length * math.cos(_TIP_ANGLE) * along, length * math.sin(_TIP_ANGLE) * outward
    return [end + back + aside, end, end + back - aside]


def _pose(T: Array) -> dict[str, Any]:
    return {"position": position_of(T), "orientation": orientation_of(T)}


COLORS: Final[Mapping[Quantity, Color]] = MappingProxyType(
    {
        Quantity.A: (0.12, 0.49, 0.31),
        Quantity.ALPHA: (0.80, 0.15, 0.52),
        Quantity.D: (0.75, 0.38, 0.00),
        Quantity.THETA: (0.43, 0.20, 0.78),
        Quantity.BETA: (0.05, 0.52, 0.60),
    }
)
"""Of the table's columns."""
_ROOT: Final = "/row"
AXIS_COLOR: Final[Color] = (0.35, 0.40, 0.50)
"""Of joint axes and of the common normal."""
_AXIS = 1.8
"""Length of axes beyond frames and offsets; like the next a share of the ``size`` argument."""
_NORMAL = 0.6
"""Length of the common normal beyond the axes."""
_MOVING = 1.25
"""Length of the axes of the moving frame."""


def row_annotations(
    spec: RobotSpec,
    chain: KinematicChain,
    row: int,
    q: ArrayLike,
    size: float,
    angle: AngleUnit = AngleUnit.DEG,
    done: float | None = None,
) -> Scene:
    """Return a drawing that explains a row of the table at a configuration.

    In the order of the row's product, the arrows and arcs lead from DH frame i - 1 to DH frame i: theta, d, a, alpha
    (standard), a, alpha, theta, d (modified), theta, d, a, alpha, beta (Hayati). A quantity that is zero has a label
    but no drawing.

    Args:
        spec: The robot.
        chain: Of the same robot.
        row: Of the table, from 0.
        q: Joint vector, rad and m, shape (n,).
        size: Length of the axes of frames, m; everything is drawn in proportion.
        angle: Unit of the angles in labels.
        done: How many of the steps are done: 1.5 is the first one and half of the second. None for all of them.

    Returns:
        Items below ``/row``, in base_link. ``/row/0`` is frame i - 1, ``/row/0/1`` below it the frame after the first
        step, and so on to frame i, so that the pose of one of them is all that changes while another joint moves.
        In these frames: ``axis_before`` and ``axis_after``, the z axes of frames i - 1 and i; ``normal``, the line of
        a, which is the common normal of those axes unless a Hayati row has a beta; for each quantity its arrow, or
        its arc with ``_tip``, ``_from`` and ``_to``. In base_link: labels, ``/row/…_label``; and, with ``done``,
        ``/row/moving_frame``, which the steps done so far lead to. Steps that have not begun are not drawn.

    Raises:
        IndexError: There is no such row.
        ConfigurationError: ``q`` has the wrong shape or is not finite.
    """
    steps = row_steps(spec, chain, row, q)
    frames, items = _frames(steps)
    ends = {}
    for name, frame, T, (low, high) in _axes(steps, spec.rows[row].convention, size):
        items[f"{frames[frame]}/{name}"] = _line(2, low, high)
        ends[name] = T[:3, 3] + (high + 0.2 * size) * T[:3, 2]
    for before, step in zip(frames, steps, strict=False):
        if step.quantity is Quantity.A:
            items[f"{before}/normal"] = _line(0, *_extended(step.value, _NORMAL * size))
    T_moving = steps[0].T_before
    for number, step in enumerate(steps):
        share = 1.0 if done is None else min(done - number, 1.0)
        if share <= 0.0:
            break
        color, drawn = COLORS[step.quantity], step if share == 1.0 else step.begun(share)
        if drawn.is_drawn:
            items.update({f"{frames[number]}/{name}": mark for name, mark in step_marks(drawn, color, size).items()})
        position = vector(label_place(drawn, size))
        items[f"{_ROOT}/{step.quantity.value}_label"] = Label(position=position, text=step.text(angle), color=color)
        T_moving = drawn.T_after
    if done is not None:
        items[f"{_ROOT}/moving_frame"] = Triad(length=_MOVING * size, **_pose(T_moving))
    for name, number in (("axis_before", row), ("axis_after", row + 1)):
        text = f"z{subscript(number)}"
        items[f"{_ROOT}/{name}_label"] = Label(position=vector(ends[name]), text=text, color=AXIS_COLOR)
    return items


def _frames(steps: tuple[Step, ...]) -> tuple[list[str], dict[str, Item]]:
    """Return the names of the frames before the first step and after each, and the frames, each in the one before."""
    names, items = [f"{_ROOT}/0"], dict[str, Item]()
    items[names[0]] = Placed(**_pose(steps[0].T_before))
    for number, step in enumerate(steps, start=1):
        names.append(f"{names[-1]}/{number}")
        items[names[-1]] = Placed(**_pose(_transform(step.quantity, step.value)))
    return names, items


def _axes(
    steps: tuple[Step, ...], convention: Convention, size: float
) -> list[tuple[str, int, Array, tuple[float, float]]]:
    """Return the z axes of the frames before and after: name, which frame, its pose in base_link, and both ends.

    Each covers its offset d.
    """
    d = next(step.value for step in steps if step.quantity is Quantity.D)
    before, after = (0.0, -d) if convention is Convention.MODIFIED else (d, 0.0)
    return [
        ("axis_before", 0, steps[0].T_before, _extended(before, _AXIS * size)),
        ("axis_after", -1, steps[-1].T_after, _extended(after, _AXIS * size)),
    ]


def _extended(length: float, margin: float) -> tuple[float, float]:
    return min(0.0, length) - margin, max(0.0, length) + margin


def _line(axis: int, low: float, high: float) -> Polyline:
    direction = np.eye(3)[axis]
    return Polyline(points=(vector(low * direction), vector(high * direction)), color=AXIS_COLOR, width=1.0)
