"""How well references are followed."""

from __future__ import annotations

from typing import Any

import numpy as np

from dh2sim.simulate.pictures.plots.joints import ROWS
from dh2sim.simulate.pictures.plots.saturation import saturated
from dh2sim.simulate.pictures.plots.style import BLUE, RED, legend_below, make_figure, view_range
from dh2sim.simulate.pictures.plots.title import title
from dh2sim.simulate.pictures.selection import RolloutData


def plot_tracking(rollout: RolloutData, size: tuple[float, float] | None = None) -> Any:
    """Return a figure with the error q - q_ref of every joint; marked where its actuator was at the end of its range.

    Args:
        rollout: the data; needs qpos and qpos_ref.
        size: of the figure, inches.

    Raises:
        PictureError: positions or references were not recorded, as of controllers that follow none.
    """
    rollout.require("qpos", "qpos_ref", what="this plot")
    names, units = rollout.names("joint"), rollout.names("joint_unit")
    time, error = rollout.values("time"), rollout.values("qpos") - rollout.values("qpos_ref")
    clipped, starts = saturated(rollout), rollout.values("interval_time")
    blocks = max(1, -(-len(names) // ROWS))
    rows = max(1, -(-len(names) // blocks))
    width, height = size or (7.6 * blocks, 1.25 * rows + 1.0)
    figure = make_figure(width, height, title(rollout))
    grid = figure.subplots(rows, blocks, sharex=True, squeeze=False)
    for place, ax in enumerate(grid.T.ravel()):
        if place >= len(names):
            ax.set_visible(False)
            continue
        rms = float(np.sqrt(np.mean(error[:, place] ** 2)))
        ax.axhline(0.0, color=RED, lw=0.6, alpha=0.6)
        ax.plot(time, error[:, place], color=BLUE)
        low, high = _range(error[:, place])
        ax.set_ylim(low, high)
        marks = starts[clipped[:, place]]
        if len(marks):
            ax.plot(marks, np.full(len(marks), low), "|", color=RED, ms=9, clip_on=False, label="actuator saturated")
        ax.set_title(f"{names[place]}   RMS {rms:.2g} {units[place]}")
        ax.set_ylabel(f"q − q_ref, {units[place]}")
        if place % rows == rows - 1 or place + 1 == len(names):
            ax.set_xlabel("time, s")
            ax.tick_params(labelbottom=True)
    figure.align_ylabels()
    legend_below(figure, grid.ravel())
    return figure


def _range(error: Any) -> tuple[float, float]:
    """An error may be as small as it likes: it is no noise."""
    greatest = float(np.abs(error).max())
    low, high = view_range(error / greatest) if greatest > 0.0 else (-1e-9, 1e-9)
    return (low * greatest, high * greatest) if greatest > 0.0 else (low, high)
