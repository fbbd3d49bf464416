#!/usr/bin/env python3
"""Draw the README's picture of a rollout: the Stanford arm with its frames and the path of its tool, and its joints.

    python scripts/draw_rollout.py [ROBOT] [--out docs/images/rollout.png]

Simulates one rollout with the program itself. Needs the extras `plot` and `video`, and EGL or OSMesa.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
HEIGHT = 760
ARM, JOINTS = 720, 960
"""Widths, pixels."""
ROLLOUT = 7
"""One in which much of the arm is seen."""


def dh2sim(*arguments: str | int | Path) -> None:
    """Run a command line."""
    subprocess.run([sys.executable, "-m", "dh2sim", *map(str, arguments)], cwd=ROOT, check=True)


def draw(robot: str, folder: Path) -> Image.Image:
    """Simulate a robot and return it at the end of its rollout, beside what its joints did."""
    run, arm, joints = folder / f"{robot}.zarr", folder / "arm.png", folder / "joints.png"
    dh2sim(
        *("rollout", robot, "--out", run, "--rollouts", ROLLOUT + 1, "--duration", "4", "--seed", "3", "--quiet"),
        *("--controller", "pd:period=1", "--record", "qpos,qvel,tool_pose,reference"),
    )
    chosen = ("--rollout", ROLLOUT, "--quiet")
    dh2sim("render", run, *chosen, "--frames", "--size", f"{ARM}x{HEIGHT}", "--out", arm)
    dh2sim("plot", run, *chosen, "--size", f"{JOINTS}x{HEIGHT}", "--dpi", "110", "--out", joints)
    whole = Image.new("RGB", (ARM + JOINTS, HEIGHT), "white")
    with Image.open(arm) as left, Image.open(joints) as right:
        whole.paste(left, (0, 0))
        whole.paste(right.convert("RGB"), (ARM, 0))
    return whole


def main() -> None:
    """Parse the command line and write the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robot", nargs="?", default="stanford", metavar="ROBOT")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "images" / "rollout.png")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        draw(arguments.robot, Path(folder)).save(arguments.out, optimize=True)
    print(arguments.out)


if __name__ == "__main__":
    main()
