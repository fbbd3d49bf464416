#!/usr/bin/env python3
"""Draw docs/images/architecture.svg: the path of a table through the folders."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl

mpl.use("svg")
import matplotlib.pyplot as plt
from matplotlib.patches import FancyBboxPatch

OUT = Path(__file__).resolve().parent.parent / "docs" / "images" / "architecture.svg"
INK, SOFT, WARM, COOL = "#26303c", "#eef1f5", "#fbe6d2", "#dcebf7"

BOXES = {
    # name: (x, y, width, words, colour)
    "sources": (0.0, 5.75, 1.7, "URDF, MJCF,\ntables, axes", "white"),
    "importing": (0.0, 4.375, 1.7, "importing/\nback to DH", SOFT),
    "yaml": (0.0, 3.0, 1.7, "robot file\n(YAML)", "white"),
    "robot": (2.4, 3.0, 1.9, "robot/\nRobotSpec", SOFT),
    "kinematics": (5.0, 4.15, 2.1, "kinematics/\nKinematicChain", SOFT),
    "model": (7.8, 4.15, 1.9, "model/\nRobotModel", SOFT),
    "formats": (10.4, 4.15, 1.9, "formats/\nURDF, MJCF", SOFT),
    "oracle": (5.0, 1.85, 2.1, "kinematics/\ntable oracle", WARM),
    "engines": (10.4, 1.85, 1.9, "engines/\nMuJoCo, …", COOL),
    "compare": (7.8, 1.85, 1.9, "validate/\nreport", WARM),
    "export": (13.0, 3.0, 1.9, "export\nfiles on disk", SOFT),
    "simulate": (10.4, 5.75, 1.9, "simulate/\nrollouts", COOL),
    "run": (13.0, 5.75, 1.9, "dataset\n(Zarr)", "white"),
    "view": (7.8, 5.75, 1.9, "view/\nin the browser", COOL),
    "draw": (15.6, 5.75, 1.9, "draw/\nvideos, plots", COOL),
}
ARROWS = [
    ("sources", "importing"),
    ("importing", "yaml"),
    ("yaml", "robot"),
    ("robot", "kinematics"),
    ("kinematics", "model"),
    ("model", "formats"),
    ("formats", "export"),
    ("export", "engines"),
    ("engines", "compare"),
    ("robot", "oracle"),
    ("oracle", "compare"),
    ("formats", "simulate"),
    ("simulate", "run"),
    ("model", "view"),
    ("run", "draw"),
]
HEIGHT = 0.95


def main() -> None:
    """Write the picture; one version of matplotlib writes the same bytes every time."""
    mpl.rcParams.update({"svg.hashsalt": "dh2sim", "font.family": "DejaVu Sans", "svg.fonttype": "path"})
    figure, axes = plt.subplots(figsize=(12.8, 4.3))
    for x, y, width, words, color in BOXES.values():
        box = FancyBboxPatch(
            (x, y), width, HEIGHT, boxstyle="round,pad=0.05,rounding_size=0.12", fc=color, ec=INK, lw=1.2
        )
        axes.add_patch(box)
        axes.text(x + width / 2, y + HEIGHT / 2, words, ha="center", va="center", fontsize=9, color=INK)
    for start, end in ARROWS:
        _arrow(axes, start, end)
    axes.text(6.05, 1.45, "shares no code with the chain", ha="center", fontsize=8.5, style="italic", color=INK)
    axes.set_xlim(-0.2, 17.7)
    axes.set_ylim(1.2, 6.95)
    axes.set_aspect("equal")
    axes.axis("off")
    figure.savefig(OUT, bbox_inches="tight", metadata={"Date": None})


def _arrow(axes: plt.Axes, start: str, end: str) -> None:
    (x1, y1, w1, *_), (x2, y2, w2, *_) = BOXES[start], BOXES[end]
    if x2 > x1 + w1:
        a, b = (x1 + w1 + 0.07, y1 + HEIGHT / 2), (x2 - 0.07, y2 + HEIGHT / 2)
    elif x2 + w2 < x1:
        a, b = (x1 - 0.07, y1 + HEIGHT / 2), (x2 + w2 + 0.07, y2 + HEIGHT / 2)
    elif y2 > y1:
        a, b = (x1 + w1 / 2, y1 + HEIGHT + 0.07), (x2 + w2 / 2, y2 - 0.07)
    else:
        a, b = (x1 + w1 / 2, y1 - 0.07), (x2 + w2 / 2, y2 + HEIGHT + 0.07)
    axes.annotate("", b, a, arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 1.3})


if __name__ == "__main__":
    main()
