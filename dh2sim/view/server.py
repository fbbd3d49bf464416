"""The web server: a page for every browser that connects, each with its own state.

It is viser's, without its messages, and without its tunnel to the internet.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import gc
import importlib
import io
import logging
import os
import socket
import sys
import threading
import time
import warnings
import webbrowser
from collections.abc import Iterable, Iterator
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Final, Generic, Protocol, TypeVar

from dh2sim.errors import Dh2simError
from dh2sim.view.access import ANY_ADDRESS, Access, closer
from dh2sim.view.page import Page
from dh2sim.view.scene.camera import aim
from dh2sim.view.state import ViewState

if TYPE_CHECKING:
    import viser

    from dh2sim.view.motion.replay import Replay

PORTS_TRIED: Final = 100
STOP_TIMEOUT: Final = 5.0
"""s that a page may take to end."""
CLEAR_UP_DELAY: Final = 1.0
"""s from when a page is closed until its memory is given back."""


def start_server(host: str, port: int, access: Access | None = None) -> viser.ViserServer:
    """Start a viser server that prints nothing and never shares its pages.

    Args:
        host: Address to listen at.
        port: Port to listen at, 0 for any free one.
        access: Checks requests; by default for the names of ``host``.

    Raises:
        Dh2simError: Requests cannot be checked with this version of viser.
    """
    import viser

    # pages detect by themselves that their browser is gone
    warnings.filterwarnings("ignore", message="Queued a .* on a closed connection", category=UserWarning)
    # nor does it matter what a page sends: what cannot be used closes it
    warnings.filterwarnings("ignore", message=r"\[viser\] [\s\S]* does not match annotation", category=UserWarning)
    logging.getLogger("websockets.server").addFilter(_is_worth_logging)
    server: viser.ViserServer | None = None
    try:
        with (access or Access(host)).guarding(), contextlib.redirect_stdout(io.StringIO()):  # it prints its address
            server = viser.ViserServer(host=host, port=port, verbose=False)
    except Dh2simError:
        if server is not None:
            stop_server(server)
        raise
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


class ServedPage(Protocol):
    """What a server knows of a page."""

    def start(self) -> None:
        """Draw, and begin to work through events."""

    def close(self) -> None:
        """End after the present task."""

    def join(self, timeout: float) -> None:
        """Wait until its thread has ended, at most ``timeout`` seconds."""

    @property
    def is_alive(self) -> bool:
        """Whether its thread has not ended yet."""


P = TypeVar("P", bound=ServedPage)


class PageServer(Generic[P]):
    """Serves pages until it is stopped."""

    def __init__(self, *, host: str, port: int, allow_hosts: Iterable[str]) -> None:
        """Start to serve.

        Args:
            host: Address to listen at.
            port: Port to listen at, 0 for any free one; see ``free_port``.
            allow_hosts: Names of this machine that browsers may use, besides those that it knows of itself.

        Raises:
            Dh2simError: Requests cannot be checked with this version of viser.
        """
        self._host = host
        self._pages: dict[int, P] = {}
        self._leaving: list[P] = []
        """Pages whose browser is gone, and which are not cleared up yet."""
        self._stopping = threading.Event()
        self._lock = threading.Lock()
        self.access: Final = Access(host, allow_hosts)
        self._server = start_server(host, port, self.access)
        self.port: int = self._server.get_port()
        _configure(self._server)
        self.aim(self._server)
        # not a daemon: Python crashes if it ends while a library is being loaded
        threading.Thread(target=_preload, name="preload").start()
        self._server.on_client_connect(self._open)
        self._server.on_client_disconnect(self._close)

    @property
    def url(self) -> str:
        """Address for a browser on this machine."""
        name = "127.0.0.1" if self._host in ANY_ADDRESS else self._host
        return f"http://{f'[{name}]' if ':' in name else name}:{self.port}"

    @property
    def pages(self) -> tuple[P, ...]:
        """The open pages."""
        with self._lock:
            return tuple(self._pages.values())

    def new_page(self, client: viser.ClientHandle) -> P:
        """Return a page for a browser."""
        raise NotImplementedError

    def aim(self, server: viser.ViserServer) -> None:
        """Set where the camera of a page is at first."""
        raise NotImplementedError

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
        self._stopping.set()
        with self._lock:
            pages = (*self._pages.values(), *self._leaving)
        for page in pages:
            page.close()
        for page in pages:  # a stopped server complains about what is sent to it
            page.join(STOP_TIMEOUT)
        stop_server(self._server)

    async def _open(self, client: viser.ClientHandle) -> None:
        page = self.new_page(client)
        with self._lock:
            self._pages[client.client_id] = page
        page.start()

    async def _close(self, client: viser.ClientHandle) -> None:
        with self._lock:
            page = self._pages.pop(client.client_id, None)
            if page is None:
                return
            page.close()
            self._leaving.append(page)
            if len(self._leaving) == 1:
                threading.Thread(target=self._clear_up, name="clear up").start()

    def _clear_up(self) -> None:
        """Give back the memory of pages that are closed, of several at once, for that takes a tenth of a second.

        They consist of cycles, which Python finds late, and more so as short commands let it wait (``cli/main.py``).
        """
        while not self._stopping.wait(CLEAR_UP_DELAY):
            with self._lock:
                ended = [page for page in self._leaving if not page.is_alive]
                self._leaving = [page for page in self._leaving if page.is_alive]
                done = not self._leaving
            if ended:
                ended.clear()
                gc.collect()
                give_back_memory()
            if done:
                return


class Viewer(PageServer[Page]):
    """Serves pages of a robot."""

    def __init__(
        self,
        state: ViewState,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        run: FilePath | None = None,
        allow_hosts: Iterable[str] = (),
    ) -> None:
        """Start to serve.

        Args:
            state: Initial state of every page.
            host: Address to listen at; by default only this machine can reach it.
            port: Port to listen at, 0 for any free one; see ``free_port``.
            run: A run of the same robot that pages can play.
            allow_hosts: Names of this machine that browsers may use, besides those that it knows of itself.

        Raises:
            RunError: The run cannot be read, or is of a robot with other joints.
            Dh2simError: Requests cannot be checked with this version of viser.
        """
        self._state = state
        self._run = run
        self._open_replay()  # raises early
        super().__init__(host=host, port=port, allow_hosts=allow_hosts)

    def new_page(self, client: viser.ClientHandle) -> Page:
        """Return a page for a browser."""
        return Page(client, self._state, self._open_replay, closer())

    def aim(self, server: viser.ViserServer) -> None:
        """Set where the camera of a page is at first."""
        aim(server.initial_camera, self._state.model)

    def _open_replay(self) -> Replay | None:
        """Open the run; every page has its own, which caches rollouts and is not thread-safe."""
        if self._run is None:
            return None
        from dh2sim.view.motion.replay import open_replay

        return open_replay(self._run, self._state.model)


def give_back_memory() -> None:
    """Give memory that is free back to the system, where the C library does so on request only (glibc)."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None) if os.name == "posix" else None
    if trim is not None:
        trim(0)


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


def _preload() -> None:
    """Import what the first page will need while its browser starts."""
    importlib.import_module("dh2sim.engines.mujoco_engine")


def _configure(server: viser.ViserServer) -> None:
    """Set what all pages have in common: theme and light."""
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
