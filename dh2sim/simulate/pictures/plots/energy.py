"""Mechanical energy over time, and how far it drifts."""

from __future__ import annotations

from typing import Any

import numpy as np

from dh2sim.simulate.pictures.plots.style import BLUE, INK, ORANGE, RED, legend_beside, make_figure, view_range
from dh2sim.simulate.pictures.plots.title import title
from dh2sim.simulate.pictures.selection import RolloutData


def plot_energy(rollout: RolloutData, size: tuple[float, float] | None = None) -> Any:
    """Return a figure with potential, kinetic and total energy, and the change of the total since the start.

    Args:
        rollout: the data; needs energy.
        size: of the figure, inches.

    Raises:
        PictureError: energy was not recorded.
    """
    rollout.require("energy", what="this plot")
    time, energy = rollout.values("time"), rollout.values("energy")
    potential, kinetic = energy[:, 0], energy[:, 1]
    total = potential + kinetic
    figure = make_figure(*(size or (8.0, 4.8)), title(rollout))
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[1.7, 1.0])
    for values, color, label in ((potential, BLUE, "potential"), (kinetic, ORANGE, "kinetic"), (total, INK, "total")):
        above.plot(time, values, color=color, label=label)
    above.set_ylim(*view_range(energy, total))
    above.set_ylabel("energy, J")
    legend_beside(above)
    drift = total - total[0]
    below.axhline(0.0, color=INK, lw=0.6)
    below.plot(time, drift, color=RED, label=f"at most {np.abs(drift).max():.2g} J")
    low, high = float(drift.min()), float(drift.max())
    room = 0.08 * max(high - low, 1e-15)
    below.set_ylim(low - room, high + room)
    below.set_ylabel("change of the total, J")
    below.set_xlabel("time, s")
    legend_beside(below)
    figure.align_ylabels()
    return figure
