"""viser's server, without its own words, and without its way to the open net."""

from __future__ import annotations

import contextlib
import io
import logging
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import viser


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
