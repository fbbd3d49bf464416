"""Keys that move joints: each joint has one for less and one for more."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal

from dh2sim.view.events import Nudge

if TYPE_CHECKING:
    import viser

    from dh2sim.view.panel.bound import Send


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyPair:
    """The keys of a joint, as a user names them."""

    down: str
    up: str


KEYS: Final = tuple(
    KeyPair(down=down, up=up)
    for down, up in (("1", "3"), ("4", "6"), ("7", "9"), ("R", "Y"), ("F", "H"), ("V", "N"), ("G", "Shift+G"))
)
"""Of joints 1 to 7: the rows of a keyboard's number block, then of its letters."""


ARROWS_ARE_THE_SLIDERS: Final = """<img hidden src="data:," onerror="
if (!document.body.dataset.dh2sim) {
    document.body.dataset.dh2sim = 'arrows';
    document.body.addEventListener('keydown', (event) => {
        if (event.key.startsWith('Arrow') && event.target.closest('[role=slider]')) event.stopPropagation();
    });
}">"""
"""viser turns the eye at arrow keys, also at those that move a slider; by here the slider has seen them."""


def add_keys(client: viser.ClientHandle, send: Send) -> None:
    """Make a page listen to the keys; they do nothing while the user types into a field."""
    client.gui.add_html(ARROWS_ARE_THE_SLIDERS)
    for joint, pair in enumerate(KEYS):
        _add(client, send, pair.down, joint, -1)
        _add(client, send, pair.up, joint, 1)


def _add(client: viser.ClientHandle, send: Send, key: str, joint: int, direction: Literal[-1, 1]) -> None:
    *modifier, letter = key.split("+")
    command = client.gui.add_command(
        f"Joint {joint + 1}: {'more' if direction > 0 else 'less'}",
        description="3 degrees, or 1 % of a sliding joint's travel",
        hotkey=letter,  # type: ignore[arg-type]
        modifier="shift" if modifier else None,
    )

    async def pressed(_press: Any) -> None:
        send(Nudge(joint=joint, direction=direction))

    command.on_trigger(pressed)
