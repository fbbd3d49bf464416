"""Widgets and the state: nothing that is typed is undone, and what is shown is the state in the end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeAlias

import pytest

from dh2sim.view.events import Notify
from dh2sim.view.panel.bound import Bound, bind
from dh2sim.view.server import start_server, stop_server
from tests.view.on_page import wait_until
from tests.view.without_browser import speaking

Field: TypeAlias = "tuple[Bound[str], Callable[[str], None], list[Callable[[], None]]]"


@pytest.fixture
def typed() -> Iterator[Field]:
    """A field of a server, what types into it from a page, and what says that an event was worked through."""
    server = start_server("127.0.0.1", 0)
    events: list[Callable[[], None]] = []
    try:
        field = server.gui.add_text("field", "before")

        def send(task: object, *, on_start: Callable[[], None] | None = None) -> None:
            assert on_start is not None
            events.append(on_start)

        bound = bind(field, send, lambda text: Notify(notice=text))
        with speaking(f"http://127.0.0.1:{server.get_port()}") as say:

            def type_in(text: str) -> None:
                before = len(events)
                say("GuiUpdateMessage", uuid=field._impl.uuid, updates={"value": text})
                wait_until(lambda: len(events) > before, "the event")

            wait_until(lambda: len(server.get_clients()) == 1, "the page")
            yield bound, type_in, events
    finally:
        stop_server(server)


def test_what_was_typed_since_is_not_undone(typed: Field) -> None:
    bound, type_in, seen = typed
    type_in("1")
    type_in("12")
    seen[0]()
    bound.show("1")
    assert bound.handle.value == "12"
    seen[1]()
    bound.show("12")
    assert bound.handle.value == "12"


def test_a_value_that_the_state_refuses_is_restored(typed: Field) -> None:
    bound, type_in, seen = typed
    type_in("1000")
    seen[0]()
    bound.show("90")
    assert bound.handle.value == "90"


def test_typing_before_the_field_was_written_is_shown_again(typed: Field) -> None:
    bound, type_in, seen = typed
    type_in("typed")
    bound.show("written")
    assert bound.handle.value == "written"
    seen[0]()
    bound.show("typed")
    assert bound.handle.value == "typed"
