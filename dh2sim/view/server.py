"""The web server: a page for every browser that comes, each with a state of its own."""

from __future__ import annotations

import contextlib
import errno
import importlib
import io
import socket
import threading
import time
import warnings
from collections.abc import Mapping
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Final
from urllib.parse import urlsplit

from dh2sim.errors import Dh2simError
from dh2sim.view.extent import FIELD, eye_of, size_of
from dh2sim.view.page import Page
from dh2sim.view.state import ViewState

if TYPE_CHECKING:
    import viser
    from viser import infra

    from dh2sim.view.replay import Replay

LOOPBACK: Final = ("127.0.0.1", "localhost", "::1")
PORTS_TRIED: Final = 100


PATIENCE = 2.0
"""s that a page is given to end what it does."""


class Viewer:
    """Serves pages until it is stopped."""

    def __init__(
        self, state: ViewState, *, host: str = "127.0.0.1", port: int = 0, run: FilePath | None = None
    ) -> None:
        """Begin to serve.

        Args:
            state: What every page begins with.
            host: Address to listen at; by default only this machine can reach it.
            port: Port to listen at, 0 for any that is free; see ``free_port``.
            run: A run of the same robot, that pages can play.

        Raises:
            RunError: The run cannot be read, or is one of another robot.
        """
        self._state = state
        self._host = host
        self._run = run
        self._replay()
        self._pages: dict[int, Page] = {}
        self._lock = threading.Lock()
        self._server = quiet_server(host, port)
        self.port: int = self._server.get_port()
        _dress(self._server, state)
        self._warm_up = threading.Thread(target=_warm_up, name="warm-up", daemon=True)
        self._warm_up.start()
        self._server._websock_server.on_client_connect(self._check)
        self._server.on_client_connect(self._open)
        self._server.on_client_disconnect(self._close)

    @property
    def url(self) -> str:
        """Where a browser on this machine finds it."""
        name = "127.0.0.1" if self._host in ("0.0.0.0", "::") else self._host
        return f"http://{f'[{name}]' if ':' in name else name}:{self.port}"

    @property
    def pages(self) -> tuple[Page, ...]:
        """The pages that are open."""
        with self._lock:
            return tuple(self._pages.values())

    def wait(self) -> None:
        """Return never, but let signals through."""
        while True:
            time.sleep(3600)

    def stop(self) -> None:
        """Close all pages, and end."""
        pages = self.pages
        for page in pages:
            page.close()
        for page in pages:
            page.join(PATIENCE)
        stop_quietly(self._server)
        self._warm_up.join()  # Python must not end while a library is loaded: that is a crash

    async def _check(self, connection: infra.WebsockClientConnection) -> None:
        """Turn away whoever comes from elsewhere, before anything is told."""
        live = self._server._websock_server._live_connections.get(connection.client_id)
        if live is not None and live.request is not None and self._is_foreign(live.request.headers):
            await live.close(1008, "not a page of this server")

    async def _open(self, client: viser.ClientHandle) -> None:
        page = Page(client, self._state, self._replay)
        with self._lock:
            self._pages[client.client_id] = page
        page.start()

    def _is_foreign(self, headers: Mapping[str, str]) -> bool:
        """Whether a web page of somebody else, open in a browser on this machine, asks for a page."""
        origin = headers.get("Origin")
        if origin is None:  # no browser
            return False
        ours = urlsplit(origin)
        local = self._host not in LOOPBACK or ours.hostname in LOOPBACK
        return ours.netloc != headers.get("Host") or not local

    def _replay(self) -> Replay | None:
        """Open the run, once for every page: one keeps what it has read, and is not for two threads."""
        if self._run is None:
            return None
        from dh2sim.view.replay import open_replay

        return open_replay(self._run, self._state.model)

    async def _close(self, client: viser.ClientHandle) -> None:
        with self._lock:
            page = self._pages.pop(client.client_id, None)
        if page is not None:
            page.close()


def free_port(host: str, port: int) -> int:
    """Return a port, or the next one after it that nobody listens at.

    Raises:
        Dh2simError: Nobody can listen at this address, or all of a hundred ports are taken.
    """
    for candidate in range(port, min(port + PORTS_TRIED, 65536)):
        try:
            family = socket.getaddrinfo(host, candidate, type=socket.SOCK_STREAM)[0][0]
            with socket.socket(family, socket.SOCK_STREAM) as trial:
                trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                trial.bind((host, candidate))
                return int(trial.getsockname()[1])
        except UnicodeError as error:  # of a name that cannot be one
            raise Dh2simError(f"cannot listen at {host}, port {candidate}: that is no address") from error
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise Dh2simError(f"cannot listen at {host}, port {candidate}: {error.strerror or error}") from error
    raise Dh2simError(f"cannot listen at {host}: ports {port} to {candidate} are all taken")


def _warm_up() -> None:
    """Import what the first page will need, while its browser still starts."""
    importlib.import_module("dh2sim.engines.mujoco_engine")


def quiet_server(host: str, port: int) -> viser.ViserServer:
    """Start a server; viser's own words about it are dropped."""
    import viser

    # pages notice by themselves that their browser is gone
    warnings.filterwarnings("ignore", message="Queued a .* on a closed connection", category=UserWarning)
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host=host, port=port, verbose=False)
    server.request_share_url = _refuse_to_share  # type: ignore[method-assign]
    return server


def stop_quietly(server: viser.ViserServer) -> None:
    """Stop a server; viser's last words are dropped."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def _refuse_to_share(*_arguments: object, **_options: object) -> None:
    """A page of this machine stays on it: viser's tunnel to the open net is never dug."""


def _dress(server: viser.ViserServer, state: ViewState) -> None:
    """Set what all pages have in common: colours, light, and where the eye begins."""
    server.gui.configure_theme(
        control_width="large",
        dark_mode=False,
        show_logo=False,
        show_share_button=False,
        brand_color=(35, 83, 148),
    )
    server.gui.main_panel.dock_right()
    server.scene.set_up_direction("+z")
    eye = eye_of(state.model)
    server.initial_camera.position = eye.position
    server.initial_camera.look_at = eye.look_at
    server.initial_camera.fov = FIELD
    server.initial_camera.near = 1e-3 * size_of(state.model)
    server.initial_camera.far = 1e3 * size_of(state.model)
