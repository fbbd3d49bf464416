"""What a file holds that is replayed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dh2sim.errors import ControllerError
from dh2sim.robot.spec import ActuatorType
from dh2sim.robot.words import closest, listed
from dh2sim.typing import Array, read_only


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """Controls or positions at instants, of one rollout or of many."""

    file: str
    """As messages name it."""
    positions: bool
    """Whether it holds positions of joints; otherwise controls."""
    actuation: ActuatorType | None
    """The actuators that it drives; None: the robot's own."""
    names: tuple[str, ...] | None
    """Of the columns: joints or actuators; None: not said, then they are in the robot's order."""
    width: int
    """Number of columns, m."""
    length: int
    """Number of instants, K."""
    times: Array | None
    """Instants, s, from 0, shape (K,); None: one a time step."""
    rollouts: int | None
    """How many it holds; None: one, for all."""
    read: Callable[[range], Array] = field(repr=False)
    """Gives the numbers of some rollouts, shape (rollouts, K, m)."""
    digest: str
    """SHA-256 of the file."""

    def times_at(self, timestep: float) -> Array:
        """Return the instants, s, shape (K,)."""
        return read_only(np.arange(self.length) * timestep) if self.times is None else self.times

    def only(self, rollout: int) -> Recording:
        """Return one of its rollouts, for all.

        Raises:
            ControllerError: it has no such rollout, or not all of it.
        """
        if rollout >= (self.rollouts or 1):
            held = "one rollout, 0" if self.rollouts in (None, 1) else f"rollouts 0 to {self.rollouts - 1}"
            raise ControllerError(f"{self.file} has {held}; there is no rollout {rollout}")
        data = self.read(range(rollout, rollout + 1))
        if not np.isfinite(data).all():
            raise ControllerError(
                f"{self.file} does not hold all of rollout {rollout}: it stopped early, or the run is not finished"
            )
        return replace(self, rollouts=None, read=lambda _: data)

    def columns(self, wanted: Sequence[str], what: str, *, joints: Sequence[str]) -> list[int]:
        """Return which column belongs to each of the robot's joints or actuators.

        Args:
            wanted: the robot's names, in its order.
            what: 'joints' or 'actuators', for messages.
            joints: the robot's joints.

        Raises:
            ControllerError: columns are missing, or there is one that the robot does not have.
        """
        if self.names is None:
            if self.width != len(wanted):
                raise ControllerError(
                    f"{self.file} has {self.width} columns; the robot has {len(wanted)} {what}: {listed(wanted)}"
                )
            return list(range(self.width))
        missing = [name for name in wanted if name not in self.names]
        unknown = [name for name in self.names if name not in wanted]
        if not missing and not unknown:
            return [self.names.index(name) for name in wanted]
        problems = []
        if missing:
            problems.append(f"it has no column {_quoted(missing)}")
        for name in unknown:
            guess = closest(name, missing)
            problems.append(f"column '{name}' is none of them" + (f"; did you mean '{guess}'?" if guess else ""))
        if not self.positions and set(self.names) <= set(joints):
            problems.append("the columns are joints: say as=reference")
        start = f"{self.file} does not fit the robot, whose {what} are {listed(wanted)}"
        raise ControllerError("\n  ".join([f"{start}:", *problems]))


def _quoted(names: Sequence[str]) -> str:
    return listed((f"'{name}'" for name in names), ", ")
