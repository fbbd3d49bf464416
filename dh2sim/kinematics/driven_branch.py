"""The branch of motion that a mechanism is on as its driven joints go along a path.

Continuation sets anchors on the branch; configurations between them are found many at a time, by Newton's method from
the nearest anchor along its tangent. Where one driven joint moves alone, and a whole turn of it brings the mechanism
back to where it was, all further turns are the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dh2sim.kinematics.loop_batch import LoopBatch, blocks
from dh2sim.kinematics.loop_closure import assembly
from dh2sim.kinematics.loop_motion import LONGEST, Continuation, actuated_joints
from dh2sim.kinematics.tree import joint_values
from dh2sim.progress import Advance, no_progress
from dh2sim.robot.spec import SpecLike, spec_of
from dh2sim.typing import Array, read_only

_TURN: Final = 2.0 * math.pi
_SAME: Final = 1e-9
"""rad, or sizes: a mechanism that is so near to where it was is there."""


class DrivenPath(NamedTuple):
    """Where a mechanism goes as its driven joints go through targets."""

    q: Array
    """Joint vectors at which the loops are closed, rad and m, shape (N, n)."""
    rates: Array
    """Velocities of all joints for a unit velocity of each driven one, shape (N, n, k)."""
    tool: Array
    """Twist of tool0 for the same, shape (N, 6, k), as ``mechanism_jacobian``."""


class DrivenBranch:
    """A mechanism along a path of its driven joints."""

    def __init__(
        self,
        robot: SpecLike,
        q: ArrayLike,
        places: ArrayLike,
        values: ArrayLike,
        advance: Advance = no_progress,
    ) -> None:
        """Follow the mechanism along the path.

        Args:
            robot: The mechanism.
            q: Joint vector at the beginning of the path, with the loops closed, rad and m, shape (n,).
            places: Of points of the path, such as times, increasing, shape (N,).
            values: Coordinates of the driven joints there, in the order of ``actuated``, shape (N, k): between
                neighbours the path is straight as far as a step of continuation goes, 0.1 rad or mechanism sizes.
            advance: Called with numbers of points as they are passed.

        Raises:
            SingularPositionError: On the way there is a dead or singular position; the text says where.
            ConfigurationError: ``q`` has another shape or is not finite.
        """
        spec = spec_of(robot)
        tree, _ = assembly(spec)
        self._driven = list(actuated_joints(spec))
        self._passive = [k for k in range(tree.n) if k not in self._driven]
        self._loops = LoopBatch(tree)
        self._tool = tree.frame("tool0")
        self._turns = np.array([joint.type.turns for joint in tree.moving_joints])
        self._motion = Continuation(spec, tree, self._driven)
        start, values = np.array(joint_values(tree, q)), np.asarray(values, dtype=np.float64)
        self._motion.check(start)
        moving = np.flatnonzero(np.ptp(values, axis=0) > 0.0)
        self._alone = int(moving[0]) if len(moving) == 1 else None
        """The driven joint, by its place among them, that moves alone: then its coordinate is the place."""
        self._first, self._period, self._shift = 0.0, math.inf, np.zeros(tree.n)
        """Where the first turn begins, how long it is, and what coordinates grow by in it."""
        if self._alone is None:
            anchors = self._along(start, np.asarray(places, dtype=np.float64), values, advance)
        else:
            anchors = self._by_turns(start, values[:, self._alone], advance)
        ordered = sorted(anchors, key=lambda anchor: anchor[0])
        self._places, self._q = (np.array(each) for each in zip(*ordered, strict=True))
        self._slopes = self._rates(self._q)

    def _along(self, q: Array, places: Array, values: Array, advance: Advance) -> Iterator[tuple[float, Array]]:
        """Yield anchors along the path."""
        yield float(places[0]), q
        here, scale = 0, self._loops.scale[self._driven]
        while here < len(places) - 1:
            ahead = values[here + 1 : here + 65]
            far = np.abs((ahead - values[here]) / scale).max(axis=1) > LONGEST
            there = here + max(1, int(far.argmax()) if far.any() else len(ahead))
            passed: list[tuple[float, Array]] = []
            q = self._motion.follow(q, values[there], _noted(passed))
            for share, at in passed:
                yield float(places[here] + share * (places[there] - places[here])), at
            advance(there - here)
            here = there

    def _by_turns(self, q: Array, values: Array, advance: Advance) -> Iterator[tuple[float, Array]]:
        """Yield anchors over the coordinate of the joint that moves alone, of one turn if all are the same."""
        start, span = float(values[0]), float(np.ptp(values))
        yield start, q
        for end in (float(values.max()), float(values.min())):
            way = math.copysign(_TURN, end - start)
            at, place, whole = q, start, True
            while place != end and not math.isfinite(self._period):
                whole = abs(end - place) > _TURN
                to = place + way if whole else end
                target = at[self._driven].copy()
                target[self._alone] = to
                passed: list[tuple[float, Array]] = []
                at = self._motion.follow(at, target, _noted(passed))
                yield from ((place + share * (to - place), each) for share, each in passed)
                advance(int(abs(to - place) / span * len(values)))
                place = to
                if whole and self._is_as(at, q):
                    self._period, self._first = abs(to - start), min(start, to)
                    shift = (at - q) * math.copysign(1.0, way)
                    self._shift = np.where(self._turns, np.round(shift / _TURN) * _TURN, 0.0)

    def _is_as(self, q: Array, other: Array) -> bool:
        """Whether two configurations are the same but for whole turns, the joint that moves alone aside."""
        if not self._turns[self._driven[self._alone or 0]]:
            return False
        off = np.where(self._turns, np.remainder(q - other + math.pi, _TURN) - math.pi, q - other)
        return bool(np.abs(off / self._loops.scale).max() <= _SAME)

    def at(self, places: ArrayLike, values: ArrayLike, advance: Advance = no_progress) -> DrivenPath:
        """Return the mechanism at points of the path.

        Args:
            places: Of the points, any number in any order, shape (N,).
            values: Coordinates of the driven joints there, shape (N, k).
            advance: Called with numbers of points as they are found.

        Raises:
            SingularPositionError: A dead or singular position is between a point and the anchors.
        """
        where, wanted = np.asarray(places, dtype=np.float64), np.asarray(values, dtype=np.float64)
        parts = []
        for part in blocks(len(where)):
            q = self._found(where[part], wanted[part])
            rates = self._rates(q)
            twists = self._loops.twists(self._loops.poses(q), self._tool, len(q))
            parts.append((q, rates, twists @ rates))
            advance(len(q))
        return DrivenPath(*(read_only(np.concatenate(each)) for each in zip(*parts, strict=True)))

    def _found(self, places: Array, values: Array) -> Array:
        """Return the joint vectors at points of the path, shape (N, n)."""
        turns = np.zeros(len(places))
        if self._alone is not None:
            places = values[:, self._alone]
            if math.isfinite(self._period):
                turns = np.floor((places - self._first) / self._period)
                places = places - turns * self._period
        middles = 0.5 * (self._places[1:] + self._places[:-1])
        nearest = np.searchsorted(middles, places)
        anchors = self._q[nearest] + turns[:, None] * self._shift
        ways = values - anchors[:, self._driven]
        steps = (self._slopes[nearest] @ ways[:, :, None])[:, :, 0]
        guesses = anchors + steps
        guesses[:, self._driven] = values
        closed = self._loops.closed(guesses, self._driven)
        moved = np.abs(steps / self._loops.scale).max(axis=1, initial=0.0)
        lost: NDArray[np.intp] = np.flatnonzero(~closed.ok | (closed.moved > 0.3 * moved + 1e-6))
        for k in lost.tolist():
            closed.q[k] = self._motion.follow(anchors[k], values[k])
        return closed.q

    def _rates(self, q: Array) -> Array:
        """Return the velocities of all joints for a unit velocity of each driven one, shape (N, n, k)."""
        parts = []
        for part in blocks(len(q)):
            S = np.zeros((len(q[part]), q.shape[1], len(self._driven)))
            S[:, self._driven, range(len(self._driven))] = 1.0
            _, J = self._loops.evaluate(q[part])
            S[:, self._passive] = self._motion.passive_rates(J)
            parts.append(S)
        scale = self._loops.scale
        return np.asarray(np.concatenate(parts) * scale[:, None] / scale[self._driven])


def _noted(passed: list[tuple[float, Array]]) -> Callable[[float, Array], None]:
    return lambda share, q: passed.append((share, q))
