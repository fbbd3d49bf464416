"""The configurations at which the point is farthest, nearest, highest, lowest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, TypeAlias

import numpy as np

from dh2sim.typing import Array, read_only
from dh2sim.workspace.point import PointMap, along

STARTS: Final = 12
"""Best of the sampled configurations that each search starts from."""
_MOST: Final = 80
_HALVINGS: Final = 6
_DONE: Final = 1e-13
"""Share of the arm's size below which a step gains nothing."""

Objective: TypeAlias = Callable[[Array], tuple[Array, Array, Array]]
"""Of points (N, 3): what is to be greatest (N,), its gradient (N, 3), its second derivatives (3, 3)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Extreme:
    """An extreme of the reach, and a configuration that attains it."""

    value: float
    """m."""
    point: Array = field(repr=False)
    """Where the frame's origin is then, in base_link, m, shape (3,)."""
    q: Array
    """rad and m, shape (n,)."""


def distance_from(origin: Array, axis: Array | None = None) -> Objective:
    """Return half the squared distance from a point, or from the axis through it along a unit vector."""
    M = np.eye(3) - (0.0 if axis is None else np.outer(axis, axis))

    def objective(p: Array) -> tuple[Array, Array, Array]:
        gradient = along(p - origin, M)
        return 0.5 * (gradient * gradient).sum(axis=-1), gradient, M

    return objective


def height_along(axis: Array) -> Objective:
    """Return the component of the point along a unit vector, shape (3,)."""

    def objective(p: Array) -> tuple[Array, Array, Array]:
        return along(p, axis[None])[:, 0], np.broadcast_to(axis, p.shape), np.zeros((3, 3))

    return objective


def least(objective: Objective) -> Objective:
    """Return the objective whose greatest value is the least of another."""

    def negated(p: Array) -> tuple[Array, Array, Array]:
        value, gradient, M = objective(p)
        return -value, -gradient, -M

    return negated


def greatest(point: PointMap, objective: Objective, q: Array, p: Array) -> tuple[Array, Array]:
    """Return the configuration at which an objective is greatest, shape (m,), and the point there, m, shape (3,).

    Newton's method climbs inside the limits from the best of the given configurations: curvatures are turned so that
    each step rises, and joints at a limit that the gradient pushes against are held.

    Args:
        point: The point.
        objective: What is to be greatest.
        q: Configurations, shape (N, m).
        p: The points there, m, shape (N, 3).
    """
    best = np.argsort(-objective(p)[0], kind="stable")[:STARTS]
    at, m = q[best].copy(), q.shape[1]
    if not m:
        return at[0], p[best[0]]
    steps = point.steps
    value = objective(point.positions(at))[0]
    for _ in range(_MOST):
        here, J, H = point.second(at)
        value, w, M = objective(here)
        J, H = J * steps, H * steps[:, None] * steps
        g = (J * w[:, :, None]).sum(axis=1)
        held = ((at <= point.lower) & (g < 0.0)) | ((at >= point.upper) & (g > 0.0))
        g = np.where(held, 0.0, g)
        hessian = np.einsum("nai,ab,nbj->nij", J, M, J) + (H * w[:, :, None, None]).sum(axis=1)
        hessian = np.where(held[:, :, None] | held[:, None, :], 0.0, hessian)
        curvature, vectors = np.linalg.eigh(hessian)
        floor = 1e-9 * np.abs(curvature).max(axis=-1, keepdims=True) + 1e-30
        climbed = np.einsum("nij,ni->nj", vectors, g) / np.maximum(np.abs(curvature), floor)
        step = np.einsum("nij,nj->ni", vectors, climbed)
        step = np.where(held, 0.0, step) / np.maximum(1.0, np.abs(step).max(axis=-1))[:, None]
        share = np.ones(len(at))
        for _ in range(_HALVINGS):
            tried = np.clip(at + share[:, None] * step * steps, point.lower, point.upper)
            better = objective(point.positions(tried))[0] > value
            if better.all():
                break
            share = np.where(better, share, 0.25 * share)
        tried = np.clip(at + share[:, None] * step * steps, point.lower, point.upper)
        reached = objective(point.positions(tried))[0]
        rises = reached > value
        at = np.where(rises[:, None], tried, at)
        if not (rises & (reached - value > _DONE * point.size**2)).any():
            break
        value = np.where(rises, reached, value)
    here = point.positions(at)
    k = int(np.argmax(objective(here)[0]))
    return at[k], here[k]


def extreme_of(point: PointMap, objective: Objective, q: Array, p: Array, value: Callable[[Array], float]) -> Extreme:
    """Return an extreme whose ``value`` is computed from the point that attains it; arguments as of ``greatest``."""
    best, place = greatest(point, objective, q, p)
    return Extreme(value=value(place), point=read_only(place), q=read_only(point.full(best[None])[0]))
