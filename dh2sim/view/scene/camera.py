"""The camera of a page: placed so that the whole robot is seen, until the user moves it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, Final

import numpy as np

from dh2sim.draw.projection import Pinhole
from dh2sim.kinematics.rotations import rotations_of_quaternions
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.view.events import SetCamera
from dh2sim.view.scene.ground import ground_of
from dh2sim.view.scene.items import Placed, Solid, Vector, vector
from dh2sim.view.scene.link_poses import frame_origins, robot_size, triad_length
from dh2sim.view.scene.solids import robot_solids

if TYPE_CHECKING:
    import viser

FIELD_OF_VIEW: Final = math.radians(45.0)
"""From top to bottom, rad."""
_NARROWEST: Final = 0.2
"""Aspect ratio of the narrowest picture that the robot is fitted into."""
_DIRECTION: Final = (0.62, -0.68, 0.42)
"""From the robot to the camera."""
_MARGIN: Final = 0.06
"""At each edge of the picture, as a share of it."""
_FRAME: Final = 1.2
"""Radius of a ball around a frame's axes and its name, as a share of their length."""
_HANDLE: Final = 1.5
"""Likewise, around the handle of tool0."""
_SAME_ASPECT: Final = 0.01
_SAME_PINHOLE: Final = 0.02
"""Rotation, rad, and relative change of distance or scale below which labels stay where they are."""
_SAME_PLACE: Final = 1e-3
"""Distance, as a share of the robot's size, up to which the camera counts as not moved by the user."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Viewpoint:
    """Where a camera is, and what it looks at; m, in base_link."""

    position: Vector
    look_at: Vector


def viewpoint_of(model: RobotModel, aspect: float = 1.0) -> Viewpoint:
    """Return the nearest viewpoint from which the whole robot at home is seen, with its frames and its handle.

    A ball at (x, y, z) along right, up and towards the camera, of radius r, is inside a picture whose edge rises by k
    a metre if the camera, at distance D and moved sideways by s, has |x - s| + r sqrt(1 + k²) <= k (D - z). The least
    D with its s follows from the two balls that limit it on either side.

    Args:
        model: The robot.
        aspect: Width of the picture over its height.
    """
    balls = _balls(model)
    back = np.array(_DIRECTION) / np.linalg.norm(_DIRECTION)
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    centre = 0.5 * (balls[:, :3].min(axis=0) + balls[:, :3].max(axis=0))
    offsets, radii = balls[:, :3] - centre, balls[:, 3]
    towards = offsets @ back
    vertical = (1.0 - _MARGIN) * math.tan(0.5 * FIELD_OF_VIEW)
    distance, look_at = 0.5 * robot_size(model), centre.copy()
    for axis, k in ((right, vertical * max(aspect, _NARROWEST)), (up, vertical)):
        sideways, widths = offsets @ axis, radii * math.hypot(1.0, k)
        above = float(((sideways + widths) / k + towards).max())
        below = float(((widths - sideways) / k + towards).max())
        distance = max(distance, 0.5 * (above + below))
        look_at += 0.5 * k * (above - below) * axis
    return Viewpoint(position=vector(look_at + distance * back), look_at=vector(look_at))


def aim(camera: viser.CameraHandle | viser.InitialCameraConfig, model: RobotModel, aspect: float = 1.0) -> None:
    """Make a camera show the whole of a robot, however small or large.

    Args:
        camera: That of a page, or the initial one of all pages.
        model: The robot.
        aspect: Width of the camera's picture over its height.
    """
    viewpoint, size = viewpoint_of(model, aspect), robot_size(model)
    camera.near, camera.far = 1e-3 * size, 1e3 * size
    camera.fov = FIELD_OF_VIEW
    camera.position = viewpoint.position
    camera.look_at = viewpoint.look_at


def pinhole_of(camera: viser.CameraHandle) -> Pinhole | None:
    """Return the model of a page's camera, or None if the browser sent nothing usable.

    viser's cameras follow OpenCV: x to the right, y down, z ahead. The unit quaternion (w, v) turns a vector
    x into x + 2 v × (v × x + w x).
    """
    height, field_of_view = float(camera.image_height), float(camera.fov)
    if not (height > 0.0 and 0.0 < field_of_view < math.pi):
        return None
    pinhole = Pinhole(
        position=vector(camera.position),
        right=vector(_rotated(camera.wxyz, (1.0, 0.0, 0.0))),
        up=vector(_rotated(camera.wxyz, (0.0, -1.0, 0.0))),
        focal=0.5 * height / math.tan(0.5 * field_of_view),
    )
    return pinhole if pinhole.is_usable else None


class CameraWatch:
    """Reports how a page's camera sees, and aims it again when the window changes its shape.

    A camera that the user has moved is not aimed.
    """

    def __init__(
        self,
        camera: viser.CameraHandle,
        model: Callable[[], RobotModel],
        send: Callable[[SetCamera | Callable[[], None]], None],
    ) -> None:
        """Watch a camera.

        Args:
            camera: The page's, already aimed at the robot for a picture at least as wide as high.
            model: Returns the robot that is shown.
            send: Queues an event or a task.
        """
        self._camera = camera
        self._model = model
        self._send = send
        self._aimed = (model(), 1.0)
        self._reported: Pinhole | None = None
        self._report()
        camera.on_update(self._changed)

    def aim(self) -> None:
        """Aim at the robot that is shown."""
        self._aimed = (self._model(), self._aspect)
        aim(self._camera, *self._aimed)

    @property
    def _aspect(self) -> float:
        """Aspect ratio of the picture; 1 for all that are wider than high."""
        return min(self._camera.aspect, 1.0)

    async def _changed(self, _camera: viser.CameraHandle) -> None:
        self._report()
        model, aspect = self._aimed
        moved = float(np.linalg.norm(self._camera.position - np.array(viewpoint_of(model, aspect).position)))
        if abs(self._aspect - aspect) > _SAME_ASPECT and moved <= _SAME_PLACE * robot_size(model):
            self._send(self.aim)

    def _report(self) -> None:
        """Report how the camera sees, if that makes a difference to labels."""
        pinhole = pinhole_of(self._camera)
        if pinhole is None:
            return
        distance = float(np.linalg.norm(self._camera.position - self._camera.look_at))
        if self._reported is None or not pinhole.resembles(self._reported, _SAME_PINHOLE, distance):
            self._reported = pinhole
            self._send(SetCamera(pinhole=pinhole))


@lru_cache(maxsize=8)  # asked for whenever the camera moves
def _balls(model: RobotModel) -> Array:
    """Return balls around what is drawn of a robot at home: centres and radii, m, shape (count, 4)."""
    length, items = triad_length(model), robot_solids(model, model.home, "")
    balls = [[*origin, _FRAME * length] for origin in frame_origins(model)]
    balls[-1][3] = _HANDLE * length  # tool0
    for name, item in items.items():
        if isinstance(item, Solid):
            carrier = items[name.rpartition("/")[0]]
            low, high = _box(item.vertices)
            corners = _placed(carrier, _placed(item, np.array(list(product(*zip(low, high, strict=True))))))
            balls += [[*corner, 0.0] for corner in corners]
    pedestal = ground_of(model).pedestal
    if pedestal is not None:
        balls += [[*corner, 0.0] for corner in _placed(pedestal, np.array(_box(pedestal.vertices)))]
    return np.array(balls)


@lru_cache(maxsize=64)
def _box(vertices: tuple[Vector, ...]) -> tuple[Vector, Vector]:
    """Return the lowest and the highest coordinates of points."""
    points = np.array(vertices)
    return vector(points.min(axis=0)), vector(points.max(axis=0))


def _placed(item: Placed, points: Array) -> Array:
    """Return points in an item's frame in that of its carrier, shape (count, 3)."""
    return np.asarray(points @ rotations_of_quaternions(item.orientation).T + item.position)


def _rotated(wxyz: Array, x: Vector) -> Array:
    w, v = wxyz[0], wxyz[1:]
    return np.asarray(np.array(x) + 2.0 * np.cross(v, np.cross(v, x) + w * np.array(x)))
