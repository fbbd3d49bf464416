"""Actuators: gains that the robot file leaves open."""

from __future__ import annotations

import math

from dh2sim.model.layout import neat
from dh2sim.model.robot_model import ActuatorModel
from dh2sim.robot.spec import ActuatorSpec, ActuatorType

ASSUMED_BANDWIDTH = 100.0
"""rad/s: natural frequency that assumed gains give each joint, critically damped, in the home configuration."""


def actuator_model(actuator: ActuatorSpec, inertia: float) -> ActuatorModel:
    """Fill in gains: a joint becomes a critically damped oscillator, kp = I w² and kv = 2 I w.

    Args:
        actuator: what the robot file says.
        inertia: what the joint moves, armature included, kg·m² or kg.
    """
    kp = kv = 0.0
    assumed = False
    if actuator.type is ActuatorType.POSITION:
        kp = actuator.kp if actuator.kp is not None else neat(inertia * ASSUMED_BANDWIDTH**2)
        if actuator.kv is not None:
            kv = actuator.kv
        else:
            kv = neat(2 * math.sqrt(kp * inertia))
        assumed = actuator.kp is None or actuator.kv is None
    elif actuator.type is ActuatorType.VELOCITY:
        kv = actuator.kv if actuator.kv is not None else neat(inertia * ASSUMED_BANDWIDTH)
        assumed = actuator.kv is None
    return ActuatorModel(type=actuator.type, kp=kp, kv=kv, assumed=assumed)
