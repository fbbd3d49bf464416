"""``dh2sim view``."""

from __future__ import annotations

import contextlib
import ctypes
import os
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.common import RobotArgument, StrictOption, load_one, report_slips, words_of
from dh2sim.cli.output import require_free
from dh2sim.errors import Dh2simError
from dh2sim.messages import printable

if TYPE_CHECKING:
    from dh2sim.model.mechanism import MechanismModel
    from dh2sim.model.robot_model import RobotModel
    from dh2sim.robot.spec import RobotSpec
    from dh2sim.trajectory.files import SampledTrajectory
    from dh2sim.view.state import ViewState

DEFAULT_PORT = 8080
NEVER = "never"
"""The only value of --share."""


def view(
    robot: RobotArgument,
    run: Annotated[
        Path | None,
        typer.Argument(
            metavar="RUN.zarr|MOTION",
            help="A run of that robot to play, or a trajectory file, .csv or .npz.",
            show_default=False,
        ),
    ] = None,
    port: Annotated[
        int, typer.Option(min=1, max=65535, metavar="N", help="Port, or the next free one.")
    ] = DEFAULT_PORT,
    host: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Address to listen at; by default only this machine can reach it.")
    ] = "127.0.0.1",
    allow_host: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Names of this machine that browsers may use, with commas or repeated."),
    ] = None,
    share: Annotated[str, typer.Option(metavar="never", help="Pages are never shared over the internet.")] = NEVER,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")] = True,
    export: Annotated[
        Path | None, typer.Option(metavar="PAGE.html", help="Write a page that needs no server, and exit.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Let --export replace an existing file.")] = False,
    rollout: Annotated[int, typer.Option(metavar="N", help="Rollout of the run to export, counted from 0.")] = 0,
    strict: StrictOption = False,
) -> None:
    """Show a robot in the browser: move its joints, edit its table, read its poses.

    Every page has its own state. Edits never change the robot file, but can be saved as a new one. Stop with Ctrl-C.

    \b
    Examples:
      dh2sim view stanford
      dh2sim view my_robot.yaml --port 9000 --no-browser
      dh2sim view stanford --host 0.0.0.0 --allow-host lab.example.org
      dh2sim view stanford run.zarr
      dh2sim view puma560 motion.csv         # of 'dh2sim trajectory'
      dh2sim view stanford --export stanford.html
    """
    if share != NEVER:
        raise typer.BadParameter(
            f"must be 'never', got {share!r}; pages are never shared over the internet", param_hint="--share"
        )
    if force and export is None:
        raise typer.BadParameter("needs --export", param_hint="--force")
    if rollout != 0 and (export is None or run is None):
        raise typer.BadParameter(
            "needs a run and --export; a page lets you choose the rollout", param_hint="--rollout"
        )
    if export is not None and export.suffix.lower() not in (".html", ".htm"):
        raise typer.BadParameter(f"must be a file that ends in .html, got {str(export)!r}", param_hint="--export")
    require_free(export, force=force)
    _require_robot(robot, run)
    spec = load_one(robot)
    if spec.is_mechanism:
        names = _host_names(allow_host)
        _view_mechanism(spec, run, rollout, export, host=host, allow_hosts=names, port=port, browser=browser)
        return
    from dh2sim.view.initial_state import folder_of, open_state

    state = open_state(spec, folder_of(robot))
    report_slips([state.model], strict=strict)
    motion = _motion(run, rollout, state.model)
    if motion is not None:
        from dh2sim.view.page_export import tool_path

        state = replace(state, planned=tool_path(state.model, motion), q=tuple(motion.q[0].tolist()))
    if export is None:
        _serve(state, run, host=host, allow_hosts=_host_names(allow_host), port=port, browser=browser)
    else:
        _export(state, run, rollout, export, motion)


def _require_robot(robot: str, run: Path | None) -> None:
    """Refuse a run or a trajectory file in the place of its robot, and say how it is played."""
    what = _motion_kind(Path(robot))
    if what is None:
        return
    owner = "ROBOT" if run is None or _motion_kind(run) is not None else str(run)
    if owner == "ROBOT" and what == "run":
        from dh2sim.robot.catalog import builtin_path
        from dh2sim.simulate.description import describe

        with contextlib.suppress(Dh2simError):
            recorded = describe(robot).robot
            owner = owner if builtin_path(recorded) is None else recorded
    raise Dh2simError(f"{robot}: is a {what}, not a robot; 'dh2sim view {owner} {robot}' plays it")


def _motion_kind(path: Path) -> str | None:
    """Return what a file is that can be played: a run or a trajectory file; else None."""
    from dh2sim.trajectory.files import is_trajectory_file

    if (path / "zarr.json").is_file():
        return "run"
    if path.is_file() and is_trajectory_file(path) and (path.suffix.lower() != ".csv" or _begins_with_time(path)):
        return "trajectory file"
    return None


def _begins_with_time(path: Path) -> bool:
    """Return whether a table is one of a motion, not of Denavit-Hartenberg parameters."""
    with contextlib.suppress(OSError), path.open("rb") as file:
        return re.match(rb'(\xef\xbb\xbf)?\s*"?time\b', file.read(64)) is not None
    return False


def _host_names(texts: list[str] | None) -> list[str]:
    names = words_of(texts, "--allow-host")
    for name in names:
        if not re.fullmatch(r"[\w.-]{1,253}", name):
            raise typer.BadParameter(
                f"must be a name such as lab.example.org, without a scheme or a port, got {name!r}",
                param_hint="--allow-host",
            )
    return names


def _view_mechanism(
    spec: RobotSpec,
    run: Path | None,
    rollout: int,
    export: Path | None,
    *,
    host: str,
    allow_hosts: list[str],
    port: int,
    browser: bool,
) -> None:
    """Show a mechanism, or write a page of it."""
    from dh2sim.model.mechanism import build_mechanism

    model = build_mechanism(spec)
    motion = _motion(run, rollout, model)
    if export is None:
        _serve(model, run, host=host, allow_hosts=allow_hosts, port=port, browser=browser)
        return
    from dh2sim.draw.rollout_data import open_rollout
    from dh2sim.view.mechanism.scene import export_mechanism_page

    data = None if run is None or motion is not None else open_rollout(run, rollout)
    export_mechanism_page(model, model.q, export, rollout=data, trajectory=motion)
    print(printable(f"{export}: {spec.name}{_what(run, rollout, motion)}"))


def _serve(
    shown: ViewState | MechanismModel,
    run: Path | None,
    *,
    host: str,
    allow_hosts: list[str],
    port: int,
    browser: bool,
) -> None:
    """Serve pages until the program is interrupted."""
    from dh2sim.view.access import ANY_ADDRESS, is_address
    from dh2sim.view.start import serve

    _use_one_arena()
    viewer = serve(shown, host=host, port=port, run=run, allow_hosts=allow_hosts)
    try:
        if viewer.port != port:
            print(f"dh2sim: port {port} is taken; using {viewer.port}", file=sys.stderr)
        if not viewer.access.only_here:
            address = "any of its addresses" if host in ANY_ADDRESS else host
            print(f"dh2sim: anyone who can reach this machine at {address} can open the page", file=sys.stderr)
            names = ", ".join(each for each in viewer.access.names if not is_address(each))
            print(f"dh2sim: by an IP address or as {names}; --allow-host adds a name", file=sys.stderr)
        print(f"{shown.spec.name}: {viewer.url}  (stop with Ctrl-C)", flush=True)
        if browser:
            viewer.open_browser()
        viewer.wait()
    finally:
        viewer.stop()


def _use_one_arena() -> None:
    """Let all threads allocate from one place, of which the C library (glibc) can give back what pages have used.

    Measured with 50 pages: otherwise 11 % more memory is held once they are closed, now 6 %.
    """
    set_option = getattr(ctypes.CDLL(None), "mallopt", None) if os.name == "posix" else None
    if set_option is not None:
        arena_max = -8
        set_option(arena_max, 1)


def _motion(path: Path | None, rollout: int, model: RobotModel | MechanismModel) -> SampledTrajectory | None:
    """Return a trajectory file's content, in the order of the robot's joints; None for the path of a run."""
    from dh2sim.trajectory.files import is_trajectory_file, read_trajectory
    from dh2sim.view.motion.replay import trajectory_of

    if path is None or not is_trajectory_file(path):
        return None
    if rollout != 0:
        raise typer.BadParameter("does not apply to a trajectory file", param_hint="--rollout")
    return trajectory_of(read_trajectory(path), path, model)


def _what(run: Path | None, rollout: int, motion: SampledTrajectory | None) -> str:
    """Return what else than the robot a page shows."""
    return "" if run is None else f", {run}" if motion is not None else f", rollout {rollout} of {run}"


def _export(state: ViewState, run: Path | None, rollout: int, page: Path, motion: SampledTrajectory | None) -> None:
    """Write a page that needs no server."""
    from dh2sim.view.page_export import export_page

    data = None
    if run is not None and motion is None:
        from dh2sim.draw.rollout_data import open_rollout

        data = open_rollout(run, rollout)
    export_page(state.model, state.q, page, rollout=data, trajectory=motion)
    print(printable(f"{page}: {state.spec.name}{_what(run, rollout, motion)}"))
