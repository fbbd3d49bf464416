"""The arm as inverse kinematics sees it: joints along z, constant links, and a target that closes the ring.

With J_i the motion of joint i, about or along its own z axis, and K_i the constant link behind it, a configuration
reaches the pose T where K_0 J_1 K_1 J_2 ... J_n K_n = T. Where a table puts its frames does not matter: a frame may
slide along a revolute axis, and be anywhere on a prismatic joint, as long as the links on both sides make up for it.
Here frames stand as near to their neighbours' as possible, and lengths are in units of the arm's own, so that
nothing is lost where calibrated rows lead hundreds of metres out and back.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.typing import Array, ComplexArray, read_only

Indices: TypeAlias = NDArray[np.intp]
Flags: TypeAlias = NDArray[np.bool_]
Numbers = TypeVar("Numbers", Array, ComplexArray)

DEPENDENT: Final = 1e-9
"""Share of the largest singular value up to which others are zero."""
_ROUNDS: Final = 8
"""Of moving each frame between its neighbours: enough where axes are at an angle; nearly parallel ones stay."""
_HALF_TURN: Final = np.diag([1.0, -1.0, -1.0, 1.0])
"""About x: turns a joint about -z into one about z."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arm:
    """Joints and links; after the robot's own joints come those that stand for what the goal leaves free."""

    turns: tuple[bool, ...]
    """Whether each joint turns; else it slides."""
    links: tuple[Array, ...] = field(repr=False)
    """K_0 ... K_n, lengths in units of ``length``, each of shape (4, 4)."""
    offsets: Array = field(repr=False)
    """Added to slides, in m, shape (n,): a slide is measured from where its neighbours are nearest."""
    length: float
    """Unit of length, m: the longest link between two joints, or the longest slide's travel."""
    goal_joints: int = 0
    """How many joints at the end belong to the goal, not to the robot."""

    @property
    def n(self) -> int:
        """Number of joints, the goal's included."""
        return len(self.turns)

    def scaled(self, q: Array) -> Array:
        """Return the arm's coordinates for the robot's, shape (..., n): slides in units of ``length``."""
        slides = ~np.array(self.turns)
        return np.where(slides, (q + self.offsets) / self.length, q)

    def unscaled(self, q: Array) -> Array:
        """Return the robot's coordinates for the arm's, rad and m, shape (..., n)."""
        slides = ~np.array(self.turns)
        return np.where(slides, q * self.length - self.offsets, q)

    def scaled_poses(self, T: Array) -> Array:
        """Return poses with their positions in units of ``length``."""
        scaled = np.array(T, dtype=np.float64)
        scaled[..., :3, 3] /= self.length
        return scaled


def build_arm(chain: KinematicChain, travels: Sequence[tuple[float, float] | None], goal_joints: int = 0) -> Arm:
    """Return a chain as an arm.

    Args:
        chain: The robot, n moving joints.
        travels: Position limits of each moving joint, m or rad, None where there are none; only a unit of length for
            arms without one.
        goal_joints: What the goal leaves free: 0, 1 (turning about z of tool0), or 3 (any rotation of tool0).
    """
    links, turns = [np.eye(4)], []
    for joint in chain.joints:
        links[-1] = links[-1] @ joint.T_parent_joint
        if joint.type.moves:
            flip = _HALF_TURN if joint.sign < 0.0 else np.eye(4)
            links[-1] = links[-1] @ flip
            links.append(flip)
            turns.append(joint.type.turns)
    links[-1] = links[-1] @ chain.joints[-1].T_joint_dh @ chain.T_dhn_tool0
    offsets = np.append(_draw_near(links, turns), np.zeros(goal_joints))
    if goal_joints:  # turning about z of tool0, or about three axes through its origin
        turns += [True] * goal_joints
        quarter = np.eye(4)
        quarter[:3, :3] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
        links += [quarter] * (goal_joints - 1) + [np.linalg.matrix_power(quarter.T, goal_joints - 1)]
    slides = [travel for travel, joint in zip(travels, chain.moving_joints, strict=True) if not joint.type.turns]
    counted = links if None in slides else links[1:-1]
    lengths = [float(np.linalg.norm(K[:3, 3])) for K in counted]
    length = max([*lengths, *(max(map(abs, travel)) for travel in slides if travel is not None)], default=0.0) or 1.0
    for K in links:
        K[:3, 3] = K[:3, 3] / length
    return Arm(
        turns=tuple(turns),
        links=tuple(read_only(K) for K in links),
        offsets=read_only(offsets),
        length=length,
        goal_joints=goal_joints,
    )


def _draw_near(links: list[Array], turns: Sequence[bool]) -> Array:
    """Move the joints' frames near each other, in place; return what is added to slides, m, shape (n,).

    First each frame goes to where the next one's origin, and first of all tool0, is projected onto its axis. From
    there it goes to the middle between its neighbours, a few times. Nearly parallel axes are nearest to each other
    far away, but no frame gets there so soon.
    """
    n = len(turns)
    offsets = np.zeros(n)
    for i in reversed(range(n)):
        after = links[i + 1][:3, 3]
        _shift(links, i, _along_z(after[2]) if turns[i] else after)
    for i in [*range(n), *reversed(range(n))] * _ROUNDS if n > 1 else []:
        # origins of the frames before and behind, seen from this one; nothing is near to the base and to tool0
        before = links[i][:3, :3].T @ -links[i][:3, 3] if i > 0 else links[i + 1][:3, 3]
        after = links[i + 1][:3, 3] if i < n - 1 else before
        if turns[i]:
            _shift(links, i, _along_z(0.5 * (before[2] + after[2])))
        else:
            gap = after[2] - before[2]
            offsets[i] += gap
            links[i + 1][:3, 3] -= _along_z(gap)
            _shift(links, i, before)
    return offsets


def _along_z(height: float) -> Array:
    return np.array([0.0, 0.0, height])


def _shift(links: list[Array], joint: int, by: Array) -> None:
    """Move a joint's frame by a vector along its own axes; the links on both sides make up for it."""
    links[joint][:3, 3] += links[joint][:3, :3] @ by
    links[joint + 1][:3, 3] -= by


def joint_motion(turns: bool, q: Array) -> Array:
    """Return the motion of a joint: a turn about z, or a slide along it, shape (..., 4, 4) for q of shape (...)."""
    J = np.zeros((*np.shape(q), 4, 4))
    J[..., range(4), range(4)] = 1.0
    if turns:
        c, s = np.cos(q), np.sin(q)
        J[..., 0, 0], J[..., 0, 1], J[..., 1, 0], J[..., 1, 1] = c, -s, s, c
    else:
        J[..., 2, 3] = q
    return J


def inverse_poses(T: Array) -> Array:
    """Return the inverses of poses, shape (..., 4, 4)."""
    inverse = np.zeros(T.shape)
    R = np.swapaxes(T[..., :3, :3], -1, -2)
    inverse[..., :3, :3] = R
    inverse[..., :3, 3:] = -(R @ T[..., :3, 3:])
    inverse[..., 3, 3] = 1.0
    return inverse


def pose_and_jacobian(arm: Arm, q: Numbers) -> tuple[Numbers, Numbers]:
    """Return K_0 J_1 ... K_n and its geometric Jacobian.

    Args:
        arm: The arm.
        q: Its coordinates, slides in units of its length, shape (M, n).

    Returns:
        Poses, shape (M, 3, 4), and Jacobians, rows 0-2 linear, shape (M, 6, n).
    """
    count = len(q)
    frame: Any = np.broadcast_to(arm.links[0][:3], (count, 3, 4))
    axes, points = np.empty((2, count, 3, arm.n), dtype=q.dtype)
    c, s = np.cos(q), np.sin(q)
    for i, turns in enumerate(arm.turns):
        axes[:, :, i], points[:, :, i] = frame[:, :, 2], frame[:, :, 3]
        moved = np.array(frame, dtype=q.dtype)
        if turns:
            ci, si = c[:, i, None], s[:, i, None]
            moved[:, :, 0] = frame[:, :, 0] * ci + frame[:, :, 1] * si
            moved[:, :, 1] = frame[:, :, 1] * ci - frame[:, :, 0] * si
        else:
            moved[:, :, 3] += frame[:, :, 2] * q[:, i, None]
        frame = (moved.reshape(-1, 4) @ arm.links[i + 1]).reshape(count, 3, 4)
    turning = np.array(arm.turns)
    J: Any = np.zeros((count, 6, arm.n), dtype=q.dtype)
    arms = frame[:, :, 3, None] - points
    linear = J[:, :3]
    linear[:, 0] = axes[:, 1] * arms[:, 2] - axes[:, 2] * arms[:, 1]
    linear[:, 1] = axes[:, 2] * arms[:, 0] - axes[:, 0] * arms[:, 2]
    linear[:, 2] = axes[:, 0] * arms[:, 1] - axes[:, 1] * arms[:, 0]
    J[:, :3, ~turning] = axes[:, :, ~turning]
    J[:, 3:, turning] = axes[:, :, turning]
    return frame, J


def joint_rank(arm: Arm, moving: Flags, ranges: Array, zero: float = DEPENDENT) -> int:
    """Return how many of an arm's directions its joints move it in, at a general configuration.

    Args:
        arm: The arm.
        moving: Which joints move, bool, shape (n,).
        ranges: Of the coordinates, in the arm's units, shape (n, 2).
        zero: Share of the largest singular value up to which others are zero.
    """
    q = np.random.default_rng(1).uniform(ranges[:, 0], ranges[:, 1], (8, arm.n))
    J = pose_and_jacobian(arm, q)[1][:, :, moving]
    values = np.linalg.svd(J, compute_uv=False)
    return int((values > zero * values[:, :1]).sum(axis=1).max(initial=0))


def pose_error(frame: Array, T: Array) -> Array:
    """Return what is left from a pose to another: translation and rotation vector along the axes of the base.

    Args:
        frame: Poses, shape (M, 3, 4).
        T: Where they should be, shape (M, 4, 4).

    Returns:
        Shape (M, 6).
    """
    R = T[:, :3, :3] @ np.swapaxes(frame[:, :, :3], 1, 2)
    w = 0.5 * np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], 1)
    sine = np.linalg.norm(w, axis=1)
    cosine = 0.5 * (np.trace(R, axis1=1, axis2=2) - 1.0)
    factor = np.where(sine > 1e-8, np.arctan2(sine, cosine) / np.maximum(sine, 1e-300), 1.0)
    return np.concatenate([T[:, :3, 3] - frame[:, :, 3], w * factor[:, None]], axis=1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Loop:
    """Six joints in a ring, for N poses at once: J_1 K_1 J_2 K_2 ... J_6 K_6 = identity."""

    turns: tuple[bool, ...]
    links: tuple[Array, ...]
    """K_1 ... K_6, each of shape (1, 4, 4) where it is the same for all poses, or (N, 4, 4)."""

    def variant(self, first: int, *, backwards: bool) -> Loop:
        """Return the same ring read from another joint on, or against the arrow, where coordinates are negative."""
        order = loop_order(first, backwards=backwards)
        if backwards:
            links = [inverse_poses(self.links[i - 1]) for i in order]
        else:
            links = [self.links[i] for i in order]
        return Loop(turns=tuple(self.turns[i] for i in order), links=tuple(links))

    def moved(self, motions: Array) -> Loop:
        """Return a ring with each link changed by a small motion, shape (6, 4, 4)."""
        return Loop(turns=self.turns, links=tuple(K @ M for K, M in zip(self.links, motions, strict=True)))


def loop_order(first: int, *, backwards: bool) -> list[int]:
    """Return the joints of a ring of six in the order in which a variant reads them."""
    return [(first - k if backwards else first + k) % 6 for k in range(6)]


def close_loop(arm: Arm, T: Array, locked: Mapping[int, Array], extra: Sequence[Array] = ()) -> Loop:
    """Return the ring that an arm makes with the poses that it is to reach.

    Args:
        arm: The arm.
        T: Poses, positions in units of the arm's length, shape (N, 4, 4).
        locked: Coordinates of joints that do not move, each of shape (N,) or (1,), in the arm's units.
        extra: Links before and between virtual joints that follow the last joint, and behind them; their product is
            the identity.
    """
    links: list[Array] = []
    turns: list[bool] = []
    before = arm.links[0][None]
    for i, turn in enumerate(arm.turns):
        if i in locked:
            fixed = joint_motion(turn, locked[i]) @ arm.links[i + 1]
            if links:
                links[-1] = links[-1] @ fixed
            else:
                before = before @ fixed
        else:
            links.append(arm.links[i + 1][None])
            turns.append(turn)
    behind = links.pop()
    closing = behind @ inverse_poses(T) @ before
    if extra:
        links += [K[None] for K in extra[:-1]]
        turns += [True] * (len(extra) - 1)
        closing = extra[-1] @ closing
    return Loop(turns=tuple(turns), links=(*links, closing))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Candidates:
    """Configurations near solutions, of some of N poses."""

    pose: Indices
    """Index of the pose of each, shape (M,)."""
    q: Array
    """Coordinates of the ring's six joints, shape (M, 6)."""
    blurred: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    """Indices of poses at which others may have been lost: eigenvalues are double, or ill-conditioned."""
