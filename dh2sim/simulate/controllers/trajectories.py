"""Smooth random trajectories inside the limits, for many rollouts at once.

They have the same bits however the rollouts and the time steps are divided.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, Final, TypeAlias

import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from dh2sim.errors import ControllerError
from dh2sim.simulate.controllers.options import Within
from dh2sim.simulate.controllers.protocol import RolloutBatch
from dh2sim.simulate.mujoco_runtime import POSITION_STAGE, forward, set_models
from dh2sim.typing import Array

MINIMUM_JERK_PEAK: Final = 1.875
"""Greatest speed of a minimum-jerk motion, at its middle, over distance/duration: 30 · 1/4 · 1/4."""
_CACHED: Final = 16384
"""Numbers processed at a time; three arrays of them fit into the cache."""


def weighted_sum(weights: Array, values: Sequence[Array], out: Array | None = None) -> Array:
    """Return the sum over terms h of ``weights[h, k] * values[h][i, j]``.

    Terms are added in their order, one multiplication and one addition each, and never by a library's product of
    matrices, whose order of additions depends on sizes.

    Args:
        weights: What varies with time, shape (terms, count).
        values: What varies with rollout and joint, each of shape (batch, m); at least one.
        out: Where to put the result.

    Returns:
        Array of shape (batch, count, m).
    """
    batch, m = values[0].shape
    count = weights.shape[1]
    out = np.empty((batch, count, m)) if out is None else out
    if out.size == 0:
        return out
    group = min(batch, max(1, _CACHED // (m * count)))
    total, term = np.empty((2, group, m, count))  # time last: long inner loops
    for first in range(0, batch, group):
        last = min(first + group, batch)
        here, product = total[: last - first], term[: last - first]
        np.multiply(values[0][first:last, :, None], weights[0], out=here)
        for weight, value in zip(weights[1:], values[1:], strict=True):
            np.multiply(value[first:last, :, None], weight, out=product)
            np.add(here, product, out=here)
        out[first:last] = here.transpose(0, 2, 1)
    return out


def minimum_jerk(s: Array) -> tuple[Array, Array, Array]:
    """Return the minimum-jerk motion from 0 to 1 and its first two derivatives.

    10 s³ - 15 s⁴ + 6 s⁵, which starts and ends at rest without acceleration. Source: T. Flash and N. Hogan, The
    coordination of arm movements, Journal of Neuroscience 5 (1985).

    Args:
        s: Time over duration, from 0 to 1.
    """
    rest = 1.0 - s
    position = s * s * s * (10.0 + s * (6.0 * s - 15.0))
    return position, 30.0 * s * s * rest * rest, 60.0 * s * rest * (1.0 - 2.0 * s)


def cubic_spline_weights(u: Array) -> Array:
    """Return the weights of four neighbouring points of a uniform cubic B-spline, shape (4, count).

    They are not negative and add up to one, so the curve stays between the least and the greatest point. Source:
    C. de Boor, A Practical Guide to Splines (1978).

    Args:
        u: Position between the two middle points, from 0 to 1, shape (count,).
    """
    rest = 1.0 - u
    return np.stack(
        (
            rest * rest * rest / 6.0,
            (4.0 + u * u * (3.0 * u - 6.0)) / 6.0,
            (1.0 + 3.0 * u * (1.0 + u * rest)) / 6.0,
            u * u * u / 6.0,
        )
    )


def pieces(first: int, count: int, timestep: float, duration: float, number: int) -> tuple[Array, Array]:
    """Return in which of ``number`` pieces of equal duration time steps are, and where in it.

    Args:
        first: First time step.
        count: Number of time steps.
        timestep: s.
        duration: Duration of a piece, s.
        number: Number of pieces; later time steps are at the end of the last.

    Returns:
        The pieces, whole numbers from 0, shape (count,); and the time since the start of the piece as a share of its
        duration, from 0 to 1.
    """
    place = np.arange(first, first + count) * timestep / duration
    piece = np.minimum(np.floor(place), number - 1.0)
    return piece, np.clip(place - piece, 0.0, 1.0)


def runs_of(piece: Array) -> list[tuple[int, slice]]:
    """Return each piece that occurs in an array that does not decrease, with the part of the array where it does."""
    bounds = [*np.flatnonzero(np.diff(piece, prepend=-1.0)).tolist(), piece.size]
    return [(int(piece[first]), slice(first, end)) for first, end in itertools.pairwise(bounds)]


INSIDE: Final = 1.0 - 1e-9
"""Share of the limits that is used, so that rounding never exceeds them."""


def half_ranges(lower: Array, upper: Array, free: Array) -> Array:
    """Return half of each range, or ``free`` where a range is not limited; of shape (m,) or (batch, m)."""
    limited = np.isfinite(lower) & np.isfinite(upper)
    return np.where(limited, 0.5 * np.where(limited, upper, 0.0) - 0.5 * np.where(limited, lower, 0.0), free)


def centers(start: Array, reach: Array, lower: Array, upper: Array) -> Array:
    """Return the points nearest to ``start`` from which ``reach`` on either side is inside the limits.

    Args:
        start: Shape (batch, m).
        reach: At most half of the ranges, shape (m,) or (batch, m).
        lower: Shape (m,) or (batch, m); -inf where unlimited.
        upper: Likewise; inf where unlimited.

    Returns:
        Array of shape (batch, m).
    """
    return np.minimum(np.maximum(start, lower + reach), upper - reach)


def follow(start: Array, targets: Iterable[Array], most: Array) -> Array:
    """Return points that go from ``start`` towards each target in turn, each at most ``most`` from the last.

    Args:
        start: Shape (batch, m).
        targets: Each of shape (batch, m).
        most: Greatest distance between neighbouring points, shape (m,) or (batch, m).

    Returns:
        The start and the points, shape (1 + targets, batch, m).
    """
    points = [start]
    for target in targets:
        points.append(points[-1] + np.clip(target - points[-1], -most, most))
    return np.stack(points)


def uniform(generators: Sequence[np.random.Generator], a: int, m: int) -> Array:
    """Draw numbers from -1 to 1, shape (a, m) for every rollout; returned with shape (a, batch, m)."""
    drawn = [generator.uniform(-1.0, 1.0, size=(a, m)) for generator in generators]
    return np.ascontiguousarray(np.moveaxis(np.stack(drawn), 0, -2))


def widened(batch: RolloutBatch) -> tuple[Array, Array]:
    """Return the joints' limits, extended to the start of a rollout outside of them, each of shape (batch, n)."""
    return np.minimum(batch.plant.lower, batch.q0), np.maximum(batch.plant.upper, batch.q0)


Period: TypeAlias = Annotated[float, Within(above=0.0, unit="s")]
"""Duration of a motion from waypoint to waypoint."""
Amplitude: TypeAlias = Annotated[float, Within(at_least=0.0, at_most=1.0)]
"""Share of the joint's range."""

_FEWEST_STEPS: Final = 10
"""Fewest time steps of a motion between waypoints."""
_AHEAD: Final = 64
"""Time steps that are computed together when they are used one by one."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """Positions, velocities and accelerations, rad or m and their rates, each of shape (batch, count, n)."""

    q: Array
    v: Array
    a: Array


class StepByStep:
    """A motion that is used one time step after the other, computed for many at a time."""

    def __init__(self, motion: Callable[[int, int], Motion]) -> None:
        """Take what returns the motion at the beginning of some steps, from a first one and their number."""
        self._motion = motion
        self._ahead: Motion | None = None
        self._first = 0

    def __call__(self, step: int) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration at the beginning of a time step, each of shape (batch, n)."""
        k = step % _AHEAD
        if self._ahead is None or step - k != self._first:
            self._first = step - k
            self._ahead = self._motion(self._first, _AHEAD)
        return self._ahead.q[:, k], self._ahead.v[:, k], self._ahead.a[:, k]


_TRIES: Final = 20
"""Draws of a waypoint; if links would touch on the way to each, the arm rests instead."""
_LOOK: Final = 0.08
"""rad or m: how far a joint moves at most between the places at which contacts are looked for."""


_Reached: TypeAlias = Callable[[NDArray[np.intp], Array, Array], NDArray[np.bool_]]
"""Takes rollouts and where each goes from and to, shape (rollouts, n); returns which of them can."""


def _reachable(batch: RolloutBatch, targets: Array, center: Array, reach: Array, most: Array) -> Array:
    """Return waypoints as ``follow`` does; a target is drawn again if something is in the way to it.

    Args:
        batch: The rollouts.
        targets: As they were drawn, shape (motions, batch, n).
        center: Centre of the window that they are drawn from, shape (batch, n).
        reach: Half of its width, shape (n,) or (batch, n).
        most: Greatest distance between neighbouring waypoints, shape (n,) or (batch, n).
    """
    reached: _Reached
    if batch.plant.loops is not None:
        reached = _closes_loops(batch)
    elif batch.plant.may_touch:
        reached = _clear_of_links(batch)
    else:
        return follow(batch.q0, targets, most)
    reach, most = (np.broadcast_to(array, batch.q0.shape) for array in (reach, most))
    again: dict[int, np.random.Generator] = {}
    waypoints = [np.array(batch.q0)]
    for drawn in targets:
        before, wanted, left = waypoints[-1], drawn.copy(), np.arange(len(drawn))
        point = before.copy()  # where none is found, it rests
        for _ in range(_TRIES):
            there = before[left] + np.clip(wanted[left] - before[left], -most[left], most[left])
            good = reached(left, before[left], there)
            point[left[good]] = there[good]
            left = left[~good]
            for i in left.tolist():
                # a stream of its own: a longer run, which draws more targets first, must begin alike
                if i not in again:
                    again[i] = batch.generators[i].spawn(1)[0]
                wanted[i] = center[i] + reach[i] * again[i].uniform(-1.0, 1.0, size=len(wanted[i]))
            if not len(left):
                break
        waypoints.append(point)
    return np.stack(waypoints)


def _clear_of_links(batch: RolloutBatch) -> _Reached:
    """Return what tells whether no links touch on the way, or do already where it begins, which could not be left."""
    model = batch.plant.model
    looking = Batch(model, len(batch.rollouts), nthread=1)
    set_models(looking, batch.plant)
    contacts, q = looking.bind("ncon"), looking.bind("qpos")[:, model.nq - batch.plant.n :]

    def touch(which: NDArray[np.intp], at: Array) -> NDArray[np.bool_]:
        q[which] = at
        forward(looking, which, stage=POSITION_STAGE)
        return np.asarray(contacts[which] > 0)

    def reached(left: NDArray[np.intp], start: Array, end: Array) -> NDArray[np.bool_]:
        looks = np.maximum(1.0, np.ceil(np.abs(end - start).max(axis=1, initial=0.0) / _LOOK))
        clear = np.ones(len(left), dtype=bool)
        for k in range(1, int(looks.max()) + 1):
            now = np.flatnonzero(clear & (k <= looks))
            if len(now):
                share = (k / looks[now])[:, None]
                clear[now] = ~touch(left[now], start[now] + share * (end[now] - start[now]))
        blocked = np.flatnonzero(~clear)
        if len(blocked):
            clear[blocked] = touch(left[blocked], start[blocked])
        return clear

    return reached


def _closes_loops(batch: RolloutBatch) -> _Reached:
    """Return what tells whether the loops of a mechanism can be closed all the way."""
    loops = batch.plant.loops
    assert loops is not None
    assert batch.qpos0 is not None
    qpos = batch.qpos0.copy()

    def reached(left: NDArray[np.intp], _start: Array, end: Array) -> NDArray[np.bool_]:
        found, good = loops.follow(qpos[left], end)
        qpos[left[good]] = found[good]
        return good

    return reached


_LOOK_EVERY: Final = 0.1
"""s: between the places of a path at which loops are closed to see whether it can be followed."""


def followed_by_loops(batch: RolloutBatch, path: Callable[[int, int], Array]) -> NDArray[np.bool_]:
    """Return in which rollouts the loops of a mechanism can be closed all along a path of its driven joints.

    Args:
        batch: The rollouts.
        path: Takes a first time step and a number of them; returns positions, shape (batch, count, n).
    """
    loops = batch.plant.loops
    if loops is None or batch.qpos0 is None:
        return np.ones(len(batch.rollouts), dtype=bool)
    every = max(1, round(_LOOK_EVERY / batch.plant.timestep))
    qpos, good = batch.qpos0.copy(), np.ones(len(batch.rollouts), dtype=bool)
    for step in range(0, batch.steps, every):
        left = np.flatnonzero(good)
        qpos[left], good[left] = loops.follow(qpos[left], path(step, 1)[left, 0])
    return good


class SmoothReference:
    """Minimum-jerk motions from one random waypoint to the next, at rest in each.

    The first waypoint is where the rollout starts. The others are uniform in a window around it, ``amplitude`` times
    the joint's range wide, or as near to it as the limits allow. A waypoint that could not be reached within the
    velocity limit is moved closer; one is drawn again if links would touch on the way to it, and if they do on all of
    twenty ways, the arm rests. Every motion stays between its two waypoints, so that nothing leaves the limits.
    """

    def __init__(self, batch: RolloutBatch, *, period: float, amplitude: float) -> None:
        """Draw the waypoints.

        Args:
            batch: The rollouts.
            period: Duration of a motion from waypoint to waypoint, s.
            amplitude: Width of the window as a share of the joint's range, 0 to 1; for joints without limits, as a
                share of 2 pi rad or 2 m.

        Raises:
            ControllerError: A motion would be shorter than ten time steps.
        """
        plant = batch.plant
        self._timestep = plant.timestep
        if period < _FEWEST_STEPS * plant.timestep:
            least = _FEWEST_STEPS * plant.timestep
            raise ControllerError(
                f"option 'period' must be at least {_FEWEST_STEPS} time steps, {least:g} s, got {period:g} s"
            )
        self._period = period
        self._motions = math.floor(batch.steps * plant.timestep / period) + 1
        lower, upper = widened(batch)
        reach = INSIDE * amplitude * half_ranges(plant.lower, plant.upper, plant.free_half_ranges)
        center = centers(batch.q0, reach, plant.lower, plant.upper)
        targets = center + reach * uniform(batch.generators, self._motions, plant.n)
        # no joint exceeds its velocity limit, even where a start outside the limits makes the way longer
        most = INSIDE * plant.velocity * period / MINIMUM_JERK_PEAK
        # rollouts next to each other, as in what is observed of them
        self._waypoints = np.ascontiguousarray(_reachable(batch, targets, center, reach, most).transpose(0, 2, 1))
        self._lower, self._upper = np.ascontiguousarray(lower.T), np.ascontiguousarray(upper.T)
        self.at = StepByStep(self.motion)

    def motion(self, first: int, count: int) -> Motion:
        """Return the motion at the beginning of time steps ``first`` to ``first + count - 1``."""
        piece, s = pieces(first, count, self._timestep, self._period, self._motions)
        position, speed, acceleration = (factor[:, None, None] for factor in minimum_jerk(s))
        speed, acceleration = speed / self._period, acceleration / (self._period * self._period)
        q, v, a = np.empty((3, count, *self._lower.shape))
        for i, part in runs_of(piece):
            start, end = self._waypoints[i], self._waypoints[i + 1]
            np.multiply(1.0 - position[part], start, out=q[part])
            q[part] += position[part] * end
            np.multiply(speed[part], end - start, out=v[part])
            np.multiply(acceleration[part], end - start, out=a[part])
        np.clip(q, self._lower, self._upper, out=q)
        q, v, a = (array.transpose(2, 0, 1) for array in (q, v, a))
        return Motion(q=q, v=v, a=a)
