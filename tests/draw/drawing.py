"""What tests that draw for real need."""

from __future__ import annotations

import functools
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from dh2sim.draw.motion import Motion, motion_of_run
from dh2sim.draw.offscreen import open_renderer
from dh2sim.draw.renderer import MotionRenderer
from dh2sim.draw.rollout_data import select_rollout
from dh2sim.errors import PictureError
from tests.draw.datasets import swinging


@functools.cache
def _why_not() -> str:
    try:
        with open_renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 64, 64):
            return ""
    except PictureError as error:
        return str(error)


def require_gl() -> None:
    """Skip a test where nothing can render, and say what to install."""
    if _why_not():
        pytest.skip(_why_not())


def moving(robot: str = "rpr") -> Motion:
    return motion_of_run(select_rollout(swinging(robot), 0, "run.zarr"))


def robot_seen(renderer: MotionRenderer, number: int) -> NDArray[np.bool_]:
    """Which pixels show a part of the robot, by MuJoCo's own segmentation."""
    flags = (mujoco.mjtRndFlag.mjRND_SEGMENT.value, mujoco.mjtRndFlag.mjRND_IDCOLOR.value)
    for flag in flags:
        renderer.renderer.scene.flags[flag] = 1
    colors = renderer.picture(number).astype(int)
    for flag in flags:
        renderer.renderer.scene.flags[flag] = 0
    model: Any = renderer.motion.model
    scene = renderer.renderer.scene
    geoms = scene.geoms[: scene.ngeom]
    parts = [
        geom.segid + 1
        for geom in geoms
        if geom.objtype == mujoco.mjtObj.mjOBJ_GEOM.value and model.geom_bodyid[geom.objid] > 0
    ]
    return np.isin(colors[:, :, 0] + (colors[:, :, 1] << 8) + (colors[:, :, 2] << 16), parts)
