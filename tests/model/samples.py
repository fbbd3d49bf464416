"""MuJoCo's view of models."""

from __future__ import annotations

import mujoco
import numpy as np

from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array


def compiled(built: RobotModel) -> mujoco.MjModel:
    """What MuJoCo makes of a model's MJCF."""
    return mujoco.MjModel.from_xml_string(to_mjcf(built))


def body_inertia(mj: mujoco.MjModel, body: int) -> Array:
    """A body's inertia about its centre of mass, along the body's axes, shape (3, 3)."""
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, mj.body_iquat[body])
    R = rotation.reshape(3, 3)
    tensor: Array = R @ np.diag(mj.body_inertia[body]) @ R.T
    return tensor
