"""Widgets bound to the state: a user's change becomes an event, and the state is shown without echoes.

A widget that is set to what its user has just typed would lose what was typed since. So each remembers the value that
the browser has, as far as events were worked through, and is written only if the state differs from that. If it was
written after the user's event came and before its turn, it keeps what was written.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

if TYPE_CHECKING:
    from dh2sim.view.events import Event

Value = TypeVar("Value")


class Send(Protocol):
    """Queues what a widget stands for."""

    def __call__(self, task: Event | Callable[[], None], *, on_start: Callable[[], None] | None = None) -> None:
        """Queue an event or a function; ``on_start`` is called when its turn comes."""


@dataclass(slots=True)
class Bound(Generic[Value]):
    """A widget with a value."""

    handle: Any
    known: Value
    """What the browser shows, as far as events were worked through."""
    writes: int = 0
    """How often the widget was written."""

    def show(self, value: Value) -> None:
        """Make the widget show a value."""
        if value != self.known:
            self.known = value
            self.handle.value = value
            self.writes += 1

    def acknowledge(self, value: Value, writes: int) -> None:
        """Record a user's value, set when the widget had been written ``writes`` times."""
        if writes == self.writes:
            self.known = value


def bind(handle: Any, send: Send, event: Callable[[Any], Event | Callable[[], None]]) -> Bound[Any]:
    """Send the event of a widget's new value whenever a user changes it.

    Args:
        handle: A viser widget with a value.
        send: Queues events.
        event: Returns the event, or a function, for a value.
    """
    bound = Bound(handle, handle.value)

    async def changed(change: Any) -> None:  # async: runs on viser's own loop, which keeps the order
        if change.client is None:  # not by a user
            return
        value, writes = handle.value, bound.writes
        send(event(value), on_start=lambda: bound.acknowledge(value, writes))

    handle.on_update(changed)
    return bound


def on_click(handle: Any, send: Send, action: Callable[[], Event | Callable[[], None]]) -> None:
    """Send the event, or function, that ``action`` returns whenever a button is pressed."""

    async def clicked(_press: Any) -> None:
        send(action())

    handle.on_click(clicked)
