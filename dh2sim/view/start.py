"""Starts the viewer of a robot or a mechanism, for code and for the command line."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from dh2sim.arguments import names, text, whole_number
from dh2sim.errors import ArgumentError
from dh2sim.model.mechanism import MechanismModel, build_mechanism
from dh2sim.robot.spec import SpecLike, spec_of
from dh2sim.view.initial_state import folder_of, open_state
from dh2sim.view.mechanism.server import MechanismViewer
from dh2sim.view.server import PageServer, Viewer, free_port
from dh2sim.view.state import ViewState


def serve(
    shown: ViewState | MechanismModel,
    *,
    host: str,
    port: int,
    run: Path | None = None,
    allow_hosts: Iterable[str] = (),
) -> PageServer[Any]:
    """Serve pages of a robot, in its initial state, or of a mechanism.

    Args:
        shown: The robot's state, or the mechanism.
        host: Address to listen at.
        port: Port to listen at, or the next that is free.
        run: A run of the same robot that pages can play.
        allow_hosts: Names of this machine that browsers may use, besides those that it knows of itself.

    Raises:
        RunError: The run cannot be read, or is of a robot with other joints.
        Dh2simError: Nobody can listen at this address.
    """
    free = free_port(host, port)
    if isinstance(shown, MechanismModel):
        return MechanismViewer(shown, host=host, port=free, run=run, allow_hosts=allow_hosts)
    return Viewer(shown, host=host, port=free, run=run, allow_hosts=allow_hosts)


def start_viewer(
    robot: SpecLike,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    browser: bool = True,
    allow_hosts: Iterable[str] = (),
) -> PageServer[Any]:
    """Show a robot or a mechanism in the browser, and return at once: see ``Robot.view``."""
    text("host", host)
    if whole_number("port", port) > 65535:
        raise ArgumentError(f"port must be at most 65535, got {port}")
    allow_hosts = names("allow_hosts", allow_hosts)
    spec = spec_of(robot)
    shown: ViewState | MechanismModel
    if spec.is_mechanism:
        shown = build_mechanism(spec)
    else:
        shown = open_state(spec, None if spec.source_file is None else folder_of(spec.source_file.path))
    viewer = serve(shown, host=host, port=port, allow_hosts=allow_hosts)
    if browser:
        viewer.open_browser()
    return viewer
