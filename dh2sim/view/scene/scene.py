"""The scene that a state stands for: a pure function."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Final

import numpy as np

from dh2sim.typing import Array
from dh2sim.view.scene.annotations import row_annotations
from dh2sim.view.scene.ghost import ghost_configuration, ghost_scene
from dh2sim.view.scene.items import Color, Item, Label, Lines, Placed, Polyline, Scene, Solid, Triad, Vector
from dh2sim.view.scene.labels import spread
from dh2sim.view.scene.link_poses import stance_of
from dh2sim.view.scene.markers import line_to_unreached, pull_arrow
from dh2sim.view.scene.robot_size import size_of, triad_length
from dh2sim.view.scene.solids import orientation_of, position_of, robot_solids
from dh2sim.view.state import Part, ViewState

ROBOT: Final = "/robot"
FRAMES: Final = "/frames"
NAMES: Final = "/names"
ROW: Final = "/row"
GHOST: Final = "/ghost"
PULL: Final = "/pull"
UNREACHED: Final = "/unreached"
IN_BASE_LINK: Final = (ROBOT, FRAMES, NAMES, ROW, GHOST)
"""All that stands in base_link is below these; the rest, such as the trace and the grid, stands in the world."""
_TRACE_COLOR: Final[Color] = (0.10, 0.45, 0.85)
_GRID_COLOR: Final[Color] = (0.82, 0.84, 0.87)
_AXIS_COLOR: Final[Color] = (0.62, 0.65, 0.70)
_CELLS: Final = 20
"""Cells of the grid along each side."""
_SEEN_THROUGH: Final = 0.35
"""Opacity of a robot inside which something is explained."""
_TOGETHER: Final = 0.25
"""Frames nearer to each other than this share of their axes' length have one label."""
_ABOVE: Final = 0.45
"""How far above its frame a label stands, as a share of the axes' length."""


def scene_of(state: ViewState) -> Scene:
    """Return everything that is drawn, by name.

    The pose of ``/robot/link_i`` is that of link i in base_link, of ``/frames/dh_i`` that of DH frame i. What stands
    in base_link is below ``IN_BASE_LINK``, which have the pose of base_link in the world.
    """
    items = dict(_items(state))
    items.update(_spread_labels(state, items))
    return items if Part.SHADING in state.shown else {name: _plain(item) for name, item in items.items()}


def _items(state: ViewState) -> Iterator[tuple[str, Item]]:
    shapes = Part.SHAPES in state.shown
    explained = Part.ANNOTATIONS in state.shown
    base = _base_link(state)
    yield from ((root, base) for root in IN_BASE_LINK)
    solids = robot_solids(state.model, state.q, ROBOT, opacity=_SEEN_THROUGH if explained else None)
    yield from _without(ROBOT, {name: item for name, item in solids.items() if shapes or not isinstance(item, Solid)})
    if Part.FRAMES in state.shown:
        yield from _frames(state)
    if explained:
        size = triad_length(state.model)
        row = row_annotations(state.spec, state.model.chain, state.selected_row, state.q, size, state.angle)
        yield from row.items()
    if Part.GHOST in state.shown and state.ghost is not None:
        stands = ghost_configuration(state.ghost.model, state.model, state.q)
        yield from _without(GHOST, ghost_scene(state.ghost.model, stands.q))
    if state.pull is not None:
        yield PULL, pull_arrow(state.model, state.q, state.pull)
    if (line := line_to_unreached(state)) is not None:
        yield UNREACHED, line
    if Part.TRACE in state.shown and len(state.trace) > 1:
        yield "/trace", Polyline(points=state.trace, color=_TRACE_COLOR, width=3.0)
    if Part.GRID in state.shown:
        yield from _grid(size_of(state.model)).items()


def _spread_labels(state: ViewState, items: Scene) -> Scene:
    """Return the labels where the eye sees all of them; those of the explained row choose their places first."""
    if state.sight is None:
        return {}
    sight = state.sight.seen_from(state.T_world_base_link) if state.floats else state.sight
    labels = {name: item for name, item in items.items() if isinstance(item, Label)}
    return spread(labels, sight, first=[name for name in labels if name.startswith(f"{ROW}/")])


def _plain(item: Item) -> Item:
    return replace(item, plain=True) if isinstance(item, Solid) else item


def _base_link(state: ViewState) -> Placed:
    """Return where base_link is in the world."""
    if not state.floats:
        return Placed()
    T = np.array(state.T_world_base_link)
    return Placed(position=position_of(T), orientation=orientation_of(T))


def _without(root: str, scene: Scene) -> Iterator[tuple[str, Item]]:
    return ((name, item) for name, item in scene.items() if name != root)


def _frames(state: ViewState) -> Iterator[tuple[str, Item]]:
    length = triad_length(state.model)
    frames = frames_of(state)
    for name, T_base_frame in frames.items():
        position, orientation = position_of(T_base_frame), orientation_of(T_base_frame)
        yield f"{FRAMES}/{name}", Triad(position=position, orientation=orientation, length=length)
    if Part.FRAME_NAMES in state.shown:
        yield from _names({name: position_of(T) for name, T in frames.items()}, length)


def _names(places: Mapping[str, Vector], length: float) -> Iterator[tuple[str, Item]]:
    """Yield the frames' names, those of frames with one origin on one label."""
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
    stance = stance_of(state.model, state.q)
    return {**{f"dh_{i}": T for i, T in enumerate(stance.frames)}, "tool0": stance.tool0}


def _braced(name: str) -> str:
    return f"{{{name.removeprefix('dh_')}}}" if name.startswith("dh_") else name


@lru_cache(maxsize=8)  # the same lines for every picture
def _grid(size: float) -> Mapping[str, Item]:
    """Return lines on the ground, a round number of metres apart."""
    cell = _round_length(2.6 * size / _CELLS)
    half = 0.5 * _CELLS * cell
    places = [-half + k * cell for k in range(_CELLS + 1)]
    middle = places.pop(_CELLS // 2)
    return {
        "/grid/cells": Lines(segments=tuple(_crosses(places, half)), color=_GRID_COLOR, width=1.0),
        "/grid/axes": Lines(segments=tuple(_crosses([middle], half)), color=_AXIS_COLOR, width=1.0),
    }


def _crosses(places: Iterable[float], half: float) -> Iterator[tuple[Vector, Vector]]:
    for at in places:
        yield (at, -half, 0.0), (at, half, 0.0)
        yield (-half, at, 0.0), (half, at, 0.0)


def _round_length(length: float) -> float:
    """Return 1, 2 or 5 times a power of ten, about as long."""
    unit = 10.0 ** math.floor(math.log10(length))
    return next(step * unit for step in (1.0, 2.0, 5.0, 10.0) if length <= step * unit * 1.000001)
