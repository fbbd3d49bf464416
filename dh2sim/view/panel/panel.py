"""The panel of a page: the robot, notices, and tabs; of these, what to show and files are defined here."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from dh2sim.errors import Dh2simError
from dh2sim.export import Format
from dh2sim.robot.catalog import builtin_robots
from dh2sim.robot.yaml_tree import MAX_BYTES
from dh2sim.view.events import Compare, CompareMisread, Event, SetOpacity, Show
from dh2sim.view.initial_state import file_name
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Send, bind, on_click
from dh2sim.view.panel.joints import KEYS, JointsTab, add_keys
from dh2sim.view.panel.motion import MotionTab
from dh2sim.view.panel.pose import PoseTab
from dh2sim.view.panel.table import TableTab
from dh2sim.view.scene.ghost import ghost_text, misread_text
from dh2sim.view.scene.scene import goal_text
from dh2sim.view.state import Part, ViewState

if TYPE_CHECKING:
    import viser

    from dh2sim.view.motion.motion_source import MotionControl
    from dh2sim.view.robot_files import RobotFiles

UseFile: TypeAlias = Callable[[bytes, str], None]
"""Takes the content and the name of an uploaded file."""

_PART_LABELS: Final = {
    Part.SHAPES: "Shapes",
    Part.FRAMES: "DH frames",
    Part.FRAME_NAMES: "Frame names",
    Part.ANNOTATIONS: "Explained row",
    Part.TRACE: "Path of tool0",
    Part.GHOST: "Show ghost",
    Part.HANDLE: "Handle to drag tool0",
    Part.ELLIPSOID: "Velocity ellipsoid",
    Part.FORCE: "Force ellipsoid",
    Part.WORKSPACE: "Reachable points",
    Part.SECTION: "Section of the workspace",
    Part.BRANCHES: "All branches",
    Part.GRID: "Floor",
    Part.SHADING: "Soft shading",
}
_HINTS: Final = {Part.SHADING: "A browser without a graphics card draws twice as fast without it"}
_NO_GHOST, _MISREAD = "none", "this table, misread"


class Panel:
    """All widgets of a page."""

    def __init__(
        self, client: viser.ClientHandle, send: Send, state: ViewState, files: RobotFiles, motion: MotionControl
    ) -> None:
        """Add the widgets.

        Args:
            client: The page's viser client.
            send: Queues events.
            state: The initial state.
            files: The actions of the buttons for files.
            motion: Starts simulations and recordings.
        """
        self._gui = client.gui
        self._name = ""
        self._notice = client.gui.add_html("")
        chooser = client.gui.add_dropdown("Robot", files.robots, initial_value=files.chosen)
        self._robot = bind(chooser, send, lambda name: partial(files.choose, name))
        self._files = files
        tabs = client.gui.add_tab_group()
        with tabs.add_tab("Joints") as joints:
            self._joints = JointsTab(client, joints, send, state)
        with tabs.add_tab("Table") as table:
            self._table = TableTab(client, table, send, state)
        with tabs.add_tab("Pose"):
            self._pose = PoseTab(client, send, state)
        with tabs.add_tab("Motion"):
            self._motion = MotionTab(client, send, motion)
        with tabs.add_tab("Show"):
            self._parts = ShowTab(client.gui, send, state, files)
        with tabs.add_tab("Files"):
            _add_files(client.gui, send, files)
        add_keys(client, send)

    def show(self, state: ViewState) -> None:
        """Show a state."""
        if state.spec.name != self._name:
            self._name = state.spec.name
            self._gui.set_panel_label(f"dh2sim · {self._name}")
        notice = " ".join(text for text in (state.notice, goal_text(state)) if text)
        self._notice.content = markup.banner(
            markup.lines_of_text(notice), error=bool(state.table.errors), name="notice"
        )
        if tuple(self._robot.handle.options) != self._files.robots:
            self._robot.handle.options = self._files.robots
        self._robot.show(self._files.chosen)
        self._joints.show(state)
        self._table.show(state)
        self._parts.show(state)
        self._pose.show(state)
        self._motion.show(state)

    def show_slow(self, state: ViewState) -> None:
        """Show what takes a while to compute."""
        self._pose.show_slow(state)
        self._table.show_slow(state)


class ShowTab:
    """A checkbox for each part of the scene, the ghost, and the keys."""

    def __init__(self, gui: viser.GuiApi, send: Send, state: ViewState, files: RobotFiles) -> None:
        """Add the widgets to viser's current container."""
        self._boxes = {
            part: bind(
                gui.add_checkbox(label, part in state.shown, hint=_HINTS.get(part)), send, partial(_show, part)
            )
            for part, label in _PART_LABELS.items()
        }
        opacity = gui.add_slider("Robot opacity", min=0.0, max=1.0, step=0.05, initial_value=state.opacity)
        self._opacity = bind(opacity, send, lambda value: SetOpacity(opacity=value))
        self._always = (_NO_GHOST, _MISREAD, *builtin_robots())
        chooser = gui.add_dropdown("Ghost", self._ghosts(state), initial_value=_chosen(state))
        self._ghost = bind(chooser, send, partial(_compare, files.compare))
        add_upload_button(gui, send, "Compare with a robot file", files.compare_uploaded)
        self._offset = gui.add_html("")
        pairs = [
            (f"joint {i}", f"{pair.down} to decrease, {pair.up} to increase") for i, pair in enumerate(KEYS, start=1)
        ]
        with gui.add_folder("Keys", expand_by_default=False):
            gui.add_html(markup.lines(pairs, name="keys"))

    def show(self, state: ViewState) -> None:
        """Show a state."""
        for part, box in self._boxes.items():
            box.show(part in state.shown)
        self._opacity.show(state.opacity)
        if tuple(self._ghost.handle.options) != self._ghosts(state):
            self._ghost.handle.options = self._ghosts(state)
        self._ghost.show(_chosen(state))
        visible = state.ghost is not None and Part.GHOST in state.shown
        self._offset.content = markup.note(markup.text(_ghost_text(state)) if visible else "", name="ghost")

    def _ghosts(self, state: ViewState) -> tuple[str, ...]:
        """Return the ghosts to choose from, including an uploaded one."""
        return self._always if _chosen(state) in self._always else (*self._always, _chosen(state))


def _show(part: Part, on: bool) -> Show:
    return Show(part=part, on=on)


def _chosen(state: ViewState) -> str:
    if state.ghost is None:
        return _NO_GHOST
    return _MISREAD if state.ghost.misread else state.ghost.label


def _compare(compare: Callable[[str], None], chosen: str) -> Event | Callable[[], None]:
    if chosen == _NO_GHOST:
        return Compare(ghost=None)
    return CompareMisread() if chosen == _MISREAD else partial(compare, chosen)


def _ghost_text(state: ViewState) -> str:
    if state.ghost is None:
        return ""
    if state.ghost.misread:
        return misread_text(state.spec, state.q)
    return ghost_text(state.ghost.model, state.model, state.q)


def _add_files(gui: viser.GuiApi, send: Send, files: RobotFiles) -> None:
    """Add the buttons for files to viser's current container."""
    add_upload_button(gui, send, "Open a robot file", files.open)
    verified = "Verified against the table before the download"
    on_click(gui.add_button("Save robot file"), send, lambda: files.save)
    on_click(gui.add_button("Save URDF", hint=verified), send, lambda: lambda: files.export(Format.URDF))
    on_click(gui.add_button("Save MJCF", hint=verified), send, lambda: lambda: files.export(Format.MJCF))
    on_click(gui.add_button("Reopen the first file", hint="Drops all edits"), send, lambda: files.reopen)


def add_upload_button(gui: viser.GuiApi, send: Send, label: str, use: UseFile) -> None:
    """Add a button to viser's current container that uploads a robot file.

    viser puts a file together before it can be checked. What is larger than a robot file may be goes no further, and
    the button keeps no more than the last file.
    """
    button = gui.add_upload_button(label, mime_type=".yaml,.yml")

    async def uploaded(_event: Any) -> None:
        name, content = file_name(str(button.value.name)), button.value.content
        size = len(content)
        send(partial(_refuse, name, size) if size > MAX_BYTES else partial(use, content, name))

    button.on_upload(uploaded)


def _refuse(name: str, size: int) -> None:
    raise Dh2simError(f"{name} has {size} bytes; at most {MAX_BYTES} are allowed.")
