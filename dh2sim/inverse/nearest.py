"""Numeric inverse kinematics with the results of the complete one: what is reached, or what comes nearest."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from dh2sim.inverse.goals import Free
from dh2sim.inverse.numeric import NumericSolver, goal_angles, goal_distances
from dh2sim.inverse.reach import amount_text, beyond_limits, limits_reason, position_limits, why_unreachable
from dh2sim.inverse.solutions import Solutions
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.forward import forward_kinematics, geometric_jacobian
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only

NOT_COMPLETE = "found numerically: there may be other solutions"


def numeric_solutions(
    spec: RobotSpec,
    T: Array,
    *,
    q0: Array | None = None,
    limits: bool = True,
    lock: Mapping[str, float] | None = None,
    free: Free | None = None,
) -> list[Solutions]:
    """Return for each goal the solution that descents from several starts find first, nearest to ``q0``.

    Args:
        spec: The robot.
        T: Goals for tool0 in base_link, shape (N, 4, 4), their rotations orthonormal.
        q0: Where the first descent starts, rad and m, shape (n,).
        limits: Whether to keep the position limits.
        lock: Coordinates of joints that are not to move, rad and m.
        free: What the goals leave open.

    Returns:
        One each; where nothing reaches a goal, it has no solution, a ``reason``, and the ``nearest`` configuration.
    """
    chain, rows = build_chain(spec), spec.moving_rows
    lower, upper = (np.array(bound) for bound in position_limits(rows))
    if not limits:
        lower[:], upper[:] = -math.inf, math.inf
    for i, row in enumerate(rows):
        if row.name in (lock or {}):
            lower[i] = upper[i] = (lock or {})[row.name]
    solver = NumericSolver(chain, lower, upper)
    found = solver.search(T, q0, free=free)
    residuals = goal_residuals(spec, found.q, T, free=free, size=solver.size)
    sigmas = goal_sigma_min(spec, found.q, free=free, size=solver.size)
    inside = (beyond_limits(rows, found.q) == 0.0).all(axis=1)
    answers = []
    for k, reached in enumerate(found.reached):
        if reached:
            one = slice(k, k + 1)
            answers.append(
                Solutions(
                    q=read_only(found.q[one]),
                    residual=read_only(residuals[one]),
                    sigma_min=read_only(sigmas[one]),
                    within_limits=inside[one],
                    same=np.zeros(1, dtype=np.intp),
                    branch=("",),
                    complete=False,
                    notes=(NOT_COMPLETE,),
                )
            )
        else:
            reason = _reason(spec, T[k], found.q[k], lock, free)
            answers.append(no_solutions(chain.n, reason, found.q[k], complete=False))
    return answers


def no_solutions(n: int, reason: str, nearest: Array | None, *, complete: bool) -> Solutions:
    """Return the result for a pose that no configuration of n joints reaches."""
    none = read_only(np.zeros(0))
    return Solutions(
        q=read_only(np.zeros((0, n))),
        residual=none,
        sigma_min=none,
        within_limits=np.zeros(0, dtype=np.bool_),
        same=np.zeros(0, dtype=np.intp),
        branch=(),
        complete=complete,
        reason=reason,
        nearest=nearest,
    )


def _reason(spec: RobotSpec, T: Array, nearest: Array, lock: Mapping[str, float] | None, free: Free | None) -> str:
    if lock:
        return f"not found with {', '.join(lock)} locked; the nearest is {miss_text(spec, nearest, T, free)}"
    shortfall = why_unreachable(spec, T, q0=nearest, free=free)
    if shortfall is not None:
        return shortfall.reason
    chain = build_chain(spec)
    unbounded = np.full(chain.n, math.inf)
    beyond = NumericSolver(chain, -unbounded, unbounded).search(T[None], nearest, free=free).q
    if beyond_limits(spec.moving_rows, beyond).any():
        return limits_reason(spec, beyond)
    return f"not found; the nearest is {miss_text(spec, nearest, T, free)}"


def miss_text(spec: RobotSpec, q: Array, T: Array, free: Free | None) -> str:
    """Return how far a configuration is from a goal: ``0.12 m and 3.1 degrees away``."""
    pose = forward_kinematics(spec, q)
    parts = [f"{math.dist(pose[:3, 3], T[:3, 3]):.3g} m"]
    if free != "rotation":
        parts.append(amount_text(spec, float(goal_angles(pose[None], T[None], free)[0]), turns=True))
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


def goal_sigma_min(spec: RobotSpec, q: Array, *, free: Free | None, size: float) -> Array:
    """Return the least singular values of a goal's Jacobian, lengths in units of ``size``, shape (N,).

    Its rows are the velocity of tool0's origin and, as far as the goal asks for it, its angular velocity in tool0.
    """
    J = np.array(geometric_jacobian(spec, q))
    J[:, :3] /= size
    J[:, :, [i for i, row in enumerate(spec.moving_rows) if not row.type.turns]] *= size
    if free == "rotation":
        J = J[:, :3]
    elif free == "roll":
        axes = np.swapaxes(forward_kinematics(spec, q)[:, :3, :2], 1, 2)
        J = np.concatenate([J[:, :3], axes @ J[:, 3:]], axis=1)
    return np.asarray(np.linalg.svd(J, compute_uv=False)[:, -1])
