"""Plots of a rollout: joints, tool, energy and tracking.

They are made by matplotlib, whose global figures are left alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dh2sim.draw.plot_style import (
    BLUE,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    RED,
    TEAL,
    legend_below,
    legend_beside,
    make_figure,
    plot_style,
    require_plot,
    save,
    shade_outside,
    value_range,
)
from dh2sim.draw.rollout_data import RolloutData
from dh2sim.errors import PictureError, RunError
from dh2sim.messages import did_you_mean, listed, shown
from dh2sim.simulate.recorded_model import recorded_model
from dh2sim.typing import Array


def title(rollout: RolloutData) -> str:
    """Return robot, controller, run and rollout, and why it stopped if it did."""
    attributes = rollout.attributes
    parts = [str(attributes[name]) for name in ("robot", "controller") if attributes.get(name)]
    parts.append(rollout.label)
    if rollout.reason:
        parts.append(f"stopped: {rollout.reason}")
    return " · ".join(part if len(part) <= 40 else part[:39] + "…" for part in parts)


NEAR = 1e-9
"""Share of a range within which a value is at its end."""


def saturated(rollout: RolloutData) -> NDArray[np.bool_]:
    """Return in which intervals the control or the force of a joint's actuator is at an end of its range.

    Args:
        rollout: the data; controls and torques as far as they were recorded.

    Returns:
        Shape (interval, joint); all False where nothing was recorded or nothing is limited.

    Raises:
        PictureError: the model in the run's attributes cannot be read.
    """
    joints = rollout.names("joint")
    found = np.zeros((int(rollout.data.sizes["interval"]), len(joints)), dtype=bool)
    if "ctrl" not in rollout.data and "torque" not in rollout.data:
        return found
    try:
        model = recorded_model(rollout.attributes, design=rollout.design)
    except RunError as error:
        raise PictureError(f"{rollout.run}: {error}") from error
    for number in range(model.nu):
        actuator, joint = model.actuator(number).name, model.joint(int(model.actuator_trnid[number, 0])).name
        if joint not in joints:
            continue
        column = joints.index(joint)
        if "ctrl" in rollout.data and actuator in rollout.names("actuator") and model.actuator_ctrllimited[number]:
            control = rollout.values("ctrl")[:, rollout.names("actuator").index(actuator)]
            found[:, column] |= _at_end(control, model.actuator_ctrlrange[number])
        if "torque" in rollout.data and model.actuator_forcelimited[number]:
            found[:, column] |= _at_end(rollout.values("torque")[:, column], model.actuator_forcerange[number])
    return found


def _at_end(values: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.bool_]:
    low, high = float(ends[0]), float(ends[1])
    near = NEAR * (high - low)
    return np.asarray((values <= low + near) | (values >= high - near))


ROWS = 8
"""Joints in a column; more go into further columns."""


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
    shade_outside(ax, limits[0], limits[1], *value_range(*seen))
    ax.set_ylabel(f"position, {_unit(rollout, joint)}")


def _velocity(ax: Any, rollout: RolloutData, joint: int) -> None:
    seen = _curve(ax, rollout, joint, "qvel", "velocity", TEAL)
    seen += _control(ax, rollout, joint, "velocity")
    limit = float(rollout.values("joint_velocity_limit")[joint])
    shade_outside(ax, -limit, limit, *value_range(*seen))
    ax.set_ylabel(f"velocity, {_unit(rollout, joint)}/s")


def _force(ax: Any, rollout: RolloutData, joint: int) -> None:
    time = rollout.values("interval_time")
    if "torque" in rollout.data:
        values, label = rollout.values("torque")[:, joint], "actuator force"
    else:
        found = control(rollout, joint, "motor")
        values, label = (np.full(len(time), np.nan) if found is None else found), "control"
    ax.step(time, values, where="post", color=PURPLE, lw=1.1, label=label)
    ax.set_ylim(*value_range(values))
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
        ax.set_ylim(*value_range(values))
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
    above.set_ylim(*value_range(energy, total))
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
    """An error may be as small as it likes: it is not noise."""
    greatest = float(np.abs(error).max())
    low, high = value_range(error / greatest) if greatest > 0.0 else (-1e-9, 1e-9)
    return (low * greatest, high * greatest) if greatest > 0.0 else (low, high)


KINDS: Mapping[str, Callable[[RolloutData, tuple[float, float] | None], Any]] = {
    "joints": plot_joints,
    "tool": plot_tool,
    "energy": plot_energy,
    "tracking": plot_tracking,
}


def require_kind(what: str) -> None:
    """Check the name of a kind of plot.

    Raises:
        PictureError: it is none of ``KINDS``.
    """
    if what not in KINDS:
        raise PictureError(f"unknown plot {shown(what)}.{did_you_mean(what, KINDS)} Allowed: {listed(KINDS)}")


def write_plot(
    out: Path, rollout: RolloutData, what: str, *, size: tuple[int, int] | None = None, dpi: float = 150.0
) -> None:
    """Write a plot of a rollout, whole or not at all; the same bytes every time.

    Args:
        out: .png, .svg or .pdf.
        rollout: the data.
        what: one of ``KINDS``.
        size: pixels; None: what suits the plot.
        dpi: pixels an inch.

    Raises:
        PictureError: the kind of plot is unknown, or what it needs was not recorded.
        OutputError: it cannot be written.
    """
    require_plot(out)
    require_kind(what)
    with plot_style():
        inches = None if size is None else (size[0] / dpi, size[1] / dpi)
        save(KINDS[what](rollout, inches), out, dpi=dpi)
