"""The actuators of a compiled model, as controllers in control space need to know them."""

from __future__ import annotations

import mujoco
import numpy as np

from dh2sim.robot.spec import ActuatorType
from dh2sim.simulate.controllers.protocol import Lanes
from dh2sim.simulate.plant import Plant
from dh2sim.typing import Array


def actuator_types(plant: Plant) -> tuple[ActuatorType, ...]:
    """Return what each actuator takes for its control: a position, a velocity, or a force."""
    model = plant.model
    types = []
    for i in range(model.nu):
        if model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_NONE:
            types.append(ActuatorType.MOTOR)
        elif model.actuator_biasprm[i, 1] != 0.0:
            types.append(ActuatorType.POSITION)
        elif model.actuator_gainprm[i, 0] == -model.actuator_biasprm[i, 2]:
            types.append(ActuatorType.VELOCITY)
        else:  # a position actuator of zero stiffness
            types.append(ActuatorType.POSITION)
    return tuple(types)


def of_type(plant: Plant, kind: ActuatorType) -> Array:
    """Return which actuators are of a type, as a boolean array of shape (actuators,)."""
    return np.array([found is kind for found in actuator_types(plant)], dtype=bool)


def driven_joints(plant: Plant) -> list[int]:
    """Return for each actuator the number of its joint, to index the last axis of an array with."""
    return list(plant.driven)


def holding_controls(lanes: Lanes, *, against_gravity: bool) -> Array:
    """Return the controls that keep a robot near its start, inside their ranges, shape (batch, actuators).

    Positions: the start, and with ``against_gravity`` as much more as makes the actuator's pull, kp times the
    difference, balance gravity. Velocities and forces: 0, and for forces with ``against_gravity`` that of gravity.
    """
    plant = lanes.plant
    joints = driven_joints(plant)
    position, motor = of_type(plant, ActuatorType.POSITION), of_type(plant, ActuatorType.MOTOR)
    start, load = lanes.q0[:, joints], lanes.gravity0[:, joints]
    controls = np.where(position, start, 0.0)
    if against_gravity:
        kp = plant.model.actuator_gainprm[:, 0]
        pulls = position & (kp > 0.0)
        controls = controls + np.where(pulls, load / np.where(pulls, kp, 1.0), np.where(motor, load, 0.0))
    return np.clip(controls, plant.control_lower, plant.control_upper)
