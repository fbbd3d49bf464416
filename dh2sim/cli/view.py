"""``dh2sim view``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.common import RobotArgument, StrictOption, load_all, report_slips
from dh2sim.cli.output import require_free

if TYPE_CHECKING:
    from dh2sim.view.state import ViewState

DEFAULT_PORT = 8080
NEVER = "never"
"""The only value of --share."""


def view(
    robot: RobotArgument,
    run: Annotated[
        Path | None,
        typer.Argument(metavar="RUN.zarr", help="A run of that robot to play.", show_default=False),
    ] = None,
    port: Annotated[
        int, typer.Option(min=1, max=65535, metavar="N", help="Port, or the next free one.")
    ] = DEFAULT_PORT,
    host: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Address to listen at; by default only this machine can reach it.")
    ] = "127.0.0.1",
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
      dh2sim view stanford run.zarr
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
    from dh2sim.view.initial_state import folder_of, open_state

    [spec] = load_all([robot])
    state = open_state(spec, folder_of(robot))
    report_slips([state.model], strict=strict)
    if export is None:
        _serve(state, run, host=host, port=port, browser=browser)
    else:
        _export(state, run, rollout, export)


def _serve(state: ViewState, run: Path | None, *, host: str, port: int, browser: bool) -> None:
    """Serve pages until the program is interrupted."""
    from dh2sim.view.server import ANY_ADDRESS, Viewer, free_port, is_local_only

    chosen = free_port(host, port)
    if chosen != port:
        print(f"dh2sim: port {port} is taken; using {chosen}", file=sys.stderr)
    if not is_local_only(host):
        address = "any of its addresses" if host in ANY_ADDRESS else host
        print(f"dh2sim: anyone who can reach this machine at {address} can open the page", file=sys.stderr)
    viewer = Viewer(state, host=host, port=chosen, run=run)
    try:
        print(f"{state.spec.name}: {viewer.url}  (stop with Ctrl-C)", flush=True)
        if browser:
            viewer.open_browser()
        viewer.wait()
    finally:
        viewer.stop()


def _export(state: ViewState, run: Path | None, rollout: int, page: Path) -> None:
    """Write a page that needs no server."""
    from dh2sim.view.page_export import export_page

    data = None
    if run is not None:
        from dh2sim.draw.rollout_data import open_rollout

        data = open_rollout(run, rollout)
    export_page(state.model, state.q, page, rollout=data)
    print(f"{page}: {state.spec.name}{'' if run is None else f', rollout {rollout} of {run}'}")
