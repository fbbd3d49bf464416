"""The constraints of closed loops: how far they are open, their Jacobian, its rank with the gap that shows it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from dh2sim.mobility.mechanism import Mechanism
from dh2sim.mobility.screws import DEPENDENT, exponential, moved_screw
from dh2sim.typing import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rank:
    """A rank, and how clear it is."""

    rank: int
    kept: float | None
    """The smallest singular value that counts; None where none does."""
    dropped: float | None
    """The largest one that does not; None where all do."""
    motions: Array = field(repr=False)
    """Orthonormal basis of the velocities that violate nothing to first order, shape (mobility, freedoms)."""
    values: Array = field(repr=False)
    """All singular values, falling."""

    @property
    def mobility(self) -> int:
        """Return the number of independent velocities."""
        return len(self.motions)

    @property
    def gap(self) -> float:
        """Return how many times larger the last that counts is than the first that does not."""
        if self.kept is None or not self.dropped:
            return math.inf
        return self.kept / self.dropped


def rank_of(jacobian: Array) -> Rank:
    """Return the rank of a Jacobian by its singular values, shape (constraints, freedoms)."""
    count = jacobian.shape[1]
    if not len(jacobian) or not count:
        return Rank(rank=0, kept=None, dropped=None, motions=np.eye(count), values=np.zeros(0))
    _, values, directions = np.linalg.svd(jacobian)
    rank = int((values > DEPENDENT * values[0]).sum())
    return Rank(
        rank=rank,
        kept=float(values[rank - 1]) if rank else None,
        dropped=float(values[rank]) if rank < len(values) else None,
        motions=directions[rank:],
        values=values,
    )


class LoopEquations:
    """The loops of a spanning tree as equations in the joints' coordinates, which are 0 at the assembly.

    Each joint that closes a loop gives six: the screw that is left between its two ends, in units of the mechanism's
    size. Everything takes many configurations at once.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        """Lay out the loops."""
        self._mechanism = mechanism
        self._starts = np.cumsum([0, *(joint.freedoms for joint in mechanism.joints)])
        signs = np.zeros((len(mechanism.tree.chords), mechanism.freedoms))
        for row, chord in enumerate(mechanism.tree.chords):
            a, b = mechanism.joints[chord].links
            for link, side in ((a, 1), (b, -1)):
                for k, direction in mechanism.tree.paths[link] or ():
                    signs[row, self._freedoms(k)] += side * direction
            signs[row, self._freedoms(chord)] = 1.0
        self._signs = signs

    def _freedoms(self, joint: int) -> slice:
        return slice(int(self._starts[joint]), int(self._starts[joint + 1]))

    def jacobian(self, q: Array) -> Array:
        """Return the derivatives of ``errors`` by the coordinates, on closed loops.

        Args:
            q: Joint coordinates, rad and sizes, shape (freedoms,).

        Returns:
            Shape (6 loops, freedoms).
        """
        return np.asarray(self.evaluate(q[None])[1][0])

    def evaluate(self, q: Array) -> tuple[Array, Array]:
        """Return how far the loops are open, and the Jacobian.

        Args:
            q: Joint coordinates, rad and sizes, shape (count, freedoms).

        Returns:
            Shapes (count, 6 loops) and (count, 6 loops, freedoms).
        """
        mechanism, count = self._mechanism, len(q)
        screws = np.empty((count, mechanism.freedoms, 6))
        poses: dict[int, Array] = {0: np.broadcast_to(np.eye(4), (count, 4, 4))}
        for k, direction in mechanism.tree.order:
            a, b = mechanism.joints[k].links[::direction]
            poses[b] = self._moved(poses[a], k, direction, q, screws)
        errors = np.empty((count, len(self._signs), 6))
        for row, k in enumerate(mechanism.tree.chords):
            a, b = mechanism.joints[k].links
            end = self._moved(poses[a], k, 1, q, screws)
            rotation = end[:, :3, :3] @ poses[b][:, :3, :3].transpose(0, 2, 1)
            position = end[:, :3, 3] - (rotation @ poses[b][:, :3, 3, None])[:, :, 0]
            errors[:, row, 0] = rotation[:, 2, 1] - rotation[:, 1, 2]
            errors[:, row, 1] = rotation[:, 0, 2] - rotation[:, 2, 0]
            errors[:, row, 2] = rotation[:, 1, 0] - rotation[:, 0, 1]
            errors[:, row, :3] /= 2.0
            errors[:, row, 3:] = position
        jacobian = self._signs[None, :, None, :] * screws.transpose(0, 2, 1)[:, None]
        rows = 6 * len(self._signs)
        return errors.reshape(count, rows), jacobian.reshape(count, rows, mechanism.freedoms)

    def _moved(self, pose: Array, joint: int, direction: int, q: Array, screws: Array) -> Array:
        """Return the poses of the link behind a joint, and put the joint's screws where they are then."""
        place = self._freedoms(joint)
        for i in range(place.start, place.stop)[::direction]:
            motion = exponential(self._mechanism.screws[i], direction * q[:, i])
            screws[:, i] = moved_screw(pose, self._mechanism.screws[i])
            pose = pose @ motion
        return pose
