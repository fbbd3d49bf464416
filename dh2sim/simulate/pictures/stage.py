"""Pictures of a motion, one at a time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import PictureError
from dh2sim.simulate.pictures.backend import gl_context, import_mujoco
from dh2sim.simulate.pictures.camera import View, extreme_points, goes_along, make_camera
from dh2sim.simulate.pictures.markers import TRACE_RADIUS, add_trace, corners, draw_frames, frame_sites
from dh2sim.simulate.pictures.motion import Motion
from dh2sim.simulate.pictures.projection import scene_projection
from dh2sim.simulate.pictures.surroundings import complete, dim, foot, widen
from dh2sim.typing import Array

SMALLEST, LARGEST = 64, 8192
"""Width and height of pictures, pixels."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """How pictures look."""

    width: int = 1280
    height: int = 720
    view: View = field(default_factory=View)
    frames: bool = False
    """Whether the DH frames are shown."""
    trace: bool = True
    """Whether the way of the tool is shown."""

    def __post_init__(self) -> None:
        """Check the size.

        Raises:
            PictureError: it is too small or too large.
        """
        for name, value in (("width", self.width), ("height", self.height)):
            if not SMALLEST <= value <= LARGEST:
                raise PictureError(f"the {name} of {value} pixels is not from {SMALLEST} to {LARGEST}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stage:
    """A motion in front of a camera; made by ``stage``."""

    motion: Motion
    look: Look
    data: Any = field(repr=False)
    scene: Any = field(repr=False)
    camera: Any = field(repr=False)
    resources: Any = field(repr=False)
    travel: Array = field(repr=False)
    """How far the camera has gone along with the robot, m, shape (positions, 3)."""
    lookat: Array = field(repr=False)
    """Where the camera looks at first, m, shape (3,)."""
    size: float
    """Radius of a ball around the robot at home, m: the measure of everything that is drawn beside it."""
    samples: Array = field(repr=False)
    """Numbers of the positions between which the trace is drawn, shape (count,)."""
    trace: Array = field(repr=False)
    """Positions of the tool there, shape (count, 3), m; none where the trace is not shown."""

    def picture(self, number: int) -> NDArray[np.uint8]:
        """Draw the robot in one of its positions.

        Args:
            number: of the position.

        Returns:
            Red, green, blue, from top left, shape (height, width, 3).
        """
        mujoco = import_mujoco()
        model = self.motion.model
        self.motion.place(self.data, number)
        self.camera.lookat[:] = self.lookat + self.travel[number]
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(model, self.data, mujoco.MjvOption(), None, self.camera, everything, self.scene)
        complete(self.scene, model)
        if len(self.trace):
            past = int(np.searchsorted(self.samples, number))
            here = self.data.site_xpos[_tool(model)][None, :]
            add_trace(self.scene, np.concatenate([self.trace[:past], here]), TRACE_RADIUS * self.size)
        area = mujoco.MjrRect(0, 0, self.look.width, self.look.height)
        mujoco.mjr_render(area, self.scene, self.resources)
        pixels = np.empty((self.look.height, self.look.width, 3), dtype=np.uint8)
        mujoco.mjr_readPixels(pixels, None, area, self.resources)
        pixels = np.ascontiguousarray(pixels[::-1])
        if self.look.frames:
            projection = scene_projection(self.scene, self.look.width, self.look.height)
            pixels = draw_frames(pixels, self.data, frame_sites(model), projection, self.size)
        return pixels


@contextmanager
def stage(motion: Motion, look: Look) -> Iterator[Stage]:
    """Set everything up to draw pictures of a motion without a screen.

    Args:
        motion: what moves.
        look: size, camera, and what else is shown.

    Raises:
        PictureError: nothing can draw here, or the model has no such camera.
    """
    mujoco = import_mujoco()
    model, size = motion.model, float(motion.model.stat.extent)
    along = goes_along(look.view, motion)
    points = extreme_points(motion, along=along)
    widen(model, points, floor=not along)
    points = np.concatenate([points, foot(model)])
    camera = make_camera(look.view, model, points, look.width / look.height)
    dim(model, float(camera.elevation))
    data = mujoco.MjData(model)
    samples, trace = np.zeros(0), np.zeros((0, 3))
    if look.trace and len(motion.time) > 1:
        samples = np.array(motion.sampled(), dtype=float)
        trace = np.array([_tool_position(motion, data, int(number)) for number in samples])
        kept = corners(trace, TRACE_RADIUS / 6 * size)
        samples, trace = samples[kept], trace[kept]
    scene = mujoco.MjvScene(model, model.ngeom + len(trace) + 100)
    # a map of shadows finer than the picture would only take time
    finest = 2 ** math.ceil(math.log2(4 * max(look.width, look.height)))
    model.vis.quality.shadowsize = min(int(model.vis.quality.shadowsize), finest)
    # a floor without end is drawn around where the camera was at the update before
    motion.place(data, 0)
    everything = mujoco.mjtCatBit.mjCAT_ALL.value
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, everything, scene)
    with gl_context(model, look.width, look.height) as resources:
        yield Stage(
            motion=motion,
            look=look,
            data=data,
            scene=scene,
            camera=camera,
            resources=resources,
            travel=motion.travel if along else np.zeros((len(motion.time), 3)),
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
