"""Numeric inverse kinematics with the results of the complete one: what is reached, or what comes nearest."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from dh2sim.inverse.goals import Free
from dh2sim.inverse.numeric import NumericSolver, goal_angles, goal_distances
from dh2sim.inverse.reach import SLACK, amount_text, beyond_limits
from dh2sim.inverse.solutions import Solutions
from dh2sim.kinematics.chain import ChainLike, KinematicChain, chain_of
from dh2sim.kinematics.forward import forward_kinematics, geometric_jacobian
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only

NOT_COMPLETE: Final = "Found numerically: there may be other solutions."


def numeric_solutions(
    spec: RobotSpec,
    chain: KinematicChain,
    solver: NumericSolver,
    T: Array,
    q0: Array,
    *,
    free: Free | None,
    size: float,
    rank: int,
) -> list[Solutions]:
    """Return for each goal the solution that descents from several starts find first.

    Args:
        spec: The robot.
        chain: Its chain.
        solver: Of the chain.
        T: Goals for tool0 in base_link, shape (N, 4, 4), their rotations orthonormal.
        q0: Where the first descent starts, rad and m, shape (n,).
        free: What the goals leave open.
        size: Unit of length of residuals and singular values, m.
        rank: Of the goal's Jacobian at a general configuration.

    Returns:
        One each; where nothing reaches a goal, it has no solution, but the ``nearest`` configuration.
    """
    found = solver.search(T, q0, free=free)
    residuals = goal_residuals(spec, found.q, T, free=free, size=size)
    sigmas = goal_sigma_min(chain, found.q, free=free, size=size, rank=rank)
    inside = (beyond_limits(spec.moving_rows, found.q) == 0.0).all(axis=1)
    return [
        replace(
            no_solutions(len(spec.moving_rows), found.q[k]),
            **{
                "q": read_only(found.q[k : k + 1]),
                "residual": read_only(residuals[k : k + 1]),
                "sigma_min": read_only(sigmas[k : k + 1]),
                "within_limits": inside[k : k + 1],
                "same": np.zeros(1, dtype=np.intp),
                "branch": ("",),
                "nearest": None,
                "notes": (NOT_COMPLETE,),
            }
            if reached
            else {},
        )
        for k, reached in enumerate(found.reached)
    ]


def no_solutions(n: int, nearest: Array | None = None) -> Solutions:
    """Return the result for a pose for which no configuration of n joints was found."""
    none = read_only(np.zeros(0))
    return Solutions(
        q=read_only(np.zeros((0, n))),
        residual=none,
        sigma_min=none,
        within_limits=np.zeros(0, dtype=np.bool_),
        same=np.zeros(0, dtype=np.intp),
        branch=(),
        complete=False,
        nearest=None if nearest is None else read_only(nearest),
    )


def miss_text(spec: RobotSpec, q: Array, T: Array, free: Free | None) -> str:
    """Return how far a configuration is from a goal: ``0.12 m and 3.1 degrees away``; what fits is left out."""
    pose = forward_kinematics(spec, q)
    distance, angle = math.dist(pose[:3, 3], T[:3, 3]), 0.0
    if free != "rotation":
        angle = float(goal_angles(pose[None], T[None], free)[0])
    parts = [f"{distance:.3g} m"] if distance > SLACK or angle <= SLACK else []
    if angle > SLACK:
        parts.append(amount_text(spec, angle, turns=True))
    return f"{' and '.join(parts)} away"


def goal_residuals(spec: RobotSpec, q: Array, T: Array, *, free: Free | None, size: float) -> Array:
    """Return how far configurations are from their goals by the table's textbook product.

    Args:
        spec: The robot.
        q: Configurations, rad and m, shape (N, n).
        T: Goals, shape (N, 4, 4).
        free: What they leave open.
        size: The arm's size, m.

    Returns:
        The distance over the size or the angle, rad, whichever is larger, shape (N,).
    """
    found = table_tool_pose(spec, q)
    return np.asarray(np.maximum(goal_distances(found, T) / size, goal_angles(found, T, free)))


def goal_sigma_min(robot: ChainLike, q: Array, *, free: Free | None, size: float, rank: int) -> Array:
    """Return the least singular values of a goal's Jacobian, lengths in units of ``size``, shape (N,).

    Its rows are the velocity of tool0's origin and, as far as the goal asks for it, its angular velocity in tool0.
    ``rank`` is that of a general configuration: further singular values are always zero.
    """
    chain = chain_of(robot)
    turns = np.array([joint.type.turns for joint in chain.moving_joints], dtype=np.bool_)
    R = forward_kinematics(chain, q)[:, :3, :3] if free == "roll" else None
    J = np.array(geometric_jacobian(chain, q))
    J[:, :3, turns] /= size
    return least_singular_values(J, R, free=free, rank=rank)


def least_singular_values(J: Array, R: Array | None, *, free: Free | None, rank: int) -> Array:
    """Return the least singular values of the rows of Jacobians that a goal asks for, shape (N,).

    Args:
        J: Geometric Jacobians, lengths in units of the arm's size, shape (N, 6, n).
        R: Orientations of tool0, shape (N, 3, 3); used where the roll is free.
        free: What the goal leaves open.
        rank: Of the rows that it asks for, at a general configuration.
    """
    if free == "rotation":
        J = J[:, :3]
    elif free == "roll" and R is not None:
        J = np.concatenate([J[:, :3], np.swapaxes(R[:, :, :2], 1, 2) @ J[:, 3:]], axis=1)
    return np.asarray(np.linalg.svd(J, compute_uv=False)[:, rank - 1])
