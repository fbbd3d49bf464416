"""Energy and momentum of a robot from its table and masses alone: the oracle of what MuJoCo conserves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dh2sim.model.mass import MassProperties
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BaseMotion:
    """Where base_link is in the world, and how it moves, at K instants."""

    rotation: Array
    """Its axes in the world, shape (K, 3, 3)."""
    position: Array
    """Of its origin, m, shape (K, 3)."""
    velocity: Array
    """Of its origin, m/s, along the world's axes, shape (K, 3)."""
    turning: Array
    """Angular velocity, rad/s, along the world's axes, shape (K, 3)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bodies:
    """The motion of the L links that have mass, at K instants; everything along the world's axes."""

    mass: Array
    """kg, shape (L,)."""
    com: Array
    """Centres of mass, m, shape (K, L, 3)."""
    velocity: Array
    """Of the centres of mass, m/s, shape (K, L, 3)."""
    turning: Array
    """Angular velocities, rad/s, shape (K, L, 3)."""
    spin: Array
    """Angular momenta, each about the link's own centre of mass, kg·m²/s, shape (K, L, 3)."""

    @property
    def momentum(self) -> Array:
        """Linear momenta, kg·m/s, shape (K, L, 3)."""
        return self.mass[:, None] * self.velocity

    @property
    def angular_momentum(self) -> Array:
        """Angular momenta about the centre of mass of all links together, kg·m²/s, shape (K, L, 3)."""
        share = (self.mass / self.mass.sum())[:, None]
        arm = self.com - (share * self.com).sum(axis=1, keepdims=True)
        relative = self.velocity - (share * self.velocity).sum(axis=1, keepdims=True)
        return self.spin + np.cross(arm, self.mass[:, None] * relative)

    @property
    def kinetic_energy(self) -> Array:
        """J, shape (K,)."""
        moving = 0.5 * self.mass * (self.velocity**2).sum(axis=2)
        turning = 0.5 * (self.turning * self.spin).sum(axis=2)
        return np.asarray((moving + turning).sum(axis=1))


def bodies(model: RobotModel, q: Array, v: Array, base: BaseMotion | None = None) -> Bodies:
    """Walk along the chain and compute how every link moves.

    Args:
        model: the robot; at least one of its links has mass.
        q: joint positions, rad and m, shape (K, n).
        v: their rates, shape (K, n).
        base: the motion of a base that floats; None for one that stands at the world's origin.
    """
    standing = np.zeros((len(q), 3))
    at = base or BaseMotion(
        rotation=np.broadcast_to(np.eye(3), (len(q), 3, 3)), position=standing, velocity=standing, turning=standing
    )
    R, p, u, w = at.rotation, at.position, at.velocity, at.turning
    found = [] if model.base.inertial is None or base is None else [_Body.of(model.base.inertial, R, p, u, w)]
    column = 0
    for link, joint in zip(model.links, model.chain.joints, strict=True):
        arm = R @ joint.T_parent_joint[:3, 3]
        p, u = p + arm, u + np.cross(w, arm)
        R = R @ joint.T_parent_joint[:3, :3]
        if joint.type.moves:
            moved, rate = joint.sign * q[:, column], joint.sign * v[:, column]
            column += 1
            axis = R[:, :, 2]
            if joint.type.turns:
                R = R @ _turns(moved)
                w = w + rate[:, None] * axis
            else:
                arm = moved[:, None] * axis
                p, u = p + arm, u + np.cross(w, arm) + rate[:, None] * axis
        if link.inertial is not None:
            found.append(_Body.of(link.inertial, R, p, u, w))
    return Bodies(
        mass=np.array([body.mass for body in found]),
        com=np.stack([body.com for body in found], axis=1),
        velocity=np.stack([body.velocity for body in found], axis=1),
        turning=np.stack([body.turning for body in found], axis=1),
        spin=np.stack([body.spin for body in found], axis=1),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Body:
    """One of the links of ``Bodies``."""

    mass: float
    com: Array
    velocity: Array
    turning: Array
    spin: Array

    @classmethod
    def of(cls, body: MassProperties, R: Array, p: Array, u: Array, w: Array) -> _Body:
        """Place a body in a frame with axes R and origin p, which moves with velocities u and w."""
        arm = R @ body.com
        own = np.einsum("kji,kj->ki", R, w) @ body.inertia
        return cls(
            mass=body.mass,
            com=p + arm,
            velocity=u + np.cross(w, arm),
            turning=w,
            spin=np.asarray(np.einsum("kij,kj->ki", R, own)),
        )


def energy(model: RobotModel, q: Array, v: Array) -> tuple[Array, Array]:
    """Potential energy in the robot's gravity, and kinetic energy with that of the rotors, J, shape (K,) each.

    Args:
        model: the robot; its base stands still.
        q: joint positions, rad and m, shape (K, n).
        v: their rates, shape (K, n).
    """
    links = bodies(model, q, v)
    armature = np.array([joint.dynamics.armature for joint in model.moving_joints])
    potential = -(links.mass * (links.com @ np.asarray(model.spec.gravity))).sum(axis=1)
    return potential, links.kinetic_energy + 0.5 * (armature * v**2).sum(axis=1)


def _turns(angle: Array) -> Array:
    """Rotations about z, shape (K, 3, 3)."""
    R = np.zeros((len(angle), 3, 3))
    R[:, 0, 0] = R[:, 1, 1] = np.cos(angle)
    R[:, 1, 0] = np.sin(angle)
    R[:, 0, 1] = -R[:, 1, 0]
    R[:, 2, 2] = 1.0
    return R
