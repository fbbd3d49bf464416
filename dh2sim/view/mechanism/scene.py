"""What is drawn of a mechanism: its links, frames, and the joints that close its loops."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from dh2sim.errors import PictureError
from dh2sim.files import atomic_file
from dh2sim.kinematics.tree import body_poses, placed
from dh2sim.messages import listed
from dh2sim.model.mechanism import STRUT, MechanismModel
from dh2sim.typing import Array, read_only
from dh2sim.view.page_export import bounding_sphere, page_html, shown_records
from dh2sim.view.scene.items import Item, Label, Placed, Polyline, Scene, Solid, Triad, vector
from dh2sim.view.scene.scene import PLANNED_COLOR
from dh2sim.view.scene.solids import ball_triangles, link_solids, orientation_of, position_of

if TYPE_CHECKING:
    from pathlib import Path

    from dh2sim.draw.rollout_data import RolloutData
    from dh2sim.trajectory.files import SampledTrajectory

CLOSURE_COLOR: Final = (0.10, 0.45, 0.75)
_TRIAD: Final = 0.08
"""Length of a frame's axes, in sizes of the mechanism."""
_BALL: Final = 2.2 * STRUT
"""Radius of a ball that marks a closure, likewise."""
_ROBOT: Final = "/robot"
PATH: Final = "/planned"
"""Name of the path of a frame."""
_MOST_PATH_POINTS: Final = 400


def mechanism_scene(model: MechanismModel, q: Array, *, frames: bool = True) -> Scene:
    """Return a mechanism with its frames and closures, each below the link that carries it.

    Args:
        model: The mechanism.
        q: Joint vector, rad and m, shape (n,).
        frames: Whether its DH frames and tool0 are shown.
    """
    items: dict[str, Item] = {_ROBOT: Placed(), f"{_ROBOT}/{_path(model.base.name)}": Placed()}
    poses = body_poses(model.tree, q)
    for link, T in zip(model.links, poses, strict=True):
        items[f"{_ROBOT}/{_path(link.name)}"] = _at(T)
    if (tool := model.main.tool) is not None:
        end = len(model.main.joints) - 1
        items[f"{_ROBOT}/{_path(tool.name)}"] = _at(placed(poses, model.tree.frames[f"dh_{end + 1}"]))
    return {**items, **_fixed(model), **(_frames(model) if frames else {})}


def _path(name: str) -> str:
    """Return the name of a link or a frame as one step of an item's path."""
    return name.replace("/", " ")


def _at(T: Array) -> Placed:
    return Placed(position=position_of(T), orientation=orientation_of(T))


@lru_cache(maxsize=4)
def _fixed(model: MechanismModel) -> Mapping[str, Item]:
    """Return what is below the links' frames, the same at every configuration."""
    items: dict[str, Item] = {}
    joints = [joint.T_joint_dh for joint in model.joints]
    carried = [model.tree.frames["dh_0"].T_body_frame, *joints, read_only(np.eye(4))]
    for link, T_link_dh in zip(model.all_links, carried, strict=False):
        for name, solid in link_solids(link, T_link_dh).items():
            items[f"{_ROBOT}/{_path(link.name)}/{name}"] = solid
    vertices, faces = ball_triangles()
    radius = _BALL * model.size
    for closure in model.tree.closures:
        frame = model.tree.frame(closure.a)
        name = f"{_ROBOT}/{_path(model.body_name(frame.body))}/closure {closure.name}"
        items[name] = Solid(
            position=position_of(frame.T_body_frame),
            vertices=vertices,
            faces=faces,
            color=CLOSURE_COLOR,
            scale=(radius, radius, radius),
        )
        items[f"{name}/name"] = Label(text=closure.name, position=(0.0, 0.0, 2.0 * radius))
    return items


@lru_cache(maxsize=4)
def _frames(model: MechanismModel) -> Mapping[str, Item]:
    items: dict[str, Item] = {}
    length = _TRIAD * model.size
    poses = body_poses(model.tree, model.q)
    named: list[Array] = []
    for name, frame in model.tree.frames.items():
        if name.rpartition("/")[2].startswith(("dh_", "tool0")):
            origin = placed(poses, frame)[:3, 3]
            below = sum(float(np.linalg.norm(origin - other)) < 0.1 * length for other in named)
            named.append(origin)
            path = f"{_ROBOT}/{_path(model.body_name(frame.body))}/{_path(name)}"
            items[path] = Triad(
                position=position_of(frame.T_body_frame),
                orientation=orientation_of(frame.T_body_frame),
                length=length,
            )
            items[f"{path}/name"] = Label(text=name, position=(0.0, 0.0, (1.15 + 0.35 * below) * length))
    return items


def frame_path(model: MechanismModel, q: Array, frame: str) -> Polyline:
    """Return the path of a frame's origin through joint vectors, rad and m, shape (N, n): a coupler's curve.

    The loops are as closed as they were recorded.
    """
    chosen = np.unique(np.linspace(0, len(q) - 1, min(len(q), _MOST_PATH_POINTS)).round().astype(int))
    carried = model.tree.frame(frame)
    points = [vector(placed(body_poses(model.tree, q[k]), carried)[:3, 3]) for k in chosen]
    return Polyline(points=tuple(points if len(points) > 1 else 2 * points), color=PLANNED_COLOR, width=2.0)


def export_mechanism_page(
    model: MechanismModel,
    q: Array,
    path: Path,
    *,
    rollout: RolloutData | None = None,
    trajectory: SampledTrajectory | None = None,
) -> None:
    """Write a page that shows a mechanism, as ``export_page`` does for a robot.

    Args:
        model: The mechanism.
        q: Joint vector, rad and m, shape (n,).
        path: Of the file, which is replaced if it exists.
        rollout: Shown instead of ``q``, in a loop.
        trajectory: Likewise, with the path of tool0; its joints are in the mechanism's order.

    Raises:
        PictureError: Positions were not recorded in the rollout, or it is of a robot with other joints.
        OutputError: The file cannot be written.
    """
    with atomic_file(path) as temporary:
        temporary.write_text(mechanism_page_html(model, q, rollout=rollout, trajectory=trajectory), encoding="utf-8")


def mechanism_page_html(
    model: MechanismModel,
    q: Array,
    *,
    rollout: RolloutData | None = None,
    trajectory: SampledTrajectory | None = None,
) -> str:
    """Return the same as HTML."""
    keyframes = [(0.0, mechanism_scene(model, q))]
    if trajectory is not None:
        path = {PATH: frame_path(model, trajectory.q, "tool0")}
        keyframes = [(time, {**scene, **path}) for time, scene in _keyframes(model, trajectory.time, trajectory.q)]
    elif rollout is not None:
        keyframes = list(_rollout_keyframes(model, rollout))
    bounds = bounding_sphere(scene for _, scene in keyframes[:: max(1, len(keyframes) // 60)])
    return page_html(keyframes, title=model.name, bounds=bounds)


def _keyframes(model: MechanismModel, time: Array, q: Array) -> Iterator[tuple[float, Scene]]:
    """Yield times, s, from 0, and scenes of a motion."""
    for k in shown_records(time):
        yield float(time[k] - time[0]), mechanism_scene(model, q[k])


def _rollout_keyframes(model: MechanismModel, rollout: RolloutData) -> Iterator[tuple[float, Scene]]:
    """Yield times, s, from 0, and scenes of a rollout at recorded times."""
    rollout.require("qpos", what="a page")
    own, recorded = [joint.name for joint in model.moving_joints], rollout.names("joint")
    if own != recorded:
        raise PictureError(
            f"{rollout.label} is of a robot with the joints {listed(recorded)}; {model.name} has {listed(own)}"
        )
    yield from _keyframes(model, rollout.values("time"), rollout.values("qpos"))
