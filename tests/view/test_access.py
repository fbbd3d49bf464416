"""Who may reach the pages, and what a page that sends nonsense does to itself and to others."""

from __future__ import annotations

import contextlib
import http.client
import logging
import math
import socket
import threading
from collections.abc import Iterator
from functools import partial
from typing import Any, Final

import pytest
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.http11 import Request

from dh2sim.robot.read import load_robot
from dh2sim.view.access import Access
from dh2sim.view.initial_state import open_state
from dh2sim.view.page import Page
from dh2sim.view.server import Viewer
from tests.view.on_page import DEADLINE, wait_until
from tests.view.without_browser import CAMERA, connected, encoded, speaking


@pytest.fixture(scope="module")
def served() -> Iterator[Viewer]:
    """A server that no other test talks to."""
    viewer = Viewer(open_state(load_robot("stanford")))
    yield viewer
    viewer.stop()


def answer(viewer: Viewer, path: str = "/", **headers: str) -> http.client.HTTPResponse:
    """What the server answers to a request; Host is its own unless given."""
    connection = http.client.HTTPConnection("127.0.0.1", viewer.port, timeout=DEADLINE)
    connection.putrequest("GET", path, skip_host=True, skip_accept_encoding=True)
    for name, value in {"Host": f"127.0.0.1:{viewer.port}", **headers}.items():
        connection.putheader(name, value)
    connection.endheaders()
    response = connection.getresponse()
    response.read()
    connection.close()
    return response


UPGRADE = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13"}


@pytest.mark.parametrize(
    ("path", "headers", "status"),
    [
        ("/", {}, 200),
        ("/index.html?a=b", {"Accept-Encoding": "gzip"}, 200),
        ("/nowhere", {}, 404),
        ("/%2e%2e/setup.py", {}, 404),
        ("/", {"Host": "evil.example"}, 403),
        ("/", UPGRADE, 400),
        ("/", {**UPGRADE, "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}, 101),
        ("/", {**UPGRADE, "Origin": "http://evil.example"}, 403),
    ],
)
def test_no_answer_may_be_shown_inside_another_sites_page(
    served: Viewer, path: str, headers: dict[str, str], status: int
) -> None:
    response = answer(served, path, **headers)
    assert response.status == status
    assert response.getheader("Content-Security-Policy") == "frame-ancestors 'none'"
    assert response.getheader("X-Frame-Options") == "DENY"


def test_a_connection_from_another_origin_or_to_another_name_is_turned_away(served: Viewer) -> None:
    port = served.port
    for options in ({}, {"origin": None}):
        with connected(served.url, **options) as connection:
            connection.recv(timeout=DEADLINE)
    foreign = ("http://elsewhere.example", f"http://elsewhere.example:{port}", "null", f"http://127.0.0.1:{port + 1}")
    for origin in foreign:
        with pytest.raises(InvalidStatus) as caught, connected(served.url, origin=origin):
            pass
        assert caught.value.response.status_code == 403
    rebound = f"http://elsewhere.example:{port}"  # its name points at this machine
    with (
        socket.create_connection(("127.0.0.1", port)) as own,
        pytest.raises(InvalidStatus) as caught,
        connected(rebound, origin=rebound, sock=own),
    ):
        pass
    assert caught.value.response.status_code == 403
    assert b"does not answer to the name 'elsewhere.example'" in (caught.value.response.body or b"")


def refused(access: Access, *hosts: str, origin: str | None = None) -> bool:
    headers = Headers([*(("Host", host) for host in hosts), *([("Origin", origin)] if origin is not None else [])])
    return bool(access.refusal(Request("/", headers)))


OWN_ADDRESS = "192.0.2.7:8080"


@pytest.mark.parametrize(
    ("listening", "host", "welcome"),
    [
        ("127.0.0.1", "127.0.0.1:8080", True),
        ("127.0.0.1", "localhost", True),
        ("127.0.0.1", "LocalHost.:9000", True),
        ("127.0.0.1", "[::1]:8080", True),
        ("127.0.0.1", OWN_ADDRESS, False),
        ("127.0.0.1", "evil.example", False),
        ("127.0.0.1", "localhost.evil.example", False),
        ("127.0.0.1", "evil.example@localhost", False),
        ("127.0.0.1", "localhost/evil", False),
        ("127.0.0.1", "localhost:eighty", False),
        ("127.0.0.1", "", False),
        ("127.0.0.1", socket.gethostname(), socket.gethostname() == "localhost"),
        ("0.0.0.0", OWN_ADDRESS, True),
        ("0.0.0.0", "[2001:db8::1]:8080", True),
        ("0.0.0.0", "0.0.0.0:8080", True),
        ("0.0.0.0", f"{socket.gethostname()}:8080", True),
        ("0.0.0.0", "evil.example", False),
        ("0.0.0.0", "192.0.2.7.evil.example", False),
        ("0.0.0.0", "lab.example.org:443", True),
        ("::", OWN_ADDRESS, True),
        ("::", "evil.example", False),
    ],
)
def test_only_requests_that_name_this_machine_are_answered(listening: str, host: str, welcome: bool) -> None:
    access = Access(listening, ["Lab.Example.ORG"])
    assert refused(access, host) is not welcome
    assert refused(access, host, origin=f"http://{host}") is not welcome
    assert refused(access, host, origin="http://evil.example")


def test_a_request_names_one_host() -> None:
    access = Access("127.0.0.1")
    assert refused(access)
    assert refused(access, "localhost", "evil.example")
    assert not refused(access, "localhost")


@pytest.mark.parametrize(
    ("host", "private"),
    [("127.0.0.1", True), ("127.8.0.1", True), ("localhost", True), ("0.0.0.0", False), ("192.0.2.1", False)],
)
def test_whether_others_can_reach_an_address_is_known(host: str, private: bool) -> None:
    assert Access(host).only_here is private


NONSENSE = {
    "text": "text",
    "nothing": b"",
    "no msgpack": b"\xc1",
    "nested": b"\x91" * 100_000,
    "a list": b"\x92\x01\x02",
    "no type": b"\x80",
    "an unknown type": encoded("Nope"),
    "escape sequences": encoded("\x1b[31mred"),
    "lacking fields": encoded("GuiUpdateMessage"),
    "an impossible key": encoded("GuiUpdateMessage", uuid=[1], updates={"value": 1}),
    "an inner value": encoded("GuiUpdateMessage", uuid="x", updates={"update_cb": "abc"}),
    "no numbers": encoded("ViewerCameraMessage", **{**CAMERA, "position": "abc"}),
    "no number": encoded("ViewerCameraMessage", **{**CAMERA, "image_height": "abc"}),
    "no quaternion": encoded("ViewerCameraMessage", **{**CAMERA, "wxyz": None}),
    "too large": b"\x00" * (2**23 + 1),
}


@pytest.mark.slow
@pytest.mark.parametrize("known", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["at first", "later"])
@pytest.mark.parametrize("what", NONSENSE)
def test_a_page_that_sends_nonsense_loses_only_itself(
    served: Viewer, what: str, known: bool, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    with speaking(served.url) as say:
        wait_until(lambda: len(served.pages) == 1, "the page of another")
        (other,) = served.pages
        with connected(served.url) as connection:
            if known:
                connection.send(encoded("ViewerCameraMessage", **CAMERA))
                wait_until(lambda: len(served.pages) == 2, "its page")
            connection.send(NONSENSE[what])
            with pytest.raises(ConnectionClosed):
                listen(connection)
        wait_until(lambda: served.pages == (other,), "its page is closed")
        say("GuiUpdateMessage", uuid=uuid_of(other, "joint_1 [°]"), updates={"value": 12.0})
        wait_until(lambda: math.isclose(other.state.q[0], math.radians(12.0)), "the other goes on")
    wait_until(lambda: not served.pages, "the other is closed")
    assert_no_traceback(caplog, capfd)


VALUES: Final[tuple[Any, ...]] = (
    *("abc", None, [], {}, [[1]], ["a", 1.0], math.nan, -math.inf, 1e308, 2**64 - 1, -(2**63)),
    *(b"x", "y" * 100_000, "\x1b["),
)


@pytest.mark.slow
@pytest.mark.parametrize(
    "widget",
    [
        "joint_1 [°]",
        *(
            pytest.param(label, marks=pytest.mark.slow)
            for label in ("a₁", "Robot", "Angles in", "Shapes", "Row", "Mode", "Ghost")
        ),
    ],
)
def test_a_widget_takes_any_value_or_its_page_is_closed(
    served: Viewer, widget: str, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    for value in VALUES:
        with contextlib.suppress(ConnectionClosed), speaking(served.url) as say:
            wait_until(lambda: len(served.pages) == 1, "the page")
            (page,) = served.pages
            chosen, slider = (uuid_of(page, label) for label in (widget, "joint_3 [m]"))
            say("GuiUpdateMessage", uuid=chosen, updates={"value": value})
            say("GuiUpdateMessage", uuid=slider, updates={"value": 0.5})
            wait_until(partial(is_closed_or_moved, served), "it goes on, or is closed")
        wait_until(lambda: not served.pages, "it is closed")
        wait_until(lambda page=page: not page.is_alive, "its thread has ended")  # type: ignore[misc]
        assert_no_traceback(caplog, capfd)


def is_closed_or_moved(served: Viewer) -> bool:
    return not any(page.state.q[2] != 0.5 for page in served.pages)


def listen(connection: Any) -> None:
    """Receive until the connection is closed."""
    while True:
        connection.recv(timeout=DEADLINE)


def uuid_of(page: Page, label: str) -> str:
    """What the browser calls a widget."""

    def found() -> list[str]:
        handles = list(page.client.gui._gui_input_handle_from_uuid.values())
        return [handle._impl.uuid for handle in handles if getattr(handle, "label", None) == label]

    wait_until(lambda: bool(found()), f"the widget {label}")
    return found()[0]


def assert_no_traceback(caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]) -> None:
    said = "".join(capfd.readouterr())
    assert said == ""
    for record in caplog.records:
        if record.levelno >= logging.WARNING and record.getMessage() != "opening handshake failed":
            assert record.exc_info is None, record
            assert record.getMessage().startswith("dh2sim: a page was closed: ")
            assert record.getMessage().isprintable()
    assert threading.active_count() < 50
