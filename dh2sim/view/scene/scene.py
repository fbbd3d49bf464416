"""The scene of a state: a pure function."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.kinematics.transforms import compose, pose_errors
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.view.branches import branches_of
from dh2sim.view.scene.annotations import row_annotations
from dh2sim.view.scene.ellipsoids import ELLIPSOID, FORCE, ellipsoids
from dh2sim.view.scene.ghost import PALE, ToolOffset, ghost_configuration, ghost_scene
from dh2sim.view.scene.ground import ground_of
from dh2sim.view.scene.items import (
    Arrow,
    Color,
    Item,
    Label,
    Lines,
    Placed,
    Polyline,
    Scene,
    Solid,
    Triad,
    Vector,
    vector,
)
from dh2sim.view.scene.labels import spread_labels
from dh2sim.view.scene.link_poses import poses_at, robot_size, round_length, triad_length
from dh2sim.view.scene.reach import SECTION, WORKSPACE, reach_items
from dh2sim.view.scene.solids import orientation_of, position_of, robot_solids
from dh2sim.view.state import Goal, LinkDrag, Mode, Part, ViewState

ROBOT: Final = "/robot"
NAMES: Final = "/names"
ROW: Final = "/row"
GHOST: Final = "/ghost"
DRAG: Final = "/drag"
GOAL: Final = "/goal"
BRANCHES: Final = "/branches"
GRID: Final = "/grid"
PEDESTAL: Final = "/pedestal"
IN_BASE_LINK: Final = (ROBOT, NAMES, ROW, GHOST, ELLIPSOID, FORCE, BRANCHES, WORKSPACE, SECTION)
"""Items below these are given in base_link, all others, such as the trace and the grid, in the world."""
_BRANCH_OPACITY: Final = 0.16
PLANNED_COLOR: Final[Color] = (0.85, 0.45, 0.05)
_TRACE_COLOR: Final[Color] = (0.10, 0.45, 0.85)
_GRID_COLOR: Final[Color] = (0.82, 0.84, 0.87)
_AXIS_COLOR: Final[Color] = (0.62, 0.65, 0.70)
_GOAL_COLOR: Final[Color] = (0.85, 0.20, 0.10)
_DRAG_COLOR: Final[Color] = (0.75, 0.10, 0.70)
_CELLS: Final = 20
"""Cells of the grid along each side."""
_TOGETHER: Final = 0.25
"""Frames nearer to each other than this share of their axes' length share a label."""
_ABOVE: Final = 0.45
"""Height of a label above its frame, as a share of the axes' length."""
_THICKNESS: Final = 0.12
"""Of the arrow of a drag, as a share of the axes' length."""


def scene_of(state: ViewState) -> Scene:
    """Return everything that is drawn, by name.

    The pose of ``/robot/link_i`` is that of link i in base_link. DH frame i is ``/robot/link_i/dh_i``, below the link
    so that it never lags behind it. The roots in ``IN_BASE_LINK`` have the pose of base_link in the world.
    """
    items = dict(_items(state))
    items.update(_spread_labels(state, items))
    return items if Part.SHADING in state.shown else {name: _plain(item) for name, item in items.items()}


def _items(state: ViewState) -> Iterator[tuple[str, Item]]:
    shapes = Part.SHAPES in state.shown
    base = _base_link(state)
    yield from ((root, base) for root in IN_BASE_LINK)
    solids = robot_solids(state.model, state.q, ROBOT, opacity=state.opacity)
    yield from _without(ROBOT, {name: item for name, item in solids.items() if shapes or not isinstance(item, Solid)})
    if Part.FRAMES in state.shown:
        yield from _triads(state.model).items()
        if Part.FRAME_NAMES in state.shown:
            places = {name: position_of(T) for name, T in frames_of(state).items()}
            yield from _names(places, triad_length(state.model))
    if Part.ANNOTATIONS in state.shown:
        size = triad_length(state.model)
        number, done = state.selected_row, state.row_progress
        row = row_annotations(state.spec, state.model.chain, number, state.q, size, state.angle, done)
        yield from row.items()
    if Part.GHOST in state.shown and state.ghost is not None:
        configuration = ghost_configuration(state.ghost.model, state.model, state.q)
        yield from _without(GHOST, ghost_scene(state.ghost.model, configuration.q))
    if Part.BRANCHES in state.shown and state.mode is Mode.MANUAL:
        yield from _branches(state)
    yield from ellipsoids(state)
    yield from reach_items(state)
    if state.drag is not None:
        yield DRAG, _drag_arrow(state, state.drag)
    if (marker := _goal_marker(state)) is not None:
        yield GOAL, marker
    if len(state.planned) > 1:
        yield "/planned", Polyline(points=state.planned, color=PLANNED_COLOR, width=2.0)
    if Part.TRACE in state.shown and len(state.trace) > 1:
        yield "/trace", Polyline(points=state.trace, color=_TRACE_COLOR, width=3.0)
    if Part.GRID in state.shown:
        ground = ground_of(state.model)
        yield GRID, Placed(position=(0.0, 0.0, ground.height))
        yield from _grid(robot_size(state.model)).items()
        if ground.pedestal is not None and not state.floats:
            yield PEDESTAL, ground.pedestal


def _branches(state: ViewState) -> Iterator[tuple[str, Item]]:
    """Yield the robot in all other branches that hold tool0 where it is."""
    for number, branch in enumerate(branches_of(state).branches, start=1):
        if not branch.here:
            root = f"{BRANCHES}/branch_{number}"
            yield from robot_solids(state.model, branch.q, root, color=PALE, opacity=_BRANCH_OPACITY).items()


def _spread_labels(state: ViewState, items: Scene) -> Scene:
    """Return the labels where all can be read; those of the explained row are placed first."""
    if state.pinhole is None:
        return {}
    pinhole = state.pinhole.in_frame(state.T_world_base_link) if state.floats else state.pinhole
    labels = {name: item for name, item in items.items() if isinstance(item, Label)}
    return spread_labels(labels, pinhole, first=[name for name in labels if name.startswith(f"{ROW}/")])


def _plain(item: Item) -> Item:
    return replace(item, plain=True) if isinstance(item, Solid) else item


def _base_link(state: ViewState) -> Placed:
    if not state.floats:
        return Placed()
    T = np.array(state.T_world_base_link)
    return Placed(position=position_of(T), orientation=orientation_of(T))


def _without(root: str, scene: Scene) -> Iterator[tuple[str, Item]]:
    return ((name, item) for name, item in scene.items() if name != root)


@lru_cache(maxsize=8)  # they do not move in their links
def _triads(model: RobotModel) -> Mapping[str, Item]:
    """Return DH frames and tool0, each below the link that carries it."""
    chain, length = model.chain, triad_length(model)
    T_link_dh = [chain.T_base_link_dh0, *(joint.T_joint_dh for joint in chain.joints)]
    carried = [
        (link.name, f"dh_{i}", T)
        for i, (link, T) in enumerate(zip((model.base, *model.links), T_link_dh, strict=True))
    ]
    link, _, T_last = carried[-1]
    carried.append((link, "tool0", compose(T_last, chain.T_dhn_tool0)))
    return {
        f"{ROBOT}/{link}/{frame}": Triad(position=position_of(T), orientation=orientation_of(T), length=length)
        for link, frame, T in carried
    }


def _names(places: Mapping[str, Vector], length: float) -> Iterator[tuple[str, Item]]:
    """Yield labels with the frames' names; frames at one place share a label."""
    groups: list[tuple[Vector, list[str]]] = []
    for name, place in places.items():
        group = next((names for other, names in groups if math.dist(other, place) <= _TOGETHER * length), None)
        if group is None:
            groups.append((place, [name]))
        else:
            group.append(name)
    for (x, y, z), names in groups:
        text = " ".join(_braced(name) for name in names)
        yield f"{NAMES}/{names[0]}", Label(text=text, position=(x, y, z + _ABOVE * length))


def frames_of(state: ViewState) -> dict[str, Array]:
    """Return the poses of DH frames dh_0 … dh_n and of tool0 in base_link, shape (4, 4) each."""
    poses = poses_at(state.model, state.q)
    return {**{f"dh_{i}": T for i, T in enumerate(poses.frames)}, "tool0": poses.tool0}


def _braced(name: str) -> str:
    return f"{{{name.removeprefix('dh_')}}}" if name.startswith("dh_") else name


def goal_text(state: ViewState) -> str:
    """Return how far tool0 is from where the user has dragged its handle, a sentence; empty if it is there."""
    goal = _missed_goal(state)
    if goal is None:
        return ""
    tool = forward_kinematics(state.model.chain, state.q)
    distance, angle = pose_errors(tool, np.array(goal.T_base_link_tool0))
    offset = ToolOffset(distance=float(distance), angle=float(angle))
    return f"The handle is out of reach, or too far for one step: tool0 is {offset.text}."


def _goal_marker(state: ViewState) -> Polyline | None:
    """Return a line in base_link from tool0 to where its handle is; None if it is there."""
    goal = _missed_goal(state)
    if goal is None:
        return None
    tool = position_of(forward_kinematics(state.model.chain, state.q))
    return Polyline(points=(tool, position_of(np.array(goal.T_base_link_tool0))), color=_GOAL_COLOR, width=3.0)


def _missed_goal(state: ViewState) -> Goal | None:
    missed = Part.HANDLE in state.shown and state.goal is not None and not state.goal.reached
    return state.goal if missed else None


def point_in_link(model: RobotModel, q: ArrayLike, link: str, point: ArrayLike) -> Vector:
    """Return a point of base_link in a link's frame.

    Args:
        model: The robot.
        q: Joint vector, rad and m, shape (n,).
        link: Name of one of the links.
        point: In base_link, m, shape (3,).

    Returns:
        The point in the link's frame, m.
    """
    T = _link_pose(model, q, link)
    return vector(T[:3, :3].T @ (np.asarray(point, dtype=np.float64) - T[:3, 3]))


def _drag_arrow(state: ViewState, drag: LinkDrag) -> Arrow:
    """Return the arrow from the grabbed point of a link to the mouse, in base_link."""
    T = _link_pose(state.model, state.q, drag.link)
    start = T[:3, :3] @ np.array(drag.point_in_link) + T[:3, 3]
    thickness = _THICKNESS * triad_length(state.model)
    return Arrow(start=vector(start), end=drag.target, color=_DRAG_COLOR, thickness=thickness)


def _link_pose(model: RobotModel, q: ArrayLike, link: str) -> Array:
    index = [known.name for known in model.all_links].index(link)
    return np.asarray(poses_at(model, q).links[index])


@lru_cache(maxsize=8)  # the lines are the same in every picture
def _grid(size: float) -> Mapping[str, Item]:
    """Return lines on the ground, a round number of metres apart."""
    cell = round_length(2.6 * size / _CELLS)
    half = 0.5 * _CELLS * cell
    places = [-half + k * cell for k in range(_CELLS + 1)]
    middle = places.pop(_CELLS // 2)
    return {
        f"{GRID}/cells": Lines(segments=tuple(_crosses(places, half)), color=_GRID_COLOR, width=1.0),
        f"{GRID}/axes": Lines(segments=tuple(_crosses([middle], half)), color=_AXIS_COLOR, width=1.0),
    }


def _crosses(places: Iterable[float], half: float) -> Iterator[tuple[Vector, Vector]]:
    for at in places:
        yield (at, -half, 0.0), (at, half, 0.0)
        yield (-half, at, 0.0), (half, at, 0.0)
