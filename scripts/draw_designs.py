"""Draw ``docs/images/designs.png``: what the lengths of a UR5e's links do to its workspace and its payload."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt

from dh2sim import Robot

OUT = Path(__file__).resolve().parent.parent / "docs" / "images" / "designs.png"
VARY = {"a2": 0.3, "a3": 0.3}


def main() -> None:
    found = Robot.load("ur5e").sweep(vary=VARY, count=500, measure="workspace,payload")
    columns = found.columns
    figure, axes = plt.subplots(figsize=(7.0, 4.0), dpi=120, layout="constrained")
    drawn = axes.scatter(columns["workspace"], columns["payload"], c=abs(columns["a2"]), s=14, cmap="viridis")
    figure.colorbar(drawn, label="length of the upper arm |a2|, m")
    axes.set_xlabel("workspace, m³")
    axes.set_ylabel("payload in every configuration, kg")
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(OUT)


if __name__ == "__main__":
    main()
