"""Actuators: gains that the robot file leaves open, and the loads and inertias that they are chosen for.

Plain double arithmetic in a fixed order, so that every machine writes the same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.forward import reference_joint_poses
from dh2sim.model.mass import MassProperties, in_frame, shift_inertia
from dh2sim.model.shapes import cross, neat
from dh2sim.robot.spec import ActuatorSpec, ActuatorType
from dh2sim.typing import Array


def gravity_loads(
    chain: KinematicChain, bodies: Sequence[MassProperties | None], q: Array, gravity: Array
) -> tuple[float, ...]:
    """Return the generalised force that each joint must exert to hold the robot still.

    Args:
        chain: The chain, n rows of which m move.
        bodies: Mass properties of the n links in their joint frames; None for a massless one.
        q: Joint vector, rad or m, shape (m,).
        gravity: m/s² in base_link, shape (3,).

    Returns:
        m values, N·m or N: minus the power of the weights per unit of joint velocity (principle of virtual work).
    """
    poses = reference_joint_poses(chain, q)
    placed = _outboard(poses, bodies)
    loads = []
    for i, joint in enumerate(chain.joints):
        if not joint.type.moves:
            continue
        axis = [joint.sign * float(poses[i][k, 2]) for k in range(3)]
        terms = []
        for body in placed[i:]:
            if body is None:
                continue
            weight = [body.mass * float(g) for g in gravity]
            if joint.type.turns:
                arm = [float(body.com[k]) - float(poses[i][k, 3]) for k in range(3)]
                moved = cross(axis, arm)
            else:
                moved = axis
            terms.append(-_dot(weight, moved))
        loads.append(math.fsum(terms) + 0.0)
    return tuple(loads)


def seen_inertias(chain: KinematicChain, bodies: Sequence[MassProperties | None], q: Array) -> tuple[float, ...]:
    """Return the inertia or mass that each joint sees with all others locked: the diagonal of the mass matrix.

    Args:
        chain: As for ``gravity_loads``.
        bodies: Likewise.
        q: Likewise.

    Returns:
        m values, kg·m² or kg; a joint that carries nothing sees 0.
    """
    poses = reference_joint_poses(chain, q)
    placed = _outboard(poses, bodies)
    seen = []
    for i, joint in enumerate(chain.joints):
        if not joint.type.moves:
            continue
        carried = [body for body in placed[i:] if body is not None]
        if joint.type.turns:
            axis = [float(poses[i][k, 2]) for k in range(3)]
            origin = [float(poses[i][k, 3]) for k in range(3)]
            terms = []
            for body in carried:
                arm = [float(body.com[k]) - origin[k] for k in range(3)]
                along = _dot(arm, axis)  # of no account, and much where a frame is far along its axis
                arm = [arm[k] - along * axis[k] for k in range(3)]
                about = shift_inertia(body.inertia, body.mass, arm)
                terms.append(_dot(axis, [_dot([float(x) for x in about[k]], axis) for k in range(3)]))
        else:
            terms = [body.mass for body in carried]
        seen.append(math.fsum(terms))
    return tuple(seen)


def _outboard(poses: Sequence[Array], bodies: Sequence[MassProperties | None]) -> list[MassProperties | None]:
    return [None if body is None else in_frame(T, body) for T, body in zip(poses, bodies, strict=True)]


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


ASSUMED_BANDWIDTH = 100.0
"""rad/s: natural frequency that assumed gains give each joint, critically damped, in the home configuration."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ActuatorModel:
    """What drives a joint, with gains."""

    type: ActuatorType
    kp: float
    """N·m/rad or N/m; 0 where the type has none."""
    kv: float
    """N·m·s/rad or N·s/m; 0 where the type has none."""
    assumed: bool
    """Whether a gain was chosen by dh2sim because the robot file gives none."""


def actuator_model(actuator: ActuatorSpec, inertia: float) -> ActuatorModel:
    """Fill in gains that make a joint a critically damped oscillator, kp = I w² and kv = 2 I w.

    Args:
        actuator: As in the robot file.
        inertia: What the joint moves, armature included, kg·m² or kg.
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
