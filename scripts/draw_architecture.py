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
    "verbs": (0.0, 7.3, 17.3, "Robot and its methods      ·      functions      ·      dh2sim COMMAND", "white"),
    "others": (0.0, 5.75, 1.9, "URDF, MJCF,\ntables, axes", "white"),
    "importing": (0.0, 4.375, 1.9, "importing/\nback to DH", SOFT),
    "yaml": (0.0, 3.0, 1.9, "robot file\n(YAML)", "white"),
    "robot": (2.6, 3.0, 1.9, "robot/\nRobotSpec", SOFT),
    "kinematics": (5.1, 4.15, 2.1, "kinematics/\nKinematicChain", SOFT),
    "model": (7.8, 4.15, 1.9, "model/\nRobotModel", SOFT),
    "formats": (10.4, 4.15, 1.9, "formats/\nURDF, MJCF", SOFT),
    "oracle": (5.1, 1.85, 2.1, "table_oracle\nfrom the rows", WARM),
    "engines": (10.4, 1.85, 1.9, "engines/\nMuJoCo, …", COOL),
    "validate": (7.8, 1.85, 1.9, "validate/\ncompared", WARM),
    "export": (13.0, 3.0, 1.9, "export\nfiles on disk", SOFT),
    "view": (7.8, 5.75, 1.9, "view/\na live page", COOL),
    "simulate": (10.4, 5.75, 1.9, "simulate/\nrollouts", COOL),
    "run": (13.0, 5.75, 1.9, "dataset\n(Zarr)", "white"),
    "draw": (15.4, 5.75, 1.9, "draw/\nvideos, plots", COOL),
}
ARROWS = [
    ("others", "importing"),
    ("importing", "yaml"),
    ("yaml", "robot"),
    ("robot", "kinematics"),
    ("kinematics", "model"),
    ("model", "formats"),
    ("model", "view"),
    ("formats", "export"),
    ("export", "engines"),
    ("engines", "validate"),
    ("robot", "oracle"),
    ("oracle", "validate"),
    ("formats", "simulate"),
    ("simulate", "run"),
    ("run", "draw"),
]
HEIGHT = 0.95


def main() -> None:
    """Write the picture; one version of matplotlib writes the same bytes every time."""
    mpl.rcParams.update({"svg.hashsalt": "dh2sim", "font.family": "DejaVu Sans", "svg.fonttype": "path"})
    figure, axes = plt.subplots(figsize=(12.6, 5.0))
    for x, y, width, words, color in BOXES.values():
        box = FancyBboxPatch(
            (x, y), width, HEIGHT, boxstyle="round,pad=0.05,rounding_size=0.12", fc=color, ec=INK, lw=1.2
        )
        axes.add_patch(box)
        axes.text(x + width / 2, y + HEIGHT / 2, words, ha="center", va="center", fontsize=9, color=INK)
    for start, end in ARROWS:
        _arrow(axes, start, end)
    axes.text(6.15, 1.45, "shares no code with the chain", ha="center", fontsize=8.5, style="italic", color=INK)
    axes.set_xlim(-0.2, 17.5)
    axes.set_ylim(1.2, 8.45)
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
