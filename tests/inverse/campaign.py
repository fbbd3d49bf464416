"""Figures of the inverse kinematics for docs/inverse.md: ``OPENBLAS_NUM_THREADS=1 python -m tests.inverse.campaign``.

Every robot of six joints and fewer that comes with dh2sim, and arms of the literature: how many of 10 000 random
configurations are found again among the solutions of their poses, how many solutions there are, how exact they are,
and what it costs in CPU time.
"""

from __future__ import annotations

import sys
import time
from collections import Counter

import numpy as np

from dh2sim.inverse.nearest import goal_sigma_min
from dh2sim.inverse.solver import InverseSolver
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.inverse.arms import ARMS
from tests.sample_robots import NAMES, robot

POSES = 10_000
REGULAR = 1e-6
"""Least singular value above which a configuration counts as regular."""
SINGLE = 50
"""Poses that are solved one by one for their time."""


def figures(spec: RobotSpec, poses: int = POSES) -> str:
    """Return a row of the table."""
    limits = [row.limits.position or (-np.pi, np.pi) for row in spec.moving_rows]
    lower, upper = np.array(limits).T
    q = np.random.default_rng(0).uniform(lower, upper, (poses, len(limits)))
    T = table_tool_pose(spec, q)
    start = time.process_time()
    solver = InverseSolver(spec)
    solver.solve(T[:1], limits=False)
    built = time.process_time()
    results = [result for i in range(0, poses, 1000) for result in solver.solve(T[i : i + 1000], limits=False)]
    solved = time.process_time()
    for i in range(SINGLE):
        solver.solve(T[i : i + 1], limits=False)
    single = time.process_time()
    found = missed = 0
    counts: Counter[int] = Counter()
    worst = 0.0
    for vector, result in zip(q, results, strict=True):
        if is_found(spec, vector, result.q):
            found += 1
        elif goal_sigma_min(spec, vector[None], free=None, size=solver.size, rank=len(vector))[0] > REGULAR:
            missed += 1
        counts[len(result)] += 1
        worst = max(worst, float(result.residual.max(initial=0.0)))
    share = results[0].found_share
    branches = ", ".join(f"{count}: {number}" for count, number in sorted(counts.items()))
    return (
        f"| {spec.name} | {found} | {missed} | {branches} | {worst:.0e} | {share:.3f} | {built - start:.2f} s "
        f"| {1e3 * (solved - built) / poses:.2f} ms | {1e3 * (single - solved) / SINGLE:.1f} ms |"
    )


def is_found(spec: RobotSpec, q: Array, solutions: Array) -> bool:
    """Return whether a joint vector is among others, but for whole turns."""
    turns = np.array([row.type.turns for row in spec.moving_rows])
    gap = solutions - q
    gap = np.where(turns, gap - 2.0 * np.pi * np.round(gap / (2.0 * np.pi)), gap)
    return bool((np.abs(gap).max(axis=1, initial=0.0) < 1e-4).any())


def main(names: list[str]) -> None:
    """Print the table."""
    specs = [robot(name) for name in NAMES if len(robot(name).moving_rows) <= 6] + list(ARMS.values())
    print(
        "| arm | found of 10 000 | missed, regular | solutions: poses | residual | share | built | a pose | alone |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for spec in specs:
        if not names or spec.name in names:
            print(figures(spec), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
