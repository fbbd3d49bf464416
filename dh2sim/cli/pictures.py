"""``dh2sim plot``.

``dh2sim render``.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.common import build_all
from dh2sim.cli.output import progress_bar
from dh2sim.errors import PictureError

if TYPE_CHECKING:
    from dh2sim.draw.renderer import Look
    from dh2sim.draw.rollout_data import RolloutData

FILM_SIZE, GIF_SIZE = "1280x720", "640x360"
FPS, GIF_FPS = 30.0, 25.0


def render(
    source: Annotated[
        str,
        typer.Argument(metavar="RUN.zarr|ROBOT", help="A run, or a robot: a file, or a name that comes with dh2sim."),
    ],
    rollout: Annotated[int | None, typer.Option(help="Which rollout of the run, from 0. [default: 0]")] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help=".mp4, .gif or .png. [default: RUN-<rollout>.mp4 or ROBOT.png]"),
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(metavar="WIDTHxHEIGHT", help=f"Pixels. [default: {FILM_SIZE}, .gif: {GIF_SIZE}]"),
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|AZ,EL[,DIST]",
            help="A camera of the scene ('overview' shows it at home), or the direction in which to look, azimuth "
            "and elevation in degrees, and from how far, m. [default: all of the motion is in the picture]",
        ),
    ] = None,
    frames: Annotated[bool, typer.Option("--frames", help="Show the DH frames: x red, y green, z blue.")] = False,
    trace: Annotated[bool, typer.Option("--trace/--no-trace", help="Show the way of tool0.")] = True,
    fps: Annotated[
        float | None, typer.Option(help=f"Pictures a second. [default: {FPS:g}, .gif: {GIF_FPS:g}]")
    ] = None,
    speed: Annotated[float | None, typer.Option(help="Below 1 is slow motion. [default: 1]")] = None,
    time: Annotated[
        float | None, typer.Option(metavar="S", help="With .png: at which instant, s. [default: the end]")
    ] = None,
    configuration: Annotated[
        str | None, typer.Option(metavar="NAME", help="Of a ROBOT: in which configuration. [default: home]")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Render a rollout as a film or a picture, or a robot as a picture.

    Needs no screen: it draws with EGL or OSMesa, whichever works (MUJOCO_GL=egl or osmesa decides). The file is
    written whole or not at all.

    \b
    Examples:
      dh2sim render run.zarr
      dh2sim render run.zarr --rollout 7 --frames --speed 0.25 --out slow.mp4
      dh2sim render run.zarr --out run.gif --camera 60,-15
      dh2sim render run.zarr --out end.png --time 1.5
      dh2sim render stanford --frames --configuration printed
    """
    of_run = source.endswith(".zarr") or Path(source).is_dir()
    if of_run:
        _refuse("a run", {"--configuration": configuration})
    else:
        _refuse("a robot", {"--rollout": rollout, "--fps": fps, "--speed": speed, "--time": time})
    from dh2sim.draw.motion import motion_of_robot, motion_of_run
    from dh2sim.draw.rollout_data import open_rollout
    from dh2sim.draw.video import FILMS, Tempo, film_positions, require_ending, write_film, write_still

    number = 0 if rollout is None else rollout
    path = (_default(source, number) if of_run else Path(f"{Path(source).stem}.png")) if out is None else out
    require_ending(path)
    film, gif = path.suffix.lower() in FILMS, path.suffix.lower() == ".gif"
    if film and not of_run:
        raise PictureError(f"a robot stands still: write '{path.with_suffix('.png')}', or render a run")
    if film:
        _refuse("a film", {"--time": time})
    else:
        _refuse("a .png", {"--fps": fps, "--speed": speed})
    look = _look(size or (GIF_SIZE if gif else FILM_SIZE), camera, frames=frames, trace=trace)
    usual = GIF_FPS if gif else FPS
    tempo = Tempo(fps=usual if fps is None else fps, speed=1.0 if speed is None else speed)
    if of_run:
        data = open_rollout(Path(source), number)
        motion, told = motion_of_run(data), data.label
    else:
        [robot] = build_all([source])
        data, motion, told = None, motion_of_robot(robot, configuration), robot.name
    if film:
        count = len(film_positions(motion, tempo))
        with progress_bar("rendering", "pictures", count, quiet=quiet) as advance:
            write_film(path, motion, look, tempo, advance)
        told += f", {motion.time[-1]:g} s in {count} pictures"
    else:
        position = motion.number_at(time)
        write_still(path, motion, look, position)
        told += f" at {motion.time[position]:g} s" if of_run else f" at {configuration or 'home'}"
    if data is not None and data.reason:
        print(f"dh2sim: {stopped(data)}", file=sys.stderr)
    if not quiet:
        print(f"{path}: {told}, {look.width}x{look.height}")


def _default(source: str, rollout: int) -> Path:
    """Beside the run."""
    run = Path(source)
    return run.with_name(f"{run.stem}-{rollout}.mp4")


def stopped(data: RolloutData) -> str:
    """Say that a rollout stopped early, and where what is shown ends."""
    when = f" in time step {data.stop_step}" if data.stop_step >= 0 else ""
    end = float(data.values("time")[-1])
    return f"{data.label} stopped early{when} ({data.reason}): what is shown ends at {end:g} s"


def _look(size: str, camera: str | None, *, frames: bool, trace: bool) -> Look:
    from dh2sim.draw.camera import parse_view
    from dh2sim.draw.renderer import Look

    width, height = parse_size(size)
    return Look(width=width, height=height, view=parse_view(camera), frames=frames, trace=trace)


def parse_size(text: str) -> tuple[int, int]:
    """Read ``WIDTHxHEIGHT``, in pixels.

    Raises:
        BadParameter: that is something else.
    """
    width, _, height = text.lower().partition("x")
    if not (width.isascii() and width.isdigit() and height.isascii() and height.isdigit() and len(text) < 20):
        raise typer.BadParameter(
            f"'{text}' is not of the form WIDTHxHEIGHT, such as {FILM_SIZE}", param_hint="--size"
        )
    return int(width), int(height)


def _refuse(what: str, options: dict[str, object]) -> None:
    for name, value in options.items():
        if value is not None:
            raise typer.BadParameter(f"means nothing for {what}", param_hint=name)


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
    from dh2sim.draw.plot_style import require_plot_ending
    from dh2sim.draw.plots import require_kind, write_plot
    from dh2sim.draw.rollout_data import open_rollout

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
