"""Numeric inverse kinematics: the configuration inside limits whose pose is nearest to a goal.

It is found by damped Newton steps on

    E(q) = |p - p*|² / 2 L² + w² Σ a_c |c - c*|² / 2,

where p is the frame's origin, L the arm's size, c its axes x, y, z, and the star marks the goal. a = ½, ½, ½ for a
whole orientation, of which the sum then is 4 sin²(angle / 2); 0, 0, 1 if it may roll about its z; 0 if only its
position counts. Unlike a rotation vector, the axes have no jump at half a turn, and the second derivatives of all of
this are as cheap as the first: with W and P the columns of the Jacobian (angular and linear), B = Σ a_c c c*ᵀ,

    ∂E/∂q_j      = P_j·r - W_j·vec(B)                                           r = p - p*
    ∂²E/∂q_i∂q_j = P_i·P_j + W_i·(P_j x r) + W_iᵀ (tr(B) 1 - B) W_j             i <= j

as a joint turns all that is behind it: ∂P_j/∂q_i = W_i x P_j for i <= j. Newton's steps converge where a goal cannot
be reached, too, where those of Gauss and Newton crawl: a stretched arm. Near a goal, the terms that vanish there are
left out, which makes them those of Gauss and Newton: where the arm is almost singular they lead astray.

Negative eigenvalues are counted positive, so that every step goes down (Y. Dauphin et al., Identifying and attacking
the saddle point problem in high-dimensional non-convex optimization, 2014), and a joint that is pushed beyond its
limit is left out (D. Bertsekas, Projected Newton methods for optimization problems with simple constraints, SIAM J.
Control and Optimization 20(2), 1982). The damping is Levenberg's and Marquardt's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.inverse.goals import Free
from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.sampling import scattered_configurations
from dh2sim.kinematics.skeleton import build_skeleton
from dh2sim.kinematics.transforms import compose, identity
from dh2sim.typing import Array, read_only

SMALLEST_SIZE: Final = 1e-6
"""m; an arm with less only turns, and counts as of size 1 m."""
LEVER: Final = 0.3
"""What 1 rad counts as, in sizes of the arm, where position and orientation cannot both be reached."""
EXACT: Final = 1e-14
"""Error of an arm of size 1 m below which no more steps are made, m and rad."""
REACHED: Final = 1e-9
"""Error that counts as none."""
STILL: Final = 1e-11
"""A slope of E below this share of its square root is zero."""
FARTHEST: Final = 1e3
"""Sizes of the arm: a goal farther away is as good as one there, in its direction."""
LONGEST_STEP: Final = 0.7
"""Of a joint, rad or sizes of the arm."""
KICK: Final = 0.1
"""Length of the step out of a saddle, where no slope leads away."""
STALLED: Final = 1e-3
"""A step that reduces E by less than this share is a poor one."""
NEAR: Final = 1e-6
"""Below this E, steps are those of Gauss and Newton, and may raise it, to no more than DETOUR times."""
DETOUR: Final = 16.0
PATIENCE: Final = 8
"""Poor steps in a row after which no more are made."""
ROUNDS: Final = (1, 5, 16, 42)
"""Starts that are tried together; a later round only where those before did not reach the goal."""
_EPSILON: Final = np.array(
    [[[0, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, 0, 1], [0, 0, 0], [-1, 0, 0]], [[0, -1, 0], [1, 0, 0], [0, 0, 0]]],
    dtype=np.float64,
)
"""Element k is the matrix of the cross product with unit vector k."""
_WEIGHTS: Final = {None: (0.5, 0.5, 0.5), "roll": (0.0, 0.0, 1.0), "rotation": (0.0, 0.0, 0.0)}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Nearest:
    """Configurations whose poses are nearest to N goals, as far as was searched."""

    q: Array
    """Inside the limits, rad and m, shape (N, n)."""
    position_error: Array
    """Distances of the frame's origin from the goals', m, shape (N,)."""
    rotation_error: Array
    """Angles between its orientation and the goals', rad, shape (N,): between the z axes if the roll is free, 0 if
    the orientation is."""
    reached: NDArray[np.bool_]
    """Whether both count as none, shape (N,)."""


@dataclass(slots=True, kw_only=True, eq=False)
class _State:
    """Where N descents are, in units of the arm's size."""

    q: Array
    cost: Array
    """E, shape (N,)."""
    slope: Array
    """Shape (N, n)."""
    curvature: Array
    """Shape (N, n, n)."""


@dataclass(slots=True, kw_only=True, eq=False)
class _Goals:
    """N goals, in units of the arm's size."""

    p: Array
    R: Array
    weights: Array = field(repr=False)
    """Of the axes, shape (3,)."""

    def of(self, rows: NDArray[np.intp]) -> _Goals:
        return _Goals(p=self.p[rows], R=self.R[rows], weights=self.weights)


class NumericSolver:
    """Numeric inverse kinematics of tool0 of one arm; every result is the same in every run."""

    def __init__(self, chain: KinematicChain, lower: Array, upper: Array) -> None:
        """Prepare an arm.

        Args:
            chain: The arm.
            lower: Lowest joint coordinates, rad and m, shape (n,); -inf where there is none.
            upper: Highest joint coordinates, likewise.
        """
        self.n = chain.n
        self.turns = np.array([joint.type.turns for joint in chain.moving_joints], dtype=np.bool_)
        self.size = arm_size(chain, lower, upper)
        """What lengths are compared with: how far the arm reaches, m."""
        self._units = np.where(self.turns, 1.0, self.size)
        self._signs = np.array([joint.sign for joint in chain.moving_joints])
        self._links = _links(chain, self.size)
        self._lower, self._upper = lower / self._units, upper / self._units
        self._limits = read_only(lower), read_only(upper)
        spread = np.where(self.turns, math.pi, 1.0)
        self._start_lower = np.where(np.isfinite(lower), self._lower, np.minimum(self._upper, spread) - 2.0 * spread)
        self._start_upper = np.where(np.isfinite(upper), self._upper, self._start_lower + 2.0 * spread)

    def descend(
        self, T: Array, q0: Array, *, free: Free | None = None, lever: float = LEVER, steps: int = 100
    ) -> Nearest:
        """Follow one descent for each goal, as in tracking: the configurations found are near where they start.

        Args:
            T: Goals for tool0 in base_link, shape (N, 4, 4); rotations must be orthonormal.
            q0: Where to start, rad and m, shape (N, n); moved inside the limits.
            free: What the goals leave open.
            lever: What 1 rad counts as, in sizes of the arm.
            steps: Most steps.
        """
        goals = self._goals(T, free, lever)
        q = np.clip(q0 / self._units, self._lower, self._upper)
        return self.errors(self._robots(self._descended(goals, q, steps)[0]), T, free)

    def errors(self, q: Array, T: Array, free: Free | None = None) -> Nearest:
        """Return how far configurations, rad and m, shape (N, n), are from their goals, shape (N, 4, 4)."""
        frames = self._frames(q / self._units)[-1]
        frames[:, :3, 3] *= self.size
        position, rotation = goal_distances(frames, T), goal_angles(frames, T, free)
        return Nearest(
            q=read_only(q),
            position_error=read_only(position),
            rotation_error=read_only(rotation),
            reached=(position <= REACHED * self.size) & (rotation <= REACHED),
        )

    def _robots(self, q: Array) -> Array:
        """Return coordinates in rad and m; rounding takes none beyond its limit."""
        return np.asarray(np.clip(q * self._units, *self._limits))

    def search(
        self,
        T: Array,
        q0: Array | None = None,
        *,
        free: Free | None = None,
        lever: float = LEVER,
    ) -> Nearest:
        """Descend from several starts, the first at ``q0``, and keep the nearest that is found of each goal.

        Args:
            T: Goals for tool0 in base_link, shape (N, 4, 4); rotations must be orthonormal.
            q0: The first start, rad and m, shape (n,); by default the middle of the ranges. Of several configurations
                that reach a goal in one round, the one nearest to it is kept.
            free: What the goals leave open.
            lever: What 1 rad counts as, in sizes of the arm.
        """
        count = len(T)
        first = 0.5 * (self._start_lower + self._start_upper) if q0 is None else q0 / self._units
        first = np.clip(first, self._lower, self._upper)
        scattered = scattered_configurations(self._start_lower, self._start_upper, sum(ROUNDS) - 1)
        starts = np.concatenate([first[None], scattered])
        best, left = np.broadcast_to(first, (count, self.n)).copy(), np.full(count, np.inf)
        pending = np.arange(count)
        for amount in ROUNDS:
            tried, starts = starts[:amount], starts[amount:]
            goals = self._goals(np.repeat(T[pending], amount, axis=0), free, lever)
            q, cost = self._descended(goals, np.tile(tried, (len(pending), 1)), 100)
            q, cost = q.reshape(len(pending), amount, self.n), cost.reshape(len(pending), amount)
            # all that reach the goal are equally good: the nearest to the first start wins
            far = np.abs(q - first).max(axis=-1, initial=0.0)
            order = np.where(cost <= 0.5 * REACHED**2, far * 1e-30, 1.0 + cost)
            chosen = order.argmin(axis=1)
            rows = np.arange(len(pending))
            better = cost[rows, chosen] < left[pending]
            best[pending[better]] = q[rows, chosen][better]
            left[pending[better]] = cost[rows, chosen][better]
            pending = np.flatnonzero(left > 0.5 * REACHED**2)
            if not len(pending):
                break
        return self.errors(self._robots(best), T, free)

    def _goals(self, T: Array, free: Free | None, lever: float) -> _Goals:
        p, farthest = T[:, :3, 3], FARTHEST * self.size
        far = np.maximum(np.abs(p).max(axis=1, keepdims=True), farthest)
        return _Goals(p=p * (farthest / far) / self.size, R=T[:, :3, :3], weights=lever**2 * np.array(_WEIGHTS[free]))

    # ------------------------------------------------------------------------ the descent

    def _descended(self, goals: _Goals, q: Array, steps: int) -> tuple[Array, Array]:
        """Return the best of N descents, and E there; those that have ended leave the batch."""
        at = self._evaluated(goals, q)
        best, least = q.copy(), at.cost.copy()
        damping, poor = np.full(len(q), 1e-2), np.zeros(len(q), dtype=np.int64)
        active = np.flatnonzero(least > 0.5 * EXACT**2)
        for _ in range(steps if self.n else 0):
            if not len(active):
                break
            now = _State(q=at.q[active], cost=at.cost[active], slope=at.slope[active], curvature=at.curvature[active])
            move, still = self._step(now, damping[active])
            tried = self._evaluated(goals.of(active), np.clip(now.q + move, self._lower, self._upper))
            # near a goal, E may rise for some steps: it would take many short ones down a narrow, bent valley
            taken = tried.cost < np.where(now.cost < NEAR, DETOUR, 1.0) * now.cost
            damping[active] *= np.where(taken, 0.3, 8.0)
            poor[active] = np.where(tried.cost < (1.0 - STALLED) * least[active], 0, poor[active] + 1)
            better = tried.cost < least[active]
            best[active[better]], least[active[better]] = tried.q[better], tried.cost[better]
            rows = active[taken]
            at.q[rows], at.cost[rows] = tried.q[taken], tried.cost[taken]
            at.slope[rows], at.curvature[rows] = tried.slope[taken], tried.curvature[taken]
            active = active[(least[active] > 0.5 * EXACT**2) & (poor[active] < PATIENCE) & ~still]
        return best, least

    def _step(self, now: _State, damping: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return a step of each descent, and whether there is none that goes down."""
        q, slope, curvature = now.q, now.slope, now.curvature
        held = ((q <= self._lower) & (slope > 0.0)) | ((q >= self._upper) & (slope < 0.0))
        diagonal = np.arange(self.n)
        if held.any():
            slope = np.where(held, 0.0, slope)
            curvature = np.where(held[:, :, None] | held[:, None, :], 0.0, curvature)
            curvature[:, diagonal, diagonal] += held
        values, vectors = np.linalg.eigh(curvature)
        along = np.einsum("nji,nj->ni", vectors, slope)
        floor = damping * np.minimum(now.cost, 1.0) + 1e-14
        move = -np.einsum("nij,nj->ni", vectors, along / (np.abs(values) + floor[:, None]))
        flat = np.abs(slope).max(axis=1, initial=0.0) <= STILL * np.sqrt(now.cost)
        if flat.any():
            saddle = flat & (values[:, 0] < -1e-9)
            move = np.where(saddle[:, None], KICK * _pointing(vectors[:, :, 0]), move)
            flat &= ~saddle
        longest = np.abs(move).max(axis=1, initial=0.0)
        return move * np.minimum(1.0, LONGEST_STEP / np.maximum(longest, 1e-300))[:, None], flat

    def _evaluated(self, goals: _Goals, q: Array) -> _State:
        """Return E with its first and second derivatives; near the goal, without those of what is left."""
        frames = self._frames(q)
        tool = frames[-1]
        axes = np.moveaxis(frames[:-1, :, :3, 2], 0, 1) * self._signs[:, None]
        origins = np.moveaxis(frames[:-1, :, :3, 3], 0, 1)
        p, R = tool[:, :3, 3], tool[:, :3, :3]
        W = np.where(self.turns[:, None], axes, 0.0)
        P = np.where(self.turns[:, None], _crossed(axes, p[:, None] - origins), axes)
        r = p - goals.p
        turned = R - goals.R
        cost = 0.5 * np.einsum("ni,ni->n", r, r) + 0.5 * np.einsum("nic,nic,c->n", turned, turned, goals.weights)
        B = (R * goals.weights) @ np.swapaxes(goals.R, 1, 2)
        vec = np.einsum("kij,nij->nk", _EPSILON, -B)
        slope = np.einsum("nji,ni->nj", P, r) - np.einsum("nji,ni->nj", W, vec)
        near = (cost < NEAR)[:, None, None]
        B = np.where(near, (R * goals.weights) @ np.swapaxes(R, 1, 2), B)
        M = np.trace(B, axis1=1, axis2=2)[:, None, None] * np.eye(3) - B
        cross = np.einsum("nk,kij->nij", np.where(near[:, :, 0], 0.0, r), _EPSILON)
        P_T, W_T = np.swapaxes(P, 1, 2), np.swapaxes(W, 1, 2)
        upper = np.triu(P @ P_T + W @ (M @ W_T - cross @ P_T))
        curvature = upper + np.swapaxes(np.triu(upper, 1), 1, 2)
        return _State(q=q, cost=cost, slope=slope, curvature=curvature)

    def _frames(self, q: Array) -> Array:
        """Return the frames of the joints that move, each behind its joint, and of tool0: shape (n + 1, N, 4, 4)."""
        moved = np.ascontiguousarray((q * self._signs).T)
        c = np.where(self.turns[:, None], np.cos(moved), 1.0)[..., None]
        s = np.where(self.turns[:, None], np.sin(moved), 0.0)[..., None]
        d = np.where(self.turns[:, None], 0.0, moved)[..., None]
        x, y, z, p = (self._links[:-1, None, :, k] for k in range(4))
        steps = np.empty((*moved.shape, 4, 4))
        steps[..., 0] = c * x + s * y
        steps[..., 1] = c * y - s * x
        steps[..., 2] = z
        steps[..., 3] = p + d * z
        frames = np.empty((self.n + 1, len(q), 4, 4))
        before: Array = np.broadcast_to(np.eye(4), (len(q), 4, 4))
        for k in range(self.n):
            before = np.matmul(before, steps[k], out=frames[k])
        np.matmul(before, self._links[-1], out=frames[-1])
        return frames


def goal_distances(poses: Array, T: Array) -> Array:
    """Return the distances of poses from goals, both of shape (N, 4, 4), shape (N,)."""
    x, y, z = (poses[:, :3, 3] - T[:, :3, 3]).T
    return np.asarray(np.hypot(np.hypot(x, y), z))  # a norm's squares would overflow


def goal_angles(poses: Array, T: Array, free: Free | None) -> Array:
    """Return the angles by which poses miss what goals ask for, both of shape (N, 4, 4); rad, shape (N,)."""
    if free == "rotation":
        return np.zeros(len(T))
    if free == "roll":
        axis, wanted = poses[:, :3, 2], T[:, :3, 2]
        sine, cosine = np.linalg.norm(np.cross(axis, wanted), axis=1), np.einsum("ni,ni->n", axis, wanted)
        return np.asarray(np.arctan2(sine, cosine))
    return rotation_angles(poses[:, :3, :3], T[:, :3, :3])


def rotation_angles(R_a: Array, R_b: Array) -> Array:
    """Return the angles between orientations of shape (..., 3, 3), rad, from 0 to pi, exact for small ones too."""
    R = np.swapaxes(R_a, -1, -2) @ R_b
    twice = np.einsum("kij,...ij->...k", _EPSILON, R)
    sine = 0.5 * np.linalg.norm(twice, axis=-1)
    return np.asarray(np.arctan2(sine, 0.5 * (np.trace(R, axis1=-2, axis2=-1) - 1.0)))


def _crossed(a: Array, b: Array) -> Array:
    """Return the cross products of vectors along the last axis."""
    matrices = (a @ _EPSILON.reshape(3, 9)).reshape(*a.shape, 3)
    return np.asarray((matrices @ b[..., None])[..., 0])


def _pointing(vectors: Array) -> Array:
    """Return vectors, shape (N, n), or their opposites, so that the first that is not small is positive."""
    first = (np.abs(vectors) > 1e-6).argmax(axis=1)
    return np.asarray(vectors * np.sign(vectors[np.arange(len(vectors)), first])[:, None])


def arm_size(chain: KinematicChain, lower: Array, upper: Array) -> float:
    """Return a bound on the distance from base_link to tool0, m; a slide without limits counts as none."""
    ranges = iter(zip(lower.tolist(), upper.tolist(), strict=True))
    travels = []
    for joint in chain.joints:
        low, high = next(ranges) if joint.type.moves else (0.0, 0.0)
        slides = joint.type.moves and not joint.type.turns and math.isfinite(high - low)
        travels.append((low, high) if slides else (0.0, 0.0))
    size = build_skeleton(chain, travels).taut_length
    return size if size > SMALLEST_SIZE else 1.0


def _links(chain: KinematicChain, size: float) -> Array:
    """Return the constant poses between joints that move, and of tool0 in the last: shape (n + 1, 4, 4).

    Lengths are in units of ``size``.
    """
    links, T = [], identity()
    for joint in chain.joints:
        T = compose(T, joint.T_parent_joint)
        if joint.type.moves:
            links.append(T)
            T = identity()
    links.append(compose(compose(T, chain.joints[-1].T_joint_dh), chain.T_dhn_tool0))
    scaled = np.array(links)
    scaled[:, :3, 3] /= size
    return scaled
