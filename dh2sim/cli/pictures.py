"""``dh2sim render`` and ``dh2sim plot``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.common import QuietOption, build_any, refuse_options
from dh2sim.cli.output import progress_bar
from dh2sim.errors import PictureError
from dh2sim.messages import printable

if TYPE_CHECKING:
    from dh2sim.draw.renderer import PictureOptions
    from dh2sim.draw.rollout_data import RolloutData

SIZE, GIF_SIZE = "1280x720", "640x360"
FPS, GIF_FPS = 30.0, 25.0


def render(
    source: Annotated[
        str,
        typer.Argument(
            metavar="RUN.zarr|ROBOT", help="A run, or a robot: a file, or the name of one that comes with dh2sim."
        ),
    ],
    rollout: Annotated[
        int | None, typer.Option(metavar="N", help="Number of the rollout, from 0. [default: 0]")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE",
            help="File to write: .mp4, .gif or .png. [default: RUN-<rollout>.mp4 or ROBOT.png]",
        ),
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(metavar="WIDTHxHEIGHT", help=f"Size in pixels. [default: {SIZE}, .gif: {GIF_SIZE}]"),
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|AZ,EL[,DIST]",
            help="A camera of the scene ('overview' shows the robot at home), or the direction to look in: azimuth "
            "and elevation in degrees, and the distance in m. [default: shows the whole motion]",
        ),
    ] = None,
    frames: Annotated[bool, typer.Option("--frames", help="Show the DH frames: x red, y green, z blue.")] = False,
    trace: Annotated[bool, typer.Option("--trace/--no-trace", help="Show the path of tool0.")] = True,
    fps: Annotated[
        float | None, typer.Option(metavar="X", help=f"Pictures per second. [default: {FPS:g}, .gif: {GIF_FPS:g}]")
    ] = None,
    speed: Annotated[
        float | None, typer.Option(metavar="X", help="Speed of the video; below 1 is slow motion. [default: 1]")
    ] = None,
    time: Annotated[
        float | None, typer.Option(metavar="S", help="Time shown by a .png of a run, in seconds. [default: the end]")
    ] = None,
    configuration: Annotated[
        str | None, typer.Option(metavar="NAME", help="Configuration of a ROBOT. [default: home]")
    ] = None,
    quiet: QuietOption = False,
) -> None:
    """Render a rollout as a video or a picture, or a robot as a picture.

    No screen is needed: EGL or OSMesa is used, whichever works; MUJOCO_GL=egl or osmesa chooses one. The file is
    written whole or not at all.

    \b
    Examples:
      dh2sim render run.zarr
      dh2sim render run.zarr --rollout 7 --frames --speed 0.25 --out slow.mp4
      dh2sim render run.zarr --out run.gif --camera 60,-15
      dh2sim render run.zarr --out end.png --time 1.5
      dh2sim render stanford --frames --configuration printed
    """
    of_run = source.endswith(".zarr") or source.lower().startswith("s3://") or Path(source).is_dir()
    if of_run:
        refuse_options("a run", {"--configuration": configuration})
    else:
        refuse_options("a robot", {"--rollout": rollout, "--fps": fps, "--speed": speed, "--time": time})
    from dh2sim.draw.motion import motion_of_robot, motion_of_run
    from dh2sim.draw.rollout_data import open_rollout
    from dh2sim.draw.video import VIDEOS, VideoSpeed, require_picture, video_positions, write_image, write_video

    number = 0 if rollout is None else rollout
    path = (
        (_beside(Path(source), f"-{number}.mp4") if of_run else Path(f"{Path(source).stem}.png"))
        if out is None
        else out
    )
    require_picture(path)
    video, gif = path.suffix.lower() in VIDEOS, path.suffix.lower() == ".gif"
    if video and not of_run:
        raise PictureError(f"a robot does not move: write '{path.with_suffix('.png')}', or render a run")
    if video:
        refuse_options("a video", {"--time": time})
    else:
        refuse_options("a .png", {"--fps": fps, "--speed": speed})
    options = _options(size or (GIF_SIZE if gif else SIZE), camera, frames=frames, trace=trace)
    usual = GIF_FPS if gif else FPS
    rate = VideoSpeed(fps=usual if fps is None else fps, speed=1.0 if speed is None else speed)
    if of_run:
        data = open_rollout(Path(source), number)
        motion, summary = motion_of_run(data), data.label
    else:
        [robot] = build_any([source])
        data, motion, summary = None, motion_of_robot(robot, configuration or "home"), robot.name
    if video:
        count = len(video_positions(motion, rate))
        with progress_bar("rendering", "pictures", count, quiet=quiet) as advance:
            write_video(path, motion, options, rate, advance)
        summary += f", {motion.time[-1]:g} s in {count} pictures"
    else:
        position = motion.number_at(time)
        write_image(path, motion, options, position)
        summary += f" at {motion.time[position]:g} s" if of_run else f" at {configuration or 'home'}"
    _warn_if_stopped(data)
    if not quiet:
        print(printable(f"{path}: {summary}, {options.width}x{options.height}"))


def _beside(run: Path, ending: str) -> Path:
    """Return the path of a file beside a run, named after it; the run may be given as '.', from inside."""
    named = run.resolve() if run.name in ("", "..") else run
    if run.parts[:1] in (("s3:",), ("S3:",)):  # nothing is written beside a run in an object store
        return Path(f"{named.stem}{ending}")
    return named.parent / f"{named.stem}{ending}"


def _warn_if_stopped(data: RolloutData | None) -> None:
    """Report that a rollout stopped early, and where what is shown of it ends."""
    if data is not None and data.reason:
        when = f" in time step {data.stop_step}" if data.stop_step >= 0 else ""
        end = float(data.values("time")[-1])
        text = f"{data.label} stopped early{when} ({data.reason}): what is shown ends at {end:g} s"
        print(printable(f"dh2sim: {text}"), file=sys.stderr)


def _options(size: str, camera: str | None, *, frames: bool, trace: bool) -> PictureOptions:
    from dh2sim.draw.camera import parse_camera
    from dh2sim.draw.renderer import PictureOptions

    width, height = _parse_size(size)
    return PictureOptions(width=width, height=height, camera=parse_camera(camera), frames=frames, trace=trace)


def _parse_size(text: str) -> tuple[int, int]:
    """Read ``WIDTHxHEIGHT``, in pixels.

    Raises:
        BadParameter: it has another form.
    """
    width, _, height = text.lower().partition("x")
    if not (width.isascii() and width.isdigit() and height.isascii() and height.isdigit() and len(text) < 20):
        raise typer.BadParameter(f"'{text}' must have the form WIDTHxHEIGHT, such as {SIZE}", param_hint="--size")
    return int(width), int(height)


def plot(
    run: Annotated[
        Path,
        typer.Argument(
            metavar="RUN.zarr|MOTION",
            help="A run written by 'dh2sim rollout', or a .csv or .npz file written by 'dh2sim trajectory'.",
        ),
    ],
    rollout: Annotated[int, typer.Option(metavar="N", help="Number of the rollout, from 0.")] = 0,
    what: Annotated[str, typer.Option(metavar="joints|tool|energy|tracking", help="What to plot.")] = "joints",
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE",
            help="File to write: .png, .svg or .pdf. [default: RUN-<rollout>-<what>.png or MOTION.png]",
        ),
    ] = None,
    size: Annotated[
        str | None, typer.Option(metavar="WIDTHxHEIGHT", help="Size in pixels. [default: depends on the plot]")
    ] = None,
    dpi: Annotated[
        float, typer.Option(min=30, max=1200, metavar="X", help="Pixels per inch; more make text larger.")
    ] = 150.0,
    quiet: QuietOption = False,
) -> None:
    """Plot a rollout, or position, velocity, acceleration and jerk of a trajectory.

    \b
    --what joints     positions, velocities and forces; limits shaded,
                      references dashed, controls thin
    --what tool       pose of tool0 over time, and its path
    --what energy     potential, kinetic and total energy, and its drift
    --what tracking   errors of joints that follow a reference; saturated
                      actuators marked

    The same run gives the same bytes.

    \b
    Examples:
      dh2sim plot run.zarr
      dh2sim plot run.zarr --rollout 7 --what tool --out tool.svg
      dh2sim plot run.zarr --what tracking --size 1600x1200
      dh2sim plot motion.npz
    """
    from dh2sim.draw.plot_style import require_plot
    from dh2sim.draw.plots import require_kind, write_plot
    from dh2sim.draw.rollout_data import open_rollout
    from dh2sim.trajectory.files import is_trajectory_file

    require_kind(what)
    of_file = is_trajectory_file(run) and not run.is_dir()
    ending = ".png" if of_file else f"-{rollout}-{what}.png"
    path = _beside(run, ending) if out is None else out
    require_plot(path)
    pixels = None if size is None else _parse_size(size)
    if pixels is not None and not all(200 <= length <= 20_000 for length in pixels):
        raise typer.BadParameter(f"must be from 200 to 20000 pixels each way, got {size}", param_hint="--size")
    if of_file:
        if (what, rollout) != ("joints", 0):
            option = "--what" if what != "joints" else "--rollout"
            raise typer.BadParameter("does not apply to a trajectory file", param_hint=option)
        _plot_trajectory(run, path, pixels, dpi, quiet=quiet)
        return
    data = open_rollout(run, rollout)
    write_plot(path, data, what, size=pixels, dpi=dpi)
    _warn_if_stopped(data)
    if not quiet:
        print(printable(f"{path}: {what} of {data.label}"))


def _plot_trajectory(file: Path, out: Path, size: tuple[int, int] | None, dpi: float, *, quiet: bool) -> None:
    from dh2sim.draw.trajectory_plot import write_trajectory_plot
    from dh2sim.trajectory.files import read_trajectory

    read = read_trajectory(file)
    title = " · ".join(filter(None, (read.robot, file.name, f"{read.duration:.4g} s")))
    write_trajectory_plot(out, read, title, size=size, dpi=dpi)
    if not quiet:
        print(printable(f"{out}: {len(read.joints)} joints over {read.duration:.4g} s"))
