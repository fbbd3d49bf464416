"""A page without a browser: what talks to the server as viser's page does, and draws nothing."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.view.on_page import DEADLINE

CAMERA = {
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (3.0, 0.0, 0.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 100.0,
    "image_height": 10,
    "image_width": 10,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}
"""What a page reports first."""


def encoded(kind: str, **content: Any) -> bytes:
    """A message of a kind and with a content."""
    import msgspec

    return msgspec.msgpack.encode({"type": kind, **content})


@contextlib.contextmanager
def connected(url: str, **options: Any) -> Iterator[Any]:
    """Connect to a server as a page of it does; gives the connection, on which nothing was sent."""
    client = pytest.importorskip("websockets.sync.client")
    import viser

    address, protocols = url.replace("http", "ws", 1), [f"viser-v{viser.__version__}"]
    # nobody reads what comes, and to close it waits for room in its queue; a busy server answers late
    settings: dict[str, Any] = {"max_size": None, "max_queue": 2**30, "open_timeout": DEADLINE}
    with client.connect(address, **{"origin": url, **settings, **options}, subprotocols=protocols) as connection:
        yield connection


@contextlib.contextmanager
def speaking(url: str) -> Iterator[Callable[..., None]]:
    """Come to a server as a page; gives what sends it a message, of a kind and with a content."""
    with connected(url) as connection:

        def say(kind: str, **content: Any) -> None:
            connection.send(encoded(kind, **content))

        say("ViewerCameraMessage", **CAMERA)
        yield say
