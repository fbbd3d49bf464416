"""Who may reach the pages, and what a page may send.

Other sites' pages, open in a browser on this machine, are kept out in three ways: a request must name this machine
(otherwise a site could point its own name at it, known as DNS rebinding), a connection must come from a page of this
server, and no page may be shown inside another site's (clickjacking). A page that sends what viser cannot read, or
what its own code stumbles over, is closed; the others go on.
"""

from __future__ import annotations

import asyncio
import http
import ipaddress
import logging
import math
import socket
import threading
from collections.abc import Callable, Coroutine, Generator, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, Final, TypeAlias
from urllib.parse import urlsplit

import msgspec
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from dh2sim.errors import Dh2simError
from dh2sim.messages import printable

if TYPE_CHECKING:
    from websockets.http11 import Request, Response

LOOPBACK: Final = ("127.0.0.1", "localhost", "::1")
ANY_ADDRESS: Final = ("0.0.0.0", "::")
"""Listening at these means at all addresses of this machine."""
HEADERS: Final = {"Content-Security-Policy": "frame-ancestors 'none'", "X-Frame-Options": "DENY"}
"""Of every answer: no page may be shown inside another."""
MAX_MESSAGE: Final = 2**23
"""Bytes of a message from a page; files come in parts."""

Handler: TypeAlias = Callable[[ServerConnection], Coroutine[Any, Any, None]]
"""Serves a connection until it ends."""

_log: Final = logging.getLogger(__name__)
_sender: ContextVar[PageConnection | None] = ContextVar("sender", default=None)
"""The connection whose messages are worked through."""
_starting: Final = threading.Lock()


class Access:
    """The names that a server answers to, and its check of requests and messages."""

    def __init__(self, host: str, allowed: Iterable[str] = ()) -> None:
        """Derive the names from where the server listens.

        Args:
            host: Address or name that it listens at. At a loopback address it answers to loopback names alone; at
                others, to the name of the machine and to any IP address too, which no other site's page can have.
            allowed: More names.
        """
        self.only_here: Final = all(ipaddress.ip_address(address).is_loopback for address in _addresses(host))
        """Whether only this machine can reach the server."""
        machine = socket.gethostname()
        own = () if self.only_here else (machine, f"{machine.split('.')[0]}.local")
        names = (*LOOPBACK, *(() if host in ANY_ADDRESS else (host,)), *own, *allowed)
        self.names: Final = tuple(dict.fromkeys(name.lower().rstrip(".") for name in names))
        """In small letters."""

    def refusal(self, request: Request) -> str:
        """Return why a request is refused, or an empty text."""
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        name = _name(f"//{hosts[0]}") if len(hosts) == 1 else None
        if name is None:
            return "A request must have one valid header 'Host'."
        if not (name in self.names or (not self.only_here and is_address(name))):
            return f"This server does not answer to the name '{name}'. 'dh2sim view --allow-host NAME' adds a name."
        if origins and (len(origins) > 1 or urlsplit(origins[0]).netloc != hosts[0]):
            return "Only pages of this server may connect to it."
        return ""

    @contextmanager
    def guarding(self) -> Iterator[None]:
        """Guard the server of websockets that is started inside the block.

        viser gives no access to the requests that it answers. It starts its server with the public
        ``websockets.asyncio.server.serve``, in whose place a function stands meanwhile that adds the checks.

        Raises:
            Dh2simError: No server was started that way.
        """
        guarded = False

        def serve(handler: Handler, *where: Any, **options: Any) -> Any:
            nonlocal guarded
            guarded = True
            asyncio.get_running_loop().set_task_factory(_watched_task)
            answer = options["process_request"]

            def process_request(connection: ServerConnection, request: Request) -> Response | None:
                why = self.refusal(request)
                if why:
                    return connection.respond(http.HTTPStatus.FORBIDDEN, f"{why}\n")
                response: Response | None = answer(connection, request)
                return response

            options |= {
                "process_request": process_request,
                "process_response": _add_headers,
                "create_connection": PageConnection,
                "max_size": MAX_MESSAGE,
            }
            return original(_handled(handler), *where, **options)

        with _starting:
            original = websockets.asyncio.server.serve
            websockets.asyncio.server.serve = serve  # type: ignore[assignment,misc]
            try:
                yield
            finally:
                websockets.asyncio.server.serve = original  # type: ignore[misc]
        if not guarded:
            import viser

            raise Dh2simError(f"viser {viser.__version__} is not supported: its requests cannot be checked")


class PageConnection(ServerConnection):
    """A connection to a page, which is closed if the page sends nonsense."""

    _blamed = False

    async def recv(self, decode: bool | None = None) -> Any:
        """Return the next message, once it has been checked.

        Raises:
            ConnectionClosed: The page is gone, or was closed for what it sent.
        """
        message = await super().recv(decode)
        why = _nonsense(message)
        if why:
            self.blame(why)
            await self.close(1008, "not a message of this page")
            await super().recv(decode)  # raises
        return message

    def blame(self, why: str) -> None:
        """Close the page, and say once why."""
        if not self._blamed:
            self._blamed = True
            _log.warning("dh2sim: a page was closed: %s", printable(why))
            self._closing = asyncio.get_running_loop().create_task(self.close(1008, "not a message of this page"))


def closer() -> Callable[[], None]:
    """Return what closes the page whose message is being worked through, from any thread."""
    connection = _sender.get()
    if connection is None:
        return lambda: None
    loop = asyncio.get_running_loop()

    def close() -> None:
        asyncio.run_coroutine_threadsafe(connection.close(1011, "the page failed"), loop)

    return close


def _handled(handler: Handler) -> Callable[..., Any]:
    async def handle(connection: PageConnection) -> None:
        _sender.set(connection)  # tasks that are started from here inherit it
        try:
            await handler(connection)
        except ConnectionClosed:
            pass
        except Exception as error:
            connection.blame(_words(error))

    return handle


def _watched_task(
    loop: asyncio.AbstractEventLoop, work: Coroutine[Any, Any, Any] | Generator[Any, None, Any], **options: Any
) -> asyncio.Task[Any]:
    """Make a task; if it fails at what a page has sent, the page is closed."""
    task = asyncio.Task(work, loop=loop, **options)
    sender = _sender.get()
    if sender is not None:

        def look(done: asyncio.Task[Any]) -> None:
            error = None if done.cancelled() else done.exception()
            if error is not None and not isinstance(error, ConnectionClosed):
                sender.blame(_words(error))

        task.add_done_callback(look)
    return task


def _add_headers(_connection: ServerConnection, _request: Request, response: Response) -> None:
    for name, value in HEADERS.items():
        response.headers[name] = value


def _nonsense(message: str | bytes) -> str:
    """Return what is wrong with a message, as far as viser does not look, or an empty text."""
    if isinstance(message, str):
        return "text in place of bytes"
    try:
        content = msgspec.msgpack.decode(message)
    except (msgspec.DecodeError, RecursionError, ValueError) as error:
        return _words(error)
    if not isinstance(content, dict) or not isinstance(content.get("type"), str):
        return "a message without a type"
    if content["type"] != "GuiUpdateMessage":
        return ""
    updates = content.get("updates")
    if not isinstance(updates, dict) or set(updates) != {"value"}:
        return "a change of a widget that is not its value"
    return "" if _is_finite(updates["value"]) else "a number that is not finite"


def _is_finite(value: object) -> bool:
    if isinstance(value, list):
        return all(isinstance(item, str | int | float) and _is_finite(item) for item in value)
    return not isinstance(value, float) or math.isfinite(value)


def _words(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"


def _name(url: str) -> str | None:
    """Return the host name in a URL in small letters, or None if there is none."""
    try:
        parts = urlsplit(url)
        _ = parts.port  # raises unless it is a number
    except ValueError:
        return None
    known = parts.hostname and not (parts.username or parts.path or parts.query or parts.fragment)
    return parts.hostname.rstrip(".") if parts.hostname and known else None


def is_address(name: str) -> bool:
    """Return whether a host name is an IP address."""
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _addresses(host: str) -> list[str]:
    return [str(info[4][0]) for info in socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)]
