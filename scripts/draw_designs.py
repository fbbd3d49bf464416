"""Draw ``docs/images/designs.png``: what two numbers of the Stanford arm do to its workspace and its payload."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt

from dh2sim import Robot

OUT = Path(__file__).resolve().parent.parent / "docs" / "images" / "designs.png"
VARY = {"d2": 0.2, "joint_3.limits.position[1]": "uniform:0.6:1.3"}


def main() -> None:
    found = Robot.load("stanford").sweep(vary=VARY, count=500, measure="workspace,payload")
    columns = found.columns
    figure, axes = plt.subplots(figsize=(7.0, 4.0), dpi=120, layout="constrained")
    drawn = axes.scatter(
        columns["workspace"], columns["payload"], c=columns["joint_3.limits.position[1]"], s=14, cmap="viridis"
    )
    figure.colorbar(drawn, label="upper limit of the boom, m")
    axes.set_xlabel("workspace, m³")
    axes.set_ylabel("payload in every configuration, kg")
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(OUT)


if __name__ == "__main__":
    main()
