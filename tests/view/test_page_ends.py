"""What a page's thread makes of a browser that is gone."""

from __future__ import annotations

import socket
import threading
from types import SimpleNamespace
from typing import Any

import pytest
import websockets

from dh2sim.errors import Dh2simError
from dh2sim.robot.read import load_robot
from dh2sim.view.events import Event, FoundWorkspace, Show
from dh2sim.view.initial_state import open_state
from dh2sim.view.page import is_disconnect
from dh2sim.view.reach_search import ReachSearch
from dh2sim.view.server import Viewer, free_port
from dh2sim.view.state import Part
from dh2sim.workspace import workspace
from tests.view.on_page import DEADLINE, wait_until
from tests.view.states import STANFORD, after
from tests.view.without_browser import speaking


@pytest.mark.parametrize(
    "error",
    [
        UserWarning("Queued a GuiUpdateMessage on a closed connection (e.g. via a handle owned by a disconnected"),
        RuntimeError("Event loop is closed"),
    ],
    ids=["viser", "asyncio"],
)
def test_a_closed_browser_is_no_error(error: Exception) -> None:
    assert is_disconnect(error)


@pytest.mark.parametrize("error", [RuntimeError("dictionary changed size"), UserWarning("something else")])
def test_everything_else_is(error: Exception) -> None:
    assert not is_disconnect(error)


def test_a_server_ends_after_all_that_its_pages_still_do_for_browsers_that_are_gone() -> None:
    viewer = Viewer(open_state(load_robot("stanford")))
    for _ in range(4):
        with speaking(viewer.url):
            wait_until(lambda: len(viewer.pages) == 1, "the page")
        wait_until(lambda: not viewer.pages, "it is closed")
    viewer.stop()
    assert [thread.name for thread in threading.enumerate() if thread.name.startswith("page-")] == []


def test_a_page_that_is_closed_leaves_what_is_queued() -> None:
    viewer = Viewer(open_state(load_robot("stanford")))
    try:
        with speaking(viewer.url):
            wait_until(lambda: len(viewer.pages) == 1, "the page")
            (page,) = viewer.pages
            busy, done = threading.Event(), threading.Event()

            def be_busy() -> None:
                busy.wait(20.0)

            page.send(be_busy)
            page.send(done.set)
            page.close()
            busy.set()
            page.join(20.0)
            assert not page.is_alive
            assert not done.is_set()
    finally:
        viewer.stop()


def test_a_search_that_fails_is_reported_on_its_page_and_not_in_the_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_arguments: object, **_options: object) -> None:
        raise ValueError("a bug")

    monkeypatch.setattr(workspace, "compute_workspace", fail)
    sent: list[Event] = []
    search = ReachSearch(sent.append)
    search.show(after(STANFORD, Show(part=Part.WORKSPACE, on=True)))
    search.join(DEADLINE)
    assert isinstance(sent[-1], FoundWorkspace)
    assert sent[-1].note == "This is a bug in dh2sim, please report it: ValueError: a bug"


def test_no_page_is_served_if_requests_cannot_be_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    import viser
    import websockets.asyncio.server as public

    started: list[int] = []

    def serve(*arguments: Any, **options: Any) -> Any:
        started.append(options.get("port", arguments[2]))
        return original(*arguments, **options)

    original = public.serve
    elsewhere = SimpleNamespace(asyncio=SimpleNamespace(server=SimpleNamespace(serve=serve)))
    # a viser that has its server from elsewhere
    monkeypatch.setattr("viser.infra._infra.websockets", Layered(elsewhere, websockets))
    port = free_port("127.0.0.1", 18080)
    with pytest.raises(Dh2simError) as caught:
        Viewer(open_state(load_robot("stanford")), port=port)
    assert str(caught.value) == f"viser {viser.__version__} is not supported: its requests cannot be checked"
    assert started == [port]
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.1", port), timeout=10.0)


class Layered:
    """A module of which some names are replaced."""

    def __init__(self, first: object, then: object) -> None:
        self._layers = (first, then)

    def __getattr__(self, name: str) -> object:
        return next(getattr(layer, name) for layer in self._layers if hasattr(layer, name))
