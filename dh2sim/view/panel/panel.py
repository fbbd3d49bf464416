"""The panel of a page: tabs, and a line for what there is to tell.

Files: a robot to open; and to take home the robot file as edited, and the models made of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from dh2sim.export import Format
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Send, on_click
from dh2sim.view.panel.joints import JointsTab, add_keys
from dh2sim.view.panel.motion import MotionTab
from dh2sim.view.panel.pose import PoseTab
from dh2sim.view.panel.show import ShowTab
from dh2sim.view.panel.table import TableTab
from dh2sim.view.panel.uploads import UploadButtons
from dh2sim.view.scene.markers import told_unreached
from dh2sim.view.state import ViewState

if TYPE_CHECKING:
    import viser

    from dh2sim.view.motion.motion_source import Mover
    from dh2sim.view.robot_files import RobotFiles


def add_files(client: viser.ClientHandle, send: Send, uploads: UploadButtons, files: RobotFiles) -> None:
    """Add the buttons to viser's current container."""
    gui = client.gui
    uploads.add("Open a robot file", files.open)
    checked = "Compared with the table before it is handed out"
    on_click(gui.add_button("Save robot file"), send, lambda: files.save)
    on_click(gui.add_button("Save URDF", hint=checked), send, lambda: lambda: files.export(Format.URDF))
    on_click(gui.add_button("Save MJCF", hint=checked), send, lambda: lambda: files.export(Format.MJCF))
    on_click(gui.add_button("Back to the opened file", hint="Forgets all edits"), send, lambda: files.back)


class Panel:
    """All widgets of a page."""

    def __init__(
        self,
        client: viser.ClientHandle,
        send: Send,
        state: ViewState,
        files: RobotFiles,
        mover: Mover,
    ) -> None:
        """Add the widgets.

        Args:
            client: The page's viser client.
            send: Where events go.
            state: To begin with.
            files: What the buttons for files do.
            mover: What lets somebody else move the joints.
        """
        self._gui = client.gui
        self._name = ""
        self._uploads = uploads = UploadButtons(client, send)
        self._notice = client.gui.add_html("")
        tabs = client.gui.add_tab_group()
        with tabs.add_tab("Joints") as joints:
            self._joints = JointsTab(client, joints, send, state)
        with tabs.add_tab("Table") as table:
            self._table = TableTab(client, table, send, state)
        with tabs.add_tab("Pose"):
            self._pose = PoseTab(client, send, state)
        with tabs.add_tab("Motion"):
            self._motion = MotionTab(client, send, mover)
        with tabs.add_tab("Show"):
            self._parts = ShowTab(client, send, state, uploads, files)
        with tabs.add_tab("Files"):
            add_files(client, send, uploads, files)
        add_keys(client, send)

    def show(self, state: ViewState) -> None:
        """Show a state."""
        if state.spec.name != self._name:
            self._name = state.spec.name
            self._gui.set_panel_label(f"dh2sim · {self._name}")
        notice = " ".join(told for told in (state.notice, told_unreached(state)) if told)
        self._notice.content = markup.note(
            markup.lines_of_text(notice), wrong=bool(state.draft.complaints), name="notice"
        )
        self._joints.show(state)
        self._table.show(state)
        self._parts.show(state)
        self._pose.show(state)
        self._motion.show(state)

    def settle(self, state: ViewState) -> None:
        """Show what takes a while to find out."""
        self._pose.settle(state)
