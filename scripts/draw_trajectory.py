"""Draw the picture of docs/trajectories.md: the motion of docs/waypoints.yaml over time."""

from __future__ import annotations

from pathlib import Path

import dh2sim
from dh2sim.draw.trajectory_plot import write_trajectory_plot
from dh2sim.trajectory.waypoints import read_waypoints

DOCS = Path(__file__).resolve().parent.parent / "docs"


def main() -> None:
    robot = dh2sim.Robot.load("puma560")
    file = read_waypoints(DOCS / "waypoints.yaml", robot.spec)
    planned = robot.trajectory(file.waypoints, limits=file.limits)
    title = f"puma560 · waypoints.yaml · {planned.duration:.4g} s"
    write_trajectory_plot(DOCS / "images" / "trajectory.png", planned.sample(), title, dpi=100.0)


if __name__ == "__main__":
    main()
