#!/usr/bin/env python3
"""Make the pictures of docs/drawings.md: SVGs in docs/images, the same bytes every time.

python scripts/draw_robots.py            writes them
python scripts/draw_robots.py --check    exits with 1 if one is out of date
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from dh2sim.draw.diagram.drawing import RobotDrawing, draw_robot
from dh2sim.robot.read import load_robot

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "images"
BOX = (-1.0, 1.0, -1.0, 1.0, -1.0, 1.0)


def drawings() -> dict[str, RobotDrawing]:
    """Return the pictures by the names of their files."""
    stanford, printed = load_robot("stanford"), [math.radians(x) for x in (45, 60, 0, 45, 0, -60)]
    printed[2] = 0.2
    return {
        "drawing_kinematic.svg": draw_robot(stanford),
        "drawing_frames.svg": draw_robot(load_robot("puma560_standard"), style="frames"),
        "drawing_stick_zero.svg": draw_robot(stanford, "zero", style="stick", workspace=BOX, reach=1.0),
        "drawing_stick_printed.svg": draw_robot(stanford, printed, style="stick", workspace=BOX, reach=1.0),
        "drawing_four_bar.svg": draw_robot(load_robot("four_bar")),
    }


def main() -> None:
    """Write the pictures, or compare them."""
    outdated = []
    for name, drawing in drawings().items():
        path = FOLDER / name
        if "--check" not in sys.argv[1:]:
            drawing.save(path)
        elif not path.exists() or path.read_text(encoding="utf-8") != drawing.svg:
            outdated.append(name)
    if outdated:
        sys.exit(f"out of date: {', '.join(outdated)}; run python scripts/draw_robots.py")


if __name__ == "__main__":
    main()
