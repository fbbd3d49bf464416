"""The scene around the robot is made for the robot at home; here it is made large enough for a motion."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dh2sim.simulate.pictures.backend import import_mujoco
from dh2sim.typing import Array

GAP = 0.1
"""Between the lowest part of the robot and a floor that had to be lowered, as a share of the scene's extent."""
BRIGHTEST = 1.07
"""Light of all lamps on the floor, together."""
PEDESTAL_COLOR = (0.62, 0.64, 0.68, 1.0)


def widen(model: Any, points: Array, *, floor: bool = True) -> None:
    """Lower the floor under the whole motion, and move the lights so that all of it has a shadow.

    A run is simulated without a floor: it only shows.

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
        model.geom_pos[ground, 2] = lowest - GAP * size
        if pedestal >= 0:
            model.geom_pos[pedestal, 2] = model.geom_pos[ground, 2] / 2
            model.geom_size[pedestal, 1] = -model.geom_pos[ground, 2] / 2
    for geom, shown in ((ground, floor), (pedestal, not _floats(model))):
        if geom >= 0 and not shown:
            model.geom_matid[geom] = -1
            model.geom_rgba[geom] = 0.0


def dim(model: Any, elevation: float) -> None:
    """Take light from the lamp at the camera where it looks down so steeply that the floor would be all white.

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
    """Make the surroundings in a scene as they shall be drawn.

    The floor takes no part in the shadows' map, where a plane without end makes stains of rounding errors; a shadow
    falls on it all the same. And a base that would hang in the air above a lowered floor gets a pedestal.

    Args:
        scene: ``mujoco.MjvScene``, updated before.
        model: ``mujoco.MjModel``, after ``widen``.
    """
    mujoco = import_mujoco()
    for number in range(scene.ngeom):
        if scene.geoms[number].type == mujoco.mjtGeom.mjGEOM_PLANE.value:
            scene.geoms[number].category = mujoco.mjtCatBit.mjCAT_DECOR.value
    _add_pedestal(scene, model)


def foot(model: Any) -> Array:
    """Return corners around where the pedestal stands on the floor, shape (4, 3), m; (0, 3) if there is none.

    Args:
        model: ``mujoco.MjModel``, after ``widen``.
    """
    radius, z = _pedestal(model)
    corners = [[x * radius, y * radius, z] for x in (-1, 1) for y in (-1, 1)]
    return np.array(corners if radius > 0.0 else []).reshape(-1, 3)


def _pedestal(model: Any) -> tuple[float, float]:
    """Radius of the pedestal, 0 if there is none, and height of the floor, m."""
    mujoco = import_mujoco()
    floor, base = _geom(model, "floor"), mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY.value, "base_link")
    if floor < 0 or base < 0 or _floats(model) or model.geom_pos[floor, 2] >= 0.0:
        return 0.0, 0.0
    z, own = float(model.geom_pos[floor, 2]), _geom(model, "pedestal")
    if own >= 0:
        return float(model.geom_size[own, 0]), z
    widths = model.geom_size[model.geom_bodyid == base, 0]
    return 0.8 * float(widths.max(initial=0.0)), z


def _add_pedestal(scene: Any, model: Any) -> None:
    mujoco = import_mujoco()
    radius, z = _pedestal(model)
    if radius == 0.0 or _geom(model, "pedestal") >= 0 or scene.ngeom >= scene.maxgeom:
        return
    geom = scene.geoms[scene.ngeom]
    size, place = np.array([radius, radius, -z / 2]), np.array([0.0, 0.0, z / 2])
    rgba = np.array(PEDESTAL_COLOR, dtype=np.float32)
    mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_CYLINDER.value, size, place, np.eye(3).ravel(), rgba)
    geom.category = mujoco.mjtCatBit.mjCAT_STATIC.value
    scene.ngeom += 1


def _geom(model: Any, name: str) -> int:
    mujoco = import_mujoco()
    return int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM.value, name))


def _floats(model: Any) -> bool:
    mujoco = import_mujoco()
    return bool(model.njnt > 0 and model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE.value)
