#!/usr/bin/env python3
"""Compare rollouts on MuJoCo Warp with those on MuJoCo: how far apart they are, and how fast each is.

    python scripts/bench_warp.py                                   stanford, 4096 rollouts of 1000 steps: for a GPU
    python scripts/bench_warp.py planar_2r --rollouts 4 --steps 50    on a processor, where it is slow

Needs the extra `warp`. Both start at random positions, so that in some rollouts links of the robot touch. Kernels are
compiled before the clock starts.
"""

from __future__ import annotations

import argparse
import sys
import time
from typing import Any

import numpy as np

import dh2sim
from dh2sim.simulate.block import Block, simulate_block
from dh2sim.simulate.options import ENGINES, RolloutOptions
from dh2sim.simulate.prepare import prepare
from dh2sim.simulate.warp_batch import warp_device


def simulated(robot: str, engine: str, **options: Any) -> tuple[Block, float]:
    """Return what an engine records, and how many steps it takes a second."""
    job = prepare(
        dh2sim.build_model(dh2sim.load_robot(robot)), RolloutOptions(engine=engine, start="random", **options)
    )
    rollouts, start = job.options.rollouts, time.perf_counter()
    block = simulate_block(job, range(rollouts))
    return block, rollouts * job.options.steps / (time.perf_counter() - start)


def main() -> int:
    """Simulate with both engines and print what differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robot", nargs="?", default="stanford")
    parser.add_argument("--rollouts", type=int, default=4096)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--controller", default="sine")
    given = parser.parse_args()
    options = {"rollouts": given.rollouts, "steps": given.steps, "every": given.steps, "controller": given.controller}
    results = {engine: simulated(given.robot, engine, record=("qpos", "qvel"), **options) for engine in ENGINES}
    (expected, _), (found, _) = results.values()
    touched = expected["contact_step"] >= 0
    for words, which in (("no links touch", ~touched), ("links touch", touched)):
        print(f"{words} in {int(which.sum())} rollouts")
        for name, unit in (("qpos", "rad or m"), ("qvel", "rad/s or m/s")):
            away = np.abs(found[name] - expected[name])[which, -1]
            if away.size:
                most, middle = np.nanmax(away), np.nanmedian(away)
                print(f"  {name} at the end: {most:.2g} {unit} apart at most, {middle:.2g} in the median")
    for engine, (_, rate) in results.items():
        where = warp_device() if engine == "warp" else "all processors"
        print(f"{engine:6} {rate:12,.0f} steps/s on {where}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
