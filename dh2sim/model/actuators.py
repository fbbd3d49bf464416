"""Actuators: gains that the robot file leaves open, and the loads and inertias that they are chosen for.

Plain double arithmetic in a fixed order, so that every machine writes the same bytes.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.forward import reference_joint_frames, reference_joint_poses
from dh2sim.kinematics.transforms import Rows, move_point, rotated_tensor
from dh2sim.model.mass import MassProperties, shifted_inertia
from dh2sim.model.shapes import neat
from dh2sim.robot.row import ActuatorSpec, ActuatorType, JointType
from dh2sim.typing import Array


def gravity_loads(
    chain: KinematicChain, bodies: Sequence[MassProperties | None], q: Array, gravity: Array
) -> list[tuple[float, ...]]:
    """Return the generalised forces that each joint must exert to hold the robot still.

    Args:
        chain: The chain, n rows of which m move.
        bodies: Mass properties of the n links in their joint frames; None for a massless one.
        q: Joint vectors, rad or m, shape (N, m).
        gravity: m/s² in base_link, shape (3,).

    Returns:
        m values for each joint vector, N·m or N: minus the power of the weights per unit of joint velocity (principle
        of virtual work).
    """
    moving = [i for i, joint in enumerate(chain.joints) if joint.type.moves]
    placed = [(i, body) for i, body in enumerate(bodies) if body is not None]
    if not placed or not moving:
        return [(0.0,) * len(moving) for _ in q]
    # by joint and body; element by element, which rounds as plain arithmetic does
    one = len(q) == 1
    poses = np.array(reference_joint_poses(chain, q[0]))[:, None] if one else reference_joint_frames(chain, q)
    rows, mass = [i for i, _ in placed], np.array([body.mass for _, body in placed])
    x, y, z = (np.array([body.com[k] for _, body in placed])[:, None, None] for k in range(3))
    upper = poses[rows, :, :3]
    coms = upper[..., 0] * x + upper[..., 1] * y + upper[..., 2] * z + upper[..., 3]
    turns = np.array([[chain.joints[i].type.turns] for i in moving])
    sign, frames = np.array([[chain.joints[i].sign] for i in moving]), poses[moving]
    weight = [mass * float(g) for g in gravity]
    first = [bisect_left(rows, i) for i in moving]
    loads = []
    for state in range(len(q)):
        x, y, z = (sign * frames[:, state, k, 2, None] for k in range(3))
        u, v, w = (coms[:, state, k] - frames[:, state, k, 3, None] for k in range(3))
        moved = [np.where(turns, *pair) for pair in ((y * w - z * v, x), (z * u - x * w, y), (x * v - y * u, z))]
        terms = -(weight[0] * moved[0] + weight[1] * moved[1] + weight[2] * moved[2])
        loads.append(tuple(math.fsum(row[start:].tolist()) + 0.0 for row, start in zip(terms, first, strict=True)))
    return loads


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
    placed = [_placed(T, body) for T, body in zip(poses, bodies, strict=True)]
    seen = []
    for i, joint in enumerate(chain.joints):
        if not joint.type.moves:
            continue
        carried = [body for body in placed[i:] if body is not None]
        if joint.type.turns:
            (a, ox), (b, oy), (c, oz) = poses[i][:3, 2:].tolist()
            terms = []
            for mass, (x, y, z), inertia in carried:
                x, y, z = x - ox, y - oy, z - oz
                along = x * a + y * b + z * c  # of no account, and much where a frame is far along its axis
                about = shifted_inertia(inertia, mass, (x - along * a, y - along * b, z - along * c))
                u, v, w = [xx * a + xy * b + xz * c for xx, xy, xz in about]
                terms.append(a * u + b * v + c * w)
        else:
            terms = [mass for mass, _, _ in carried]
        seen.append(math.fsum(terms))
    return tuple(seen)


def _placed(T: Array, body: MassProperties | None) -> tuple[float, Sequence[float], Rows] | None:
    """Return mass, centre of mass and inertia of a body in the frame in which its own has pose ``T``."""
    if body is None:
        return None
    return body.mass, move_point(T, body.com), rotated_tensor(T.tolist(), body.inertia.tolist())


ASSUMED_BANDWIDTH = 100.0
"""rad/s: natural frequency that assumed gains give each joint, critically damped, for the inertia of its duty."""
MOST_SAG = 0.01
"""rad: by which a joint that turns sags at most, stretched out, under the nominal payload."""
LEAST_OF_THE_JOINT_BEFORE = 0.2
"""Share of the load and the inertia of the joint before it that a joint is chosen for at least.

A last joint turns a round link about its own axis, and would be given next to nothing. Makers' wrists have efforts of
0.14 (Panda, joints 4 and 5) to 1 (UR5e, joints 5 and 6) times that of the joint before.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Duty:
    """What a joint is to hold and to move: assumed efforts and gains are chosen for it."""

    load: float
    """Against gravity, N·m or N."""
    inertia: float
    """At home, kg·m² or kg, without the rotor's; gains are chosen for it."""
    most_inertia: float
    """In any pose; efforts are chosen for it."""


def duties(
    types: Sequence[JointType], bounds: Sequence[tuple[float, float]], inertias: Sequence[float]
) -> tuple[Duty, ...]:
    """Return the duties of joints, base first.

    Args:
        types: Of n joints.
        bounds: What gravity asks of each at most, and the inertia that it moves at most, with the payload: N·m and
            kg·m², or N and kg.
        inertias: What each moves at home, with the payload, kg·m² or kg.

    Returns:
        n duties. A joint that turns has such an inertia that its stiffness keeps the sag below ``MOST_SAG``, and all
        is at least ``LEAST_OF_THE_JOINT_BEFORE`` of that of the last joint before it that turns.
    """
    found = []
    least = Duty(load=0.0, inertia=0.0, most_inertia=0.0)
    for kind, (load, most_inertia), inertia in zip(types, bounds, inertias, strict=True):
        if kind.turns:
            load = max(load, least.load)
            inertia = max(inertia, load / (MOST_SAG * ASSUMED_BANDWIDTH**2), least.inertia)
            most_inertia = max(most_inertia, inertia, least.most_inertia)
            share = LEAST_OF_THE_JOINT_BEFORE
            least = Duty(load=share * load, inertia=share * inertia, most_inertia=share * most_inertia)
        found.append(Duty(load=load, inertia=inertia, most_inertia=most_inertia))
    return tuple(found)


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
        inertia: Of the joint's duty, armature included, kg·m² or kg.
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
