"""A branch of the inverse kinematics along a path of the tool, by numerical continuation.

The branch is followed with a predictor and Newton's method, whose steps are kept so short that no other branch is
ever taken for it. The joints between are then Chebyshev series through exact solutions, refined until nothing is left
to add. Source of the continuation: E. Allgower, K. Georg, Numerical Continuation Methods (1990), chapter 6.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.inverse.goals import Free
from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.forward import forward_kinematics, geometric_jacobian
from dh2sim.kinematics.rotations import rotation_vectors
from dh2sim.trajectory.curves import ChebyshevCurve, NotSmoothError, PiecewisePolynomial, fit
from dh2sim.trajectory.tool_paths import ToolPath
from dh2sim.typing import Array

BLIND: Final = 1e-4
"""Least singular value, lengths in units of the arm's size, below which equations do not tell how joints go on."""
REACHED: Final = 1e-10
"""Residual, rad or sizes of the arm, up to which a pose is reached."""
_LONGEST: Final = 1.0 / 16.0
_SHORTEST: Final = 1e-8
"""Steps of the parameter."""
_ODD_SHARE: Final = 0.7289
_BEND: Final = 0.25
"""rad or sizes of the arm, by which a step's end may be off its tangent's."""
_DEPENDENT: Final = 1e-7
"""Share of the greatest singular value below which those of a singular configuration are rounding."""
TAIL: Final = 2e-12
"""Size of the last terms of a series from which on it is accurate."""


class StuckError(Exception):
    """A branch cannot be followed beyond a place."""

    def __init__(self, u: float, q: Array) -> None:
        """Keep the parameter and the configuration there."""
        super().__init__(f"stuck at {u}")
        self.u, self.q = u, q


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Task:
    """What the joints have to meet at each place of the path: as many equations as joints, or more that agree.

    Places have a parameter u from 0 to 1. It is the path's own, but where the path starts or ends in a singularity:
    joints may go there as the square root of the distance that is left, and smoothly with a parameter whose square
    that is.
    """

    chain: KinematicChain
    path: ToolPath
    free: Free | None
    units: Array
    """Of joint coordinates: 1 for turns, the arm's size for slides, shape (n,)."""
    size: float
    spare: Array
    """Directions of self-motion that go evenly from their start to their end, shape (k, n)."""
    q0: Array
    dq: Array
    """What they change by along the path, shape (n,)."""
    rank: int
    """Of the Jacobian away from singularities, or all along a path in one."""
    least: float = 1e-13
    """Share of the greatest singular value below which the equations say nothing."""
    singular: tuple[bool, bool] = (False, False)
    """Whether the path starts, and ends, in a singularity."""

    @classmethod
    def of(
        cls,
        chain: KinematicChain,
        path: ToolPath,
        q0: Array,
        q1: Array | None,
        *,
        size: float,
        free: Free | None,
        inside: bool = False,
    ) -> Task:
        """Return the task of a path from ``q0``, to ``q1`` where that is given.

        With ``inside`` it is that of a path in a singularity all along, as it is at its start: what joints can do
        there without moving the tool is to spare.
        """
        units = np.where([joint.type.turns for joint in chain.moving_joints], 1.0, size)
        n = len(units)
        dq = np.zeros(n) if q1 is None else q1 - q0
        none = np.zeros((0, n))
        plain = cls(chain=chain, path=path, free=free, units=units, size=size, spare=none, q0=q0, dq=dq, rank=6)
        ends = np.stack([q0] if q1 is None else [q0, q1])
        _, jacobian = plain.equations(ends, np.linspace(0.0, 1.0, len(ends)))
        spread = np.stack([q0 + units * np.sin(1.7 * np.arange(1, n + 1) + k) for k in range(4)])
        _, general = plain.equations(spread, np.zeros(len(spread)))
        values = np.linalg.svd(jacobian[:1] if inside else general, compute_uv=False)
        dependent = _DEPENDENT if inside else 1e-9
        rank = int((values > dependent * values.max(initial=0.0)).sum(axis=1).max())
        spare = none
        if n > rank:  # the directions that move the tool least at both ends
            square = sum(J.T @ np.linalg.pinv(J @ J.T, rcond=1e-12) @ J for J in jacobian)
            spare = np.linalg.eigh(square)[1][:, : n - rank].T
        task = cls(chain=chain, path=path, free=free, units=units, size=size, spare=spare, q0=q0, dq=dq, rank=rank)
        return replace(task, least=_DEPENDENT) if inside else task

    def along(self, u: Array) -> tuple[Array, Array]:
        """Return the path's own parameter, 0 to 1, and its derivative, shape (N,) each."""
        match self.singular:
            case True, True:
                return u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u)
            case True, False:
                return u * u, 2.0 * u
            case False, True:
                return u * (2.0 - u), 2.0 - 2.0 * u
            case _:
                return u, np.ones(len(u))

    def parameter(self, x: Array) -> Array:
        """Return the parameter at which the path's own is x, shape (N,)."""
        match self.singular:
            case True, True:
                return np.asarray(0.5 - np.sin(np.arcsin(np.clip(1.0 - 2.0 * x, -1.0, 1.0)) / 3.0))
            case True, False:
                return np.sqrt(x)
            case False, True:
                return 1.0 - np.sqrt(1.0 - x)
            case _:
                return x

    @property
    def fastest(self) -> float:
        """The greatest derivative of the path's own parameter."""
        return (1.0, 2.0, 1.5)[sum(self.singular)]

    def place(self, u: float) -> str:
        """Return where a parameter is: ``0.12 m of 0.5 m along the line``."""
        return self.path.place(float(self.along(np.array([u]))[0][0]))

    def pose(self, u: float) -> Array:
        """Return the pose at a parameter, shape (4, 4)."""
        return np.asarray(self.path.poses(self.along(np.array([u]))[0])[0])

    def equations(self, q: Array, u: Array) -> tuple[Array, Array]:
        """Return what is left, shape (N, m), and its Jacobian, shape (N, m, n), in units of the joints."""
        goal = self.path.poses(self.along(u)[0])
        T, J = forward_kinematics(self.chain, q), np.array(geometric_jacobian(self.chain, q))
        position = (T[:, :3, 3] - goal[:, :3, 3]) / self.size
        rows, left = [J[:, :3] / self.size], [position]
        R = goal[:, :3, :3]
        if self.free is None:
            left.append(rotation_vectors(T[:, :3, :3] @ np.swapaxes(R, 1, 2)))
            rows.append(J[:, 3:])
        elif self.free == "roll":
            z = T[:, :3, 2]
            across = np.swapaxes(R[:, :, :2], 1, 2)
            left.append((across @ z[:, :, None])[:, :, 0])
            rows.append(_crossed(across, z) @ J[:, 3:])
        if len(self.spare):
            left.append((q - self.q0 - u[:, None] * self.dq) / self.units @ self.spare.T)
        jacobian = np.concatenate(rows, axis=1) * self.units
        if len(self.spare):
            jacobian = np.concatenate([jacobian, np.broadcast_to(self.spare, (len(q), *self.spare.shape))], axis=1)
        return np.concatenate(left, axis=1), jacobian

    def tangent(self, q: Array, u: Array) -> tuple[Array, Array]:
        """Return the derivative of the joints along the path, shape (N, n), and the least singular value, (N,)."""
        _, jacobian = self.equations(q, u)
        steps = self._solve(jacobian, self._rates(q, u)) * self.units
        own = jacobian[:, : jacobian.shape[1] - len(self.spare)]
        values = np.linalg.svd(own, compute_uv=False)
        return steps, np.asarray(values[:, min(self.rank, values.shape[1]) - 1])

    def _rates(self, q: Array, u: Array) -> Array:
        """Return what the equations require of the joints' rates, shape (N, m)."""
        x, rate = self.along(u)
        goal = self.path.poses(x)
        moved = self.path.velocities(goal) * rate[:, None]
        parts = [moved[:, :3] / self.size]
        if self.free is None:
            parts.append(moved[:, 3:])
        elif self.free == "roll":
            across = np.swapaxes(goal[:, :3, :2], 1, 2)
            parts.append(
                (_crossed(across, forward_kinematics(self.chain, q)[:, :3, 2]) @ moved[:, 3:, None])[:, :, 0]
            )
        if len(self.spare):
            parts.append(np.broadcast_to(self.dq / self.units @ self.spare.T, (len(q), len(self.spare))))
        return np.concatenate(parts, axis=1)

    def unmoved(self) -> float:
        """Return the share of the tool's motion at the start that is across all that joints can do there."""
        q, u = self.q0[None], np.zeros(1)
        rates, jacobian = self._rates(q, u), self.equations(q, u)[1]
        left = rates - (jacobian @ self._solve(jacobian, rates)[:, :, None])[:, :, 0]
        return float(np.linalg.norm(left) / max(float(np.linalg.norm(rates)), 1e-300))

    def polished(self, q: Array, u: Array) -> tuple[Array, Array]:
        """Return configurations moved onto the path by Newton's method, and what is left of each, shape (N,)."""
        q, before = np.array(q), np.full(len(q), np.inf)
        going = np.ones(len(q), dtype=np.bool_)
        for _ in range(12):
            left, jacobian = self.equations(q, u)
            step = self._solve(jacobian, left)
            size = np.abs(step).max(axis=1, initial=0.0)
            going &= size <= 1.0  # not where it is lost
            q -= np.where(going[:, None], step * self.units, 0.0)
            going &= (size >= 1e-15) & ((size >= 1e-11) | (size < 0.5 * before))
            if not going.any():
                break
            before = size
        left, _ = self.equations(q, u)
        return q, np.abs(left).max(axis=1)

    def _solve(self, jacobian: Array, right: Array) -> Array:
        """Return the shortest least-squares solutions, shape (N, n)."""
        return np.asarray((np.linalg.pinv(jacobian, rcond=self.least) @ right[:, :, None])[:, :, 0])


def _crossed(across: Array, z: Array) -> Array:
    """Return rows r x ... : what an angular velocity w changes across · z by, for w x z, shape (N, 2, 3)."""
    return np.stack([np.cross(z, across[:, row]) for row in range(across.shape[1])], axis=1)


def branch_through(task: Task, u: float, q: Array) -> ChebyshevCurve:
    """Return the joints along the path in the branch of a configuration ``q`` at ``u``, shape (n,).

    Raises:
        StuckError: They cannot be followed to both ends.
    """
    back, forth = _continued(task, u, q, 0.0), _continued(task, u, q, 1.0)
    if not task.singular[1] and task.tangent(forth[1][-1:], np.array([1.0]))[1][0] < BLIND:
        raise StuckError(1.0, forth[1][-1])
    places = np.concatenate([back[0][:0:-1], forth[0]])
    return _refined(task, places, np.concatenate([back[1][:0:-1], forth[1]]))


def _continued(task: Task, u: float, q0: Array, end: float) -> tuple[Array, Array]:
    """Follow the branch to one end: return places, shape (k,), and configurations, shape (k, n)."""
    h, way = _LONGEST, 1.0 if end > u else -1.0
    q = q0[None]
    places, found = [u], [q0]
    tangent, _ = task.tangent(q, np.array([u]))
    while u != end:
        if h < _SHORTEST:
            raise StuckError(u, q[0])
        to = np.array([max(end, u - h) if way < 0.0 else min(end, u + h)])
        guess = q + tangent * (to - u)
        new, left = task.polished(guess, to)
        off = float(np.abs((new - guess) / task.units).max())
        good = bool(np.isfinite(off)) and off <= _BEND * 0.4 and bool(left[0] <= REACHED)
        if good:
            turned, sigma = task.tangent(new, to)
            blind = bool(sigma[0] < BLIND)
            # in a singularity at the end there is no tangent to compare
            good = to[0] == end if blind else bool(np.abs((turned - tangent) * (to - u) / task.units).max() <= _BEND)
            if not good and blind:
                h *= _ODD_SHARE  # a singularity is stepped over, not on: there the equations say too little
                continue
        if good:
            q, u, tangent = new, float(to[0]), turned
            places.append(u)
            found.append(q[0])
            h = min(1.6 * h, _LONGEST)
            continue
        h *= 0.5
    return np.array(places), np.array(found)


def _refined(task: Task, places: Array, found: Array) -> ChebyshevCurve:
    """Return the joints as series through exact solutions, with the configurations found as first guesses.

    Raises:
        StuckError: They have none.
    """
    rates, _ = task.tangent(found, places)
    h = np.diff(places)[:, None]
    slopes = np.diff(found, axis=0) / h
    for singular, here, beside, slope in zip(task.singular, (0, -1), (1, -2), (0, -1), strict=True):
        if singular:  # there the equations do not tell
            rates[here] = 2.0 * slopes[slope] - rates[beside]
    square = (3.0 * slopes - 2.0 * rates[:-1] - rates[1:]) / h
    cube = (rates[:-1] + rates[1:] - 2.0 * slopes) / (h * h)
    guide = PiecewisePolynomial.of(places, np.stack([found[:-1], rates[:-1], square, cube], axis=1))

    def exact(u: Array) -> tuple[Array, NDArray[np.bool_]]:
        guess = guide.derivatives(u)[0]
        q, left = task.polished(guess, u)
        return q, (np.abs((q - guess) / task.units).max(axis=1) < _BEND) & (left <= REACHED)

    ends = np.array([*places[:-1:2], places[-1]])
    try:
        return fit(exact, ends, task.units, TAIL, task.singular)
    except NotSmoothError as error:
        raise StuckError(error.place, guide.derivatives(np.array([error.place]))[0, 0]) from None
