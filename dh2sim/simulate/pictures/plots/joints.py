"""Positions and velocities of all joints, with references, controls and limits."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dh2sim.simulate.pictures.plots.style import (
    BLUE,
    GREY,
    ORANGE,
    PURPLE,
    TEAL,
    legend_below,
    make_figure,
    shade_outside,
    view_range,
)
from dh2sim.simulate.pictures.plots.title import title
from dh2sim.simulate.pictures.selection import RolloutData

ROWS = 8
"""Joints below each other; more stand beside them."""


def plot_joints(rollout: RolloutData, size: tuple[float, float] | None = None) -> Any:
    """Return a figure with a row for every joint: position, velocity, and force where it is known.

    Args:
        rollout: the data; needs qpos or qvel.
        size: of the figure, inches; None: as large as the joints need.

    Raises:
        PictureError: neither was recorded.
    """
    if "qvel" not in rollout.data:
        rollout.require("qpos", what="this plot")
    names = rollout.names("joint")
    columns = [draw for draw, shown in _COLUMNS if shown(rollout)]
    blocks = max(1, -(-len(names) // ROWS))
    rows = max(1, -(-len(names) // blocks))
    width, height = size or (max(6.4, 3.3 * len(columns) * blocks + 0.4), 1.25 * rows + 1.0)
    figure = make_figure(width, height, title(rollout))
    grid = figure.subplots(rows, blocks * len(columns), sharex=True, squeeze=False)
    for place in range(rows * blocks):
        block, row = divmod(place, rows)
        for k, draw in enumerate(columns):
            ax = grid[row, block * len(columns) + k]
            if place >= len(names):
                ax.set_visible(False)
                continue
            draw(ax, rollout, place)
            ax.set_title(names[place] if k == 0 else "")
            if row == rows - 1 or block * rows + row + 1 == len(names):
                ax.set_xlabel("time, s")
                ax.tick_params(labelbottom=True)
    figure.align_ylabels()
    legend_below(figure, grid.ravel())
    return figure


def control(rollout: RolloutData, joint: int, kind: str) -> NDArray[Any] | None:
    """Return the controls of a joint's actuator if it is of a kind: 'position', 'velocity' or 'motor'."""
    if "ctrl" not in rollout.data:
        return None
    name = f"{rollout.names('joint')[joint]}_{kind}"
    actuators = rollout.names("actuator")
    return rollout.values("ctrl")[:, actuators.index(name)] if name in actuators else None


def _position(ax: Any, rollout: RolloutData, joint: int) -> None:
    seen = _curve(ax, rollout, joint, "qpos", "position", BLUE)
    seen += _control(ax, rollout, joint, "position")
    limits = [float(rollout.values(f"joint_{side}")[joint]) for side in ("lower", "upper")]
    shade_outside(ax, limits[0], limits[1], *view_range(*seen))
    ax.set_ylabel(f"position, {_unit(rollout, joint)}")


def _velocity(ax: Any, rollout: RolloutData, joint: int) -> None:
    seen = _curve(ax, rollout, joint, "qvel", "velocity", TEAL)
    seen += _control(ax, rollout, joint, "velocity")
    limit = float(rollout.values("joint_velocity_limit")[joint])
    shade_outside(ax, -limit, limit, *view_range(*seen))
    ax.set_ylabel(f"velocity, {_unit(rollout, joint)}/s")


def _force(ax: Any, rollout: RolloutData, joint: int) -> None:
    time = rollout.values("interval_time")
    if "torque" in rollout.data:
        values, label = rollout.values("torque")[:, joint], "actuator force"
    else:
        found = control(rollout, joint, "motor")
        values, label = (np.full(len(time), np.nan) if found is None else found), "control"
    ax.step(time, values, where="post", color=PURPLE, lw=1.1, label=label)
    ax.set_ylim(*view_range(values))
    ax.set_ylabel("force, N" if _unit(rollout, joint) == "m" else "torque, N·m")


def _curve(ax: Any, rollout: RolloutData, joint: int, name: str, label: str, color: str) -> list[NDArray[Any]]:
    """Draw a variable and its reference; return what was drawn."""
    time, values = rollout.values("time"), rollout.values(name)[:, joint]
    ax.plot(time, values, color=color, label=label)
    if f"{name}_ref" not in rollout.data:
        return [values]
    reference = rollout.values(f"{name}_ref")[:, joint]
    ax.plot(time, reference, color=ORANGE, ls=(0, (4, 2.5)), lw=1.2, label="reference")
    return [values, reference]


def _control(ax: Any, rollout: RolloutData, joint: int, kind: str) -> list[NDArray[Any]]:
    values = control(rollout, joint, kind)
    if values is None:
        return []
    ax.step(rollout.values("interval_time"), values, where="post", color=GREY, lw=0.8, label="control", zorder=1.5)
    return [values]


def _unit(rollout: RolloutData, joint: int) -> str:
    return rollout.names("joint_unit")[joint]


def _has_force(rollout: RolloutData) -> bool:
    if "torque" in rollout.data:
        return True
    return "ctrl" in rollout.data and any(name.endswith("_motor") for name in rollout.names("actuator"))


_COLUMNS = (
    (_position, lambda rollout: "qpos" in rollout.data),
    (_velocity, lambda rollout: "qvel" in rollout.data),
    (_force, _has_force),
)
