"""What is drawn."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from dh2sim.robot.read import builtin_robots
from dh2sim.view.events import Compare, CompareReading, Event, Show
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Send, bind
from dh2sim.view.panel.joints import KEYS
from dh2sim.view.panel.uploads import UploadButtons
from dh2sim.view.scene.ghost import told_ghost, told_reading
from dh2sim.view.state import Part, ViewState

if TYPE_CHECKING:
    import viser

    from dh2sim.view.robot_files import RobotFiles

_WORDS = {
    Part.SHAPES: "Robot",
    Part.FRAMES: "DH frames",
    Part.FRAME_NAMES: "Names of frames",
    Part.ANNOTATIONS: "Row explained",
    Part.TRACE: "Trace of tool0",
    Part.GHOST: "Ghost",
    Part.HANDLE: "Handle to drag tool0",
    Part.GRID: "Grid",
    Part.SHADING: "Soft shading",
}
_HINTS = {Part.SHADING: "Without it, a browser that has no graphics card draws twice as fast"}
_NOBODY, _MISREAD = "nobody", "the table misread"


class ShowTab:
    """A box to tick for each part of the scene."""

    def __init__(
        self,
        client: viser.ClientHandle,
        send: Send,
        state: ViewState,
        uploads: UploadButtons,
        files: RobotFiles,
    ) -> None:
        """Add the widgets to viser's current container."""
        self._boxes = {
            part: bind(
                client.gui.add_checkbox(words, part in state.shown, hint=_HINTS.get(part)),
                send,
                partial(_event, part),
            )
            for part, words in _WORDS.items()
        }
        self._always = (_NOBODY, _MISREAD, *builtin_robots())
        chooser = client.gui.add_dropdown("Ghost is", self._ghosts(state), initial_value=_chosen(state))
        self._ghost = bind(chooser, send, partial(_ghost, files.compare))
        uploads.add("Compare with a robot file", files.compare_uploaded)
        self._gap = client.gui.add_html("")
        pairs = [(f"joint {i}", f"{pair.down} less, {pair.up} more") for i, pair in enumerate(KEYS, start=1)]
        with client.gui.add_folder("Keys", expand_by_default=False):
            client.gui.add_html(markup.lines(pairs, name="keys"))

    def show(self, state: ViewState) -> None:
        """Show a state."""
        for part, box in self._boxes.items():
            box.show(part in state.shown)
        if tuple(self._ghost.handle.options) != self._ghosts(state):
            self._ghost.handle.options = self._ghosts(state)
        self._ghost.show(_chosen(state))
        compared = state.ghost is not None and Part.GHOST in state.shown
        self._gap.content = markup.note(markup.text(_told(state)) if compared else "", name="ghost")

    def _ghosts(self, state: ViewState) -> tuple[str, ...]:
        """Return what there is to compare with: besides what always is, the robot that was uploaded for that."""
        return self._always if _chosen(state) in self._always else (*self._always, _chosen(state))


def _chosen(state: ViewState) -> str:
    if state.ghost is None:
        return _NOBODY
    return _MISREAD if state.ghost.reading else state.ghost.label


def _ghost(compare: Callable[[str], None], chosen: str) -> Event | Callable[[], None]:
    if chosen == _NOBODY:
        return Compare(ghost=None)
    return CompareReading() if chosen == _MISREAD else partial(compare, chosen)


def _told(state: ViewState) -> str:
    if state.ghost is None:
        return ""
    if state.ghost.reading:
        return told_reading(state.spec, state.q)
    return told_ghost(state.ghost.model, state.model, state.q)


def _event(part: Part, on: bool) -> Show:
    return Show(part=part, on=on)
