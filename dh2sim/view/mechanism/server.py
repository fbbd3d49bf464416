"""The web server of a mechanism's pages."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from dh2sim.model.mechanism import MechanismModel
from dh2sim.view.access import closer
from dh2sim.view.mechanism.page import MechanismPage
from dh2sim.view.mechanism.scene import mechanism_scene
from dh2sim.view.motion.replay import Replay, open_replay
from dh2sim.view.page_export import add_ground, bounding_sphere, look_at
from dh2sim.view.server import PageServer

if TYPE_CHECKING:
    import viser


class MechanismViewer(PageServer[MechanismPage]):
    """Serves pages of a mechanism."""

    def __init__(
        self,
        model: MechanismModel,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        run: Path | None = None,
        allow_hosts: Iterable[str] = (),
    ) -> None:
        """Start to serve.

        Args:
            model: The mechanism.
            host: Address to listen at; by default only this machine can reach it.
            port: Port to listen at, 0 for any free one.
            run: A run of the same mechanism, or a trajectory file, that pages play.
            allow_hosts: Names of this machine that browsers may use, besides those that it knows of itself.

        Raises:
            RunError: The run cannot be read, or is of a robot with other joints.
            TrajectoryError: The same of a trajectory file.
            Dh2simError: Requests cannot be checked with this version of viser.
        """
        self._model, self._run = model, run
        self._open_replay()  # raises early
        super().__init__(host=host, port=port, allow_hosts=allow_hosts)

    def new_page(self, client: viser.ClientHandle) -> MechanismPage:
        """Return a page for a browser."""
        return MechanismPage(client, self._model, closer(), self._open_replay())

    def aim(self, server: viser.ViserServer) -> None:
        """Set where the camera of a page is at first, and draw the ground."""
        bounds = bounding_sphere([mechanism_scene(self._model, self._model.q)])
        look_at(server, bounds)
        add_ground(server, bounds)

    def _open_replay(self) -> Replay | None:
        """Open the run; every page has its own, which caches rollouts and is not thread-safe."""
        return None if self._run is None else open_replay(self._run, self._model)
