"""What inverse kinematics returns: the configurations that reach a pose, and what is known of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dh2sim.messages import counted
from dh2sim.typing import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Curve:
    """Configurations that all reach the pose: a family with one parameter, followed from one of them."""

    q: Array
    """Points of the curve in order, rad and m, shape (m, n); angles go on without jumps."""
    kind: str
    """What moves, in the words of textbooks: wrist singularity, self-motion, ..."""
    closed: bool
    """Whether the curve comes back to its first point, angles modulo whole turns."""

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.q)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solutions:
    """The configurations that reach one pose, the nearest to what was asked for first."""

    q: Array
    """Joint vectors, rad and m, shape (k, n)."""
    residual: Array
    """How far each is from the pose by the table's textbook product, shape (k,): the distance over the
    arm's size or the angle, rad, whichever is larger; only what the goal asks for counts."""
    sigma_min: Array
    """Least singular value of the goal's Jacobian, lengths in units of the arm's size, shape (k,): 0 at a
    singularity."""
    within_limits: NDArray[np.bool_]
    """Whether each keeps the robot's position limits, bool, shape (k,)."""
    same: NDArray[np.intp]
    """Which of the isolated solutions each is, a whole number, shape (k,): equal ones differ by whole turns."""
    branch: tuple[str, ...]
    """Name of each one's branch, '' where no name applies."""
    complete: bool
    """Whether every isolated solution is here, as far as trials can show; false where joints to spare were held."""
    found_share: float = 1.0
    """Share of trial configurations that the solver found again when it was built."""
    curves: tuple[Curve, ...] = ()
    """Families of solutions, which are not isolated."""
    notes: tuple[str, ...] = ()
    """What else there is to say, in sentences."""
    reason: str = field(default="")
    """Why there is no solution, as a phrase: ``out of reach by 0.12 m``; empty where there is one."""
    nearest: Array | None = None
    """Where there is no solution: the nearest configuration that was found, rad and m, shape (n,)."""

    def __repr__(self) -> str:
        found = f"{counted(len(self), 'configuration')}{'' if self.complete else ', perhaps more'}"
        if self.curves:
            found += f", {counted(len(self.curves), 'curve')}"
        return f"<Solutions: {found if len(self) or self.curves else f'none, {self.reason}'}>"

    def __str__(self) -> str:
        rows = np.array2string(self.q, precision=6, suppress_small=True, threshold=200, max_line_width=80)
        return f"{self!r}\n{rows}" if len(self) else repr(self)

    def __len__(self) -> int:
        """Return the number of configurations."""
        return len(self.q)

    def __iter__(self) -> Iterator[Array]:
        """Yield the joint vectors, each of shape (n,)."""
        return iter(self.q)

    @property
    def best(self) -> Array | None:
        """The first joint vector, shape (n,): the nearest to ``q0``; None where there is no solution."""
        return self.q[0] if len(self.q) else None
