"""``dh2sim plot``."""

from __future__ import annotations

import gc
import sys
from pathlib import Path
from typing import Annotated

import typer

from dh2sim.cli.render import parse_size, stopped


def plot(
    run: Annotated[Path, typer.Argument(metavar="RUN.zarr", help="A run that 'dh2sim rollout' wrote.")],
    rollout: Annotated[int, typer.Option(help="Which rollout, from 0.")] = 0,
    what: Annotated[str, typer.Option(metavar="joints|tool|energy|tracking", help="What is plotted.")] = "joints",
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help=".png, .svg or .pdf. [default: RUN-<rollout>-<what>.png]"),
    ] = None,
    size: Annotated[
        str | None, typer.Option(metavar="WIDTHxHEIGHT", help="Pixels. [default: what suits the plot]")
    ] = None,
    dpi: Annotated[float, typer.Option(min=30, max=1200, help="Pixels an inch: larger letters.")] = 150.0,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Plot a rollout.

    joints shows positions, velocities and forces, with limits shaded, references dashed and controls thin; tool the
    pose of tool0 and its path; energy what is kept and what drifts; tracking the error of what follows a reference,
    with marks where an actuator was at the end of its range. The same run gives the same bytes.

    \b
    Examples:
      dh2sim plot run.zarr
      dh2sim plot run.zarr --rollout 7 --what tool --out tool.svg
      dh2sim plot run.zarr --what tracking --size 1600x1200
    """
    gc.enable()
    from dh2sim.simulate.pictures.plots.kinds import require_kind, write_plot
    from dh2sim.simulate.pictures.plots.style import require_plot_ending
    from dh2sim.simulate.pictures.selection import open_rollout

    require_kind(what)
    path = run.with_name(f"{run.stem}-{rollout}-{what}.png") if out is None else out
    require_plot_ending(path)
    pixels = None if size is None else parse_size(size)
    if pixels is not None and not all(200 <= length <= 20_000 for length in pixels):
        raise typer.BadParameter(f"{size}: allowed are 200 to 20000 pixels each way", param_hint="--size")
    data = open_rollout(run, rollout)
    write_plot(path, data, what, size=pixels, dpi=dpi)
    if data.reason:
        print(f"dh2sim: {stopped(data)}", file=sys.stderr)
    if not quiet:
        print(f"{path}: {what} of {data.label}")
