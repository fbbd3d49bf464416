"""The workspace of the Pose tab: what to show of it, how far its search is, and its numbers."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

from dh2sim.view.events import Show
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Send, bind
from dh2sim.view.state import Part, ViewState

if TYPE_CHECKING:
    import viser

    from dh2sim.workspace.workspace import Workspace

_BOXES: Final = {
    Part.WORKSPACE: ("Reachable points", "Coloured by the best manipulability there: dark is 0, bright is the best"),
    Part.CUT: ("Cut open", "Only the points behind base_link's x-z plane, so that those inside are seen"),
    Part.SECTION: (
        "Section in scene",
        "Through tool0; blue where joints' limits bound it, red where singularities do, dots where it is singular",
    ),
}


class ReachFolder:
    """A folder; what it shows is computed in the background when a checkbox is on."""

    def __init__(self, client: viser.ClientHandle, send: Send, state: ViewState) -> None:
        """Add the widgets to viser's current container."""
        with client.gui.add_folder("Workspace of tool0"):
            self._boxes = {
                part: bind(client.gui.add_checkbox(label, part in state.shown, hint=hint), send, partial(_show, part))
                for part, (label, hint) in _BOXES.items()
            }
            self._progress: Any = client.gui.add_progress_bar(0.0, visible=False)
            self._text = client.gui.add_html("")
        self._shown: object = None

    def show(self, state: ViewState) -> None:
        """Show a state."""
        for part, box in self._boxes.items():
            box.show(part in state.shown)
        shown = (state.workspace, state.searching, state.workspace_note, _is_shown(state))
        if shown == self._shown:
            return
        self._shown = shown
        self._progress.visible = state.searching is not None
        if state.searching is not None:
            doing, share = state.searching
            self._progress.value = 100.0 * share
            self._text.content = markup.note(markup.text(f"{doing} …"), name="workspace")
        elif _is_shown(state):
            self._text.content = reach_markup(state.workspace, state.workspace_note)
        else:
            self._text.content = markup.note("", name="workspace")


def _is_shown(state: ViewState) -> bool:
    return bool({Part.WORKSPACE, Part.SECTION} & state.shown)


def _show(part: Part, on: bool) -> Show:
    return Show(part=part, on=on)


def reach_markup(found: Workspace | None, note: str) -> str:
    """Return the numbers of a workspace, HTML."""
    if found is None:
        return markup.note(markup.text(note), name="workspace")
    pairs = [(word, f"{extreme.value:.4f} m") for word, extreme in found.extremes.items()]
    if found.volume is not None:
        pairs.append(("volume", f"{found.volume:.4g} m³"))
    if found.section is not None:
        pairs.append(("section", f"{found.section.area:.4g} m²"))
    elif found.area is not None:
        pairs.append(("area", f"{found.area:.4g} m²"))
    pairs.append(("voxels", f"{len(found.centers):,} of {found.size:g} m"))
    pairs.append(("best manipulability", f"{float(found.manipulability.max(initial=0.0)):.4g}"))
    notes = " ".join((*((note,) if note else ()), *found.notes))
    return markup.lines([(key, markup.text(value)) for key, value in pairs], name="workspace") + markup.note(
        markup.text(notes)
    )
