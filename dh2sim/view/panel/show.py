"""What is drawn."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from dh2sim.view.events import Compare, CompareReading, Event, Show
from dh2sim.view.ghost import told_reading
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Send, bind
from dh2sim.view.panel.keys import KEYS
from dh2sim.view.state import Part, ViewState

if TYPE_CHECKING:
    import viser

_WORDS = {
    Part.SHAPES: "Robot",
    Part.FRAMES: "DH frames",
    Part.FRAME_NAMES: "Names of frames",
    Part.ANNOTATIONS: "Row explained",
    Part.TRACE: "Trace of tool0",
    Part.GHOST: "Ghost",
    Part.HANDLE: "Handle to drag tool0",
    Part.GRID: "Grid",
}


_NOBODY, _MISREAD = "nobody", "the table misread"
_GHOSTS: dict[str, Event] = {_NOBODY: Compare(ghost=None), _MISREAD: CompareReading()}


class ShowTab:
    """A box to tick for each part of the scene."""

    def __init__(self, client: viser.ClientHandle, send: Send, state: ViewState) -> None:
        """Add the widgets to viser's current container."""
        self._boxes = {
            part: bind(client.gui.add_checkbox(words, part in state.shown), send, partial(_event, part))
            for part, words in _WORDS.items()
        }
        comparison = client.gui.add_dropdown("Ghost is", tuple(_GHOSTS), initial_value=_chosen(state))
        self._ghost = bind(comparison, send, lambda words: _GHOSTS[words])
        self._gap = client.gui.add_html("")
        pairs = [(f"joint {i}", f"{pair.down} less, {pair.up} more") for i, pair in enumerate(KEYS, start=1)]
        with client.gui.add_folder("Keys", expand_by_default=False):
            client.gui.add_html(markup.lines(pairs, name="keys"))

    def show(self, state: ViewState) -> None:
        """Show a state."""
        for part, box in self._boxes.items():
            box.show(part in state.shown)
        self._ghost.show(_chosen(state))
        compared = state.ghost is not None and Part.GHOST in state.shown
        self._gap.content = markup.note(markup.text(_told(state)) if compared else "", name="ghost")


def _chosen(state: ViewState) -> str:
    return _NOBODY if state.ghost is None else _MISREAD


def _told(state: ViewState) -> str:
    return told_reading(state.spec, state.q) if state.ghost is not None and state.ghost.reading else ""


def _event(part: Part, on: bool) -> Show:
    return Show(part=part, on=on)
