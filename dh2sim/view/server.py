"""The web server: a page for every browser that comes, each with a state of its own.

viser's server, without its own words, and without its way to the open net.
"""

from __future__ import annotations

import contextlib
import errno
import importlib
import io
import ipaddress
import logging
import socket
import threading
import time
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Final
from urllib.parse import urlsplit

from dh2sim.errors import Dh2simError
from dh2sim.view.page import Page
from dh2sim.view.scene.camera import aim
from dh2sim.view.state import ViewState

if TYPE_CHECKING:
    import viser
    from viser import infra

    from dh2sim.view.motion.replay import Replay


def quiet_server(host: str, port: int) -> viser.ViserServer:
    """Start a server; viser's own words about it are dropped."""
    import viser
    from viser import _messages

    # pages notice by themselves that their browser is gone
    warnings.filterwarnings("ignore", message="Queued a .* on a closed connection", category=UserWarning)
    logging.getLogger("websockets.server").addFilter(_is_worth_telling)
    with contextlib.redirect_stdout(io.StringIO()):  # it tells its address, whether it is asked to or not
        server = viser.ViserServer(host=host, port=port, verbose=False)
    server.request_share_url = _refuse_to_share  # type: ignore[method-assign]
    for message in (_messages.FileTransferStartUpload, _messages.FileTransferPart):
        server.gui._websock_interface.unregister_handler(message)  # every page takes its own files
    return server


def stop_quietly(server: viser.ViserServer) -> None:
    """Stop a server; viser's last words are dropped."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


@contextlib.contextmanager
def server_for_nobody() -> Iterator[viser.ViserServer]:
    """Give a server that nobody is told of: viser records only what a server sends."""
    server = quiet_server("127.0.0.1", 0)
    try:
        yield server
    finally:
        stop_quietly(server)


def _is_worth_telling(record: logging.LogRecord) -> bool:
    """Whether a message is not only of somebody who connected and asked nothing, as browsers do ahead of time."""
    return record.getMessage() != "opening handshake failed"


def _refuse_to_share(*_arguments: object, **_options: object) -> None:
    """A page of this machine stays on it: viser's tunnel to the open net is never dug."""


LOOPBACK: Final = ("127.0.0.1", "localhost", "::1")
EVERY_ADDRESS: Final = ("0.0.0.0", "::")
"""Of this machine; a browser on it is told another."""
PORTS_TRIED: Final = 100
PATIENCE: Final = 5.0
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
        self._leaving: list[Page] = []
        """Pages whose browser is gone, and which may still do something."""
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
        name = "127.0.0.1" if self._host in EVERY_ADDRESS else self._host
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
        for page in (*pages, *self._leaving):  # what is sent to a server that has ended makes it complain
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
        from dh2sim.view.motion.replay import open_replay

        return open_replay(self._run, self._state.model)

    async def _close(self, client: viser.ClientHandle) -> None:
        with self._lock:
            page = self._pages.pop(client.client_id, None)
        if page is not None:
            page.close()
            self._leaving = [*(left for left in self._leaving if left.works), page]


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


def is_private(host: str) -> bool:
    """Whether only this machine can reach a server at an address; ``host`` is one that can be listened at."""
    addresses = [str(info[4][0]) for info in socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)]
    return all(ipaddress.ip_address(address).is_loopback for address in addresses)


def _warm_up() -> None:
    """Import what the first page will need, while its browser still starts."""
    importlib.import_module("dh2sim.engines.mujoco_engine")


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
    # shadows of links on links tell nothing, and cost a browser without a graphics card two thirds of its time
    server.scene.configure_default_lights(cast_shadow=False)
    aim(server.initial_camera, state.model)
