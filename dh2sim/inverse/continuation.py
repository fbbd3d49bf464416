"""All solutions of a pose, followed from those of a general, complex one.

Elimination divides by matrices that are singular at some poses. Continuation does not: as a pose moves along a line
from a general complex one, its solutions move along paths, of which no two meet before the end, and every isolated
solution of the pose is the end of one. So there are at all poses as many as at the general one, if those that are
complex, or at infinity, are counted.

The solutions of the general pose are found by following random configurations' poses to it: configurations are an
irreducible set, so that each solution is reached. The same is done for another general pose, and both must have as
many. Sources: A. P. Morgan, A. J. Sommese, Coefficient-parameter polynomial continuation, Applied Mathematics and
Computation 29(2), 1989; A. J. Sommese, C. W. Wampler, The Numerical Solution of Systems of Polynomials Arising in
Engineering and Science, 2005, chapters 7 and 15.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from dh2sim.inverse.loop import Arm, Flags, Indices, pose_and_jacobian
from dh2sim.typing import Array, ComplexArray

_SEEDS: Final = 96
"""Random configurations that are followed to the first general pose,"""
_MORE_SEEDS: Final = 64
"""and to each one after it."""
_CONFIRMED: Final = 2
"""General poses in a row at which these find no more,"""
_MOST_STARTS: Final = 10
"""of so many that are tried."""
_FIRST: Final = 0.02
"""Length of the first step; the way has the length 1."""
_NEAR: Final = 1e-2
"""Farthest that a predicted point may be from its path, in rad and lengths of the arm."""
_AIM: Final = 3e-3
"""How far it should be, for which the length of steps is chosen."""
_CONTRACTION: Final = 0.1
"""What Newton's second step may be of the first one,"""
_ROUNDING: Final = 1e-7
"""unless it is no larger than this."""
_FARTHEST: Final = 1.0
"""Most that a step may change a coordinate, in rad and lengths of the arm."""
_ENOUGH: Final = 1e-10
"""Rest of the way at which a path that still has small steps is near a singular end."""
_SINGULAR_END: Final = 1e-5
"""Rest of the way at which it may be if it comes no farther."""
_SHORTEST: Final = 1e-6
"""Step, as a share of the rest of the way, below which a path is lost."""
_MOST_STEPS: Final = 400
_IMAGINARY_INFINITY: Final = 12.0
"""Imaginary part of an angle, and..."""
_FAR: Final = 1e6
"""... slide, in lengths of the arm, beyond which a path goes to infinity."""
_SAME: Final = 1e-6
"""Ends of paths that differ by less, in rad and lengths of the arm, are the same."""
_REAL: Final = 0.15
"""Imaginary part up to which the end of a path may be a real solution: rounding moves singular ones that far."""
_SEED: Final = 2026


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ends:
    """Where the paths to N poses end, d of each."""

    pose: Indices
    """Index of the pose of each end near a real configuration, shape (M,)."""
    q: Array
    """These configurations, shape (M, n)."""
    rough: Flags
    """Which of them are where a path came no farther shortly before its end, as at singularities, shape (M,)."""
    lost: Indices
    """How many paths to each pose have no known end, shape (N,)."""
    elsewhere: Indices
    """How many end at complex configurations, or at infinity, shape (N,)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Start:
    """A general pose and all its solutions."""

    parameters: ComplexArray
    """Quaternion, position and locked coordinates, shape (7 + locked,)."""
    q: ComplexArray
    """Shape (d, n)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Continuation:
    """The paths of an arm's solutions, with some of its joints locked, six that are not."""

    arm: Arm
    moving: Flags
    """Which joints are not locked, bool, shape (n,): six."""
    starts: tuple[_Start, ...] = field(repr=False)
    """Two general poses, or none, if no two have as many solutions."""

    @property
    def count(self) -> int:
        """How many solutions each pose has, complex ones included."""
        return len(self.starts[0].q) if self.starts else 0

    def ends(self, T: Array, locked: Mapping[int, Array]) -> Ends:
        """Follow all paths to N poses.

        Args:
            T: Poses, positions in units of the arm's length, shape (N, 4, 4).
            locked: Coordinates of the locked joints in the arm's units, by index, each of shape (N,) or (1,).
        """
        N, n = len(T), self.arm.n
        poses, configurations, rough = [np.zeros(0, dtype=np.intp)], [np.zeros((0, n))], [np.zeros(0, dtype=np.bool_)]
        lost, elsewhere = np.full(N, self.count or 1), np.zeros(N, dtype=np.intp)
        values = [np.broadcast_to(locked[joint], (N,)) for joint in sorted(locked)]
        goals = np.concatenate([_parameters(T[:, :3]), np.array(values).reshape(-1, N).T], axis=1)
        left = np.arange(N)
        for start in self.starts:  # paths that are lost from one are not from the other
            if not len(left):
                break
            d = len(start.q)
            begin = np.broadcast_to(start.parameters, (d * len(left), len(start.parameters)))
            q, rest, infinite = self._followed(np.tile(start.q, (len(left), 1)), begin, goals[np.repeat(left, d)])
            ends, rest, infinite = q.reshape(-1, d, n), rest.reshape(-1, d), infinite.reshape(-1, d)
            real = (np.abs(ends.imag).max(axis=2) < _REAL) & ~infinite
            there = (rest == 0.0) & ~infinite
            there &= ~self._met(ends, there)
            stuck = real & (rest > 0.0) & (rest < _SINGULAR_END)
            away = (there & ~real) | infinite
            missing = d - (there | stuck | away).sum(axis=1)
            which, lane = np.nonzero(real & (rest < _SINGULAR_END))
            poses.append(left[which])
            configurations.append(ends.real[which, lane])
            rough.append(stuck[which, lane])
            better = missing < lost[left]
            elsewhere[left[better]], lost[left[better]] = away.sum(axis=1)[better], missing[better]
            left = left[missing > 0]
        return Ends(
            pose=np.concatenate(poses),
            q=np.concatenate(configurations),
            rough=np.concatenate(rough),
            lost=lost,
            elsewhere=elsewhere,
        )

    def _met(self, q: ComplexArray, arrived: Flags) -> Flags:
        """Return which ends are the same as one before, as where a path has been left for another: shape (N, d)."""
        gap = np.abs(_wrapped(q[:, :, None] - q[:, None], self.arm)).max(axis=3)
        before = np.tri(q.shape[1], k=-1, dtype=np.bool_)
        return np.asarray(((gap < _SAME) & before & arrived[:, :, None] & arrived[:, None]).any(axis=2))

    def _followed(
        self, q: ComplexArray, begin: ComplexArray, goals: ComplexArray
    ) -> tuple[ComplexArray, Array, Flags]:
        """Follow paths from general poses to others, all at once, each with steps of its own.

        A point is predicted by the cubic through the last two points and their tangents, and corrected by two of
        Newton's steps.

        Args:
            q: Solutions of the poses where paths begin, shape (M, n).
            begin: Their parameters, shape (M, 7 + locked).
            goals: Those where paths end, shape (M, 7 + locked).

        Returns:
            The last point of each, shape (M, n), the rest of its way, and which go to infinity, shape (M,).
        """
        moving, turns = self.moving, np.array(self.arm.turns)
        way = begin - goals
        count = len(q)
        q = q.astype(np.complex128)
        rest, step = np.ones(count), np.full(count, _FIRST)
        active = np.arange(count)
        q, _, tangent, _ = self._corrected(q, begin, way)
        before, tangent_before, step_before = q.copy(), tangent.copy(), np.zeros(count)
        infinite = np.zeros(count, dtype=np.bool_)
        for _ in range(_MOST_STEPS):
            if not len(active):
                break
            h = np.minimum(step[active], rest[active])
            ahead = rest[active] - h
            there = q[active]
            predicted = _predicted(
                before[active][:, moving], there[:, moving], tangent_before[active], tangent[active],
                step_before[active], h,
            )  # fmt: skip
            change = self._size(predicted - there[:, moving], there)
            wild = ~(change <= _FARTHEST)
            there[:, moving] = np.where(wild[:, None], there[:, moving], predicted)
            there, off, new_tangent, last = self._corrected(
                there, goals[active] + ahead[:, None] * way[active], way[active]
            )
            took = ~wild & (off <= _NEAR) & (last <= np.maximum(_CONTRACTION * off, _ROUNDING))
            lane = active[took]
            before[lane], tangent_before[lane], step_before[lane] = q[lane], tangent[lane], h[took]
            q[lane], tangent[lane], rest[lane] = there[took], new_tangent[took], ahead[took]
            growth = np.clip((_AIM / np.maximum(off, 1e-12)) ** 0.25, 0.5, 2.0)
            step[active] = np.where(took, h * growth, 0.4 * h)
            end = took & (ahead < _ENOUGH)
            turned, slid = q[active][:, turns], q[active][:, ~turns]
            away = np.abs(turned.imag).max(axis=1, initial=0.0) > _IMAGINARY_INFINITY
            away |= np.abs(slid).max(axis=1, initial=0.0) > _FAR
            infinite[active[away & ~end]] = True
            active = active[~end & ~away & (took | (step[active] > _SHORTEST * rest[active]))]
        return q, rest, infinite

    def _corrected(
        self, q: ComplexArray, goals: ComplexArray, way: ComplexArray
    ) -> tuple[ComplexArray, Array, ComplexArray, Array]:
        """Return points moved onto paths by two of Newton's steps, if the first is short.

        Returns:
            The points, shape (M, n), the lengths of the first steps, shape (M,), the derivatives there by the rest of
            the way, shape (M, 6), and the lengths of the second steps.
        """
        q = q.copy()
        q[:, ~self.moving] = goals[:, 7:]
        with np.errstate(all="ignore"):  # of paths to infinity
            first, _ = self._newton(q, goals, way)
            off = self._size(first, q)
            q[:, self.moving] += np.where((off <= _NEAR)[:, None], first, 0.0)
            second, tangent = self._newton(q, goals, way)
            last = self._size(second, q)
        q[:, self.moving] += np.where((last <= _NEAR)[:, None], second, 0.0)
        return q, np.where(np.isfinite(off), off, np.inf), tangent, np.where(np.isfinite(last), last, np.inf)

    def _size(self, change: ComplexArray, q: ComplexArray) -> Array:
        """Return the largest changes of coordinates, shape (M,): those of slides as a share of how far they are."""
        slides = np.logical_not(self.arm.turns)
        return np.asarray((np.abs(change) / (1.0 + np.abs(q) * slides)[:, self.moving]).max(axis=1))

    def _newton(self, q: ComplexArray, goals: ComplexArray, way: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return Newton's steps to poses, and the derivatives by the rest of the way, shape (M, 6) each."""
        frame, J = pose_and_jacobian(self.arm, q)
        turn, turning = goals[:, :4], way[:, :4]
        E = _rotations(turn) @ np.swapaxes(frame[:, :, :3], 1, 2)
        right = np.empty((len(q), 6, 2), dtype=np.complex128)
        right[:, :3, 0] = goals[:, 4:7] - frame[:, :, 3]
        for i in range(3):
            right[:, 3 + i, 0] = 0.5 * (E[:, i - 1, i - 2] - E[:, i - 2, i - 1])
        right[:, :3, 1], right[:, 3:, 1] = way[:, 4:7], _angular(turn, turning)
        right[:, :, 1] -= (J[:, :, ~self.moving] @ way[:, 7:, None])[:, :, 0]
        A = J[:, :, self.moving]
        bad = ~np.isfinite(A).all(axis=(1, 2))
        A[bad], right[bad] = np.eye(6), np.nan
        A[:, range(6), range(6)] += 1e-30  # never quite singular
        step: ComplexArray = np.linalg.solve(A, right).astype(np.complex128, copy=False)
        return step[:, :, 0], step[:, :, 1]


def build_continuation(arm: Arm, moving: Flags) -> Continuation:
    """Find all solutions of two general poses.

    Args:
        arm: The arm, with the virtual joints that make six.
        moving: Which joints are not locked, bool, shape (n,): six.
    """
    rng = np.random.default_rng(_SEED)
    bare = Continuation(arm=arm, moving=moving, starts=())
    locked = int((~moving).sum())
    known = _Start(parameters=np.zeros(7 + locked, dtype=complex), q=np.zeros((0, arm.n), dtype=complex))
    confirmed = 0
    for number in range(_MOST_STARTS):
        [goal] = _reached(arm, moving, _general(arm, moving, rng))
        seeds = _random(arm, rng, _MORE_SEEDS if number else _SEEDS)
        begin = np.concatenate(
            [np.broadcast_to(known.parameters, (len(known.q), len(goal))), _reached(arm, moving, seeds)]
        )
        goals = np.broadcast_to(goal, begin.shape)
        q, rest, infinite = bare._followed(np.concatenate([known.q, seeds]), begin, goals)
        arrived = (rest == 0.0) & ~infinite
        if not arrived.any():  # as of an arm that is regular by rounding alone
            return bare
        start = _Start(parameters=goal, q=_distinct(q[arrived], arm))
        confirmed = confirmed + 1 if number and len(start.q) == len(known.q) else 0
        if confirmed == _CONFIRMED and len(start.q) % 2 == 0:
            return Continuation(arm=arm, moving=moving, starts=(known, start))
        known = start
    return bare


def _random(arm: Arm, rng: np.random.Generator, count: int) -> ComplexArray:
    """Return complex configurations anywhere, slides near and far, shape (count, n)."""
    real, imaginary = rng.uniform(-1.0, 1.0, (2, count, arm.n))
    far = 10.0 ** rng.uniform(-1.0, 1.5, (count, arm.n))
    return np.asarray(np.where(arm.turns, np.pi * real + 1j * imaginary, far * (real + 1j * imaginary)))


def _general(arm: Arm, moving: Flags, rng: np.random.Generator) -> ComplexArray:
    """Return the most regular of some random configurations, shape (1, n)."""
    q = _random(arm, rng, 16)
    J = pose_and_jacobian(arm, q)[1][:, :, moving]
    best = int(np.linalg.svd(J, compute_uv=False)[:, -1].argmax())
    return q[best : best + 1]


def _reached(arm: Arm, moving: Flags, q: ComplexArray) -> ComplexArray:
    """Return the parameters of the poses that configurations reach, shape (M, 7 + locked)."""
    frame, _ = pose_and_jacobian(arm, q)
    return np.concatenate([_parameters(frame), q[:, ~moving]], axis=1)


def _parameters(frame: ComplexArray | Array) -> ComplexArray:
    """Return unit quaternions and positions of poses of shape (M, 3, 4 or more), shape (M, 7)."""
    R = frame[:, :, :3]
    xx, yy, zz = R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]
    x, y, z = (R[:, i - 1, i - 2] - R[:, i - 2, i - 1] for i in range(3))
    xy, xz, yz = R[:, 0, 1] + R[:, 1, 0], R[:, 0, 2] + R[:, 2, 0], R[:, 1, 2] + R[:, 2, 1]
    columns = [  # of 4 h hᵀ: all are multiples of the quaternion h
        [1 + xx + yy + zz, x, y, z],
        [x, 1 + xx - yy - zz, xy, xz],
        [y, xy, 1 - xx + yy - zz, yz],
        [z, xz, yz, 1 - xx - yy + zz],
    ]
    products = np.array(columns, dtype=np.complex128)
    largest = np.abs(np.einsum("iim->im", products)).argmax(axis=0)
    h = products[largest, :, np.arange(len(R))]
    h /= np.sqrt((h * h).sum(axis=1, keepdims=True))
    return np.concatenate([h, frame[:, :, 3]], axis=1)


def _rotations(h: ComplexArray) -> ComplexArray:
    """Return the rotations of quaternions of any length, shape (M, 3, 3)."""
    w, x, y, z = h.T / np.sqrt((h * h).sum(axis=1))
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _angular(h: ComplexArray, change: ComplexArray) -> ComplexArray:
    """Return the angular velocities of quaternions of any length that change, shape (M, 3)."""
    (w, v), (dw, dv) = ((part[:, :1], part[:, 1:]) for part in (h, change))
    return np.asarray(2.0 * (w * dv - dw * v - np.cross(dv, v)) / (h * h).sum(axis=1, keepdims=True))


def _predicted(
    before: ComplexArray, q: ComplexArray, tangent_before: ComplexArray, tangent: ComplexArray, last: Array, h: Array
) -> ComplexArray:
    """Return the points a step h on, on the cubic through two points and their tangents; at first on a line.

    Tangents are derivatives by the rest of the way, which a step makes less.
    """
    last = last[:, None]
    r = h[:, None] / np.where(last > 0.0, last, 1.0)
    u = 1.0 + r
    onto = -last * ((u**3 - 2.0 * u**2 + u) * tangent_before + (u**3 - u**2) * tangent)
    cubic = (2.0 * u**3 - 3.0 * u**2 + 1.0) * before + (3.0 * u**2 - 2.0 * u**3) * q + onto
    return np.asarray(np.where(last > 0.0, cubic, q - h[:, None] * tangent))


def _wrapped(gap: ComplexArray, arm: Arm) -> ComplexArray:
    """Return differences of configurations, whole turns left out."""
    return np.asarray(np.where(arm.turns, gap - 2.0 * np.pi * np.round(gap.real / (2.0 * np.pi)), gap))


def _distinct(q: ComplexArray, arm: Arm) -> ComplexArray:
    """Return configurations without those that are the same but for whole turns."""
    same = np.abs(_wrapped(q[:, None] - q[None], arm)).max(axis=2) < _SAME
    return np.asarray(q[same.argmax(axis=1) == np.arange(len(q))])
