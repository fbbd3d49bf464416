"""The best correspondence of two mechanisms, refined and measured at scattered configurations."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from dh2sim.compare.matching import (
    Correspondence,
    Obstacle,
    ObstacleKind,
    correspondences,
    some_correspondences,
)
from dh2sim.compare.screws import ScrewAxes
from dh2sim.kinematics.rotations import hat
from dh2sim.kinematics.sampling import scattered_configurations
from dh2sim.kinematics.serial_chain import SerialChain, SerialJoint, serial_link_poses
from dh2sim.kinematics.transforms import pose_errors
from dh2sim.robot.row import JointType
from dh2sim.typing import Array

_CONFIGURATIONS = 64
_REFINED_ABOVE = 1e-10
"""rad, and m for a reach of up to 1 m: a smaller residual is rounding."""
_ROUNDS = 3
_MOST_TRIED = 3
"""Correspondences that are measured, the simplest first."""
_MOST_ORDERS = 120
"""Orders of B's joints that are tried, where neighbours may be exchanged."""
_COMMUTES = 1e-7


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolResidual:
    """How far tool0 of two robots are apart at most, once one is read as the other."""

    position: float
    """m"""
    rotation: float
    """rad"""
    configurations: int

    def within(self, tolerance: float, reach: float) -> bool:
        """Whether it is at most the tolerance, rad, and m for a reach of up to 1 m, then of the reach."""
        return self.rotation <= tolerance and self.position <= tolerance * max(1.0, reach)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fit:
    """The best correspondence that was found, whether or not it is good enough."""

    correspondence: Correspondence
    """With B's joints in A's order."""
    order: tuple[int, ...]
    """The index of B's joint for each joint of A."""
    residual: ToolResidual
    good: bool
    """Whether the residual is within the tolerance."""


def best_fit(a: ScrewAxes, b: ScrewAxes, tolerance: float) -> Fit | Obstacle:
    """Return the best correspondence of two mechanisms within a tolerance, or what keeps them from having one.

    Where there is none, other orders of those joints of B are tried that may be exchanged: slides, and joints that
    turn about or slide along one line.

    Args:
        a: The axes of A.
        b: The axes of B.
        tolerance: rad, and m for a reach of up to 1 m, then of the reach.
    """
    first: Fit | Obstacle | None = None
    for order in _orders(b):
        ordered = _reordered(b, order)
        ways = correspondences(a, ordered, tolerance)
        found = ways if isinstance(ways, Obstacle) else _best_of(ways, a, ordered, order, tolerance)
        if isinstance(found, Fit) and found.good:
            return found
        if first is None:
            first = found
        if isinstance(found, Obstacle) and found.kind is ObstacleKind.COUNT:
            break
    assert first is not None
    return first


def any_fit(a: ScrewAxes, b: ScrewAxes, tolerance: float) -> Fit | None:
    """Return a correspondence of two mechanisms within a tolerance, or None; not the simplest one.

    Arguments are those of ``best_fit``, which takes longer.
    """
    for order in _orders(b):
        ordered = _reordered(b, order)
        ways = some_correspondences(a, ordered, tolerance, _MOST_TRIED)
        if ways and (found := _best_of(ways, a, ordered, order, tolerance)).good:
            return found
    return None


def measured(
    pose_a: Callable[[Array], Array], pose_b: Callable[[Array], Array], way: Correspondence, q: Array
) -> ToolResidual:
    """Return how far FK_B(sense q + zero) is from T_base FK_A(q) T_tool.

    Args:
        pose_a: Returns poses of A's tool0 for joint vectors of shape (N, n).
        pose_b: Returns those of B, for joint vectors in A's order.
        way: The correspondence.
        q: Joint vectors of A, rad and m, shape (N, n).
    """
    position, rotation = pose_errors(pose_b(q * way.senses + way.zeros), way.T_base @ pose_a(q) @ way.T_tool)
    return ToolResidual(
        position=float(np.max(position, initial=0.0)),
        rotation=float(np.max(rotation, initial=0.0)),
        configurations=len(q),
    )


def joint_samples(axes: ScrewAxes, count: int) -> Array:
    """Return joint vectors over whole turns, and slides over the robot's reach to both sides, shape (count, n)."""
    bound = np.where(axes.turns, np.pi, max(axes.reach, 0.1))
    return scattered_configurations(-bound, bound, count)


def _best_of(ways: list[Correspondence], a: ScrewAxes, b: ScrewAxes, order: tuple[int, ...], tolerance: float) -> Fit:
    """Return the first of several correspondences that is good once it is refined, else the first of all."""
    reach = max(a.reach, b.reach)
    chain_a, chain_b = _as_chain(a), _as_chain(b)
    q = joint_samples(a, _CONFIGURATIONS)
    poses = serial_link_poses(chain_a, q)[:, -1]
    best: Fit | None = None
    for way in ways[:_MOST_TRIED]:
        residual = measured(lambda _: poses, lambda q_b: serial_link_poses(chain_b, q_b)[:, -1], way, q)
        if not residual.within(_REFINED_ABOVE, reach):
            way = _refined(way, chain_b, poses, q, max(1.0, reach))
            residual = measured(lambda _: poses, lambda q_b: serial_link_poses(chain_b, q_b)[:, -1], way, q)
        good = residual.within(tolerance, reach)
        if best is None or good:
            best = Fit(correspondence=way, order=order, residual=residual, good=good)
        if good:
            break
    assert best is not None
    return best


def _as_chain(axes: ScrewAxes) -> SerialChain:
    """Return the robot as joints whose links all have their frames in base_link's place at coordinate zero."""
    joints = tuple(
        SerialJoint(
            name=name,
            type=JointType.REVOLUTE if turns else JointType.PRISMATIC,
            T_parent_link=np.eye(4),
            axis=direction,
            point=point,
        )
        for name, turns, direction, point in zip(axes.names, axes.turns, axes.directions, axes.points, strict=True)
    )
    return SerialChain(joints=joints, T_link_tip=axes.T_base_tool)


def _refined(way: Correspondence, chain_b: SerialChain, poses: Array, q: Array, size: float) -> Correspondence:
    """Return the correspondence with zeros, base and tool moved to where the poses differ least.

    What is free stays where it is: steps have least norm.
    """
    zeros, T_base, T_tool = way.zeros.copy(), way.T_base.copy(), way.T_tool.copy()
    n, before = chain_b.n, np.inf
    for _ in range(_ROUNDS):
        links = serial_link_poses(chain_b, q * way.senses + zeros)
        wanted = T_base @ poses @ T_tool
        actual = links[:, -1]
        p, R = wanted[:, :3, 3], wanted[:, :3, :3]
        matrix = np.zeros((len(q), 6, n + 12))
        for i, joint in enumerate(chain_b.joints):
            z = links[:, i, :3, :3] @ joint.axis
            if joint.type.turns:
                at = links[:, i, :3, :3] @ joint.point + links[:, i, :3, 3]
                matrix[:, :3, i], matrix[:, 3:, i] = np.cross(z, actual[:, :3, 3] - at), z
            else:
                matrix[:, :3, i] = z
        matrix[:, :3, n : n + 3] = -np.eye(3)
        matrix[:, :3, n + 3 : n + 6] = hat(p)
        matrix[:, 3:, n + 3 : n + 6] = -np.eye(3)
        matrix[:, :3, n + 6 : n + 9] = -R
        matrix[:, 3:, n + 9 :] = -R
        error = np.concatenate(
            [wanted[:, :3, 3] - actual[:, :3, 3], _turned(R @ actual[:, :3, :3].transpose(0, 2, 1))], 1
        )
        matrix[:, :3] /= size
        error[:, :3] /= size
        left = float(np.linalg.norm(error))
        if left > 0.9 * before:
            break
        before = left
        # what is nearly free, as turns about nearly parallel axes are, would make great steps to fit noise: damped by
        # the residual, by which convergence stays quadratic (J. Fan, Y. Yuan, Computing 74, 2005)
        damping = left * np.eye(n + 12)
        step = np.linalg.lstsq(
            np.concatenate([matrix.reshape(-1, n + 12), damping]),
            np.concatenate([error.reshape(-1), np.zeros(n + 12)]),
            rcond=1e-9,
        )[0]
        zeros += step[:n]
        T_base = _moved(step[n : n + 6]) @ T_base
        T_tool = T_tool @ _moved(step[n + 6 :])
        if float(np.abs(step).max()) < 1e-9:
            break
    return replace(way, zeros=zeros, T_base=T_base, T_tool=T_tool)


def _turned(R: Array) -> Array:
    """Return the rotation vectors of small rotations, shape (N, 3)."""
    return 0.5 * np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1)


def _moved(step: Array) -> Array:
    """Return the transform of a small displacement and rotation vector, shape (4, 4); its rotation is orthogonal."""
    K = hat(step[3:])
    U, _, Vt = np.linalg.svd(np.eye(3) + K + 0.5 * K @ K)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = U @ Vt, step[:3]
    return T


def _reordered(axes: ScrewAxes, order: tuple[int, ...]) -> ScrewAxes:
    if order == tuple(range(axes.n)):
        return axes
    return replace(
        axes,
        names=tuple(axes.names[i] for i in order),
        turns=tuple(axes.turns[i] for i in order),
        points=axes.points[list(order)],
        directions=axes.directions[list(order)],
    )


def _orders(axes: ScrewAxes) -> Iterator[tuple[int, ...]]:
    """Yield orders of the joints that give the same mechanism, the given one first."""
    start = tuple(range(axes.n))
    seen, waiting = {start}, deque([start])
    while waiting:
        order = waiting.popleft()
        yield order
        for k in range(len(order) - 1):
            i, j = order[k], order[k + 1]
            swapped = (*order[:k], j, i, *order[k + 2 :])
            if swapped not in seen and len(seen) < _MOST_ORDERS and _commute(axes, i, j):
                seen.add(swapped)
                waiting.append(swapped)


def _commute(axes: ScrewAxes, i: int, j: int) -> bool:
    """Whether two neighbouring joints may be exchanged; two that turn about one line are alike, and stay."""
    if not axes.turns[i] and not axes.turns[j]:
        return True
    sine = float(np.linalg.norm(np.cross(axes.directions[i], axes.directions[j])))
    return axes.turns[i] is not axes.turns[j] and sine <= _COMMUTES
