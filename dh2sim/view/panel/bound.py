"""Widgets bound to the state: what a user does becomes an event, and the state is shown without talking back.

A widget that is told what its user has just typed would undo what was typed since. So each knows the value that the
widget has as far as events were worked through, and is told only what differs from that. Where it was told something
after the user's event had come, and before that was worked through, it shows what it was told.
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
    told: int = 0
    """How often the widget was told a value."""

    def show(self, value: Value) -> None:
        """Make the widget show a value."""
        if value != self.known:
            self.known = value
            self.handle.value = value
            self.told += 1

    def see(self, value: Value, told: int) -> None:
        """Note what the user had set when the widget had been told a value so often."""
        if told == self.told:
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
        value, told = handle.value, bound.told
        send(event(value), seen=lambda: bound.see(value, told))

    handle.on_update(changed)
    return bound


def on_click(handle: Any, send: Send, action: Callable[[], Event | Callable[[], None]]) -> None:
    """Send what a button stands for, whenever it is pressed."""

    async def clicked(_press: Any) -> None:
        send(action())

    handle.on_click(clicked)
