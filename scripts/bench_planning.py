"""Measure workspaces and trajectories for ``scripts/bench``."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

from scripts.bench_timing import Row, best

FIRST = """
import time
import dh2sim
from dh2sim.workspace.workspace import compute_workspace
robot = dh2sim.Robot.load("puma560")
robot.model
started = time.process_time()
found = compute_workspace(robot, size=0.04, samples=200_000)
print(time.process_time() - started, len(found.centers))
"""
"""What a process does that computes one workspace, with nothing warmed up but the robot."""


def workspace() -> Iterator[Row]:
    """Voxels of the PUMA at 40 mm by 200 000 configurations, the first computation of a process."""
    times, voxels = [], 0
    for _ in range(5):
        printed = subprocess.run([sys.executable, "-c", FIRST], capture_output=True, text=True, check=True).stdout
        seconds, voxels = float(printed.split()[0]), int(printed.split()[1])
        times.append(seconds)
    figure = f"{min(times):.2f} s CPU, {voxels:,} voxels"
    yield "workspace of puma560, 40 mm, 200 000 configurations", figure, "<= 1 s", min(times) <= 1.0


def trajectory() -> Iterator[Row]:
    """A jerk-limited motion of six joints, through the library."""
    import dh2sim

    robot = dh2sim.Robot.load("puma560")
    goal = [0.3, -0.8, -0.3, 0.1, 0.7, 0.2]

    def hundred() -> None:
        for _ in range(100):
            robot.trajectory(["home", goal], profile="jerk")

    hundred()
    milliseconds = 10.0 * best(hundred)
    yield "jerk-limited motion of six joints", f"{milliseconds:.2f} ms", "<= 1 ms", milliseconds <= 1.0
