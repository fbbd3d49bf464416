#!/usr/bin/env python3
"""Render exported robots at home: the README's picture, or a contact sheet of all robots; or the mechanisms.

    python scripts/render_robots.py [ROBOT...] [--out docs/images/robots.png] [--size 560x520]
    python scripts/render_robots.py --sheet sheet.png
    python scripts/render_robots.py --mechanisms docs/images/mechanisms.png --size 400x320

Needs the extra `video`, and EGL or OSMesa to render without a screen.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from dh2sim import Robot
from dh2sim.draw.motion import motion_of_robot
from dh2sim.draw.offscreen import open_renderer
from dh2sim.draw.renderer import PictureOptions, open_motion
from dh2sim.robot.catalog import builtin_mechanisms, builtin_robots

ROOT = Path(__file__).resolve().parent.parent
COLUMNS, MECHANISM_COLUMNS = 5, 3
"""Of a contact sheet."""


def render(robot: str, width: int, height: int) -> np.ndarray:
    """Return the scene of an exported robot at home, as its camera sees it: (height, width, 3) bytes."""
    model = mujoco.MjModel.from_xml_path(str(ROOT / "generated" / robot / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    mujoco.mj_forward(model, data)
    with open_renderer(model, width, height) as renderer:
        renderer.update_scene(data, camera="overview")
        return np.array(renderer.render())


def render_mechanism(name: str, width: int, height: int) -> np.ndarray:
    """Return a mechanism in its assembly."""
    robot = Robot.load(name)
    motion = motion_of_robot(robot.mechanism if robot.spec.is_mechanism else robot.model)
    with open_motion(motion, PictureOptions(width=width, height=height)) as renderer:
        return renderer.picture(0)


def sheet(
    robots: list[str],
    width: int,
    height: int,
    *,
    columns: int = COLUMNS,
    picture_of: Callable[[str, int, int], np.ndarray] = render,
) -> np.ndarray:
    """Return the pictures of robots in rows, each with its name."""
    rows = []
    for start in range(0, len(robots), columns):
        parts = []
        for name in robots[start : start + columns]:
            picture = Image.fromarray(picture_of(name, width, height))
            ImageDraw.Draw(picture).text((10, 8), name, fill=(30, 30, 30), font=ImageFont.load_default(16))
            parts.append(np.array(picture))
        blank = np.full((height, width * (columns - len(parts)), 3), 255, dtype=np.uint8)
        rows.append(np.concatenate([*parts, blank], axis=1))
    return np.concatenate(rows)


def main() -> None:
    """Parse the command line and write the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="*", metavar="ROBOT")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "images" / "robots.png")
    parser.add_argument("--sheet", type=Path, metavar="FILE", help="write a contact sheet, of all robots by default")
    parser.add_argument("--mechanisms", type=Path, metavar="FILE", help="write a contact sheet of the mechanisms")
    parser.add_argument("--size", default="560x520", help="of each robot's part, in pixels")
    arguments = parser.parse_args()
    width, height = (int(text) for text in arguments.size.split("x"))
    if arguments.mechanisms:
        names, out = list(builtin_mechanisms()), arguments.mechanisms
        picture = sheet(names, width, height, columns=MECHANISM_COLUMNS, picture_of=render_mechanism)
    elif arguments.sheet:
        out, picture = arguments.sheet, sheet(arguments.robots or list(builtin_robots()), width, height)
    else:
        robots = arguments.robots or ["stanford", "scara", "ssrms"]
        out, picture = arguments.out, np.concatenate([render(name, width, height) for name in robots], axis=1)
    out.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(picture).save(out, optimize=True)
    print(out)


if __name__ == "__main__":
    main()
