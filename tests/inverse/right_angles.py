"""Whether solutions are lost where joints stand at right angles, or nearly: ``python -m tests.inverse.right_angles``.

    python -m tests.inverse.right_angles [POSES_PER_ARM] [RANDOM_ARMS] [FIRST_SEED] [ARM...]

At such poses solutions share coordinates, eliminations are singular, and rounding decides what is found. So each pose
is solved several times: as it is, with its last digits changed, and by an arm that is the same but for a turned base
and tool, whose numbers are others. The configuration drawn, and each regular solution that any of them finds, must be
found by all that call their answer complete.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, Final

import numpy as np

from dh2sim.inverse.nearest import goal_sigma_min
from dh2sim.inverse.solver import InverseSolver
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.links import BaseSpec, Pose, ToolSpec
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.inverse.arms import ARMS
from tests.inverse.campaign import is_found
from tests.inverse.completeness import moves_freely, random_table
from tests.sample_robots import NAMES, robot

REGULAR: Final = 1e-4
"""Least singular value of the configurations that are compared."""
ROUNDING: Final = 1e-15
"""Share by which the last digits of poses are changed."""


@dataclass(slots=True)
class Tally:
    """What was found of an arm's poses."""

    poses: int = 0
    solved: int = 0
    """Answers: each pose is solved several times."""
    incomplete: int = 0
    """Answers that say that solutions may be missing."""
    missed: int = 0
    """Answers without the configuration drawn."""
    falsely_complete: int = 0
    """Answers that are called complete and lack a regular solution."""
    odd: int = 0
    """Answers that are called complete and have an odd number of solutions, all of them regular."""
    examples: list[Any] = field(default_factory=list)
    """Configurations at which that is so."""

    def add(self, other: Tally) -> None:
        """Add up."""
        for each in fields(self):
            setattr(self, each.name, getattr(self, each.name) + getattr(other, each.name))

    def __str__(self) -> str:
        """Return the figures in a line."""
        return ", ".join(f"{each.name} {getattr(self, each.name)}" for each in fields(self)[:-1])


def drawn(spec: RobotSpec, rng: np.random.Generator, count: int) -> Array:
    """Return joint vectors at right angles, of which some joints are off by a little, or anywhere: (count, n)."""
    rows = spec.moving_rows
    turns = np.array([row.type.turns for row in rows])
    shape = (count, len(rows))
    q = np.where(turns, rng.integers(-1, 3, shape) * 0.5 * np.pi, rng.choice([0.0, 0.25, 0.5], shape))
    little = 10.0 ** rng.uniform(-5.0, -0.5, shape) * rng.choice([-1.0, 1.0], shape)
    q = np.where(rng.random(shape) < rng.choice([0.0, 0.2, 0.4], (count, 1)), q + little, q)
    anywhere = np.where(turns, rng.uniform(-np.pi, np.pi, shape), rng.uniform(-0.5, 0.8, shape))
    return np.where(rng.random(shape) < rng.choice([0.0, 0.2, 0.4], (count, 1)), anywhere, q)


def turned(spec: RobotSpec) -> RobotSpec:
    """Return an arm with another base and tool."""
    base = BaseSpec(pose=Pose(xyz=np.array([0.13, -0.21, 0.34]), rpy=np.array([0.7, -0.4, 1.9])))
    return replace(spec, base=base, tool=ToolSpec(xyz=np.array([-0.11, 0.08, 0.17]), rpy=np.array([-1.1, 0.6, 0.3])))


def compare(spec: RobotSpec, poses: int, seed: int) -> Tally:
    """Solve some poses of an arm in several ways."""
    rng = np.random.default_rng(seed)
    q = drawn(spec, rng, poses)
    solver, other = InverseSolver(spec), InverseSolver(turned(spec))
    q = q[goal_sigma_min(spec, q, free=None, size=solver.size, rank=q.shape[1]) > REGULAR]
    T = table_tool_pose(spec, q)
    rounded = T * (1.0 + ROUNDING * rng.integers(-2, 3, T.shape))
    answers = [
        solver.solve(T, limits=False),
        solver.solve(rounded, limits=False),
        other.solve(table_tool_pose(turned(spec), q), limits=False),
    ]
    tally = Tally(poses=len(q))
    for own, each in zip(q, zip(*answers, strict=True), strict=True):
        regular = [solution for answer in each for solution in answer.q[answer.sigma_min > REGULAR]]
        for answer in each:
            tally.solved += 1
            tally.missed += not is_found(spec, own, answer.q)
            tally.incomplete += not answer.complete
            if answer.complete:
                lacking = not all(is_found(spec, solution, answer.q) for solution in [own, *regular])
                odd = len(own) == 6 and len(answer) % 2 == 1 and bool((answer.sigma_min > REGULAR).all())
                tally.falsely_complete += lacking
                tally.odd += odd
                if lacking or odd:
                    tally.examples.append((spec.name, own.tolist()))
    return tally


def random_arms(first: int, count: int) -> list[RobotSpec]:
    """Return arms of six joints like those of textbooks, whose joints make six degrees of freedom."""
    arms: list[RobotSpec] = []
    seed = first
    while len(arms) < count:
        table = random_table(seed)
        if moves_freely(table, np.random.default_rng(seed)):
            arms.append(replace(table.spec(), name=f"random_{seed}"))
        seed += 1
    return arms


def main(names: Sequence[str] = (), poses: int = 400, arms: int = 30, first: int = 0) -> int:
    """Compare on the robots of six joints that come with dh2sim, on those of the literature, and on random ones."""
    catalogue = [robot(name) for name in NAMES]
    specs = [spec for spec in catalogue if len(spec.moving_rows) == 6] + [*ARMS.values(), *random_arms(first, arms)]
    total = Tally()
    for spec in specs:
        if names and spec.name not in names:
            continue
        started = time.process_time()
        tally = compare(spec, poses, first)
        total.add(tally)
        print(f"{spec.name}: {tally}, {time.process_time() - started:.1f} s", *tally.examples[:3], flush=True)
    print(f"all: {total}")
    return 1 if total.falsely_complete or total.odd else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[4:], *(int(argument) for argument in sys.argv[1:4])))
