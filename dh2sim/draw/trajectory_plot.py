"""Plots of trajectories: position, velocity, acceleration and jerk of every joint."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np

from dh2sim.draw.plot_style import (
    BLUE,
    INK,
    ORANGE,
    PURPLE,
    TEAL,
    make_figure,
    plot_style,
    require_plot,
    save,
    value_range,
)
from dh2sim.trajectory.files import SampledTrajectory

_COLUMNS: Final = (
    ("position", "", BLUE),
    ("velocity", "/s", TEAL),
    ("acceleration", "/s²", ORANGE),
    ("jerk", "/s³", PURPLE),
)
MOST_POINTS: Final = 20_000
"""Samples that are drawn of a curve, at most."""


def plot_trajectory(trajectory: SampledTrajectory, title: str, size: tuple[float, float] | None = None) -> Any:
    """Return a figure with a row for every joint: position, velocity, acceleration and jerk.

    What a file does not have of them is of the curve through its samples.

    Args:
        trajectory: The samples.
        title: Of the figure.
        size: Of the figure, inches; None: as large as the joints need.
    """
    rows = len(trajectory.joints)
    width, height = size or (12.0, 1.15 * rows + 1.0)
    figure = make_figure(width, height, title)
    grid = figure.subplots(rows, len(_COLUMNS), sharex=True, squeeze=False)
    every = max(1, -(-len(trajectory.time) // MOST_POINTS))
    shown = np.unique(np.append(np.arange(0, len(trajectory.time), every), len(trajectory.time) - 1))
    time = trajectory.time[shown]
    states = [values[shown] for values in trajectory.states()]
    for joint, name in enumerate(trajectory.joints):
        unit = "" if trajectory.turns is None else ("rad" if trajectory.turns[joint] else "m")
        for column, (what, per, color) in enumerate(_COLUMNS):
            ax, values = grid[joint, column], states[column][:, joint]
            # an instant's value holds to the next where a piece of constant jerk ends between them
            ax.plot(time, values, color=color, drawstyle="steps-post" if what == "jerk" else "default")
            ax.axhline(0.0, color=INK, lw=0.5, alpha=0.5, zorder=1)
            ax.set_ylim(*value_range(values))
            ax.set_ylabel(f"{unit}{per}" if unit else "")
            ax.set_title(f"{name}   {what}" if column == 0 else (what if joint == 0 else ""))
            if joint == rows - 1:
                ax.set_xlabel("time, s")
    figure.align_ylabels()
    return figure


def write_trajectory_plot(
    out: Path,
    trajectory: SampledTrajectory,
    title: str,
    *,
    size: tuple[int, int] | None = None,
    dpi: float,
) -> None:
    """Write a plot of a trajectory, whole or not at all; the same bytes every time.

    Args:
        out: .png, .svg or .pdf.
        trajectory: The samples.
        title: Of the figure.
        size: Pixels; None: what suits the plot.
        dpi: Pixels an inch.

    Raises:
        PictureError: The ending is another.
        OutputError: It cannot be written.
    """
    require_plot(out)
    with plot_style():
        inches = None if size is None else (size[0] / dpi, size[1] / dpi)
        save(plot_trajectory(trajectory, title, inches), out, dpi=dpi)
