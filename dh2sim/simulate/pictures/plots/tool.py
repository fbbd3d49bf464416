"""Where the tool is and how it is turned, over time and in space."""

from __future__ import annotations

from typing import Any

import numpy as np

from dh2sim.simulate.pictures.plots.style import (
    BLUE,
    INK,
    ORANGE,
    PURPLE,
    RED,
    TEAL,
    legend_beside,
    make_figure,
    view_range,
)
from dh2sim.simulate.pictures.plots.title import title
from dh2sim.simulate.pictures.selection import RolloutData
from dh2sim.typing import Array


def plot_tool(rollout: RolloutData, size: tuple[float, float] | None = None) -> Any:
    """Return a figure with position and orientation of tool0 in the world over time, and its path.

    Args:
        rollout: the data; needs tool_pose.
        size: of the figure, inches.

    Raises:
        PictureError: the pose of the tool was not recorded.
    """
    rollout.require("tool_pose", what="this plot")
    time, pose = rollout.values("time"), rollout.values("tool_pose")
    figure = make_figure(*(size or (10.0, 5.2)), title(rollout))
    grid = figure.add_gridspec(2, 2, width_ratios=[1.1, 1.0])
    above = figure.add_subplot(grid[0, 0])
    below = figure.add_subplot(grid[1, 0], sharex=above)
    angles = roll_pitch_yaw(pose[:, 3:])
    for ax, values, names, label in (
        (above, pose[:, :3], ("x", "y", "z"), "position of tool0, m"),
        (below, angles, ("roll", "pitch", "yaw"), "orientation of tool0, rad"),
    ):
        for k, (name, color) in enumerate(zip(names, (RED, TEAL, BLUE), strict=True)):
            ax.plot(time, values[:, k], color=color, label=name)
        ax.set_ylim(*view_range(values))
        ax.set_ylabel(label)
        legend_beside(ax)
    above.tick_params(labelbottom=False)
    below.set_xlabel("time, s")
    _path(figure.add_subplot(grid[:, 1], projection="3d"), pose[:, :3])
    figure.align_ylabels()
    return figure


def roll_pitch_yaw(quaternions: Array) -> Array:
    """Return angles about fixed x, y, z, rad, shape (count, 3), without jumps by a turn.

    The rotation is Rz(yaw) Ry(pitch) Rx(roll).

    Args:
        quaternions: w, x, y, z, shape (count, 4).
    """
    w, x, y, z = np.moveaxis(quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True), 1, 0)
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return np.stack([np.unwrap(roll), pitch, np.unwrap(yaw)], axis=1)


def _path(ax: Any, points: Array) -> None:
    """Draw a path in space, a metre as long along every axis."""
    ax.plot(*points.T, color=PURPLE, lw=1.4)
    ax.scatter(*points[0], color=TEAL, s=26, label="start", depthshade=False)
    ax.scatter(*points[-1], color=ORANGE, s=26, label="end", depthshade=False)
    low, high = points.min(axis=0), points.max(axis=0)
    half = 0.55 * max(float((high - low).max()), 1e-3)
    middle = (low + high) / 2
    for name, centre in zip("xyz", middle, strict=True):
        getattr(ax, f"set_{name}lim")(centre - half, centre + half)
        getattr(ax, f"set_{name}label")(f"{name}, m")
        getattr(ax, f"{name}axis").set_major_locator(_few_ticks())
        getattr(ax, f"{name}axis").set_pane_color((0.97, 0.975, 0.98, 1.0))
    ax.set_box_aspect((1, 1, 1), zoom=0.82)
    ax.view_init(elev=22, azim=-50)
    ax.legend(loc="upper right", labelcolor=INK)


def _few_ticks() -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(4)
