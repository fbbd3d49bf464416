"""Dragging with the mouse: the handle of tool0, and the links of a simulated robot."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.kinematics.rotations import rotations_of_quaternions
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.view.events import DragLink, Event, MoveTool, ReleaseLink
from dh2sim.view.scene.link_poses import triad_length
from dh2sim.view.scene.scene import ROBOT, point_in_link
from dh2sim.view.scene.solids import orientation_of, position_of
from dh2sim.view.state import LinkDrag, Matrix, Mode, Part, ViewState

if TYPE_CHECKING:
    import viser

    from dh2sim.view.motion.inverse import HandleKinematics
    from dh2sim.view.panel.bound import Send
    from dh2sim.view.scene.items import Vector
    from dh2sim.view.scene.painter import Painter

NAME: Final = "/handle"
_SCALE: Final = 1.6
"""Of the handle, as a share of the length of frames' axes."""


class ToolHandle:
    """A handle at tool0, or where the user has dragged it; inverse kinematics makes the robot follow."""

    def __init__(
        self, scene: viser.SceneApi, send: Send, state: Callable[[], ViewState], apply: Callable[[Event], None]
    ) -> None:
        """Draw nothing yet.

        Args:
            scene: Where to draw the handle.
            send: Queues a task.
            state: Returns the page's state.
            apply: Applies an event at once.
        """
        self._scene = scene
        self._send = send
        self._state = state
        self._apply = apply
        self._handle: Any = None
        self._scale = 0.0
        self._queued = False
        """Whether a solution is queued; it will use the handle's pose of that time."""
        self._solver: tuple[RobotModel, HandleKinematics] | None = None

    def show(self, state: ViewState) -> None:
        """Show the handle of a state, if it has one."""
        visible = Part.HANDLE in state.shown and state.mode is Mode.MANUAL and state.model.chain.n > 0
        scale = _SCALE * triad_length(state.model) if visible else 0.0
        if scale != self._scale:
            self._scale = scale
            self._replace(scale)
        if self._handle is not None and state.goal is None:
            T = forward_kinematics(state.model.chain, state.q)
            self._handle.position, self._handle.wxyz = position_of(T), orientation_of(T)

    def _replace(self, scale: float) -> None:
        if self._handle is not None:
            self._handle.remove()
            self._handle = None
        if scale > 0.0:
            self._handle = self._scene.add_transform_controls(NAME, scale=scale, depth_test=False)
            self._handle.on_update(self._dragged)

    async def _dragged(self, event: Any) -> None:
        if event.client is not None and not self._queued:
            self._queued = True
            self._send(self._solve)

    def _solve(self) -> None:
        """Bring tool0 to the handle, or as near as possible."""
        self._queued = False
        state = self._state()
        if self._handle is None or state.mode is not Mode.MANUAL:
            return
        T = _pose(self._handle.position, self._handle.wxyz)
        if not np.isfinite(T).all():
            return
        solution = self._kinematics(state.model).solve(state.q, T)
        rows: Matrix = tuple(tuple(row) for row in T.tolist())
        q = tuple(solution.q.tolist())
        self._apply(MoveTool(T_base_link_tool0=rows, q=q, reached=solution.reached))

    def _kinematics(self, model: RobotModel) -> HandleKinematics:
        from dh2sim.view.motion.inverse import HandleKinematics

        if self._solver is None or self._solver[0] is not model:
            self._solver = (model, HandleKinematics(model))
        return self._solver[1]


def _pose(position: Array, wxyz: Array) -> Array:
    """Return the pose, shape (4, 4), of a position and a quaternion of any length; not finite if that is zero."""
    T = np.eye(4)
    with np.errstate(invalid="ignore"):
        T[:3, :3] = rotations_of_quaternions(np.asarray(wxyz, dtype=np.float64) / np.linalg.norm(wxyz))
    T[:3, 3] = position
    return T


class LinkGrabs:
    """Lets the user drag links while physics is on; in other modes, and next to the robot, drags move the camera."""

    def __init__(self, painter: Painter, send: Send, state: Callable[[], ViewState]) -> None:
        """Listen to nothing yet.

        Args:
            painter: Draws the links.
            send: Queues an event.
            state: Returns the page's state, in any thread.
        """
        self._painter = painter
        self._send = send
        self._state = state
        self._listening: dict[str, Any] = {}
        self._grabbed: tuple[str, Vector] | None = None
        """The link, and the point of it in its frame; used on viser's thread alone."""

    def show(self, state: ViewState) -> None:
        """Listen to the links that are drawn while physics is on, again after a solid was replaced."""
        links = self._links(state) if state.mode is Mode.PHYSICS else {}
        for name, handle in self._painter.solids().items():
            if name in self._listening and name not in links and self._listening[name] is handle:
                handle.remove_drag_callback("all")
        for name, handle in links.items():
            if self._listening.get(name) is not handle:
                handle.on_drag("left")(self._dragged)
        self._listening = links

    def _links(self, state: ViewState) -> dict[str, Any]:
        """Return the handles of the solids of links that move."""
        names = {link.name for link in state.model.moving_links}
        return {name: handle for name, handle in self._painter.solids().items() if _link_of(name) in names}

    async def _dragged(self, event: viser.SceneNodeDragEvent[Any]) -> None:  # async: viser keeps the order of events
        if event.phase == "end":
            self._grabbed = None
            self._send(ReleaseLink())
            return
        if event.phase == "start":
            state, link = self._state(), _link_of(event.target.name)
            self._grabbed = (link, point_in_link(state.model, state.q, link, event.start_position))
        if self._grabbed is not None:
            link, point = self._grabbed
            self._send(DragLink(drag=LinkDrag(link=link, point_in_link=point, target=event.end_position)))


def _link_of(name: str) -> str:
    """Return the link that an item of the scene belongs to; empty if it is none of the robot's."""
    return name.removeprefix(f"{ROBOT}/").split("/")[0] if name.startswith(f"{ROBOT}/") else ""
