"""All solutions of many poses at a time, by the elimination that suits an arm, and by others where that may fail."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from dh2sim.inverse.continuation import Continuation, build_continuation
from dh2sim.inverse.loop import (
    Arm,
    Candidates,
    Flags,
    Indices,
    Loop,
    close_loop,
    pose_and_jacobian,
    pose_error,
)
from dh2sim.inverse.nearly_singular import near_solutions
from dh2sim.inverse.polish import polish, refine
from dh2sim.kinematics.rotations import rotations_of_vectors
from dh2sim.typing import Array

CONVERGED = 1e-12
"""Error, in lengths of the arm and rad, up to which a configuration of six joints reaches a pose."""
REACHED = 1e-10
"""Error up to which one of fewer joints does, whose pose may have been rounded, and a singular one."""
_MET = 1e-11
"""Least singular value below which a solution is singular by all that rounding leaves to be seen."""
_STUCK = 1e-6
"""Error up to which a configuration that reaches no pose may be in the valley of nearly singular solutions."""
_ROUNDING = 1e-14
"""Error, in lengths of the arm and rad, that is not to be seen."""
_BLUNT = 1e-8
"""Least singular value below which a solution cannot be determined better."""
SAME = 1e-6
"""Configurations that differ by less, in rad and lengths of the arm, are the same..."""
SAME_IF_SINGULAR = 1e-4
"""... and by less than this where the arm is nearly singular, as rounding moves such solutions farther."""
NEARLY_SINGULAR = 1e-6
"""Least singular value below which that is so."""
_VIRTUAL = 0.05
"""How far virtual joints of a candidate may be from zero."""
_GATE = 0.3
"""Error of a candidate, in lengths of the arm and rad, above which it is none."""
_DOUBTFUL = 1e-5
"""Least singular value of a solution below which others may be missing."""
_ILL = 1e6
"""Condition above which solutions may be missing."""
_BLOCK = 128
"""Poses solved at a time, so that their matrices stay in the processor's cache."""
_SEED = 2026
NUDGE = 1e-6
"""Size of changes, in lengths of the arm and rad, that make singular eliminations regular."""
_NEIGHBOURS = 6
"""Solutions of a pose, sorted by a hash of their coordinates, that each one is compared with."""


class Elimination(Protocol):
    """A way from the loop equations to configurations near all solutions."""

    def candidates(self, loop: Loop) -> Candidates:
        """Return configurations near all solutions of N poses, and some that are none."""
        ...

    def condition(self, loop: Loop) -> Array:
        """Return how ill-conditioned the elimination is at N poses, shape (N,)."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Nudged:
    """An elimination of an arm whose links are a little different, where that of the arm itself is singular."""

    elimination: Elimination
    nudges: Array = field(repr=False)
    """Small motions of the six links, shape (6, 4, 4)."""

    def candidates(self, loop: Loop) -> Candidates:
        """Return configurations near all solutions of N poses, and some that are none."""
        return self.elimination.candidates(loop.moved(self.nudges))

    def condition(self, loop: Loop) -> Array:
        """Return how ill-conditioned the elimination is at N poses, shape (N,)."""
        return self.elimination.condition(loop.moved(self.nudges))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """Distinct solutions of some of N poses."""

    pose: Indices
    """Index of the pose of each, in ascending order, shape (M,)."""
    q: Array
    """Coordinates of all joints in the arm's units, shape (M, n)."""
    sigma: Array
    """Least singular value of the Jacobian of the joints that move, in the arm's units, shape (M,)."""
    error: Array
    """What is left of the pose, in lengths of the arm and rad, shape (M,)."""
    J: Array = field(repr=False)
    """Jacobians of all joints in the arm's units, shape (M, 6, n)."""
    unsure: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    """Indices of poses of which solutions may be missing: by one elimination, or by all that was tried."""

    def of(self, chosen: Indices | Flags) -> Found:
        """Return some of them, by index or bool."""
        return replace(
            self,
            pose=self.pose[chosen],
            q=self.q[chosen],
            sigma=self.sigma[chosen],
            error=self.error[chosen],
            J=self.J[chosen],
        )

    def among(self, poses: Indices) -> Found:
        """Return the same solutions with their poses' indices among others."""
        return replace(self, pose=poses[self.pose], unsure=poses[self.unsure])


@dataclass(frozen=True, kw_only=True, eq=False)
class Method:
    """How an arm's poses are solved, with some of its joints locked."""

    arm: Arm
    moving: Flags
    """Which joints are not locked, bool, shape (n,)."""
    virtual: tuple[Array, ...] = field(repr=False)
    """Links before, between and behind the virtual joints that make six of fewer joints, each of shape (4, 4)."""
    eliminations: tuple[Elimination, ...]
    """The best one, and one to fall back on."""
    found_share: float
    """Share of the solutions known of the trial's poses that they find."""
    telling: bool = True
    """Whether the first one tells where it may lack solutions: not if it says so of most poses."""

    def solve(self, T: Array, locked: Mapping[int, Array]) -> Found:
        """Return all solutions of N poses.

        Args:
            T: Poses, positions in units of the arm's length, shape (N, 4, 4).
            locked: Coordinates of the locked joints in the arm's units, by index, each of shape (N,) or (1,).
        """
        if not self.moving.any():
            return self._held(T, locked)
        blocks = []
        for start in range(0, len(T), _BLOCK):
            block = slice(start, start + _BLOCK)
            values = {joint: q if len(q) == 1 else q[block] for joint, q in locked.items()}
            found = self._solve_block(T[block], values)
            blocks.append(found.among(np.arange(start, start + _BLOCK)))
        return joined(blocks, self.arm.n)

    def _held(self, T: Array, locked: Mapping[int, Array]) -> Found:
        """Return the configuration in which all joints are locked, for the poses that it reaches."""
        q = np.stack([np.broadcast_to(locked[joint], (len(T),)) for joint in range(self.arm.n)], axis=1)
        frame, J = pose_and_jacobian(self.arm, q)
        error = np.linalg.norm(pose_error(frame, T), axis=1)
        (reached,) = np.nonzero(error < REACHED)
        found = Found(pose=np.arange(len(T)), q=q, sigma=np.ones(len(T)), error=error, J=J)
        return found.of(reached)

    def _solve_block(self, T: Array, locked: Mapping[int, Array]) -> Found:
        found = self.solve_by(self.eliminations[0], T, locked) if self.eliminations else joined([], self.arm.n)
        blurred = np.zeros(len(T), dtype=np.bool_)
        blurred[found.unsure] = self.telling
        found = replace(found, unsure=found.unsure[:0])
        again = np.flatnonzero(self.doubtful(found, len(T)) | blurred)
        if len(again) and len(self.eliminations) > 1:
            more = self.solve_by(self.eliminations[1], T[again], _values_at(locked, again))
            blurred[np.delete(again, more.unsure)] = False
            found = self._joined_with(found, again, replace(more, unsure=more.unsure[:0]))
            again = np.flatnonzero(self.doubtful(found, len(T)) | blurred)
        again = self._ill(again, blurred, found, T, locked)
        if not len(again):
            return found
        more, lost, elsewhere = self._continued(T[again], _values_at(locked, again))
        found = self._sharp(self._joined_with(found, again, more))
        lost[np.unique(more.pose[_are_blunt(more.error, more.sigma)])] = True
        if lost.any() and not self.virtual:
            stuck = again[lost]
            more = self._in_valleys(T[stuck], _values_at(locked, stuck))
            found = self._sharp(self._joined_with(found, stuck, more))
            met = np.where(found.sigma < _MET, 2, 1)  # where solutions have met, one stands for two
            counts = np.bincount(found.pose, weights=met, minlength=len(T))[again]
            lost &= (counts + elsewhere != self.continuation.count) | (self.continuation.count == 0)
        too_many = np.bincount(found.pose[found.sigma > _MET], minlength=len(T))[again] > self.continuation.count
        return replace(found, unsure=again[lost | too_many])

    def _joined_with(self, found: Found, poses: Indices, more: Found) -> Found:
        """Return solutions of N poses, and more of some of these."""
        return self.distinct(joined([found, more.among(poses)], self.arm.n))

    @cached_property
    def continuation(self) -> Continuation:
        """The paths that solutions of the ring follow from general poses to others; found when first needed."""
        arm, moving = self.arm, self.moving
        if self.virtual:
            extra = len(self.virtual) - 1
            links = (*arm.links[:-1], arm.links[-1] @ self.virtual[0], *self.virtual[1:])
            arm = replace(arm, turns=(*arm.turns, *[True] * extra), links=links)
            moving = np.append(moving, [True] * extra)
        return build_continuation(arm, moving)

    def _continued(self, T: Array, locked: Mapping[int, Array]) -> tuple[Found, Flags, Indices]:
        """Return what continuation finds of N poses, whether paths were lost, and how many ends are no solutions."""
        ends = self.continuation.ends(T, locked)
        own = (np.abs(_wrapped(ends.q[:, self.arm.n :])) < _VIRTUAL).all(axis=1)
        pose, q, rough = ends.pose[own], ends.q[own, : self.arm.n], ends.rough[own]
        lost = ends.lost > 0
        _, error, _ = polish(self.arm, q[rough], T[pose[rough]], self.moving, gate=_GATE)
        lost[pose[rough][error > REACHED]] = True
        return self.polished(pose, q, T), lost, ends.elsewhere

    @staticmethod
    def _sharp(found: Found) -> Found:
        """Return solutions without those that rounding leaves beside others in the valley of nearly singular ones.

        How far a configuration is from the solution nearby is what is left of the pose over the singular value. Where
        that is much for all singular solutions of a pose, the pose itself is rounded, and they are what there is.
        """
        blunt = _are_blunt(found.error, found.sigma)
        sharp = np.unique(found.pose[~blunt & (found.sigma < NEARLY_SINGULAR)])
        return found.of(~(blunt & np.isin(found.pose, sharp)))

    def doubtful(self, found: Found, poses: int) -> Flags:
        """Whether solutions of a pose may be missing: there are none, an odd number, or singular ones; bool (N,)."""
        regular = found.sigma > NEARLY_SINGULAR
        counts = np.bincount(found.pose[regular], minlength=poses)
        singular = np.bincount(found.pose[found.sigma < _DOUBTFUL], minlength=poses) > 0
        even = (counts % 2 == 0) | bool(self.virtual)  # only some solutions of a ring with virtual joints count
        return np.asarray((counts == 0) | ~even | singular)

    def lacking(self, found: Found, poses: int) -> Flags:
        """Whether solutions of a pose are missing for certain, bool (N,).

        Solutions of a ring of six joints that are not real come in pairs, so there is an even number of real ones.
        """
        regular = np.bincount(found.pose[found.sigma > _DOUBTFUL], minlength=poses)
        all_of_them = np.bincount(found.pose, minlength=poses)
        return np.asarray(
            (regular % 2 == 1) & (regular == all_of_them) & (bool(self.eliminations) and not self.virtual)
        )

    def _ill(self, again: Indices, blurred: Flags, found: Found, T: Array, locked: Mapping[int, Array]) -> Indices:
        """Return doubtful poses, without those at which an elimination is well-conditioned and leaves no doubt.

        There all solutions are among its eigenvalues: none at a pose out of reach, and singular ones. Nearly singular
        ones are as well, but may be merged by rounding.
        """
        counts = np.bincount(found.pose, minlength=len(T))[again]
        none = (counts == 0) & ~blurred[again]
        close = np.isin(again, found.pose[(found.sigma > _MET) & (found.sigma < _DOUBTFUL)])
        asked = again[none | ((counts > 0) & (counts % 2 == 0) & ~close)]
        if not len(asked) or not self.eliminations:
            return again
        loop = close_loop(self.arm, T[asked], _values_at(locked, asked), self.virtual)
        condition = self.eliminations[0].condition(loop)
        for other in self.eliminations[1:]:
            if not isinstance(other, Nudged):  # which is regular where the arm itself is singular
                condition = np.minimum(condition, other.condition(loop))
        return np.setdiff1d(again, asked[condition < _ILL])

    def _in_valleys(self, T: Array, locked: Mapping[int, Array]) -> Found:
        """Return what is found in the valleys that lead through what eliminations leave."""
        if not self.eliminations or int(self.moving.sum()) != 6:
            return joined([], self.arm.n)
        pose, q = self._stuck(T, locked)
        which, q = near_solutions(self.arm, q, T[pose], self.moving)
        pose = pose[which]
        frame, J = pose_and_jacobian(self.arm, q)
        error = np.linalg.norm(pose_error(frame, T[pose]), axis=1)
        near = self.distinct(Found(pose=pose, q=q, sigma=np.zeros(len(q)), error=error, J=J))
        return self.polished(near.pose, refine(self.arm, near.q, T[near.pose], self.moving)[0], T)

    def _stuck(self, T: Array, locked: Mapping[int, Array]) -> tuple[Indices, Array]:
        """Return configurations of eliminations that almost reach poses, and their poses."""
        rng = np.random.default_rng(_SEED)
        nudged = [
            Nudged(elimination=elimination, nudges=small_motions(rng, 6, size))
            for elimination in self.eliminations
            for size in (NUDGE, 0.1 * NUDGE)
        ]
        parts = [self._candidates(elimination, T, locked) for elimination in (*self.eliminations, *nudged)]
        pose, q = np.concatenate([part.pose for part in parts]), np.concatenate([part.q for part in parts])
        q, error, _ = polish(self.arm, q, T[pose], self.moving, gate=_GATE)
        stuck = (error > CONVERGED) & (error < _STUCK)
        return pose[stuck], q[stuck]

    def solve_by(self, elimination: Elimination, T: Array, locked: Mapping[int, Array]) -> Found:
        """Return the solutions of N poses that one elimination leads to."""
        candidates = self._candidates(elimination, T, locked)
        return replace(self.polished(candidates.pose, candidates.q, T), unsure=candidates.blurred)

    def _candidates(self, elimination: Elimination, T: Array, locked: Mapping[int, Array]) -> Candidates:
        """Return configurations of all joints that an elimination leads to."""
        loop = close_loop(self.arm, T, locked, self.virtual)
        candidates = elimination.candidates(loop)
        pose, ring = candidates.pose, candidates.q
        count = int(self.moving.sum())
        near = (np.abs(_wrapped(ring[:, count:])) < _VIRTUAL).all(axis=1)
        pose, ring = pose[near], ring[near, :count]
        q = np.empty((len(pose), self.arm.n))
        q[:, self.moving] = ring
        for joint, value in locked.items():
            q[:, joint] = value[0] if len(value) == 1 else value[pose]
        return Candidates(pose=pose, q=q, blurred=candidates.blurred)

    def polished(self, pose: Indices, q: Array, T: Array, gate: float = _GATE) -> Found:
        """Return the distinct solutions that configurations lead to, if their errors are below the gate."""
        q, error, J = polish(self.arm, q, T[pose], self.moving, gate=gate)
        sigma = np.asarray(np.linalg.svd(J[:, :, self.moving], compute_uv=False)[:, -1], dtype=np.float64)
        stuck = np.flatnonzero((error < _STUCK) & ((error > CONVERGED) | _are_blunt(error, sigma)))
        if len(stuck):
            q[stuck], error[stuck], J[stuck] = refine(self.arm, q[stuck], T[pose[stuck]], self.moving)
            sigma[stuck] = np.linalg.svd(J[stuck][:, :, self.moving], compute_uv=False)[:, -1]
        extent = _extents(q, np.array(self.arm.turns))  # rounding grows with it
        reached = error < extent * REACHED
        J, sigma, error, extent = J[reached], sigma[reached], error[reached], extent[reached]
        found = Found(pose=pose[reached], q=q[reached], sigma=sigma, error=error, J=J)
        if not self.virtual:
            found = found.of((error < extent * CONVERGED) | (sigma < _BLUNT))
        return self.distinct(found)

    def distinct(self, found: Found) -> Found:
        """Return solutions without those that are the same but for whole turns, in the order of their poses.

        Of equal ones the one that is nearest to its pose is kept.
        """
        turns = np.array(self.arm.turns)
        q = np.where(turns, _wrapped(found.q), found.q)
        weights = 1.0 + np.sqrt(2.0 + np.arange(self.arm.n))  # no two joints count alike
        key = np.where(turns, np.sin(q + weights), q) @ weights
        order = np.lexsort([key, found.pose])
        found, q, key = found.of(order), q[order], key[order]
        tolerance = np.where(found.sigma < NEARLY_SINGULAR, SAME_IF_SINGULAR, SAME)
        extent = _extents(q, turns)[:, None]  # far slides are as exact as they are far
        farthest = 2.0 * float(weights.sum()) * tolerance * extent[:, 0]  # keys of equal solutions are no farther
        first = np.arange(len(q))
        for lag in range(1, min(_NEIGHBOURS, len(q) - 1) + 1):
            near = np.flatnonzero(
                (found.pose[lag:] == found.pose[:-lag]) & (key[lag:] - key[:-lag] <= farthest[lag:])
            )
            if not len(near):
                break
            gap = q[near + lag] - q[near]
            apart = np.abs(np.where(turns, _wrapped(gap), gap / extent[near])).max(axis=1)
            near = near[apart <= tolerance[near + lag]]
            first[near + lag] = np.minimum(first[near + lag], near)
        while (first[first] != first).any():
            first = first[first]
        sharpest = np.lexsort([found.error, first])
        chosen = sharpest[np.flatnonzero(np.diff(first[sharpest], prepend=-1))]
        return replace(found.of(chosen), q=q[chosen])


def small_motions(rng: np.random.Generator, count: int, size: float) -> Array:
    """Return random motions of about a size, in lengths of the arm and rad, shape (count, 4, 4)."""
    turns, shifts = size * rng.normal(size=(2, count, 3))
    motions = np.zeros((count, 4, 4))
    motions[:, :3, :3], motions[:, :3, 3], motions[:, 3, 3] = rotations_of_vectors(turns), shifts, 1.0
    return motions


def _are_blunt(error: Array, sigma: Array) -> Flags:
    """Return which configurations may be farther from a solution than from others that are the same."""
    return np.asarray((error > SAME * sigma) & (error > _ROUNDING))


def _values_at(locked: Mapping[int, Array], poses: Indices) -> Mapping[int, Array]:
    """Return the locked joints' coordinates at some poses."""
    return {joint: q if len(q) == 1 else q[poses] for joint, q in locked.items()}


def _extents(q: Array, turns: Flags) -> Array:
    """Return how far configurations lead, in lengths of the arm, shape (M,): 1 unless slides are farther out."""
    return np.asarray(1.0 + np.abs(q[:, ~turns]).max(axis=1, initial=0.0))


def _wrapped(q: Array) -> Array:
    """Return angles within half a turn of zero."""
    return np.asarray(q - 2.0 * np.pi * np.round(q / (2.0 * np.pi)))


def joined(parts: list[Found], n: int) -> Found:
    """Return the solutions of several parts, for an arm of n joints."""
    none = Found(
        pose=np.zeros(0, dtype=np.intp),
        q=np.zeros((0, n)),
        sigma=np.zeros(0),
        error=np.zeros(0),
        J=np.zeros((0, 6, n)),
    )
    values = {f.name: np.concatenate([getattr(part, f.name) for part in (none, *parts)]) for f in fields(Found)}
    return Found(**values)
