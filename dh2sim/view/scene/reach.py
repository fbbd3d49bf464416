"""What tool0 reaches: points coloured by manipulability, and the section as an outline that turns with the arm."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from dh2sim.typing import Array
from dh2sim.view.scene.items import Color, Item, Lines, Placed, Points, Polyline, Vector, vector
from dh2sim.view.scene.link_poses import poses_at
from dh2sim.view.scene.solids import orientation_of, position_of
from dh2sim.view.state import Part, ViewState

if TYPE_CHECKING:
    from dh2sim.workspace.section import Section
    from dh2sim.workspace.workspace import Workspace

WORKSPACE: Final = "/workspace"
SECTION: Final = "/section"
LIMITED: Final[Color] = (0.13, 0.35, 0.75)
SINGULAR_COLOR: Final[Color] = (0.78, 0.12, 0.15)
_SHADES: Final = 64
_POINT: Final = 0.12
"""Size of a point, as a share of its voxel's edge: what is behind is seen between them."""


def reach_items(state: ViewState) -> Iterator[tuple[str, Item]]:
    """Yield what is shown of the workspace, once it is computed."""
    found = state.workspace
    if found is None:
        return
    if Part.WORKSPACE in state.shown:
        yield f"{WORKSPACE}/points", _points(found, Part.CUT in state.shown)
    if Part.SECTION in state.shown and found.section is not None:
        T = _turned(found.section, poses_at(state.model, state.q).tool0[:3, 3])
        yield f"{SECTION}/plane", Placed(position=position_of(T), orientation=orientation_of(T))
        yield from _outline(found.section).items()


@lru_cache(maxsize=2)  # the same in every picture
def _points(found: Workspace, cut: bool) -> Points:
    """Return the centres of voxels, from dark to bright as the tool moves the better there.

    Of a volume that is cut open, those in front of base_link's x-z plane are left out.
    """
    from dh2sim.workspace.files import relative_manipulability, shade

    table = [vector(color) for color in shade(np.linspace(0.0, 1.0, _SHADES))]
    shades = np.round(relative_manipulability(found) * (_SHADES - 1)).astype(int).tolist()
    behind = (found.centers[:, 1] > 0.0) | (found.dimension < 3) | (not cut)
    points = tuple(map(vector, found.centers[behind].tolist()))
    colors = tuple(table[k] for k, shown in zip(shades, behind.tolist(), strict=True) if shown)
    return Points(points=points, colors=colors, size=_POINT * found.size)


def _turned(section: Section, tool: Array) -> Array:
    """Return the pose of the section's plane, x and y along its coordinates, (4, 4); one that turns has the tool."""
    u, v = section.directions
    if section.turns_about is not None:
        across = tool - section.axis_point
        across = across - (across @ v) * v
        r = float(np.linalg.norm(across))
        u = across / r if r > 1e-9 else u
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.stack([u, v, np.cross(u, v)], axis=1), section.axis_point
    return T


@lru_cache(maxsize=2)
def _outline(section: Section) -> Mapping[str, Item]:
    """Return the boundary in the section's plane, by what bounds it, and where the arm is singular inside."""
    from dh2sim.workspace.section import SINGULAR

    pieces: dict[bool, list[tuple[Vector, Vector]]] = {False: [], True: []}
    for curve, held in zip(section.curves, section.held_by, strict=True):
        ahead = np.roll(curve.points, -1, axis=0)
        for start, end, by in zip(curve.points.tolist(), ahead.tolist(), (held == SINGULAR).tolist(), strict=True):
            pieces[by].append(((*start, 0.0), (*end, 0.0)))
    root = f"{SECTION}/plane"
    items: dict[str, Item] = {}
    for by, name, color in ((False, "limits", LIMITED), (True, "singular", SINGULAR_COLOR)):
        if pieces[by]:
            items[f"{root}/{name}"] = Lines(segments=tuple(pieces[by]), color=color, width=3.0)
    if len(section.singular):
        points = tuple((x, y, 0.0) for x, y in section.singular.tolist())
        items[f"{root}/inside"] = Points(points=points, colors=(SINGULAR_COLOR,) * len(points), size=section.size / 4)
    if len(section.line) > 1:
        line = tuple((x, y, 0.0) for x, y in section.line.tolist())
        items[f"{root}/line"] = Polyline(points=line, color=LIMITED, width=3.0)
    return items
