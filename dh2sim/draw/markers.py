"""What is drawn beside the robot itself: its DH frames with their names, and the path of its tool.

Frames sit inside links, so they are drawn over the picture. The path is a part of the scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from dh2sim.draw.labels import vertical_shift
from dh2sim.draw.projection import Pinhole
from dh2sim.typing import Array

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

Color = tuple[int, int, int]
Arrow = tuple[float, Array, Array, Color]
"""Depth of its tip, where it begins and ends in the picture, and its colour."""
AXIS_COLORS: tuple[Color, Color, Color] = ((224, 36, 30), (24, 150, 44), (28, 84, 232))
"""x red, y green, z blue, as is usual."""
INK: Color = (28, 30, 36)
PAPER: Color = (255, 255, 255)
TRACE_OLD, TRACE_NEW = (0.48, 0.66, 0.86), (0.00, 0.28, 0.66)
AXIS_LENGTH, TRACE_RADIUS = 0.17, 0.006
"""As a share of the radius of a ball around the robot at home."""
THIN = 320.0
"""The height of a picture over the width of an arrow."""
FINER = 3
"""Arrows are drawn larger by this factor, and reduced, for smooth edges."""


def frame_sites(model: Any) -> list[tuple[int, str]]:
    """Return numbers and names of the sites that are frames: dh_0 to dh_n, and tool0."""
    names = [(number, str(model.site(number).name)) for number in range(model.nsite)]
    return [(number, name) for number, name in names if name == "tool0" or name.startswith("dh_")]


def draw_frames(
    pixels: NDArray[np.uint8], data: Any, sites: Sequence[tuple[int, str]], pinhole: Pinhole, extent: float
) -> NDArray[np.uint8]:
    """Draw three arrows for every frame over a picture, and its name; frames at one point share the label.

    Args:
        pixels: the picture, shape (height, width, 3).
        data: ``mujoco.MjData`` with the poses of the sites.
        sites: numbers and names.
        pinhole: the camera of the picture.
        extent: of the scene, m.

    Returns:
        The new picture.
    """
    from PIL import Image, ImageDraw

    # a tall picture shows things no larger than a broad one
    height = min(pixels.shape[0], 0.75 * pixels.shape[1])
    picture = Image.fromarray(pixels)
    places: list[tuple[Array, list[str]]] = []
    arrows: list[Arrow] = []
    for number, name in sites:
        origin, R = np.array(data.site_xpos[number]), np.array(data.site_xmat[number]).reshape(3, 3)
        tips = origin + AXIS_LENGTH * extent * R.T
        ends = pinhole.pixels(np.concatenate([origin[None], tips]), picture.size)
        depths = pinhole.project(tips)[:, 2]
        arrows += [(float(depths[k]), ends[0], ends[k + 1], AXIS_COLORS[k]) for k in range(3)]
        for place, names in places:
            if np.abs(place - ends[0]).max() < 0.75:
                names.append(name)
                break
        else:
            places.append((ends[0], [name]))
    arrows = [arrow for arrow in arrows if np.isfinite([arrow[1], arrow[2]]).all()]
    _draw_arrows(picture, sorted(arrows, key=lambda arrow: -arrow[0]), max(1.6, height / THIN))
    _write_labels(ImageDraw.Draw(picture), [(place, joined_label(names)) for place, names in places], height)
    return np.asarray(picture, dtype=np.uint8)


def joined_label(names: Sequence[str]) -> str:
    """Return one label for frames at one point: ``dh_3, dh_4, tool0``, and ``dh_1…dh_4`` for three or more."""
    rows = [name for name in names if name.startswith("dh_")]
    others = [name for name in names if not name.startswith("dh_")]
    numbers = [int(name[3:]) for name in rows]
    if len(rows) > 2 and numbers == list(range(numbers[0], numbers[0] + len(rows))):
        rows = [f"{rows[0]}…{rows[-1]}"]
    return ", ".join([*rows, *others])


def _draw_arrows(picture: Image, arrows: Sequence[Arrow], width: float) -> None:
    """Draw arrows in their order, on a finer layer that is just as large as they need."""
    from PIL import Image, ImageDraw

    if not arrows:
        return
    points = np.stack([point for arrow in arrows for point in arrow[1:3]])
    low = np.clip(np.floor(points.min(axis=0) - 3 * width), 0, picture.size).astype(int)
    high = np.clip(np.ceil(points.max(axis=0) + 3 * width), 0, picture.size).astype(int)
    if (high <= low).any():
        return
    columns, rows = (high - low).tolist()
    layer = Image.new("RGBA", (FINER * columns, FINER * rows))
    pen = ImageDraw.Draw(layer)
    for _, start, end, color in arrows:
        _arrow(pen, FINER * (start - low), FINER * (end - low), FINER * width, color)
    layer = layer.reduce(FINER)
    picture.paste(layer, tuple(low.tolist()), layer)


def _arrow(pen: ImageDraw, start: Array, end: Array, width: float, color: Color) -> None:
    along = end - start
    length = float(np.hypot(*along))
    if length < 0.5 * width:  # it points at the camera
        pen.ellipse([*(start - width), *(start + width)], fill=color)
        return
    along = along / length
    aside = np.array([-along[1], along[0]])
    head = min(4.2 * width, 0.6 * length)
    neck = end - head * along
    corners = [
        start + aside * width / 2,
        neck + aside * width / 2,
        neck - aside * width / 2,
        start - aside * width / 2,
    ]
    pen.polygon([tuple(corner) for corner in corners], fill=color)
    pen.polygon([tuple(end), tuple(neck + 0.4 * head * aside), tuple(neck - 0.4 * head * aside)], fill=color)


def _write_labels(pen: ImageDraw, texts: Sequence[tuple[Array, str]], height: float) -> None:
    """Write names to the lower left of points, each moved up or down where another is in the way."""
    from PIL import ImageFont

    size = max(11.0, height / 42)
    font = ImageFont.load_default(size)
    taken: list[tuple[float, float, float]] = []
    for place, text in sorted(texts, key=lambda entry: (entry[0][1], entry[0][0])):
        if not np.isfinite(place).all():
            continue
        width = float(pen.textlength(text, font))
        left, top = float(place[0]) - width - 0.6 * size, float(place[1]) + 0.2 * size
        beside = np.array([y for start, end, y in taken if start < left + width and left < end])
        top -= vertical_shift(-top, -beside, size)
        taken.append((left, left + width, top))
        pen.text((left, top), text, fill=INK, font=font, stroke_width=max(1, round(size / 7)), stroke_fill=PAPER)


def simplified(points: Array, tolerance: float) -> list[int]:
    """Return the indices of the points between which straight lines pass all others within a tolerance.

    The first and the last are among them.

    Args:
        points: shape (count, 3), m.
        tolerance: m.
    """
    kept, last = [0], len(points) - 1
    end = 1
    while end < last:
        start, ahead = points[kept[-1]], points[end + 1]
        between = points[kept[-1] + 1 : end + 1] - start
        along = ahead - start
        square = float(along @ along)
        shares = np.clip(between @ along / square, 0.0, 1.0) if square > 0.0 else np.zeros(len(between))
        if np.linalg.norm(between - shares[:, None] * along, axis=1).max() > tolerance:
            kept.append(end)
        end += 1
    return [*kept, last]


def add_trace(scene: Any, points: Array, radius: float) -> None:
    """Add a line through points to a scene; it is pale where it begins.

    Args:
        scene: ``mujoco.MjvScene``, updated before.
        points: shape (count, 3), m.
        radius: of the line, m.
    """
    cylinder = mujoco.mjtGeom.mjGEOM_CYLINDER.value  # a capsule takes ten times as long to draw
    old, new = np.array(TRACE_OLD), np.array(TRACE_NEW)
    nothing, upright = np.zeros(3), np.eye(3).ravel()
    count = len(points) - 1
    for k in range(count):
        if scene.ngeom >= scene.maxgeom:
            return
        geom = scene.geoms[scene.ngeom]
        rgba = np.array([*(old + (new - old) * ((k + 1) / count)), 1.0], dtype=np.float32)
        mujoco.mjv_initGeom(geom, cylinder, nothing, nothing, upright, rgba)
        mujoco.mjv_connector(geom, cylinder, radius, points[k], points[k + 1])
        # decoration casts no shadow; the place in the scene may have been another object's before
        geom.category = mujoco.mjtCatBit.mjCAT_DECOR.value
        geom.objtype, geom.objid, geom.segid = mujoco.mjtObj.mjOBJ_UNKNOWN.value, -1, -1
        geom.emission, geom.specular, geom.shininess = 0.3, 0.0, 0.0
        scene.ngeom += 1
