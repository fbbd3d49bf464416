"""The panel of a page: tabs, and a line for what there is to tell."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Send
from dh2sim.view.panel.files import FileActions, add_files
from dh2sim.view.panel.joints import JointsTab
from dh2sim.view.panel.keys import add_keys
from dh2sim.view.panel.motion import MotionTab, Mover
from dh2sim.view.panel.pose import PoseTab
from dh2sim.view.panel.show import ShowTab
from dh2sim.view.panel.table import TableTab
from dh2sim.view.state import ViewState

if TYPE_CHECKING:
    import viser


class Panel:
    """All widgets of a page."""

    def __init__(
        self,
        client: viser.ClientHandle,
        send: Send,
        state: ViewState,
        files: FileActions,
        mover: Mover,
        compare: Callable[[str], None],
    ) -> None:
        """Add the widgets.

        Args:
            client: The page's viser client.
            send: Where events go.
            state: To begin with.
            files: What the buttons for files do.
            mover: What lets somebody else move the joints.
            compare: Draws a robot that comes with dh2sim, given its name, beside the one that is shown.
        """
        client.gui.set_panel_label(f"dh2sim · {state.spec.name}")
        self._notice = client.gui.add_html("")
        tabs = client.gui.add_tab_group()
        with tabs.add_tab("Joints") as joints:
            self._joints = JointsTab(client, joints, send, state)
        with tabs.add_tab("Table"):
            self._table = TableTab(client, send, state)
        with tabs.add_tab("Pose"):
            self._pose = PoseTab(client, send, state)
        with tabs.add_tab("Motion"):
            self._motion = MotionTab(client, send, mover)
        with tabs.add_tab("Show"):
            self._parts = ShowTab(client, send, state, compare)
        with tabs.add_tab("Files"):
            add_files(client, send, files)
        add_keys(client, send)

    def show(self, state: ViewState) -> None:
        """Show a state."""
        self._notice.content = markup.note(
            markup.text(state.notice), wrong=bool(state.draft.complaints), name="notice"
        )
        self._joints.show(state)
        self._table.show(state)
        self._parts.show(state)
        self._pose.show(state)
        self._motion.show(state)

    def settle(self, state: ViewState) -> None:
        """Show what takes a while to find out."""
        self._pose.settle(state)
