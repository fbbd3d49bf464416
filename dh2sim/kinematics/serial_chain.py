"""A serial chain as other formats describe it: links with frames anywhere, joints about axes anywhere.

This is what a URDF, an MJCF or a list of joint axes says, before any Denavit-Hartenberg frame is assigned. Fixed
joints are merged by whoever reads the file, so that every joint here moves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.rotations import rotations_about
from dh2sim.robot.row import JointType
from dh2sim.typing import Array

_BLOCK = 2048
"""Configurations handled at a time, so that a block's matrices stay in the processor's cache."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SerialJoint:
    """A joint that moves, and the link that it carries."""

    name: str
    """As in the file."""
    type: JointType
    """Revolute, continuous or prismatic; never fixed."""
    T_parent_link: Array = field(repr=False)
    """Pose of the link's frame in the previous link's (the base's for the first) at coordinate zero, shape (4, 4)."""
    axis: Array
    """Unit vector in the link's frame, shape (3,): the positive coordinate turns about it, or slides along it."""
    point: Array
    """A point of the axis in the link's frame, m, shape (3,); where the file says that the joint is."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SerialChain:
    """A base, joints that move one after the other, and a tip."""

    joints: tuple[SerialJoint, ...]
    """At least one."""
    T_link_tip: Array = field(repr=False)
    """Pose of the tip in the last link, shape (4, 4)."""

    @property
    def n(self) -> int:
        """Number of joint coordinates."""
        return len(self.joints)


def serial_link_poses(chain: SerialChain, q: ArrayLike) -> Array:
    """Return the poses of all links and of the tip in the base, straight from the file's own numbers.

    A joint turns by Rodrigues' formula R = E + sin q K + (1 - cos q) K² about its axis, or slides along it.

    Args:
        chain: The chain.
        q: Joint vectors, rad and m, shape (..., n).

    Returns:
        Shape (..., n + 1, 4, 4): links 1 … n, then the tip.

    Raises:
        ConfigurationError: ``q`` does not have n coordinates along its last axis.
    """
    vectors = np.asarray(q, dtype=np.float64)
    n = chain.n
    if vectors.ndim == 0 or vectors.shape[-1] != n:
        raise ConfigurationError(f"expected an array of shape (..., {n}), got shape {vectors.shape}")
    flat = vectors.reshape(math.prod(vectors.shape[:-1]), n)
    poses = np.empty((len(flat), n + 1, 4, 4))
    for start in range(0, len(flat), _BLOCK):
        block = flat[start : start + _BLOCK]
        T = np.broadcast_to(np.eye(4), (len(block), 4, 4))
        for i, joint in enumerate(chain.joints):
            T = T @ (joint.T_parent_link @ _motion(joint, block[:, i]))
            poses[start : start + _BLOCK, i] = T
        poses[start : start + _BLOCK, n] = T @ chain.T_link_tip
    return poses.reshape(*vectors.shape[:-1], n + 1, 4, 4)


def _motion(joint: SerialJoint, q: Array) -> Array:
    """Pose of the moved link in the link at coordinate zero, shape (N, 4, 4)."""
    T = np.zeros((len(q), 4, 4))
    T[:] = np.eye(4)
    if joint.type.turns:
        R = rotations_about(joint.axis, q)
        T[:, :3, :3] = R
        T[:, :3, 3] = joint.point - R @ joint.point
    else:
        T[:, :3, 3] = q[:, None] * joint.axis
    return T
