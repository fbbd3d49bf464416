"""The camera of a page: placed so that the whole robot is seen, until the user moves it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.draw.projection import Pinhole
from dh2sim.kinematics.transforms import compose
from dh2sim.model.meshes import MeshAsset
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.view.events import SetCamera
from dh2sim.view.scene.items import Vector, vector
from dh2sim.view.scene.link_poses import frame_origins, poses_at, robot_size
from dh2sim.view.scene.solids import mesh_triangles

if TYPE_CHECKING:
    import viser

FIELD_OF_VIEW: Final = math.radians(45.0)
"""From top to bottom, rad."""
_NARROWEST: Final = 0.2
"""Aspect ratio of the narrowest picture that the robot is fitted into."""
_DIRECTION: Final = (0.62, -0.68, 0.42)
"""From the robot to the camera."""
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
    """Return a viewpoint that shows the whole robot at home, with a margin.

    Args:
        model: The robot.
        aspect: Width of the picture over its height; for a narrow one the camera is farther away.
    """
    corners = np.vstack([frame_origins(model), _shape_corners(model)])
    low, high = corners.min(axis=0), corners.max(axis=0)
    centre = 0.5 * (low + high)
    radius = max(0.55 * float(np.linalg.norm(high - low)), 0.5 * robot_size(model))
    direction = np.array(_DIRECTION) / np.linalg.norm(_DIRECTION)
    half = math.atan(math.tan(0.5 * FIELD_OF_VIEW) * min(max(aspect, _NARROWEST), 1.0))
    position = centre + radius / math.sin(half) * direction
    return Viewpoint(position=vector(position), look_at=vector(centre))


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


def _shape_corners(model: RobotModel) -> Array:
    """Return points around the shapes and meshes of the links at home, m, shape (count, 3)."""
    poses = poses_at(model, model.home)
    points = [np.empty((0, 3))]
    for link, T_base_link, T_base_dh in zip(model.all_links, poses.links, poses.frames, strict=True):
        if link.mesh is None:
            points += [_transformed(T_base_link, shape.ends) for shape in link.shapes]
        else:
            points.append(_transformed(compose(T_base_dh, link.mesh.T_dh_mesh), _box(link.mesh)))
    return np.vstack(points)


@lru_cache(maxsize=64)
def _box(mesh: MeshAsset) -> Array:
    """Return the corners of the box around a mesh in its own frame, m, shape (8, 3)."""
    vertices = np.array(mesh_triangles(mesh)[0])
    return np.array(list(product(*np.stack([vertices.min(axis=0), vertices.max(axis=0)], axis=1))))


def _transformed(T: Array, points: ArrayLike) -> Array:
    return np.asarray(points) @ T[:3, :3].T + T[:3, 3]


def _rotated(wxyz: Array, x: Vector) -> Array:
    w, v = wxyz[0], wxyz[1:]
    return np.asarray(np.array(x) + 2.0 * np.cross(v, np.cross(v, x) + w * np.array(x)))
