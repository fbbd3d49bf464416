"""A row of the table as elementary steps: what is turned or slid, by how much, from which frame."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from numpy.typing import ArrayLike

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.forward import frame_poses
from dh2sim.kinematics.transforms import compose, joint_part, link_part, second_twist
from dh2sim.robot.spec import Convention, RobotSpec
from dh2sim.robot.units import AngleUnit
from dh2sim.typing import Array, read_only
from dh2sim.view.notation import Quantity, symbol

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
