"""What a run's dataset holds: dimensions, coordinates, variables; the same on disk and in memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

FORMAT = 1
"""Version of the layout, in the attribute ``dh2sim_run``."""
POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
TWIST = ("vx", "vy", "vz", "wx", "wy", "wz")
NOT_RUN, FINISHED = -1, 0
STATUS = {
    "not_run": NOT_RUN,
    "finished": FINISHED,
    "warning_inertia": 1,
    "warning_contacts_full": 2,
    "warning_constraints_full": 3,
    "bad_qpos": 4,
    "bad_qvel": 5,
    "bad_qacc": 6,
    "bad_ctrl": 7,
    "error": 8,
    "other_warning": 9,
}
"""Meaning of the values of ``status``; all but the first two mark a rollout that stopped early."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Coordinate:
    """Labels along one dimension."""

    name: str
    dimension: str
    values: NDArray[Any] | Sequence[str]
    attributes: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Variable:
    """One array of a run; its first dimension is ``rollout``."""

    name: str
    dimensions: tuple[str, ...]
    dtype: np.dtype[Any]
    fill: float | int
    """What stands where nothing was recorded: NaN, or what ``attributes`` explain."""
    attributes: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layout:
    """Everything about a run's dataset but the numbers themselves."""

    sizes: Mapping[str, int]
    """Size of every dimension; ``rollout`` is the number of rollouts."""
    coordinates: tuple[Coordinate, ...]
    variables: tuple[Variable, ...]
    attributes: Mapping[str, Any]
    """JSON values."""
    block: int
    """Rollouts in a block, and in a chunk along ``rollout``."""

    @property
    def blocks(self) -> int:
        """Number of blocks; the last may be smaller."""
        return -(-self.sizes["rollout"] // self.block)

    def rollouts(self, block: int) -> range:
        """Return the rollouts of a block."""
        return range(block * self.block, min((block + 1) * self.block, self.sizes["rollout"]))

    def shape(self, variable: Variable) -> tuple[int, ...]:
        """Return the shape of a variable over the whole run."""
        return tuple(self.sizes[dimension] for dimension in variable.dimensions)
