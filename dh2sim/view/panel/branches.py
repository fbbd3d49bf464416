"""The branches of the Pose tab: where the robot is, and all ways to hold tool0, in a list to click through."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from dh2sim.robot.units import AngleUnit
from dh2sim.view.branches import Branches, branch_name_of, branches_of
from dh2sim.view.events import Event, Notify, SetJoints, Show
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Send, bind
from dh2sim.view.state import Mode, Part, ViewState

if TYPE_CHECKING:
    import viser

NAMELESS: Final = "–"
_DIGITS: Final = {AngleUnit.DEG: 1, AngleUnit.RAD: 3}


class BranchList:
    """A folder of the Pose tab; what is in it is computed while its checkbox is on alone."""

    def __init__(self, client: viser.ClientHandle, send: Send, state: ViewState) -> None:
        """Add the widgets to viser's current container."""
        self._gui, self._send = client.gui, send
        self._folder = client.gui.add_folder("Branches")
        self._buttons: Any = None
        self._branches: Branches | None = None
        with self._folder:
            self._here = client.gui.add_html("")
            hint = "All ways to hold tool0 where it is, inside the limits, as pale robots"
            box = client.gui.add_checkbox("All in scene", Part.BRANCHES in state.shown, hint=hint)
            self._box = bind(box, send, lambda on: Show(part=Part.BRANCHES, on=on))
            self._list = client.gui.add_html("")
        self._shown: object = None

    def show(self, state: ViewState) -> None:
        """Show a state."""
        self._box.show(Part.BRANCHES in state.shown)
        on = Part.BRANCHES in state.shown and state.mode is Mode.MANUAL
        shown = (state.model, state.q, state.angle, on)
        if shown == self._shown:
            return
        self._shown = shown
        name = branch_name_of(state)
        self._here.content = markup.lines([("branch", markup.text(name or NAMELESS))], name="branch")
        self._branches = branches_of(state) if on else None
        self._list.content = "" if self._branches is None else branches_markup(state, self._branches)
        count = 0 if self._branches is None else len(self._branches.branches)
        self._show_buttons(tuple(str(number) for number in range(1, count + 1)))

    def _show_buttons(self, options: tuple[str, ...]) -> None:
        """Show a button for each branch; the group is replaced where their number changes."""
        if self._buttons is not None and tuple(self._buttons.options) != options:
            self._buttons.remove()
            self._buttons = None
        if options and self._buttons is None:
            with self._folder:
                self._buttons = self._gui.add_button_group("Go to", options)
            self._buttons.on_click(self._clicked)

    async def _clicked(self, press: Any) -> None:
        number = str(press.target.value)
        self._send(lambda: self._go(number))

    def _go(self, number: str) -> None:
        event = go_to(self._branches, number)
        self._send(event)


def go_to(branches: Branches | None, number: str) -> Event:
    """Return the event that moves the robot to a branch of the list."""
    known = {} if branches is None else {str(i): branch for i, branch in enumerate(branches.branches, start=1)}
    if number not in known:
        return Notify(notice="This branch is no longer in the list.")
    return SetJoints(q=known[number].q)


def branches_markup(state: ViewState, branches: Branches) -> str:
    """Return the list of branches with their joint coordinates, HTML."""
    joints = state.model.moving_joints
    degrees = state.angle is AngleUnit.DEG

    def cell(value: float, *, turns: bool) -> str:
        if not turns:
            return f"{value:.3f}"
        return f"{(math.degrees(value) if degrees else value) + 0.0:.{_DIGITS[state.angle]}f}"

    pairs: list[tuple[str, str]] = []
    for number, branch in enumerate(branches.branches, start=1):
        name = markup.text(branch.name or NAMELESS)
        values = zip(branch.q, joints, strict=True)
        pairs.append((str(number), f"<b>{name}</b>, here" if branch.here else name))
        pairs.append(("", " ".join(cell(value, turns=joint.type.turns) for value, joint in values)))
    count = len(branches.branches)
    text = "1 way" if count == 1 else f"{count} ways"
    stay = "stays" if len(branches.locked) == 1 else "stay"
    held = f" while {markup.text(', '.join(branches.locked))} {stay}" if branches.locked else ""
    unit = "°" if degrees else "rad"
    what = "the point of tool0" if branches.point_only else "tool0"
    note = markup.note(f"{text} to hold {what} here{held}, inside the limits; {unit} and m")
    return note + markup.lines(pairs, name="branches")
