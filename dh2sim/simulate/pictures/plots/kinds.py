"""Which plots there are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from dh2sim.errors import PictureError
from dh2sim.robot.words import did_you_mean, listed, shown
from dh2sim.simulate.pictures.plots.energy import plot_energy
from dh2sim.simulate.pictures.plots.joints import plot_joints
from dh2sim.simulate.pictures.plots.style import drawing, require_plot_ending, save
from dh2sim.simulate.pictures.plots.tool import plot_tool
from dh2sim.simulate.pictures.plots.tracking import plot_tracking
from dh2sim.simulate.pictures.selection import RolloutData

KINDS: Mapping[str, Callable[[RolloutData, tuple[float, float] | None], Any]] = {
    "joints": plot_joints,
    "tool": plot_tool,
    "energy": plot_energy,
    "tracking": plot_tracking,
}


def require_kind(what: str) -> None:
    """Check that there is such a plot.

    Raises:
        PictureError: there is not.
    """
    if what not in KINDS:
        raise PictureError(f"there is no plot {shown(what)}.{did_you_mean(what, KINDS)} Allowed: {listed(KINDS)}")


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
        PictureError: there is no such plot, or what it needs was not recorded.
        OutputError: it cannot be written.
    """
    require_plot_ending(out)
    require_kind(what)
    with drawing():
        inches = None if size is None else (size[0] / dpi, size[1] / dpi)
        save(KINDS[what](rollout, inches), out, dpi=dpi)
