"""Pictures of workspaces: the section with its boundary, or the voxels from three sides."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np

from dh2sim.draw.plot_style import (
    BLUE,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    RED,
    TEAL,
    make_figure,
    plot_style,
    save,
)
from dh2sim.typing import Array
from dh2sim.workspace.files import held_by_name
from dh2sim.workspace.section import SINGULAR, Section
from dh2sim.workspace.workspace import Workspace

_HELD: Final = (BLUE, TEAL, PURPLE, ORANGE, "#a06a2c", "#5c7f1f", "#b0488f", "#4a6fd0")
_FILL: Final = "#e9eff7"
_HEIGHT: Final = 5.2
"""Of a picture, inches."""


def write_workspace_picture(workspace: Workspace, out: Path, *, dpi: float = 150.0) -> None:
    """Draw the section of a workspace, or its voxels where none was asked for, into a .png, .svg or .pdf.

    Raises:
        OutputError: It cannot be written.
    """
    with plot_style():
        figure = _section(workspace, workspace.section) if workspace.section else _voxels(workspace)
        save(figure, out, dpi=dpi)


def _section(workspace: Workspace, section: Section) -> Any:
    points = np.concatenate([*(curve.points for curve in section.curves), section.line, np.zeros((1, 2))])
    width, height = np.ptp(points, axis=0)
    inches = float(np.clip(_HEIGHT * width / max(height, 1e-9), 3.6, 8.0)) + 0.9
    title = f"{workspace.robot}: section of {workspace.frame}"
    figure = make_figure(inches, _HEIGHT + 1.2, title)
    ax = figure.subplots()
    if section.curves:
        _fill(ax, section)
        for number in sorted({int(k) for held in section.held_by for k in held}):
            name = held_by_name(workspace, number)
            color = RED if number == SINGULAR else _HELD[number % len(_HELD)]
            label = "bounded by a singularity" if number == SINGULAR else f"by a limit of {name}"
            pairs = zip(section.curves, section.held_by, strict=True)
            pieces = [_pieces(curve.points, held == number) for curve, held in pairs]
            ax.plot(*_joined(pieces).T, color=color, label=label, lw=1.8, solid_capstyle="round")
    if len(section.singular):
        ax.plot(*section.singular.T, ".", ms=1.6, color=RED, alpha=0.55, mew=0, label="singular inside")
    if len(section.line):
        ax.plot(*section.line.T, ".-" if len(section.line) < 3 else "-", color=BLUE, label="reached")
    if section.turns_about is not None:
        ax.axvline(0.0, color=GREY, lw=0.8, ls=(0, (8, 3, 2, 3)))
    ax.plot(0.0, 0.0, "+", color=INK, ms=9, label="base_link" if section.turns_about is None else None)
    ax.set_aspect("equal", adjustable="datalim")
    about = f" from the axis of {section.turns_about}" if section.turns_about is not None else ""
    ax.set_xlabel(f"{section.labels[0]}{about}, m")
    ax.set_ylabel(f"{section.labels[1]}, m")
    figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=2, markerscale=3.0)
    return figure


def _fill(ax: Any, section: Section) -> None:
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    outlines = [Outline(np.concatenate([curve.points, curve.points[:1]]), closed=True) for curve in section.curves]
    patch = PathPatch(Outline.make_compound_path(*outlines), facecolor=_FILL, edgecolor="none", zorder=0.5)
    ax.add_patch(patch)


def _pieces(points: Array, mine: Any) -> Array:
    """Return the pieces of a closed curve that begin at some of its corners, with gaps of NaN between them."""
    ahead = np.roll(points, -1, axis=0)
    rows: list[Array] = []
    gap = np.full(2, np.nan)
    for k in np.flatnonzero(mine):
        if not (rows and np.array_equal(rows[-1], points[k])):
            rows += [gap, points[k]]
        rows.append(ahead[k])
    return np.array(rows).reshape(-1, 2)


def _joined(pieces: list[Array]) -> Array:
    return np.concatenate([row for piece in pieces for row in (piece, np.full((1, 2), np.nan))])


def _voxels(workspace: Workspace) -> Any:
    """Draw what is seen of the voxels along three axes: the best manipulability of each column of voxels."""
    flat = len(workspace.axes) < 3
    centers = (workspace.centers - workspace.origin) @ workspace.axes.T if flat else workspace.centers
    if flat:
        centers = np.concatenate([centers, np.zeros((len(centers), 2))], axis=1)[:, :2]
    names = (
        "xyz"
        if not flat or np.array_equal(np.abs(workspace.axes).max(axis=1), np.ones(len(workspace.axes)))
        else "uv"
    )
    if flat and names == "xyz":
        names = "".join("xyz"[int(np.argmax(axis))] for axis in workspace.axes) + " "
    views = [(0, 1)] if flat else [(0, 2), (1, 2), (0, 1)]
    extent = [np.ptp(centers[:, k]) + workspace.size for k in range(centers.shape[1])]
    widths = [max(extent[a], 0.25 * max(extent)) for a, _ in views]
    height = max(max(extent[b] for _, b in views), 0.25 * max(extent))
    total = float(np.clip(4.0 * sum(widths) / height, 4.5, 12.0))
    title = f"{workspace.robot}: best manipulability of {workspace.frame}"
    figure = make_figure(total + 1.2, min(4.0, total * height / sum(widths)) + 1.2, title)
    all_axes = figure.subplots(1, len(views), squeeze=False, gridspec_kw={"width_ratios": widths})[0]
    top = float(workspace.manipulability.max(initial=0.0)) or 1.0
    for ax, (a, b) in zip(all_axes, views, strict=True):
        index = np.round((centers[:, [a, b]] - centers[:, [a, b]].min(axis=0)) / workspace.size).astype(int)
        image = np.full(index.max(axis=0) + 1, np.nan)
        np.fmax.at(image, tuple(index.T), workspace.manipulability)
        low = centers[:, [a, b]].min(axis=0) - 0.5 * workspace.size
        high = centers[:, [a, b]].max(axis=0) + 0.5 * workspace.size
        shown = ax.imshow(
            image.T, origin="lower", extent=(low[0], high[0], low[1], high[1]), cmap="viridis", vmin=0.0, vmax=top,
            interpolation="nearest",
        )  # fmt: skip
        ax.set_xlabel(f"{names[a]}, m")
        ax.set_ylabel(f"{names[b]}, m" if names[b] else "")
        ax.grid(False)
    unit = "of the pose" if workspace.measure == "pose" else "of the position"
    figure.colorbar(shown, ax=list(all_axes), label=f"manipulability {unit}", shrink=0.85, pad=0.02)
    return figure
