"""Whether the solver lacks solutions that an independent search finds: Levenberg-Marquardt from many starts.

    python -m tests.inverse.completeness [ARMS] [FIRST_SEED]

The search has its own tables, matrices and iteration, and shares nothing with the package. Arms are random and like
those of textbooks: twists of whole quarter turns more often than not, lengths often zero, up to two slides anywhere.
Both sides' solutions are counted where they are regular, that is, away from singularity.
"""

from __future__ import annotations

import math
import sys
import time
import traceback
from dataclasses import dataclass, fields
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.inverse.solver import InverseSolver
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.sample_robots import row

STARTS: Final = 250
POSES: Final = 3
REGULAR: Final = 1e-5
"""Least singular value of the Jacobian, lengths in units of the arm's, above which a solution is regular."""
SAME: Final = 1e-5
"""Difference of coordinates, rad or units of the arm's length, below which two solutions are one."""
REACHED: Final = 1e-11
"""Residual, rad or units of the arm's length, at which the search has arrived."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Table:
    """A standard Denavit-Hartenberg table of revolute and prismatic joints; lengths of about 1."""

    a: Array
    alpha: Array
    d: Array
    theta: Array
    turns: NDArray[np.bool_]

    @property
    def pattern(self) -> str:
        """A letter for each joint."""
        return "".join("R" if turns else "P" for turns in self.turns)

    def spec(self) -> RobotSpec:
        """Return the table as a robot."""
        kinds = ["revolute" if turns else "prismatic" for turns in self.turns]
        values = zip(kinds, self.a, self.alpha, self.d, self.theta, strict=True)
        rows = (
            row(f"q{i}", kind, a=float(a), alpha=float(alpha), d=float(d), theta=float(theta))
            for i, (kind, a, alpha, d, theta) in enumerate(values, start=1)
        )
        return RobotSpec(name="random", rows=tuple(rows))

    def poses(self, q: Array) -> tuple[Array, Array]:
        """Return poses of the last frame and Jacobians for joint vectors of shape (N, 6)."""
        count, n = q.shape
        T = np.tile(np.eye(4), (count, 1, 1))
        axes, origins = np.empty((count, n, 3)), np.empty((count, n, 3))
        for i in range(n):
            axes[:, i], origins[:, i] = T[:, :3, 2], T[:, :3, 3]
            theta = self.theta[i] + (q[:, i] if self.turns[i] else 0.0) * np.ones(count)
            d = self.d[i] + (0.0 if self.turns[i] else q[:, i]) * np.ones(count)
            ct, st, zero, one = np.cos(theta), np.sin(theta), np.zeros(count), np.ones(count)
            ca, sa = math.cos(self.alpha[i]), math.sin(self.alpha[i])
            A = np.array(
                [
                    [ct, -st * ca, st * sa, self.a[i] * ct],
                    [st, ct * ca, -ct * sa, self.a[i] * st],
                    [zero, sa * one, ca * one, d],
                    [zero, zero, zero, one],
                ]
            )
            T = T @ A.transpose(2, 0, 1)
        arms = T[:, None, :3, 3] - origins
        J = np.zeros((count, 6, n))
        J[:, :3] = np.where(self.turns, np.cross(axes, arms).transpose(0, 2, 1), axes.transpose(0, 2, 1))
        J[:, 3:] = np.where(self.turns, axes.transpose(0, 2, 1), 0.0)
        return T, J


def random_table(seed: int) -> Table:
    """Return an arm of six joints like those of textbooks."""
    rng = np.random.default_rng(seed)
    turns = np.ones(6, dtype=np.bool_)
    turns[rng.choice(6, size=int(rng.choice([0, 0, 1, 2])), replace=False)] = False
    right = rng.choice([0.0, 0.5, -0.5, 1.0], size=6) * math.pi
    odd = rng.uniform(-math.pi, math.pi, 6)
    lengths = rng.uniform(0.1, 1.0, (2, 6)) * rng.choice([-1.0, 1.0], (2, 6)) * rng.choice([0.0, 1.0], (2, 6))
    return Table(
        a=lengths[0],
        alpha=np.where(rng.random(6) < 0.85, right, odd),
        d=lengths[1],
        theta=rng.choice([0.0, 0.5, -0.5], size=6) * math.pi,
        turns=turns,
    )


def random_coordinates(table: Table, rng: np.random.Generator, count: int, slide: float = 1.0) -> Array:
    """Return joint vectors anywhere, shape (count, 6): slides up to ``slide`` either way."""
    return np.where(table.turns, rng.uniform(-math.pi, math.pi, (count, 6)), rng.uniform(-slide, slide, (count, 6)))


def moves_freely(table: Table, rng: np.random.Generator) -> bool:
    """Whether six joints make six degrees of freedom almost everywhere."""
    _, J = table.poses(random_coordinates(table, rng, 8))
    return bool(np.median(np.linalg.svd(J, compute_uv=False)[:, -1]) > 1e-4)


def errors(T: Array, goal: Array) -> Array:
    """Return the twist from poses to a goal, shape (N, 6): displacement, then rotation vector."""
    R = goal[:3, :3] @ T[:, :3, :3].transpose(0, 2, 1)
    sines = 0.5 * np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1)
    sine = np.linalg.norm(sines, axis=1)
    angle = np.arctan2(sine, 0.5 * (np.trace(R, axis1=1, axis2=2) - 1.0))
    scale = np.where(sine > 1e-9, angle / np.maximum(sine, 1e-300), 1.0)
    return np.concatenate([goal[:3, 3] - T[:, :3, 3], scale[:, None] * sines], axis=1)


def search(table: Table, goal: Array, q: Array, iterations: int = 120) -> Array:
    """Return where starts of shape (N, 6) arrive at a goal: the joint vectors that do, shape (k, 6).

    Source: K. Levenberg, 1944; D. W. Marquardt, 1963. The damping is proportional to the squared error, so that the
    end is Newton's (N. Yamashita, M. Fukushima, On the rate of convergence of the Levenberg-Marquardt method, 2001).
    """
    arrived: list[Array] = []
    damping, stalled = np.full(len(q), 1e-2), np.zeros(len(q), dtype=int)
    T, J = table.poses(q)
    e = errors(T, goal)
    E = np.sum(e * e, axis=1)
    for _ in range(iterations):
        there = E < REACHED * REACHED
        arrived.append(q[there])
        going = ~there & (stalled < 10)
        q, J, e, E, damping, stalled = q[going], J[going], e[going], E[going], damping[going], stalled[going]
        if not len(q):
            break
        A = np.einsum("nki,nkj->nij", J, J)
        A[:, np.arange(6), np.arange(6)] += (damping * np.minimum(E, 1.0) + 1e-13)[:, None]
        step = np.linalg.solve(A, np.einsum("nki,nk->ni", J, e)[..., None])[..., 0]
        step *= np.minimum(1.0, 0.8 / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
        trial = q + step
        T, J_trial = table.poses(trial)
        e_trial = errors(T, goal)
        E_trial = np.sum(e_trial * e_trial, axis=1)
        better = E_trial < E
        stalled = np.where(E_trial < 0.999 * E, 0, stalled + 1)
        damping = np.where(better, 0.3 * damping, 8.0 * damping)
        q, e = np.where(better[:, None], trial, q), np.where(better[:, None], e_trial, e)
        J, E = np.where(better[:, None, None], J_trial, J), np.where(better, E_trial, E)
    return np.concatenate(arrived) if arrived else np.empty((0, 6))


def regular(table: Table, q: Array) -> list[Array]:
    """Return the distinct joint vectors of shape (k, 6) that are away from singularity."""
    if not len(q):
        return []
    sigma = np.linalg.svd(table.poses(q)[1], compute_uv=False)[:, -1]
    kept: list[Array] = []
    for candidate in q[sigma > REGULAR]:
        if not any(same(table, candidate, other) for other in kept):
            kept.append(candidate)
    return kept


def same(table: Table, q: Array, other: Array) -> bool:
    """Whether two joint vectors are one, but for whole turns."""
    gap = q - other
    turned = np.where(table.turns, gap - 2.0 * math.pi * np.round(gap / (2.0 * math.pi)), gap)
    return bool(np.abs(turned).max() < SAME)


@dataclass(slots=True)
class Tally:
    """What a comparison found."""

    arms: int = 0
    skipped: int = 0
    """Arms whose six joints do not make six degrees of freedom."""
    failed: int = 0
    """Arms at which the solver raised an error."""
    incomplete: int = 0
    """Arms of which the solver says itself that solutions may be missing."""
    poses: int = 0
    both: int = 0
    """Regular solutions that one side or the other found."""
    solver: int = 0
    found_by_search: int = 0
    lacked: int = 0
    """By the solver, of an arm that it calls complete."""
    told: int = 0
    """Lacked by the solver, of an arm that it does not call complete."""
    wrong: int = 0
    """Of the solver's, that do not reach the pose by the table."""

    def add(self, other: Tally) -> None:
        """Add up."""
        for field in fields(self):
            setattr(self, field.name, getattr(self, field.name) + getattr(other, field.name))


def compare(seed: int, *, poses: int = POSES, starts: int = STARTS) -> Tally:
    """Compare the solver with the search on one random arm."""
    rng = np.random.default_rng([seed, 1])
    table = random_table(seed)
    if not moves_freely(table, rng):
        return Tally(skipped=1)
    tally = Tally(arms=1)
    goals = table.poses(random_coordinates(table, rng, poses))[0]
    try:
        answers = InverseSolver(table.spec()).solve(goals, limits=False)
    except Exception:  # the campaign goes on, and reports it
        traceback.print_exc()
        return Tally(arms=1, failed=1)
    tally.incomplete = int(not all(answer.complete for answer in answers))
    for goal, answer in zip(goals, answers, strict=True):
        missed = errors(table.poses(answer.q)[0], goal) if len(answer) else np.zeros((0, 6))
        tally.wrong += int(np.sum(np.abs(missed).max(axis=1) > 1e-8)) if len(answer) else 0
        mine = regular(table, answer.q)
        found = regular(table, search(table, goal, random_coordinates(table, rng, starts, 2.0)))
        lacking = [q for q in found if not any(same(table, q, other) for other in mine)]
        tally.poses += 1
        tally.both += len(mine) + len(lacking)
        tally.solver += len(mine)
        tally.found_by_search += len(found)
        if answer.complete:
            tally.lacked += len(lacking)
        else:
            tally.told += len(lacking)
    return tally


def main(arms: int = 340, first: int = 0) -> int:
    """Compare on many arms and print the figures; return 1 if the solver lacks something."""
    total, seed, started = Tally(), first, time.process_time()
    while total.arms < arms:
        tally = compare(seed)
        if tally.lacked or tally.wrong or tally.incomplete or tally.failed:
            print(f"seed {seed}, {random_table(seed).pattern}: {tally}", flush=True)
        total.add(tally)
        seed += 1
        if seed % 50 == 0:
            print(f"{total.arms} arms, {total.poses} poses, {time.process_time() - started:.0f} s CPU", flush=True)
    for field in fields(total):
        print(f"{field.name:16} {getattr(total, field.name)}")
    return 1 if total.lacked or total.wrong or total.failed else 0


if __name__ == "__main__":
    sys.exit(main(*(int(argument) for argument in sys.argv[1:])))
