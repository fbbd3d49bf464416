"""Jacobians: central differences of the table against the library, and the library against every engine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from dh2sim.kinematics.table import table_tool_pose
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from dh2sim.validate.report import Check, Quantity, Worst

STEP = 1e-5
"""rad or m; rounding and truncation are then both about 1e-11 of the reach."""
DIFFERENCE_TOLERANCE = 1e-8
"""Of the Jacobian by differences; times the reach for its linear part."""


class JacobianEngine(Protocol):
    """Whatever has a Jacobian."""

    name: str

    def jacobian(self, q: Array) -> Array:
        """Geometric Jacobian of tool0 in base_link, linear rows first, shape (N, 6, n); q of shape (N, n)."""
        ...


def table_jacobian(spec: RobotSpec, q: Array) -> Array:
    """Geometric Jacobian of tool0 by central differences of the table's own product.

    Args:
        spec: the robot.
        q: joint vectors, rad and m, shape (N, n).

    Returns:
        Shape (N, 6, n). The angular part is the skew part of (R(q + h) - R(q - h)) / 2h · R(q)ᵀ.
    """
    n = q.shape[1]
    R = table_tool_pose(spec, q)[:, :3, :3]
    result = np.zeros((len(q), 6, n))
    for j in range(n):
        step = np.zeros(n)
        step[j] = STEP
        change = (table_tool_pose(spec, q + step) - table_tool_pose(spec, q - step)) / (2 * STEP)
        spin = change[:, :3, :3] @ R.transpose(0, 2, 1)
        result[:, :3, j] = change[:, :3, 3]
        result[:, 3, j] = 0.5 * (spin[:, 2, 1] - spin[:, 1, 2])
        result[:, 4, j] = 0.5 * (spin[:, 0, 2] - spin[:, 2, 0])
        result[:, 5, j] = 0.5 * (spin[:, 1, 0] - spin[:, 0, 1])
    return result


def check_jacobian(
    engine: JacobianEngine,
    reference: Array,
    q: Array,
    tolerance: float,
    reach: float,
    joints: Sequence[str],
    *,
    differences: bool = False,
) -> Check:
    """Compare an engine's Jacobian with a reference of shape (N, 6, n).

    Args:
        engine: the engine.
        reference: the Jacobians to compare with.
        q: joint vectors, rad and m, shape (N, n).
        tolerance: allowed error of an angular entry, and of a linear one as a share of max(1 m, reach).
        reach: m.
        joints: names of the n joints, for the report.
        differences: whether the reference was made by central differences.
    """
    error = np.abs(engine.jacobian(q) - reference)
    error[:, :3] /= max(1.0, reach)
    by_joint = error.max(axis=1)  # (N, n)
    worst, joint = divmod(int(np.argmax(by_joint)), len(joints))  # a NaN is worse than any number
    largest = float(by_joint[worst, joint])
    return Check(
        engine=engine.name,
        quantity=Quantity.JACOBIAN,
        ok=bool(largest <= tolerance),
        reference="central differences" if differences else "dh2sim",
        samples=len(q),
        max_error=largest,
        tolerance=tolerance,
        worst=Worst(where=joints[joint], q=tuple(q[worst].tolist()), sample=worst),
    )
