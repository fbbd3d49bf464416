"""Pictures of a motion, one at a time, rendered by MuJoCo.

The scene around the robot is made for the robot at home; here it is made large enough for a motion.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from dh2sim.draw.camera import CameraChoice, extreme_points, follows_base, make_camera
from dh2sim.draw.markers import TRACE_RADIUS, add_trace, draw_frames, frame_sites, simplified
from dh2sim.draw.motion import Motion
from dh2sim.draw.offscreen import open_renderer
from dh2sim.draw.projection import scene_pinhole
from dh2sim.errors import PictureError
from dh2sim.typing import Array

GAP = 0.1
"""Between the lowest part of the robot and a floor that had to be lowered, as a share of the scene's extent."""
BRIGHTEST = 1.07
"""Light that all lamps together throw on the floor."""
PEDESTAL_COLOR = (0.62, 0.64, 0.68, 1.0)


def widen(model: Any, points: Array, *, floor: bool = True) -> None:
    """Lower the floor under the whole motion, and move the lights so that all of it casts a shadow.

    Runs are simulated without a floor; it is only shown.

    Args:
        model: ``mujoco.MjModel``, changed in place.
        points: of the motion, shape (count, 3), m.
        floor: whether there is one.
    """
    size = float(model.stat.extent)
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    radius = float(np.linalg.norm(points - centre, axis=1).max())
    if radius > size:
        model.light_pos[:] = centre + (model.light_pos - model.stat.center) * (radius / size)
        model.stat.center[:] = centre
        model.stat.extent = radius
    ground, pedestal = _geom(model, "floor"), _geom(model, "pedestal")
    lowest = float(points[:, 2].min())
    if ground >= 0 and lowest < model.geom_pos[ground, 2] - 1e-6 * size:
        z = lowest - GAP * size
        model.geom_pos[ground, 2] = z
        if pedestal >= 0:
            top = float(model.geom_pos[pedestal, 2] + model.geom_size[pedestal, 1])
            model.geom_pos[pedestal, 2] = (top + z) / 2
            model.geom_size[pedestal, 1] = (top - z) / 2
    for geom, shown in ((ground, floor), (pedestal, not _floats(model))):
        if geom >= 0 and not shown:
            model.geom_matid[geom] = -1
            model.geom_rgba[geom] = 0.0


def dim(model: Any, elevation: float) -> None:
    """Dim the light at the camera where it looks down so steeply that the floor would be all white.

    Args:
        model: ``mujoco.MjModel``, changed in place.
        elevation: of the direction of sight, degrees.
    """
    ambient, down = float(model.vis.headlight.ambient[0]), abs(math.sin(math.radians(elevation)))
    others = sum(float(color[0]) for color in model.light_diffuse)
    allowed = max(0.1, BRIGHTEST - ambient - others)
    if down * float(model.vis.headlight.diffuse[0]) > allowed:
        model.vis.headlight.diffuse[:] = allowed / down


def complete(scene: Any, model: Any) -> None:
    """Finish the surroundings in a scene.

    The floor is left out of the shadow map, in which an infinite plane makes stains by rounding; shadows fall on it
    all the same. A base that would hang in the air above a lowered floor gets a pedestal.

    Args:
        scene: ``mujoco.MjvScene``, updated before.
        model: ``mujoco.MjModel``, after ``widen``.
    """
    for number in range(scene.ngeom):
        if scene.geoms[number].type == mujoco.mjtGeom.mjGEOM_PLANE.value:
            scene.geoms[number].category = mujoco.mjtCatBit.mjCAT_DECOR.value
    _add_pedestal(scene, model)


def foot(model: Any) -> Array:
    """Return corners around the foot of the pedestal on the floor, shape (4, 3), m; (0, 3) if there is none.

    Args:
        model: ``mujoco.MjModel``, after ``widen``.
    """
    radius, z, _ = _pedestal(model)
    corners = [[x * radius, y * radius, z] for x in (-1, 1) for y in (-1, 1)]
    return np.array(corners if radius > 0.0 else []).reshape(-1, 3)


def _pedestal(model: Any) -> tuple[float, float, float]:
    """Radius of the pedestal, 0 if there is none, and heights of the floor and of the foot of the base, m."""
    floor, base = _geom(model, "floor"), mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY.value, "base_link")
    if floor < 0 or base < 0 or _floats(model):
        return 0.0, 0.0, 0.0
    z, own = float(model.geom_pos[floor, 2]), _geom(model, "pedestal")
    if own >= 0:
        return float(model.geom_size[own, 0]), z, float(model.geom_pos[own, 2] + model.geom_size[own, 1])
    parts = np.flatnonzero((model.geom_bodyid == base) & (model.geom_type == mujoco.mjtGeom.mjGEOM_CYLINDER.value))
    if not parts.size:
        return 0.0, 0.0, 0.0
    plate, *others = (float(model.geom_pos[part, 2] - model.geom_size[part, 1]) for part in parts)
    if z >= plate - 1e-9 or any(other < plate for other in others):  # on the floor, or hanging
        return 0.0, 0.0, 0.0
    return 0.8 * float(model.geom_size[parts, 0].max()), z, plate


def _add_pedestal(scene: Any, model: Any) -> None:
    radius, z, top = _pedestal(model)
    if radius == 0.0 or _geom(model, "pedestal") >= 0 or scene.ngeom >= scene.maxgeom:
        return
    geom = scene.geoms[scene.ngeom]
    size, place = np.array([radius, radius, (top - z) / 2]), np.array([0.0, 0.0, (top + z) / 2])
    rgba = np.array(PEDESTAL_COLOR, dtype=np.float32)
    mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_CYLINDER.value, size, place, np.eye(3).ravel(), rgba)
    geom.category = mujoco.mjtCatBit.mjCAT_STATIC.value
    scene.ngeom += 1


def _geom(model: Any, name: str) -> int:
    return int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM.value, name))


def _floats(model: Any) -> bool:
    return bool(model.njnt > 0 and model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE.value)


SMALLEST, LARGEST = 64, 8192
"""Width and height of pictures, pixels."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureOptions:
    """Size of pictures, camera, and what is shown beside the robot."""

    width: int = 1280
    """Pixels."""
    height: int = 720
    """Pixels."""
    camera: CameraChoice = field(default_factory=CameraChoice)
    frames: bool = False
    """Whether the DH frames are shown."""
    trace: bool = True
    """Whether the path of the tool is shown."""

    def __post_init__(self) -> None:
        """Check the size.

        Raises:
            PictureError: it is too small or too large.
        """
        for name, value in (("width", self.width), ("height", self.height)):
            if not SMALLEST <= value <= LARGEST:
                raise PictureError(f"the {name} must be from {SMALLEST} to {LARGEST} pixels, got {value}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionRenderer:
    """A motion in front of a camera; made by ``open_motion``."""

    motion: Motion
    options: PictureOptions
    data: Any = field(repr=False)
    renderer: Any = field(repr=False)
    """``mujoco.Renderer``."""
    camera: Any = field(repr=False)
    """``mujoco.MjvCamera``."""
    travel: Array = field(repr=False)
    """How far the camera has followed the base, m, shape (positions, 3)."""
    lookat: Array = field(repr=False)
    """Where the camera looks at first, m, shape (3,)."""
    size: float
    """Radius of a ball around the robot at home, m: the measure of everything that is drawn beside it."""
    samples: Array = field(repr=False)
    """Indices of the positions between which the trace is drawn, shape (count,)."""
    trace: Array = field(repr=False)
    """Positions of the tool there, shape (count, 3), m; none where the trace is not shown."""

    def picture(self, number: int) -> NDArray[np.uint8]:
        """Render the robot in one of its positions.

        Args:
            number: index of the position.

        Returns:
            Red, green, blue, from the top left corner, shape (height, width, 3).
        """
        model, options = self.motion.model, self.options
        self.motion.place(self.data, number)
        self.camera.lookat[:] = self.lookat + self.travel[number]
        self.renderer.update_scene(self.data, self.camera)
        scene = self.renderer.scene
        complete(scene, model)
        if len(self.trace):
            past = int(np.searchsorted(self.samples, number))
            here = self.data.site_xpos[_tool(model)][None, :]
            add_trace(scene, np.concatenate([self.trace[:past], here]), TRACE_RADIUS * self.size)
        pixels: NDArray[np.uint8] = self.renderer.render()
        if options.frames:
            pinhole = scene_pinhole(scene, options.height)
            pixels = draw_frames(pixels, self.data, frame_sites(model), pinhole, self.size)
        return pixels


@contextmanager
def open_motion(motion: Motion, options: PictureOptions) -> Iterator[MotionRenderer]:
    """Set everything up to render pictures of a motion without a screen.

    Args:
        motion: what moves; its model is changed in place.
        options: size, camera, and what else is shown.

    Raises:
        PictureError: nothing can render here, or the model has no such camera.
    """
    model, size = motion.model, float(motion.model.stat.extent)
    follows = follows_base(options.camera, motion)
    points = extreme_points(motion, follows=follows)
    widen(model, points, floor=not follows)
    points = np.concatenate([points, foot(model)])
    camera = make_camera(options.camera, model, points, options.width / options.height)
    dim(model, float(camera.elevation))
    data = mujoco.MjData(model)
    samples, trace = np.zeros(0), np.zeros((0, 3))
    if options.trace and len(motion.time) > 1:
        samples = np.array(motion.sampled(), dtype=float)
        trace = np.array([_tool_position(motion, data, int(number)) for number in samples])
        kept = simplified(trace, TRACE_RADIUS / 6 * size)
        samples, trace = samples[kept], trace[kept]
    # a shadow map finer than the picture would only take time
    finest = 2 ** math.ceil(math.log2(4 * max(options.width, options.height)))
    model.vis.quality.shadowsize = min(int(model.vis.quality.shadowsize), finest)
    max_geom = model.ngeom + len(trace) + 100
    with open_renderer(model, options.width, options.height, max_geom=max_geom) as renderer:
        # an infinite floor is drawn around where the camera was at the update before
        motion.place(data, 0)
        renderer.update_scene(data, camera)
        yield MotionRenderer(
            motion=motion,
            options=options,
            data=data,
            renderer=renderer,
            camera=camera,
            travel=motion.travel if follows else np.zeros((len(motion.time), 3)),
            lookat=np.array(camera.lookat),
            size=size,
            samples=samples,
            trace=trace,
        )


def _tool(model: Any) -> int:
    return int(model.site("tool0").id)


def _tool_position(motion: Motion, data: Any, number: int) -> Array:
    motion.place(data, number)
    return np.array(data.site_xpos[_tool(motion.model)])
