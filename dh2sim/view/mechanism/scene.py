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
from dh2sim.view.scene.items import Item, Label, Placed, Scene, Solid, Triad
from dh2sim.view.scene.solids import ball_triangles, link_solids, orientation_of, position_of

if TYPE_CHECKING:
    from pathlib import Path

    from dh2sim.draw.rollout_data import RolloutData

CLOSURE_COLOR: Final = (0.10, 0.45, 0.75)
_TRIAD: Final = 0.08
"""Length of a frame's axes, in sizes of the mechanism."""
_BALL: Final = 2.2 * STRUT
"""Radius of a ball that marks a closure, likewise."""
_ROBOT: Final = "/robot"


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
    for name, frame in model.tree.frames.items():
        if name.rpartition("/")[2].startswith(("dh_", "tool0")):
            path = f"{_ROBOT}/{_path(model.body_name(frame.body))}/{_path(name)}"
            items[path] = Triad(
                position=position_of(frame.T_body_frame),
                orientation=orientation_of(frame.T_body_frame),
                length=length,
            )
            items[f"{path}/name"] = Label(text=name, position=(0.0, 0.0, 1.15 * length))
    return items


def export_mechanism_page(model: MechanismModel, q: Array, path: Path, *, rollout: RolloutData | None = None) -> None:
    """Write a page that shows a mechanism, as ``export_page`` does for a robot.

    Args:
        model: The mechanism.
        q: Joint vector, rad and m, shape (n,).
        path: Of the file, which is replaced if it exists.
        rollout: Shown instead of ``q``, in a loop.

    Raises:
        PictureError: Positions were not recorded in the rollout, or it is of a robot with other joints.
        OutputError: The file cannot be written.
    """
    with atomic_file(path) as temporary:
        temporary.write_text(mechanism_page_html(model, q, rollout=rollout), encoding="utf-8")


def mechanism_page_html(model: MechanismModel, q: Array, *, rollout: RolloutData | None = None) -> str:
    """Return the same as HTML."""
    keyframes = [(0.0, mechanism_scene(model, q))] if rollout is None else list(_keyframes(model, rollout))
    bounds = bounding_sphere(scene for _, scene in keyframes[:: max(1, len(keyframes) // 60)])
    return page_html(keyframes, title=model.name, bounds=bounds)


def _keyframes(model: MechanismModel, rollout: RolloutData) -> Iterator[tuple[float, Scene]]:
    """Yield times, s, from 0, and scenes of a rollout at recorded times."""
    rollout.require("qpos", what="a page")
    own, recorded = [joint.name for joint in model.moving_joints], rollout.names("joint")
    if own != recorded:
        raise PictureError(
            f"{rollout.label} is of a robot with the joints {listed(recorded)}; {model.name} has {listed(own)}"
        )
    time, qpos = rollout.values("time"), rollout.values("qpos")
    for k in shown_records(time):
        yield float(time[k] - time[0]), mechanism_scene(model, qpos[k])
