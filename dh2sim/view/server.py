"""The web server: a page for every browser that connects, each with its own state.

It is viser's, without its messages, and without its tunnel to the internet.
"""

from __future__ import annotations

import contextlib
import errno
import importlib
import io
import ipaddress
import logging
import os
import socket
import sys
import threading
import time
import warnings
import webbrowser
from collections.abc import Iterator, Mapping
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Final, cast
from urllib.parse import urlsplit

from dh2sim.errors import Dh2simError
from dh2sim.view.page import Page
from dh2sim.view.scene.camera import aim
from dh2sim.view.state import ViewState

if TYPE_CHECKING:
    import viser
    from viser import infra

    from dh2sim.view.motion.replay import Replay

LOOPBACK: Final = ("127.0.0.1", "localhost", "::1")
ANY_ADDRESS: Final = ("0.0.0.0", "::")
"""Listening at these means at all addresses of this machine."""
PORTS_TRIED: Final = 100
STOP_TIMEOUT: Final = 5.0
"""s that a page may take to end."""


def start_server(host: str, port: int) -> viser.ViserServer:
    """Start a viser server that prints nothing and never shares its pages."""
    import viser

    # pages detect by themselves that their browser is gone
    warnings.filterwarnings("ignore", message="Queued a .* on a closed connection", category=UserWarning)
    logging.getLogger("websockets.server").addFilter(_is_worth_logging)
    with contextlib.redirect_stdout(io.StringIO()):  # it prints its address even if it is not verbose
        server = viser.ViserServer(host=host, port=port, verbose=False)
    server.request_share_url = _refuse_to_share  # type: ignore[method-assign]
    return server


def stop_server(server: viser.ViserServer) -> None:
    """Stop a server; it prints nothing."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


@contextlib.contextmanager
def recording_server() -> Iterator[viser.ViserServer]:
    """Start a server without an audience: viser can only record what a server sends."""
    server = start_server("127.0.0.1", 0)
    try:
        yield server
    finally:
        stop_server(server)


def _is_worth_logging(record: logging.LogRecord) -> bool:
    """Return whether a message is about more than a browser that connects ahead of time and asks nothing."""
    return record.getMessage() != "opening handshake failed"


def _refuse_to_share(*_arguments: object, **_options: object) -> None:
    """Refuse viser's tunnel to the internet."""


class Viewer:
    """Serves pages until it is stopped."""

    def __init__(
        self, state: ViewState, *, host: str = "127.0.0.1", port: int = 0, run: FilePath | None = None
    ) -> None:
        """Start to serve.

        Args:
            state: Initial state of every page.
            host: Address to listen at; by default only this machine can reach it.
            port: Port to listen at, 0 for any free one; see ``free_port``.
            run: A run of the same robot that pages can play.

        Raises:
            RunError: The run cannot be read, or is of a robot with other joints.
            Dh2simError: The origin of requests cannot be checked with this version of viser.
        """
        self._state = state
        self._host = host
        self._run = run
        self._open_replay()  # raises early
        self._pages: dict[int, Page] = {}
        self._leaving: list[Page] = []
        """Pages whose browser is gone, and whose thread may still run."""
        self._lock = threading.Lock()
        self._server = start_server(host, port)
        self.port: int = self._server.get_port()
        _configure(self._server, state)
        # not a daemon: Python crashes if it ends while a library is being loaded
        threading.Thread(target=_preload, name="preload").start()
        self._websockets = _websockets(self._server)
        self._websockets.on_client_connect(self._check_origin)
        self._server.on_client_connect(self._open)
        self._server.on_client_disconnect(self._close)

    @property
    def url(self) -> str:
        """Address for a browser on this machine."""
        name = "127.0.0.1" if self._host in ANY_ADDRESS else self._host
        return f"http://{f'[{name}]' if ':' in name else name}:{self.port}"

    @property
    def pages(self) -> tuple[Page, ...]:
        """The open pages."""
        with self._lock:
            return tuple(self._pages.values())

    def open_browser(self) -> None:
        """Open the page if there is a screen; without one, Python would start a browser in the terminal."""
        screen = sys.platform in ("win32", "darwin") or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        if screen:
            webbrowser.open(self.url)

    def wait(self) -> None:
        """Wait for a signal; does not return."""
        while True:
            time.sleep(3600)

    def stop(self) -> None:
        """Close all pages, and stop the server."""
        pages = self.pages
        for page in pages:
            page.close()
        for page in (*pages, *self._leaving):  # a stopped server complains about what is sent to it
            page.join(STOP_TIMEOUT)
        stop_server(self._server)

    async def _check_origin(self, connection: infra.WebsockClientConnection) -> None:
        """Close a connection from another site's page before anything is sent to it."""
        live = self._websockets._live_connections.get(connection.client_id)
        if live is not None and live.request is not None and self._is_foreign(live.request.headers):
            await live.close(1008, "not a page of this server")

    def _is_foreign(self, headers: Mapping[str, str]) -> bool:
        """Return whether another site's page, open in a browser on this machine, made a request."""
        origin = headers.get("Origin")
        if origin is None:  # no browser
            return False
        site = urlsplit(origin)
        local = self._host not in LOOPBACK or site.hostname in LOOPBACK
        return site.netloc != headers.get("Host") or not local

    async def _open(self, client: viser.ClientHandle) -> None:
        page = Page(client, self._state, self._open_replay)
        with self._lock:
            self._pages[client.client_id] = page
        page.start()

    def _open_replay(self) -> Replay | None:
        """Open the run; every page has its own, which caches rollouts and is not thread-safe."""
        if self._run is None:
            return None
        from dh2sim.view.motion.replay import open_replay

        return open_replay(self._run, self._state.model)

    async def _close(self, client: viser.ClientHandle) -> None:
        with self._lock:
            page = self._pages.pop(client.client_id, None)
        if page is not None:
            page.close()
            self._leaving = [*(left for left in self._leaving if left.is_alive), page]


def _websockets(server: viser.ViserServer) -> infra.WebsockServer:
    """Return the part of a server that knows the headers of requests, to which viser gives no public access.

    Raises:
        Dh2simError: viser has changed; the server is stopped, since it would serve other sites' pages.
    """
    websockets = getattr(server, "_websock_server", None)
    if not hasattr(websockets, "_live_connections"):
        import viser

        stop_server(server)
        raise Dh2simError(f"viser {viser.__version__} is not supported: the origin of requests cannot be checked")
    return cast("infra.WebsockServer", websockets)


def free_port(host: str, port: int) -> int:
    """Return a port, or the next free one after it.

    Raises:
        Dh2simError: The address is not one of this machine, or 100 ports in a row are taken.
    """
    for candidate in range(port, min(port + PORTS_TRIED, 65536)):
        try:
            family = socket.getaddrinfo(host, candidate, type=socket.SOCK_STREAM)[0][0]
            with socket.socket(family, socket.SOCK_STREAM) as trial:
                trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                trial.bind((host, candidate))
                return int(trial.getsockname()[1])
        except UnicodeError as error:  # a host name with empty or very long parts
            raise Dh2simError(f"cannot listen at {host}, port {candidate}: invalid address") from error
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise Dh2simError(f"cannot listen at {host}, port {candidate}: {error.strerror or error}") from error
    raise Dh2simError(f"cannot listen at {host}: ports {port} to {candidate} are all taken")


def is_local_only(host: str) -> bool:
    """Return whether only this machine can reach a server at a valid address."""
    addresses = [str(info[4][0]) for info in socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)]
    return all(ipaddress.ip_address(address).is_loopback for address in addresses)


def _preload() -> None:
    """Import what the first page will need while its browser starts."""
    importlib.import_module("dh2sim.engines.mujoco_engine")


def _configure(server: viser.ViserServer, state: ViewState) -> None:
    """Set what all pages have in common: theme, light and initial camera."""
    server.gui.configure_theme(
        control_width="large",
        dark_mode=False,
        show_logo=False,
        show_share_button=False,
        brand_color=(35, 83, 148),
    )
    server.gui.main_panel.dock_right()
    server.scene.set_up_direction("+z")
    # shadows of links on links are no help, and take two thirds of the time of a browser without a graphics card
    server.scene.configure_default_lights(cast_shadow=False)
    aim(server.initial_camera, state.model)
