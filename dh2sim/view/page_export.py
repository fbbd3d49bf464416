"""A robot, still or moving, as one HTML file that needs neither a server nor a network.

viser's page is one file without references to others. A recording of what a server would send is embedded in it, and
played back by the same code that draws for a server.
"""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import PictureError
from dh2sim.files import atomic_file
from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.kinematics.rotations import rotations_of_quaternions
from dh2sim.kinematics.transforms import compose, identity
from dh2sim.messages import listed
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.view.scene.items import Arrow, Item, Label, Placed, Polyline, Scene, Solid, Triad, Vector
from dh2sim.view.scene.link_poses import round_length, triad_length
from dh2sim.view.scene.painter import Painter
from dh2sim.view.scene.scene import PLANNED_COLOR
from dh2sim.view.scene.solids import orientation_of, position_of, robot_solids
from dh2sim.view.server import recording_server

if TYPE_CHECKING:
    import viser

    from dh2sim.draw.rollout_data import RolloutData
    from dh2sim.trajectory.files import SampledTrajectory


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundingSphere:
    """A sphere."""

    centre: Vector
    """m."""
    radius: float
    """m, positive."""


def bounding_sphere(scenes: Iterable[Scene]) -> BoundingSphere:
    """Return a sphere around all items of scenes, with the centre of their box along base_link's axes.

    Args:
        scenes: At least one, with at least one item; parents come before their children.
    """
    boxes: dict[int, Array] = {}
    corners = []
    for scene in scenes:
        poses: dict[str, Array] = {}
        for name, item in scene.items():
            pose = poses[name] = poses.get(name.rsplit("/", 1)[0], np.eye(4)) @ _pose(item)
            corners.append(_box(item, boxes) @ pose[:3, :3].T + pose[:3, 3])
    points = np.concatenate(corners)
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    x, y, z = (float(value) for value in centre)
    return BoundingSphere(centre=(x, y, z), radius=float(np.linalg.norm(points - centre, axis=1).max()) or 1.0)


def _box(item: Item, boxes: dict[int, Array]) -> Array:
    """Return the corners of a box around an item in its own frame, shape (8, 3)."""
    match item:
        case Solid():
            if id(item.vertices) not in boxes:  # scenes share them
                boxes[id(item.vertices)] = _corners(np.array(item.vertices))
            return boxes[id(item.vertices)] * item.scale
        case Polyline():
            return _corners(np.array(item.points))
        case Arrow():
            return _corners(np.array([item.start, item.end]))
        case Triad():
            return _corners(np.array([np.zeros(3), np.full(3, item.length)]))
        case _:
            return np.zeros((8, 3))


def _corners(points: Array) -> Array:
    ends = np.array([points.min(axis=0), points.max(axis=0)])
    return np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])


def _pose(item: Item) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotations_of_quaternions(item.orientation), item.position
    return T


_FIELD_OF_VIEW: Final = math.radians(40.0)
"""From top to bottom, rad."""
_DIRECTION: Final = (1.0, -1.25, 0.7)
"""From the middle of the scene to the camera."""
_MARGIN: Final = 1.05
_LAST_FRAME: Final = 1.0 / 30.0
"""s that the end of an animation is shown before it starts again."""
_TITLE: Final = "<title>Viser</title>"


def page_html(keyframes: Sequence[tuple[float, Scene]], *, title: str, bounds: BoundingSphere) -> str:
    """Return scenes as an HTML page that needs nothing but a browser.

    Args:
        keyframes: Times, s, ascending from 0, and scenes; more than one are played in a loop, with a time slider.
        title: Of the page.
        bounds: What the camera looks at first.
    """
    with recording_server() as server:
        look_at(server, bounds)
        add_ground(server, bounds)
        painter = Painter(server.scene)
        painter.draw(keyframes[0][1])
        recording = server.get_scene_serializer()
        now = keyframes[0][0]
        for time, scene in keyframes[1:]:
            recording.insert_sleep(time - now)
            painter.draw(scene)
            now = time
        if len(keyframes) > 1:
            recording.insert_sleep(_LAST_FRAME)
        page = recording.as_html()
    return page.replace(_TITLE, f"<title>{html.escape(title)}</title>", 1)


def look_at(server: viser.ViserServer, bounds: BoundingSphere) -> None:
    """Make the initial camera see all of a scene."""
    distance = _MARGIN * bounds.radius / math.sin(0.5 * _FIELD_OF_VIEW)
    direction = np.array(_DIRECTION) / np.linalg.norm(_DIRECTION)
    camera = server.initial_camera
    camera.look_at = bounds.centre
    camera.position = np.array(bounds.centre) + distance * direction
    camera.fov = _FIELD_OF_VIEW
    camera.near, camera.far = 0.01 * distance, 100.0 * distance


def add_ground(server: viser.ViserServer, bounds: BoundingSphere) -> None:
    """Add a grid of a round number of metres on the ground, below the middle of the scene."""
    cell = round_length(bounds.radius / 10.0)
    side = 20.0 * cell
    x, y = (5.0 * cell * round(value / (5.0 * cell)) for value in bounds.centre[:2])
    server.scene.add_grid(
        "/ground", width=side, height=side, cell_size=cell, section_size=5.0 * cell, position=(x, y, 0.0)
    )


MAX_FRAME_RATE = 30.0
"""Of an animation, 1/s."""
MAX_FRAMES = 1800
"""Longer animations have a lower frame rate."""
_FRAMES_MEASURED = 60
"""Frames that the bounds of an animation are computed from."""
_ROBOT = "/robot"


def export_page(
    model: RobotModel,
    q: ArrayLike,
    path: Path,
    *,
    rollout: RolloutData | None = None,
    trajectory: SampledTrajectory | None = None,
) -> None:
    """Write a page that shows a robot with its DH frames, from all sides and with a list of parts to hide.

    Args:
        model: The robot.
        q: Joint vector, rad and m, shape (n,).
        path: Of the file, which is replaced if it exists.
        rollout: Shown instead of ``q``, in a loop, with a time slider, a pause and a choice of speeds.
        trajectory: Likewise, with the path of tool0; its joints are in the robot's order.

    Raises:
        ConfigurationError: ``q`` has the wrong shape or is not finite.
        PictureError: Positions were not recorded in the rollout, or it is of a robot with other joints.
        OutputError: The file cannot be written; one that existed is unchanged.
    """
    keyframes = [(0.0, robot_page_scene(model, q))]
    if trajectory is not None:
        keyframes = list(trajectory_keyframes(model, trajectory))
    elif rollout is not None:
        keyframes = list(rollout_keyframes(model, rollout))
    chosen = {round(k) for k in np.linspace(0, len(keyframes) - 1, min(len(keyframes), _FRAMES_MEASURED))}
    bounds = bounding_sphere([keyframes[k][1] for k in sorted(chosen)])
    html = page_html(keyframes, title=model.name, bounds=bounds)
    with atomic_file(path) as temporary:
        temporary.write_text(html, encoding="utf-8")


def robot_page_scene(model: RobotModel, q: ArrayLike, base: Placed | None = None) -> Scene:
    """Return a robot with its DH frames and tool0, each below the link that carries it.

    Args:
        model: The robot.
        q: Joint vector, rad and m, shape (n,).
        base: Pose of base_link.

    Raises:
        ConfigurationError: ``q`` has the wrong shape or is not finite.
    """
    items: dict[str, Item] = {**robot_solids(model, q, _ROBOT), _ROBOT: base or Placed()}
    length = triad_length(model)
    for number, (link, frame, text, T) in enumerate(_carried(model.chain)):
        name = f"{_ROBOT}/{link}/{frame}"
        items[name] = Triad(position=position_of(T), orientation=orientation_of(T), length=length)
        # beyond the end of z, where frames of one origin are apart; neighbours may share z, too
        height = (1.15 + 0.3 * (number % 2)) * length
        items[f"{name}/name"] = Label(text=text, position=(0.0, 0.0, height))
    return items


def _carried(chain: KinematicChain) -> list[tuple[str, str, str, Array]]:
    """Return for each frame the link that carries it, its name, its label, and its pose in the link."""
    carried = [("base_link", "dh_0", "dh_0", chain.T_base_link_dh0)]
    carried += [
        (f"link_{i}", f"dh_{i}", f"dh_{i}", joint.T_joint_dh) for i, joint in enumerate(chain.joints, start=1)
    ]
    link, last, _, T = carried[-1]
    if (chain.T_dhn_tool0 == identity()).all():
        return [*carried[:-1], (link, last, f"{last} = tool0", T)]
    return [*carried, (link, "tool0", "tool0", compose(T, chain.T_dhn_tool0))]


def rollout_keyframes(model: RobotModel, rollout: RolloutData) -> Iterator[tuple[float, Scene]]:
    """Yield times, s, from 0, and scenes of a rollout at recorded times."""
    rollout.require("qpos", what="a page")
    own, recorded = [joint.name for joint in model.moving_joints], rollout.names("joint")
    if own != recorded:
        raise PictureError(
            f"{rollout.label} is of a robot with the joints {listed(recorded)}; {model.name} has {listed(own)}"
        )
    time, qpos = rollout.values("time"), rollout.values("qpos")
    bases = rollout.values("base_pose") if "base_pose" in rollout.data else None
    for k in shown_records(time):
        base = None if bases is None else _placed(bases[k])
        yield float(time[k] - time[0]), robot_page_scene(model, qpos[k], base)


def trajectory_keyframes(model: RobotModel, trajectory: SampledTrajectory) -> Iterator[tuple[float, Scene]]:
    """Yield times, s, from 0, and scenes of a trajectory at its samples, with the path of tool0."""
    path = Polyline(points=tool_path(model, trajectory), color=PLANNED_COLOR, width=2.0)
    for k in shown_records(trajectory.time):
        yield float(trajectory.time[k]), {**robot_page_scene(model, trajectory.q[k]), "/planned": path}


MOST_PATH_POINTS = 1000


def tool_path(model: RobotModel, trajectory: SampledTrajectory) -> tuple[Vector, ...]:
    """Return the path of tool0 along a trajectory, m."""
    count = min(len(trajectory.time), MOST_PATH_POINTS)
    q = trajectory.q[np.unique(np.linspace(0, len(trajectory.time) - 1, count).round().astype(int))]
    points = forward_kinematics(model.chain, q)[:, :3, 3].tolist()
    return tuple((x, y, z) for x, y, z in points)


def shown_records(time: Array) -> list[int]:
    """Return which of the records at ``time``, s, ascending, shape (count,), are shown, including first and last."""
    duration = float(time[-1] - time[0])
    count = min(math.ceil(duration * MAX_FRAME_RATE) + 1, MAX_FRAMES, len(time))
    places = np.interp(np.linspace(time[0], time[-1], count), time, np.arange(len(time)))
    return sorted({round(place) for place in places.tolist()} | {0, len(time) - 1})


def _placed(pose: Array) -> Placed:
    x, y, z, *quaternion = (float(value) for value in pose)
    qw, qx, qy, qz = quaternion
    return Placed(position=(x, y, z), orientation=(qw, qx, qy, qz))
