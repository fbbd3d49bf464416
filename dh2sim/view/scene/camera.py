"""Where the eye stands: so that the whole robot is seen, until the user moves it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

import numpy as np

from dh2sim.model.robot_model import RobotModel
from dh2sim.view.events import Look
from dh2sim.view.scene.pinhole import Sight, sight_of
from dh2sim.view.scene.robot_size import FIELD, eye_of, size_of

if TYPE_CHECKING:
    import viser

_SAME_ASPECT: Final = 0.01
_SAME_SIGHT: Final = 0.02
"""Turns, rad, and shares of the distance or of the scale, that labels need not be placed anew for."""
_SAME_PLACE: Final = 1e-3
"""As a share of the robot's size: an eye that is no farther from where it was put was not moved by the user."""


def aim(camera: viser.CameraHandle | viser.InitialCameraConfig, model: RobotModel, aspect: float = 1.0) -> None:
    """Make a camera see the whole of a robot, however small or large that is.

    Args:
        camera: A page's own, or that which pages begin with.
        model: The robot.
        aspect: Width of the camera's picture over its height.
    """
    eye, size = eye_of(model, aspect), size_of(model)
    camera.near, camera.far = 1e-3 * size, 1e3 * size
    camera.fov = FIELD
    camera.position = eye.position
    camera.look_at = eye.look_at


class Watch:
    """Tells how a page's camera sees, and aims it again when its picture becomes narrower or wider.

    The latter only where the user has not moved it.
    """

    def __init__(
        self,
        camera: viser.CameraHandle,
        model: Callable[[], RobotModel],
        send: Callable[[Look | Callable[[], None]], None],
    ) -> None:
        """Begin to watch.

        Args:
            camera: Of the page; aimed at the robot already, for a picture that is no higher than wide.
            model: Returns the robot that is shown.
            send: Queues an event, or what is to be done.
        """
        self._camera = camera
        self._model = model
        self._send = send
        self._seen = (model(), 1.0)
        self._told: Sight | None = None
        self._tell()
        camera.on_update(self._changed)

    def look(self) -> None:
        """Aim at the robot that is shown."""
        self._seen = (self._model(), self._aspect)
        aim(self._camera, *self._seen)

    @property
    def _aspect(self) -> float:
        """Of the picture; all that are wider than high are alike."""
        return min(self._camera.aspect, 1.0)

    async def _changed(self, _camera: viser.CameraHandle) -> None:
        self._tell()
        model, aspect = self._seen
        away = float(np.linalg.norm(self._camera.position - np.array(eye_of(model, aspect).position)))
        if abs(self._aspect - aspect) > _SAME_ASPECT and away <= _SAME_PLACE * size_of(model):
            self._send(self.look)

    def _tell(self) -> None:
        """Tell how the camera sees, if that makes a difference."""
        sight = sight_of(self._camera)
        if sight is None:
            return
        distance = float(np.linalg.norm(self._camera.position - self._camera.look_at))
        if self._told is None or not sight.resembles(self._told, _SAME_SIGHT, distance):
            self._told = sight
            self._send(Look(sight=sight))
