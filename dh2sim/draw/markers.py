"""What is drawn beside the robot itself: its DH frames with their names, and the trace of its tool.

Frames sit inside links, so they are drawn over the picture. The trace is a part of the scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dh2sim.draw.offscreen import import_mujoco
from dh2sim.draw.projection import Projection
from dh2sim.typing import Array

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

Color = tuple[int, int, int]
Arrow = tuple[float, Array, Array, Color]
"""How far away its tip is, where it begins and ends in the picture, and its colour."""
AXIS_COLORS: tuple[Color, Color, Color] = ((224, 36, 30), (24, 150, 44), (28, 84, 232))
"""x red, y green, z blue, as everybody has them."""
INK: Color = (28, 30, 36)
PAPER: Color = (255, 255, 255)
TRACE_OLD, TRACE_NEW = (0.48, 0.66, 0.86), (0.00, 0.28, 0.66)
AXIS_LENGTH, TRACE_RADIUS = 0.17, 0.006
"""As a share of the radius of a ball around the robot at home."""
THIN = 320.0
"""Arrows are as thick as a picture is high, divided by this."""
FINER = 3
"""Arrows are drawn so much larger, and reduced, for smooth edges."""


def frame_sites(model: Any) -> list[tuple[int, str]]:
    """Return numbers and names of the sites that are frames: dh_0 to dh_n, and tool0."""
    names = [(number, str(model.site(number).name)) for number in range(model.nsite)]
    return [(number, name) for number, name in names if name == "tool0" or name.startswith("dh_")]


def draw_frames(
    pixels: NDArray[np.uint8], data: Any, sites: Sequence[tuple[int, str]], projection: Projection, extent: float
) -> NDArray[np.uint8]:
    """Draw three arrows for every frame over a picture, and its name; frames at one point share the label.

    Args:
        pixels: the picture, shape (height, width, 3).
        data: ``mujoco.MjData`` with the poses of the sites.
        sites: numbers and names.
        projection: of the picture.
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
        ends = projection.pixels(np.concatenate([origin[None], tips]))
        depths = projection.depth(tips)
        arrows += [(float(depths[k]), ends[0], ends[k + 1], AXIS_COLORS[k]) for k in range(3)]
        for place, names in places:
            if np.abs(place - ends[0]).max() < 0.75:
                names.append(name)
                break
        else:
            places.append((ends[0], [name]))
    arrows = [arrow for arrow in arrows if np.isfinite([arrow[1], arrow[2]]).all()]
    _draw_arrows(picture, sorted(arrows, key=lambda arrow: -arrow[0]), max(1.6, height / THIN))
    _labels(ImageDraw.Draw(picture), [(place, together(names)) for place, names in places], height)
    return np.asarray(picture, dtype=np.uint8)


def together(names: Sequence[str]) -> str:
    """Return one label for frames at one point: ``dh_3, dh_4, tool0``, and ``dh_1…dh_4`` for three or more."""
    rows = [name for name in names if name.startswith("dh_")]
    others = [name for name in names if not name.startswith("dh_")]
    numbers = [int(name[3:]) for name in rows]
    if len(rows) > 2 and numbers == list(range(numbers[0], numbers[0] + len(rows))):
        rows = [f"{rows[0]}…{rows[-1]}"]
    return ", ".join([*rows, *others])


def corners(points: Array, tolerance: float) -> list[int]:
    """Return numbers of the points that a line needs to pass all of them within a tolerance; first and last included.

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
    """Add a line through points to a scene, pale where it begins.

    Args:
        scene: ``mujoco.MjvScene``, updated before.
        points: shape (count, 3), m.
        radius: of the line, m.
    """
    mujoco = import_mujoco()
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
        # decoration casts no shadow, and is not what stood in this place of the scene before
        geom.category = mujoco.mjtCatBit.mjCAT_DECOR.value
        geom.objtype, geom.objid, geom.segid = mujoco.mjtObj.mjOBJ_UNKNOWN.value, -1, -1
        geom.emission, geom.specular, geom.shininess = 0.3, 0.0, 0.0
        scene.ngeom += 1


def _draw_arrows(picture: Image, arrows: Sequence[Arrow], thick: float) -> None:
    """Draw arrows in their order on a finer layer just as large as they need."""
    from PIL import Image, ImageDraw

    if not arrows:
        return
    points = np.stack([point for arrow in arrows for point in arrow[1:3]])
    low = np.clip(np.floor(points.min(axis=0) - 3 * thick), 0, picture.size).astype(int)
    high = np.clip(np.ceil(points.max(axis=0) + 3 * thick), 0, picture.size).astype(int)
    if (high <= low).any():
        return
    width, height = (high - low).tolist()
    layer = Image.new("RGBA", (FINER * width, FINER * height))
    pen = ImageDraw.Draw(layer)
    for _, start, end, color in arrows:
        _arrow(pen, FINER * (start - low), FINER * (end - low), FINER * thick, color)
    layer = layer.reduce(FINER)
    picture.paste(layer, tuple(low.tolist()), layer)


def _arrow(pen: ImageDraw, start: Array, end: Array, thick: float, color: Color) -> None:
    along = end - start
    length = float(np.hypot(*along))
    if length < 0.5 * thick:  # it points at the camera
        pen.ellipse([*(start - thick), *(start + thick)], fill=color)
        return
    along = along / length
    aside = np.array([-along[1], along[0]])
    head = min(4.2 * thick, 0.6 * length)
    neck = end - head * along
    corners = [
        start + aside * thick / 2,
        neck + aside * thick / 2,
        neck - aside * thick / 2,
        start - aside * thick / 2,
    ]
    pen.polygon([tuple(corner) for corner in corners], fill=color)
    pen.polygon([tuple(end), tuple(neck + 0.4 * head * aside), tuple(neck - 0.4 * head * aside)], fill=color)


def _labels(pen: ImageDraw, texts: Sequence[tuple[Array, str]], height: float) -> None:
    """Write names beside points, each below those that are in its way."""
    from PIL import ImageFont

    size = max(11.0, height / 42)
    font = ImageFont.load_default(size)
    taken: list[tuple[float, float, float, float]] = []
    for place, text in sorted(texts, key=lambda entry: (entry[0][1], entry[0][0])):
        if not np.isfinite(place).all():
            continue
        across = float(pen.textlength(text, font))
        x, y = float(place[0]) - across - 0.6 * size, float(place[1]) + 0.2 * size
        while (over := _overlapped((x, y, x + across, y + size), taken)) is not None:
            y = over
        taken.append((x, y, x + across, y + size))
        pen.text((x, y), text, fill=INK, font=font, stroke_width=max(1, round(size / 7)), stroke_fill=PAPER)


def _overlapped(
    box: tuple[float, float, float, float], taken: Sequence[tuple[float, float, float, float]]
) -> float | None:
    """Return the lower edge of a box that overlaps, or None."""
    for left, top, right, bottom in taken:
        if left < box[2] and box[0] < right and top < box[3] and box[1] < bottom:
            return bottom
    return None
