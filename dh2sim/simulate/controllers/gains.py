"""Gains that time steps are short enough for."""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from dh2sim.simulate.plant import Plant
from dh2sim.typing import Array

MOST: Final = 0.4
"""Share of its velocity that damping may take from a joint in one time step; from 2 on the arm would tremble."""


def steady_gains(plant: Plant) -> tuple[Array, Array]:
    """Return the robot's stiffness and damping, softened as much as a torque that is held for a time step requires.

    A position actuator's own damping is integrated implicitly, and may be as strong as one likes; that of a
    controller is not. With inertia M, damping D and time step h the velocities of the next step are (1 - h M⁻¹ D)
    times the present ones, so h times the largest eigenvalue of M⁻¹ D is kept below ``MOST``, at home. Stiffness goes
    with the square, which keeps the damping ratio.

    Returns:
        Stiffness, N·m/rad or N/m, and damping, N·m·s/rad or N·s/m, each of shape (n,).
    """
    if plant.n == 0:
        return plant.kp, plant.kv
    model = plant.model
    data = mujoco.MjData(model)
    data.qpos[model.nq - plant.n :] = plant.home
    mujoco.mj_forward(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    joints = slice(model.nv - plant.n, None)
    root = np.sqrt(plant.kv)
    quickness = root[:, None] * np.linalg.inv(inertia)[joints, joints] * root
    taken = plant.timestep * float(np.linalg.eigvalsh(quickness)[-1])
    share = min(1.0, MOST / taken) if taken > 0.0 else 1.0
    share = float(f"{share:.3g}")  # the last bits of an eigenvalue are not the same on every machine
    return plant.kp * share * share, plant.kv * share
