"""Arms with joints to spare: which to lock, and all self-motions of a pose."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dh2sim.inverse.loop import Arm, joint_rank, pose_and_jacobian, pose_error
from dh2sim.inverse.self_motion import ON_POSE, Path, follow, inside, lies_on, null_directions
from dh2sim.inverse.solutions import Curve
from dh2sim.kinematics.sampling import scattered_configurations
from dh2sim.typing import Array, read_only

SAMPLES: Final = 24
"""Values at which a joint is locked to find self-motions."""
SAMPLED: Final = 2
"""Joints that are locked there, one after the other."""
LEAST_SHARE: Final = 1e-6
"""Joints with less of a self-motion stand still in it: locking them leaves the arm short of a direction."""
LEAST_EXTENT: Final = 1e-3
"""What moves less, in rad and lengths of the arm, is a point: that of an arm stretched as far as it goes."""

SolveLocked: TypeAlias = Callable[[Array, Mapping[int, Array]], Array]
"""Solves poses of shape (N, 4, 4), positions in lengths of the arm, with the joints of these indices locked at values
of shape (N,); returns all configurations, shape (k, n); everything in the arm's units."""


def joints_to_lock(arm: Arm, moving: NDArray[np.bool_], ranges: Array, surplus: int) -> tuple[int, ...]:
    """Return which of an arm's own joints to lock so that none is to spare, from the tool inwards.

    Args:
        arm: The arm.
        moving: Which joints are not locked already, bool, shape (n,).
        ranges: Of the coordinates, in the arm's units, shape (n, 2).
        surplus: How many joints are to spare.
    """
    left, rank = moving.copy(), joint_rank(arm, moving, ranges)
    chosen: list[int] = []
    for joint in reversed(range(arm.n - arm.goal_joints)):
        if len(chosen) == surplus:
            break
        if left[joint]:
            left[joint] = False
            if joint_rank(arm, left, ranges) == rank:
                chosen.append(joint)
            else:
                left[joint] = True
    return tuple(chosen)


def self_motions(
    arm: Arm, T: Array, moving: NDArray[np.bool_], ranges: Array, near: Array, solve_locked: SolveLocked
) -> list[Path]:
    """Return the self-motions of a pose, the one that passes nearest to a configuration first.

    They start at all solutions with one joint locked at each of several values, so one that no such value meets is
    missed; joints that take most part in self-motions are locked. Where axes in line give the arm more freedom, its
    configurations are a surface, of which one curve is followed.

    Args:
        arm: The arm, with one joint to spare.
        T: The pose, its position in lengths of the arm, shape (4, 4).
        moving: Which joints are not locked, bool, shape (n,).
        ranges: Of the coordinates, in the arm's units, shape (n, 2).
        near: A configuration, in the arm's units, shape (n,).
        solve_locked: Solves poses with a joint locked.
    """
    own = slice(0, arm.n - arm.goal_joints)  # the goal's joints are where these leave them, in two ways
    turns = np.array(arm.turns)[own]
    seeds = []
    for joint in _moving_most(arm, moving, ranges)[:SAMPLED]:
        low, high = (-math.pi, math.pi) if arm.turns[joint] else ranges[joint]
        values = low + (high - low) * (np.arange(SAMPLES) + 0.5) / SAMPLES
        values = np.append(values, near[joint])
        seeds.append(solve_locked(np.broadcast_to(T, (len(values), 4, 4)), {joint: values}))
    found = np.concatenate(seeds) if seeds else np.zeros((0, arm.n))
    order = np.argsort(_distances(found[:, own], near[own], turns), kind="stable")
    ordered = list(found[order])
    if (
        not arm.goal_joints
        and float(np.abs(pose_error(pose_and_jacobian(arm, near[None])[0], T[None])).max()) < ON_POSE
    ):
        ordered.insert(0, near)  # exactly singular, where what is found is nearly so
    paths: list[Path] = []
    flat = False
    for q in ordered:
        several = len(null_directions(arm, q, moving)) > 1  # of a surface one curve is enough
        if (several and flat) or any(lies_on(path.q[:, own], q[own], turns, closed=path.closed) for path in paths):
            continue
        paths.append(follow(arm, q, T, moving))
        flat |= several
    return paths


def _moving_most(arm: Arm, moving: NDArray[np.bool_], ranges: Array) -> list[int]:
    """Return the arm's own joints that take part in its self-motions, the most first."""
    q = scattered_configurations(ranges[:, 0], ranges[:, 1], 16)
    J = pose_and_jacobian(arm, q)[1][:, :, moving]
    _, values, vectors = np.linalg.svd(J)
    rank = int((values > 1e-9 * values[:, :1]).sum(axis=1).max())
    share = np.zeros(arm.n)
    share[moving] = np.median(np.linalg.norm(vectors[:, rank:], axis=1), axis=0)
    own = share[: arm.n - arm.goal_joints]
    return [int(joint) for joint in np.argsort(-own, kind="stable") if own[joint] > LEAST_SHARE]


def curves_and_nearest(
    arm: Arm, paths: list[Path], kinds: Sequence[str], lower: Array, upper: Array, near: Array
) -> tuple[list[Curve], Array, list[int]]:
    """Return what limits leave of self-motions as curves, and the configuration of each that is nearest to another.

    Args:
        arm: The arm.
        paths: Its self-motions; one that stands still is not a curve, but its configuration is returned.
        kinds: What each is called.
        lower: Lowest joint coordinates, rad and m, shape (n,) of the arm's own joints; -inf where there is no limit.
        upper: Highest ones.
        near: The other configuration, likewise.

    Returns:
        The curves, nearest first, the configurations, rad and m, shape (k, n), and which self-motion each is of.
    """
    turns, n = np.array(arm.turns)[: len(near)], len(near)
    parts = []
    for number, path in enumerate(paths):
        own = Path(q=arm.unscaled(path.q)[:, :n], closed=path.closed)
        for part in inside(own, lower, upper, turns, near):
            distances = np.linalg.norm(np.where(turns, part.q - near, (part.q - near) / arm.length), axis=1)
            nearest = int(distances.argmin())
            parts.append((float(distances[nearest]), number, part, part.q[nearest]))
    parts.sort(key=lambda part: part[0])
    curves = [
        Curve(q=read_only(part.q), kind=kinds[number], closed=part.closed)
        for _, number, part, _ in parts
        if np.ptp(paths[number].q, axis=0).max() > LEAST_EXTENT
    ]
    q = np.array([q for *_, q in parts]).reshape(-1, n)
    return curves, q, [number for _, number, _, _ in parts]


def _distances(q: Array, near: Array, turns: NDArray[np.bool_]) -> Array:
    gaps = np.where(turns, (q - near + np.pi) % (2.0 * np.pi) - np.pi, q - near)
    return np.asarray(np.linalg.norm(gaps, axis=1))
