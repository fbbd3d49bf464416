"""Widgets bound to the state: what a user does becomes an event, and the state is shown without talking back.

A widget that is told what its user has just typed would undo what was typed since. So each knows the value that the
widget has as far as events were worked through, and is told only what differs from that.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

if TYPE_CHECKING:
    from dh2sim.view.events import Event

Value = TypeVar("Value")


class Send(Protocol):
    """How widgets tell the page what was done."""

    def __call__(self, task: Event | Callable[[], None], *, seen: Callable[[], None] | None = None) -> None:
        """Queue an event, or something to do in its turn; ``seen`` is called when it is worked through."""


@dataclass(slots=True)
class Bound(Generic[Value]):
    """A widget with a value."""

    handle: Any
    known: Value
    """What the widget shows, as far as events were worked through."""

    def show(self, value: Value) -> None:
        """Make the widget show a value."""
        if value != self.known:
            self.known = value
            self.handle.value = value

    def see(self, value: Value) -> None:
        """Note what the user has set."""
        self.known = value


def bind(handle: Any, send: Send, event: Callable[[Any], Event | Callable[[], None]]) -> Bound[Any]:
    """Send the event that a widget's new value stands for, whenever a user changes it.

    Args:
        handle: A viser widget with a value.
        send: Where events go.
        event: From a value; or something to do.
    """
    bound = Bound(handle, handle.value)

    async def changed(change: Any) -> None:  # async: runs on viser's own loop, so that order is kept
        if change.client is None:  # set from here, not by a user
            return
        value = handle.value
        send(event(value), seen=lambda: bound.see(value))

    handle.on_update(changed)
    return bound


def on_click(handle: Any, send: Send, action: Callable[[], Event | Callable[[], None]]) -> None:
    """Send what a button stands for, whenever it is pressed."""

    async def clicked(_press: Any) -> None:
        send(action())

    handle.on_click(clicked)
