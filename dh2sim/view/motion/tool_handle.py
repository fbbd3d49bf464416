"""The handle that tool0 is dragged by: a goal for inverse kinematics."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.view.events import Event, MoveTool
from dh2sim.view.panel.bound import Send
from dh2sim.view.scene.robot_size import triad_length
from dh2sim.view.scene.solids import orientation_of, position_of
from dh2sim.view.state import Matrix, Mode, Part, ViewState

if TYPE_CHECKING:
    import viser

    from dh2sim.view.motion.inverse import InverseKinematics

NAME: Final = "/handle"
_SCALE: Final = 1.6
"""Of the handle, as a share of the length of frames' axes."""


class ToolHandle:
    """Stands at tool0, or where the user has dragged it to."""

    def __init__(
        self, scene: viser.SceneApi, send: Send, state: Callable[[], ViewState], apply: Callable[[Event], None]
    ) -> None:
        """Draw nothing yet.

        Args:
            scene: Where the handle will be.
            send: Queues what is to be done.
            state: Returns the state at hand.
            apply: Lets an event happen now.
        """
        self._scene = scene
        self._send = send
        self._state = state
        self._apply = apply
        self._handle: Any = None
        self._scale = 0.0
        self._waits = False
        """Whether a drag is queued; where the handle is then, is read when its turn comes."""
        self._solver: tuple[RobotModel, InverseKinematics] | None = None

    def show(self, state: ViewState) -> None:
        """Show the handle where it belongs, or not at all."""
        wanted = Part.HANDLE in state.shown and state.mode is Mode.STILL and state.model.chain.n > 0
        scale = _SCALE * triad_length(state.model) if wanted else 0.0
        if scale != self._scale:
            self._scale = scale
            self._exchange(scale)
        if self._handle is not None and state.goal is None:
            T = forward_kinematics(state.model.chain, state.q)
            self._handle.position, self._handle.wxyz = position_of(T), orientation_of(T)

    def _exchange(self, scale: float) -> None:
        if self._handle is not None:
            self._handle.remove()
            self._handle = None
        if scale > 0.0:
            self._handle = self._scene.add_transform_controls(NAME, scale=scale, depth_test=False)
            self._handle.on_update(self._dragged)

    async def _dragged(self, event: Any) -> None:
        if event.client is not None and not self._waits:
            self._waits = True
            self._send(self._solve)

    def _solve(self) -> None:
        """Bring tool0 to the handle, or as near as it gets."""
        self._waits = False
        state = self._state()
        if self._handle is None or state.mode is not Mode.STILL:
            return
        T = _pose(self._handle.position, self._handle.wxyz)
        found = self._inverse(state.model).solve(state.q, T)
        rows: Matrix = tuple(tuple(row) for row in T.tolist())
        q = tuple(found.q.tolist())
        self._apply(MoveTool(T_base_link_tool0=rows, q=q, reached=found.reached))

    def _inverse(self, model: RobotModel) -> InverseKinematics:
        from dh2sim.view.motion.inverse import InverseKinematics

        if self._solver is None or self._solver[0] is not model:
            self._solver = (model, InverseKinematics(model))
        return self._solver[1]


def _pose(position: Array, wxyz: Array) -> Array:
    """Return a pose, shape (4, 4), of a position and a quaternion of any length."""
    w, x, y, z = (np.asarray(wxyz, dtype=np.float64) / np.linalg.norm(wxyz)).tolist()
    T = np.eye(4)
    T[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    T[:3, 3] = position
    return T
