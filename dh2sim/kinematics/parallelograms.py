"""Joints that a closed loop makes turn as one, as in a parallelogram: q_i = ±q_root + offset at every configuration.

A loop of joints with one freedom whose velocities are all equal up to their signs is such a loop if its closure holds
all the way round. The distance of its frames is a trigonometric polynomial in the root's angle whose degree is at
most the number of joints, so that it is zero everywhere if it is at more than twice as many angles.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from dh2sim.kinematics.loop_closure import (
    FREEDOMS,
    TOLERANCE,
    assembly,
    closure_gaps,
    constraint_jacobian,
    mechanism_size,
)
from dh2sim.kinematics.tree import KinematicTree
from dh2sim.robot.spec import RobotSpec, SpecLike, spec_of
from dh2sim.typing import Array

_EQUAL: Final = 1e-9
_CLOSED: Final = 1e-11
"""rad, and sizes of the mechanism, or m where that is more."""


class Coupling(NamedTuple):
    """A joint that another one takes along."""

    root: int
    """Place of the other one in a joint vector."""
    sign: float
    """1 or -1."""
    offset: float
    """rad or m: coordinate where the other one's is zero."""


class Couplings(NamedTuple):
    """What the loops of a mechanism couple exactly."""

    joints: dict[int, Coupling]
    """By place in a joint vector."""
    closures: tuple[str, ...]
    """Names of the closures that the coupled joints keep closed by themselves."""


def find_couplings(robot: SpecLike) -> Couplings:
    """Return the joints that closed loops make move as one.

    Raises:
        AssemblyError: The loops cannot be closed.
    """
    return _found(spec_of(robot))


@functools.lru_cache(maxsize=16)
def _found(spec: RobotSpec) -> Couplings:
    tree, q = assembly(spec)
    names = [joint.name for joint in tree.moving_joints]
    driven = {names.index(name) for name in spec.actuated or ()}
    signs: dict[int, tuple[int, float]] = {k: (k, 1.0) for k in range(tree.n)}  # of each joint: root and sign
    closures = []
    for number, closure in enumerate(tree.closures):
        loop = _loop(tree, tree.frame(closure.a).body, tree.frame(closure.b).body)
        found = _loop_signs(tree, q, number, loop)
        if found is None:
            continue
        own: dict[int, float] = {}
        for i, sign in zip(loop, found, strict=True):
            root, of_root = signs[i]
            own |= {k: sign * of_root * other for k, (with_root, other) in signs.items() if with_root == root}
        members = sorted(own)
        if len(driven & set(members)) > 1:
            continue
        root = min(members, key=lambda k: (k not in driven, k))
        signs.update({k: (root, own[k] * own[root]) for k in members})
        closures.append(closure.name)
    joints = {
        k: Coupling(root, sign, _offset(float(q[k]) - sign * float(q[root])))
        for k, (root, sign) in signs.items()
        if k != root
    }
    return Couplings(joints, tuple(closures))


def _offset(value: float) -> float:
    return 0.0 if abs(value) < TOLERANCE else value


def _loop(tree: KinematicTree, a: int, b: int) -> list[int]:
    """Return the places in a joint vector of the joints between two bodies."""
    bodies = set(tree.path(a)) ^ set(tree.path(b))
    return sorted(tree.coordinates[body] for body in bodies if tree.coordinates[body] >= 0)


def _loop_signs(tree: KinematicTree, q: Array, closure: int, loop: Sequence[int]) -> list[float] | None:
    """Return the sign of each joint of a loop against the first; None where they do not move as one."""
    joints = [tree.moving_joints[k] for k in loop]
    if len(loop) < 2 or not all(joint.type.turns for joint in joints):
        return None
    counts = [6 - FREEDOMS[each.type] for each in tree.closures[: closure + 1]]
    J = constraint_jacobian(tree, q)[sum(counts[:-1]) : sum(counts), loop]
    size = mechanism_size(tree)
    _, values, directions = np.linalg.svd(J / max(1.0, size))
    rank = int((values > 1e-8 * max(1.0, float(values.max(initial=0.0)))).sum())
    if len(loop) - rank != 1:
        return None
    rates = directions[-1] / directions[-1][0] if abs(directions[-1][0]) > 1e-6 else directions[-1]
    if np.abs(np.abs(rates) - 1.0).max() > _EQUAL:
        return None
    signs = [math.copysign(1.0, rate) for rate in rates.tolist()]
    count = 2 * len(loop) + 3
    for step in range(1, count):
        turned = np.array(q)
        turned[list(loop)] += 2.0 * math.pi * step / count * np.array(signs)
        gap = closure_gaps(tree, turned)[closure]
        if gap.position > _CLOSED * max(1.0, size) or gap.rotation > _CLOSED:
            return None
    return signs
