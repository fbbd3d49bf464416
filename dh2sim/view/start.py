"""Starts the viewer of a robot, from code."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from dh2sim.model.mechanism import build_mechanism
from dh2sim.robot.spec import RobotSpec
from dh2sim.view.initial_state import folder_of, open_state
from dh2sim.view.mechanism.server import MechanismViewer
from dh2sim.view.server import PageServer, Viewer, free_port


def start_viewer(
    spec: RobotSpec,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    browser: bool = True,
    allow_hosts: Iterable[str] = (),
) -> PageServer[Any]:
    """Show a robot or a mechanism in the browser, and return at once: see ``Robot.view``."""
    free = free_port(host, port)
    viewer: PageServer[Any]
    if spec.is_mechanism:
        viewer = MechanismViewer(build_mechanism(spec), host=host, port=free, allow_hosts=allow_hosts)
    else:
        file = spec.source_file
        state = open_state(spec, None if file is None else folder_of(file.path))
        viewer = Viewer(state, host=host, port=free, allow_hosts=allow_hosts)
    if browser:
        viewer.open_browser()
    return viewer
