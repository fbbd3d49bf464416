"""Why no configuration reaches a pose, in words, and which comes nearest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from dh2sim.inverse.goals import Free
from dh2sim.inverse.numeric import NumericSolver
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.forward import geometric_jacobian
from dh2sim.kinematics.sampling import scattered_configurations
from dh2sim.robot.row import Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit
from dh2sim.typing import Array, read_only

POSITION_FIRST: Final = 1e-3
"""What 1 rad counts as, in sizes of the arm, where the orientation is to give way."""
ROTATION_FIRST: Final = 1e2
"""Likewise where the position is."""
SLACK: Final = 1e-9
"""rad or m: a limit that is exceeded by less is kept; limits written in deg are rounded."""
PLANAR: Final = 1e-9
"""Share of the largest singular value below which velocities of all configurations span nothing."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shortfall:
    """By how much a pose is missed."""

    reason: str
    """A phrase: ``out of reach by 0.12 m``."""
    q: Array
    """The nearest configuration that was found, rad and m, shape (n,)."""


def position_limits(rows: Sequence[Row]) -> tuple[Array, Array]:
    """Return lower and upper limits of moving rows, rad and m, each of shape (n,); infinite where there are none."""
    ranges = [row.limits.position or (-math.inf, math.inf) for row in rows]
    lower, upper = np.array(ranges, dtype=np.float64).reshape(-1, 2).T
    return read_only(lower), read_only(upper)


def beyond_limits(rows: Sequence[Row], q: Array) -> Array:
    """Return by how much coordinates exceed their limits, negative below the lower one; rad and m, shape (..., n)."""
    lower, upper = position_limits(rows)
    beyond = np.where(q > upper, q - upper, np.where(q < lower, q - lower, 0.0))
    return np.where(np.abs(beyond) <= SLACK, 0.0, beyond)


def limits_reason(spec: RobotSpec, q: Array) -> str:
    """Return which limits configurations exceed, as ``only outside limits: joint_2 by 12 degrees``: the least of all.

    Args:
        spec: The robot.
        q: Configurations that all exceed limits, rad and m, shape (k, n).
    """
    beyond = beyond_limits(spec.moving_rows, q)
    least = beyond[np.abs(beyond).max(axis=1).argmin()]
    offences = [
        f"{row.name} by {amount_text(spec, abs(float(by)), turns=row.type.turns)}"
        for row, by in zip(spec.moving_rows, least, strict=True)
        if by
    ]
    return f"only outside limits: {', '.join(offences)}"


def amount_text(spec: RobotSpec, amount: float, *, turns: bool) -> str:
    """Return an amount, rad or m, in words and in the robot file's unit: ``12 degrees``."""
    unit = spec.units.angle if turns else spec.units.length
    name = "degrees" if unit is AngleUnit.DEG else unit.value
    return f"{amount / spec.units.coordinate(1.0, turns=turns):.3g} {name}"


def why_unreachable(
    spec: RobotSpec, T: Array, *, q0: Array | None = None, free: Free | None = None
) -> Shortfall | None:
    """Return why no configuration reaches a pose whatever the limits; None if the search finds one that does.

    Args:
        spec: The robot.
        T: Goal for tool0 in base_link, shape (4, 4).
        q0: Where the search starts, rad and m, shape (n,).
        free: What the goal leaves open.
    """
    chain = build_chain(spec)
    unbounded = np.full(chain.n, math.inf)
    solver = NumericSolver(chain, -unbounded, unbounded)
    goal = T[None]
    if solver.search(goal, q0, free=free).reached[0]:
        return None
    place = solver.search(goal, q0, free="rotation")
    if not place.reached[0]:
        distance = f"{place.position_error[0]:.3g} m"
        directions = _spanned(spec)
        if directions < 3:
            where = {0: "does not move", 1: "moves along a line", 2: "moves in a plane"}[directions]
            return Shortfall(reason=f"out of reach by {distance}: tool0 {where}", q=place.q[0])
        return Shortfall(reason=f"out of reach by {distance}", q=place.q[0])
    turned = solver.search(goal, place.q[0], free=free, lever=POSITION_FIRST)
    angle = amount_text(spec, float(turned.rotation_error[0]), turns=True)
    if chain.n < (6 if free is None else 5):
        joints = "1 joint" if chain.n == 1 else f"{chain.n} joints"
        return Shortfall(reason=f"orientation unreachable with {joints}, nearest by {angle}", q=turned.q[0])
    moved = solver.search(goal, place.q[0], free=free, lever=ROTATION_FIRST)
    reason = f"in this orientation out of reach by {moved.position_error[0]:.3g} m; at this position by {angle}"
    return Shortfall(reason=reason, q=turned.q[0])


def _spanned(spec: RobotSpec) -> int:
    """Return in how many directions tool0's origin can be moved, over all configurations: 3, or 2 in a plane."""
    n = len(spec.moving_rows)
    spread = np.full(n, math.pi)
    J = geometric_jacobian(spec, scattered_configurations(-spread, spread, 8))
    values = np.linalg.svd(np.concatenate(list(J[:, :3]), axis=1), compute_uv=False)
    return int((values > PLANAR * values.max(initial=0.0)).sum())
