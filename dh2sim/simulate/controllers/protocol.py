"""Protocol of controllers: what they are given and must return, all arrays with the rollouts first.

A rollout's controls must depend on that rollout alone: not on which others are in its batch, nor on how many there
are. Then a run gives the same bits however it is divided. So there must be no sums over the first axis, no matrix
products that a library blocks by size, and no random numbers but from the rollout's own generator.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np

from dh2sim.robot.row import ActuatorType
from dh2sim.simulate.plant import Plant
from dh2sim.typing import Array


class Observation(Protocol):
    """The states of a batch of rollouts at one instant.

    With a floating base, inertia and forces are those that the joints feel while the base moves freely.
    """

    @property
    def step(self) -> int:
        """Time steps since the start."""
        ...

    @property
    def time(self) -> float:
        """Time since the start, s."""
        ...

    @property
    def q(self) -> Array:
        """Joint positions, rad or m, shape (batch, n)."""
        ...

    @property
    def v(self) -> Array:
        """Joint velocities, rad/s or m/s, shape (batch, n)."""
        ...

    @property
    def mass_matrix(self) -> Array:
        """Joint-space inertia M(q) with armature, kg·m², kg·m or kg, shape (batch, n, n)."""
        ...

    @property
    def bias(self) -> Array:
        """Coriolis, centrifugal and gravity forces c(q, v) + g(q), N·m or N, shape (batch, n)."""
        ...

    @property
    def passive(self) -> Array:
        """Forces of springs and viscous damping on the joints, N·m or N, shape (batch, n)."""
        ...

    @property
    def gravity(self) -> Array:
        """Forces g(q) that balance gravity, N·m or N, shape (batch, n)."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RolloutBatch:
    """Rollouts that are driven together, at their start."""

    plant: Plant
    """The robot. Where rollouts have designs of their own its arrays have shape (batch, n), so that they may be used
    as those of shape (n,) are: beside positions of shape (batch, n)."""
    steps: int
    """Time steps of the run."""
    rollouts: Sequence[int]
    """Their indices in the run: a range, unless designs differ so much that they cannot be simulated together."""
    q0: Array
    """Joint positions at the start, rad or m, shape (batch, n)."""
    v0: Array
    """Joint velocities at the start, rad/s or m/s, shape (batch, n)."""
    gravity0: Array
    """Forces that balance gravity at the start, N·m or N, shape (batch, n)."""
    generators: Sequence[np.random.Generator]
    """One for each rollout, used by the controller alone."""
    qpos0: Array | None = None
    """Of a mechanism, MuJoCo's positions of all joints at the start, shape (batch, nq)."""


@runtime_checkable
class OpenLoop(Protocol):
    """A controller that does not look at the state: its controls are known before the simulation runs."""

    def controls(self, first: int, count: int) -> Array:
        """Return the controls of time steps ``first`` to ``first + count - 1``, shape (batch, count, actuators).

        Or of shape (batch, 1, actuators) if they are the same at every step. It is called for any steps in any
        order, and must return the same controls for the same step.
        """
        ...


@runtime_checkable
class ClosedLoop(Protocol):
    """A controller that looks at the state before every time step."""

    def control(self, observation: Observation) -> Array:
        """Return the controls of this time step, shape (batch, actuators)."""
        ...


Controller = OpenLoop | ClosedLoop


@runtime_checkable
class Follows(Protocol):
    """A controller with a reference, which is recorded."""

    def reference(self, first: int, count: int) -> tuple[Array, Array]:
        """Return reference positions and velocities at the beginning of ``count`` time steps from ``first``.

        Each of shape (batch, count, n). ``first + count - 1`` may be ``steps``, the end of the run.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepared:
    """What the static method ``prepare`` of a controller class returns for its options.

    A class that reads files has this method: their digest is one of the run's settings, and their content may decide
    how the robot is driven.
    """

    make: Callable[[RolloutBatch], Controller] = field(repr=False)
    """Makes the controller of a batch of rollouts."""
    actuation: ActuatorType | str | None = None
    """Actuators that the controller needs, like the class attribute of this name."""
    digest: str = ""
    """Hexadecimal SHA-256 of the files that were read."""
    follows: bool = False
    """Whether the controller has a ``reference``."""
    first: Mapping[str, float] | None = None
    """Where a reference from a file begins, rad and m, by joint: rollouts start there, by default."""
