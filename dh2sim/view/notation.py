"""How the quantities of a row are written: letters and indices as in the textbooks."""

from __future__ import annotations

from enum import StrEnum

from dh2sim.robot.spec import Convention

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
