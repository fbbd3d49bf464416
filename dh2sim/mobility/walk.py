"""Finite mobility: walk along the loops, and see in how many directions a mechanism really goes on.

Velocities that violate nothing to first order may still lead nowhere (a shaky structure), and where branches of
motion meet there are more of them than any branch has. So a step is made along each, the loops are closed again by
damped Gauss-Newton steps, and the directions are counted at a place away from the assembly, where they are those of
one branch.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.mobility.constraints import LoopEquations, Rank, rank_of
from dh2sim.mobility.screws import DEPENDENT
from dh2sim.typing import Array

_STEP: Final = 0.06
"""rad, and sizes of the mechanism."""
_STEPS: Final = 6
_PROBE: Final = 1e-3
"""A step so short that curvature is not to be seen in it."""
_STARTS: Final = 16
_MOVED: Final = 0.05
"""Share of a step that is a motion; what is rigid comes back to 1e-3 of a step and less."""
_CLOSED: Final = 1e-13
_ITERATIONS: Final = 90
"""Where constraints touch to the third order only, each makes two thirds of the way."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Walk:
    """What walking has shown."""

    dimension: int
    """Freedoms of the branch that has the most."""
    branches: tuple[int, ...]
    """The different freedoms that places away from the assembly have, falling."""
    spread: int
    """Dimension of the space that all first steps span: more than ``dimension`` where branches meet."""
    tangents: int
    """Least number of velocities to first order at a place reached."""


def walk(equations: LoopEquations, rank: Rank) -> Walk:
    """Count the freedoms of finite motion through the assembly.

    Args:
        equations: The loops.
        rank: Of their Jacobian at the assembly.
    """
    if not rank.mobility:
        return Walk(dimension=0, branches=(), spread=0, tangents=0)
    random = np.random.default_rng(0)
    directions = random.normal(size=(_STARTS, rank.mobility)) @ rank.motions
    directions = np.vstack([directions, rank.motions])
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    first, closed = _closed(equations, _STEP * directions)
    lengths = np.linalg.norm(first, axis=1)
    went = closed & (lengths > _MOVED * _STEP) & (lengths < 3.0 * _STEP)
    if not went.any():
        return Walk(dimension=0, branches=(), spread=0, tangents=rank.mobility)
    steps = first[went]
    values = np.linalg.svd(steps / np.linalg.norm(steps, axis=1)[:, None], compute_uv=False)
    found = [_freedoms_at(equations, place, random) for place in _different(_walked(equations, steps))]
    branches = tuple(sorted({dimension for dimension, _ in found}, reverse=True))
    return Walk(
        dimension=branches[0],
        branches=branches,
        spread=int((values > 0.2 * values[0]).sum()),
        tangents=min(tangents for _, tangents in found),
    )


def _walked(equations: LoopEquations, places: Array) -> Array:
    """Return where further steps lead, each as straight on as the loops allow."""
    headings = places / np.linalg.norm(places, axis=1)[:, None]
    for _ in range(_STEPS):
        _, jacobians = equations.evaluate(places)
        ahead = np.array([_tangential(J, heading) for J, heading in zip(jacobians, headings, strict=True)])
        lengths = np.linalg.norm(ahead, axis=1)
        new, closed = _closed(equations, places + _STEP * ahead / np.maximum(lengths, 1e-12)[:, None])
        moved = np.linalg.norm(new - places, axis=1)
        went = closed & (lengths > 0.1) & (moved > 0.5 * _STEP) & (moved < 2.0 * _STEP)
        headings = np.where(went[:, None], (new - places) / np.maximum(moved, 1e-12)[:, None], headings)
        places = np.where(went[:, None], new, places)
    return places


def _tangential(jacobian: Array, heading: Array) -> Array:
    motions = rank_of(jacobian).motions
    return np.asarray(heading @ motions.T @ motions)


def _different(places: Array) -> list[Array]:
    """Return a few places that are far from each other; a branch needs to be looked at once or twice only."""
    chosen = [places[0]]
    while len(chosen) < min(6, len(places)):
        distances = np.min([np.linalg.norm(places - place, axis=1) for place in chosen], axis=0)
        chosen.append(places[int(np.argmax(distances))])
    return chosen


def _freedoms_at(equations: LoopEquations, place: Array, random: np.random.Generator) -> tuple[int, int]:
    """Return in how many directions a short step stays on the loops, and how many velocities there are."""
    motions = rank_of(equations.jacobian(place)).motions
    if not len(motions):
        return 0, 0
    mixed = random.normal(size=(3, len(motions))) @ motions
    probes = np.vstack([motions, mixed / np.linalg.norm(mixed, axis=1)[:, None]])
    there, closed = _closed(equations, place + _PROBE * probes)
    steps = (there - place)[closed] / _PROBE
    if not len(steps):
        return 0, len(motions)
    values = np.linalg.svd(steps, compute_uv=False)
    return int((values > 0.3).sum()), len(motions)


def _closed(equations: LoopEquations, q: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return the nearest configurations at which the loops are closed, and whether they are.

    Levenberg-Marquardt steps whose damping is the square of the error: they converge quadratically where the
    constraints are independent, and steadily where they are not (Yamashita and Fukushima, 2001).

    Args:
        equations: The loops.
        q: Where to start, shape (count, freedoms).

    Returns:
        Shapes (count, freedoms) and (count,).
    """
    q = q.copy()
    left = np.arange(len(q))
    for _ in range(_ITERATIONS):
        errors, jacobians = equations.evaluate(q[left])
        open_ = np.abs(errors).max(axis=1) > _CLOSED
        left, errors, jacobians = left[open_], errors[open_], jacobians[open_]
        if not len(left):
            break
        u, values, directions = np.linalg.svd(jacobians, full_matrices=False)
        damping = (errors**2).sum(axis=1)[:, None]
        gains = np.where(values > DEPENDENT * values[:, :1], values / (values**2 + damping), 0.0)
        amounts = gains * np.einsum("bij,bi->bj", u, errors)
        q[left] -= np.einsum("bji,bj->bi", directions, amounts)
    closed = np.ones(len(q), dtype=np.bool_)
    closed[left] = False
    return q, closed
