"""A page without a browser: what talks to the server as viser's page does, and draws nothing."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

import pytest


@contextlib.contextmanager
def speaking(url: str) -> Iterator[Callable[..., None]]:
    """Come to a server as a page; gives what sends it a message, of a kind and with a content."""
    client = pytest.importorskip("websockets.sync.client")
    import msgspec
    import viser

    address, protocols = url.replace("http", "ws"), [f"viser-v{viser.__version__}"]
    with client.connect(address, origin=url, subprotocols=protocols, max_size=None) as connection:

        def say(kind: str, **content: Any) -> None:
            connection.send(msgspec.msgpack.encode({"type": kind, **content}))

        say(
            "ViewerCameraMessage",
            wxyz=(1.0, 0.0, 0.0, 0.0),
            position=(3.0, 0.0, 0.0),
            fov=1.0,
            near=0.01,
            far=100.0,
            image_height=10,
            image_width=10,
            look_at=(0.0, 0.0, 0.0),
            up_direction=(0.0, 0.0, 1.0),
        )
        yield say
