#!/usr/bin/env python3
"""Render the README's picture from the exported files: the Stanford arm, SCARA and the Space Station arm at home.

    python scripts/render_robots.py [ROBOT...] [--out docs/images/robots.png] [--size 640x560]

Needs the extra `video`, and EGL or OSMesa to render without a screen.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import mujoco
import numpy as np
from PIL import Image

from dh2sim.draw.offscreen import open_renderer

ROOT = Path(__file__).resolve().parent.parent


def render(robot: str, width: int, height: int) -> np.ndarray:
    """Return the scene of an exported robot at home, as its camera sees it: (height, width, 3) bytes."""
    model = mujoco.MjModel.from_xml_path(str(ROOT / "generated" / robot / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    mujoco.mj_forward(model, data)
    with open_renderer(model, width, height) as renderer:
        renderer.update_scene(data, camera="overview")
        return np.array(renderer.render())


def main() -> None:
    """Parse the command line and write the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="*", default=["stanford", "scara", "ssrms"], metavar="ROBOT")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "images" / "robots.png")
    parser.add_argument("--size", default="560x520", help="of each robot's part, in pixels")
    arguments = parser.parse_args()
    width, height = (int(text) for text in arguments.size.split("x"))
    parts = [render(robot, width, height) for robot in arguments.robots]
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.concatenate(parts, axis=1)).save(arguments.out, optimize=True)
    print(arguments.out)


if __name__ == "__main__":
    main()
