"""Links of a simulated robot, to be grabbed with the mouse and pulled."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from dh2sim.view.events import LetGo, PullLink
from dh2sim.view.scene.markers import grabbed_point
from dh2sim.view.scene.scene import ROBOT
from dh2sim.view.state import Mode, Pull, ViewState

if TYPE_CHECKING:
    import viser

    from dh2sim.view.panel.bound import Send
    from dh2sim.view.scene.items import Vector
    from dh2sim.view.scene.painter import Painter


class LinkGrabs:
    """Listens to drags on links while physics is on; at other times, and beside the robot, they move the camera."""

    def __init__(self, painter: Painter, send: Send, state: Callable[[], ViewState]) -> None:
        """Listen to nothing yet.

        Args:
            painter: Has drawn the links.
            send: Where events go.
            state: Returns the state at hand, from any thread.
        """
        self._painter = painter
        self._send = send
        self._state = state
        self._listening: dict[str, Any] = {}
        self._held: tuple[str, Vector] | None = None
        """The link, and which point of it; of viser's thread alone."""

    def show(self, state: ViewState) -> None:
        """Listen to the links that are drawn, or to none; a solid that was exchanged is listened to again."""
        wanted = self._links(state) if state.mode is Mode.PHYSICS else {}
        for name, handle in self._painter.solids().items():
            if name in self._listening and name not in wanted and self._listening[name] is handle:
                handle.remove_drag_callback("all")
        for name, handle in wanted.items():
            if self._listening.get(name) is not handle:
                handle.on_drag("left")(self._dragged)
        self._listening = wanted

    def _links(self, state: ViewState) -> dict[str, Any]:
        """Return the handles of the solids of links that move."""
        names = {link.name for link in state.model.links}
        return {name: handle for name, handle in self._painter.solids().items() if _link_of(name) in names}

    async def _dragged(self, event: viser.SceneNodeDragEvent[Any]) -> None:  # async: viser keeps their order
        if event.phase == "end":
            self._held = None
            self._send(LetGo())
            return
        if event.phase == "start":
            state, link = self._state(), _link_of(event.target.name)
            self._held = (link, grabbed_point(state.model, state.q, link, event.start_position))
        if self._held is not None:
            link, point = self._held
            self._send(PullLink(pull=Pull(link=link, point_in_link=point, target=event.end_position)))


def _link_of(name: str) -> str:
    """Return the link that an item belongs to; empty if it is none of the robot's."""
    return name.removeprefix(f"{ROBOT}/").split("/")[0] if name.startswith(f"{ROBOT}/") else ""
