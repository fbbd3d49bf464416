"""Below what a difference counts as none."""

from __future__ import annotations

from dataclasses import dataclass

LOOSE = 1e-6
"""rad, and of the reach: decisions that cost no accuracy, such as which way x points, are made with this, so that
noise far below it does not change them. Axes turned by less but not parallel are nearly parallel."""
FAR = 10.0
"""In reaches: where a or d would be greater, Hayati's row is used."""
LEAST_VOLUME = 1e-3
"""Of the box spanned by three directions, for a line that meets two others to be well determined."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerances:
    """What decides that axes are exactly parallel or coincident, and that a number is a simple one."""

    angle: float
    """rad."""
    length: float
    """m."""
    reach: float
    """Of the chain, m, greater than 0: what lengths are compared with."""

    @property
    def near(self) -> float:
        """Lengths below this, m, decide nothing."""
        return LOOSE * self.reach

    @property
    def far(self) -> float:
        """Lengths above this, m, are not for a table."""
        return FAR * self.reach
