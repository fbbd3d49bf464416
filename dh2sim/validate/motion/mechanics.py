"""Energy and momentum of a robot, computed from its table and masses alone and not by MuJoCo."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dh2sim.model.mass import MassProperties
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BaseMotion:
    """Pose and velocity of base_link in the world at K instants."""

    rotation: Array
    """Axes of base_link in the world, shape (K, 3, 3)."""
    position: Array
    """Position of its origin, m, shape (K, 3)."""
    velocity: Array
    """Velocity of its origin, m/s, along the world's axes, shape (K, 3)."""
    angular_velocity: Array
    """rad/s, along the world's axes, shape (K, 3)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bodies:
    """Motion of the L links that have mass at K instants, along the world's axes."""

    mass: Array
    """kg, shape (L,)."""
    com: Array
    """Centres of mass, m, shape (K, L, 3)."""
    velocity: Array
    """Velocities of the centres of mass, m/s, shape (K, L, 3)."""
    angular_velocity: Array
    """rad/s, shape (K, L, 3)."""
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
        """Of all links, J, shape (K,)."""
        moving = 0.5 * self.mass * (self.velocity**2).sum(axis=2)
        rotating = 0.5 * (self.angular_velocity * self.spin).sum(axis=2)
        return np.asarray((moving + rotating).sum(axis=1))


def bodies(model: RobotModel, q: Array, v: Array, base: BaseMotion | None = None) -> Bodies:
    """Compute how every link moves, from the base to the tool.

    Args:
        model: The robot; at least one of its links has mass.
        q: Joint positions, rad and m, shape (K, n).
        v: Joint velocities, shape (K, n).
        base: Motion of a floating base; None for a base that is fixed at the world's origin.
    """
    zero = np.zeros((len(q), 3))
    at = base or BaseMotion(
        rotation=np.broadcast_to(np.eye(3), (len(q), 3, 3)), position=zero, velocity=zero, angular_velocity=zero
    )
    R, p, u, w = at.rotation, at.position, at.velocity, at.angular_velocity
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
                R = R @ _rotations_z(moved)
                w = w + rate[:, None] * axis
            else:
                arm = moved[:, None] * axis
                p, u = p + arm, u + np.cross(w, arm) + rate[:, None] * axis
        if link.inertial is not None:
            found.append(_Body.of(link.inertial, R, p, u, w))
    if model.tool is not None and model.tool.inertial is not None:
        T = model.chain.joints[-1].T_joint_dh
        found.append(_Body.of(model.tool.inertial, R @ T[:3, :3], p + R @ T[:3, 3], u + np.cross(w, R @ T[:3, 3]), w))
    return Bodies(
        mass=np.array([body.mass for body in found]),
        com=np.stack([body.com for body in found], axis=1),
        velocity=np.stack([body.velocity for body in found], axis=1),
        angular_velocity=np.stack([body.angular_velocity for body in found], axis=1),
        spin=np.stack([body.spin for body in found], axis=1),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Body:
    """One of the links of ``Bodies``."""

    mass: float
    com: Array
    velocity: Array
    angular_velocity: Array
    spin: Array

    @classmethod
    def of(cls, body: MassProperties, R: Array, p: Array, u: Array, w: Array) -> _Body:
        """Return a body in a frame with axes R and origin p that moves with velocity u and angular velocity w."""
        arm = R @ body.com
        own = np.einsum("kji,kj->ki", R, w) @ body.inertia
        return cls(
            mass=body.mass,
            com=p + arm,
            velocity=u + np.cross(w, arm),
            angular_velocity=w,
            spin=np.asarray(np.einsum("kij,kj->ki", R, own)),
        )


def energy(model: RobotModel, q: Array, v: Array) -> tuple[Array, Array]:
    """Return the potential energy, and the kinetic energy including rotors, J, shape (K,) each.

    Args:
        model: The robot, with a fixed base.
        q: Joint positions, rad and m, shape (K, n).
        v: Joint velocities, shape (K, n).
    """
    links = bodies(model, q, v)
    armature = np.array([joint.dynamics.armature for joint in model.moving_joints])
    potential = -(links.mass * (links.com @ np.asarray(model.spec.gravity))).sum(axis=1)
    return potential, links.kinetic_energy + 0.5 * (armature * v**2).sum(axis=1)


def _rotations_z(angle: Array) -> Array:
    """Return rotations about z, shape (K, 3, 3)."""
    R = np.zeros((len(angle), 3, 3))
    R[:, 0, 0] = R[:, 1, 1] = np.cos(angle)
    R[:, 1, 0] = np.sin(angle)
    R[:, 0, 1] = -R[:, 1, 0]
    R[:, 2, 2] = 1.0
    return R
