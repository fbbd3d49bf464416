"""Profiles of motion: how far along its path a motion is at what time; and jerk-limited motions between states."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import TrajectoryError
from dh2sim.trajectory.curves import PiecewisePolynomial
from dh2sim.typing import Array

if TYPE_CHECKING:
    import ruckig


class Profile(StrEnum):
    """How a motion speeds up and slows down between rests."""

    QUINTIC = "quintic"
    """Minimum jerk, 10 s³ - 15 s⁴ + 6 s⁵: smooth, without a phase of constant velocity."""
    TRAPEZOID = "trapezoid"
    """Constant acceleration, constant velocity, constant deceleration; acceleration jumps, so jerk has no limit."""
    JERK = "jerk"
    """As fast as limits of velocity, acceleration and jerk allow: seven phases of constant jerk."""
    OPTIMAL = "optimal"
    """As fast as limits of velocity, acceleration and torque allow along the path; jerk has no limit."""


def quintic(length: float, duration: float) -> PiecewisePolynomial:
    """Return the minimum-jerk motion from 0 to ``length``, at rest at both ends.

    Source: T. Flash and N. Hogan, The coordination of arm movements, Journal of Neuroscience 5 (1985).
    """
    shares = (0.0, 0.0, 0.0, 10.0, -15.0, 6.0)
    terms = [[share * length / duration**power] for power, share in enumerate(shares)]
    return PiecewisePolynomial.of([0.0, duration], [terms])


def trapezoid(length: float, velocity: float, acceleration: float) -> PiecewisePolynomial:
    """Return the fastest motion from 0 to ``length`` within limits of velocity and acceleration."""
    v = min(velocity, math.sqrt(length * acceleration))
    rise = v / acceleration
    level = max(0.0, length / v - rise)
    times, terms = [0.0, rise], [[[0.0], [0.0], [acceleration / 2]]]
    if level > 0.0:
        times.append(rise + level)
        terms.append([[v * rise / 2], [v], [0.0]])
    times.append(times[-1] + rise)
    terms.append([[length - v * rise / 2], [v], [-acceleration / 2]])
    return PiecewisePolynomial.of(times, terms)


def state_to_state(
    q0: ArrayLike,
    q1: ArrayLike,
    *,
    velocity: ArrayLike,
    acceleration: ArrayLike,
    jerk: ArrayLike,
    v0: ArrayLike | None = None,
    v1: ArrayLike | None = None,
    a0: ArrayLike | None = None,
    a1: ArrayLike | None = None,
) -> PiecewisePolynomial:
    """Return the fastest jerk-limited motion between two states; all joints arrive together.

    Where that is possible, they move in step, along a straight line of joint vectors. By Ruckig: L. Berscheid,
    T. Kröger, Jerk-limited real-time trajectory generation with arbitrary target states, RSS 2021.

    Args:
        q0: Positions at the start, rad and m, shape (n,).
        q1: At the end.
        velocity: Limits, shape (n,), above 0 and finite.
        acceleration: Likewise.
        jerk: Likewise.
        v0: Velocities at the start; by default 0, as those below.
        v1: At the end.
        a0: Accelerations at the start.
        a1: At the end.

    Returns:
        The motion over time from 0, s, with pieces of constant jerk.

    Raises:
        TrajectoryError: No motion within the limits is found, as where a state itself exceeds them.
    """
    import ruckig

    limits = np.asarray(velocity, dtype=np.float64)
    start = np.asarray(q0, dtype=np.float64)
    n = len(start)
    zero = np.zeros(n)
    given = [zero if state is None else np.asarray(state, dtype=np.float64) / limits for state in (v0, v1, a0, a1)]
    request = ruckig.InputParameter(n)
    # in units of the velocity limits, and from zero: the same accuracy for every joint
    request.current_position = zero.tolist()
    request.target_position = ((np.asarray(q1, dtype=np.float64) - start) / limits).tolist()
    request.current_velocity, request.target_velocity = given[0].tolist(), given[1].tolist()
    request.current_acceleration, request.target_acceleration = given[2].tolist(), given[3].tolist()
    request.max_velocity = [1.0] * n
    request.max_acceleration = (np.asarray(acceleration, dtype=np.float64) / limits).tolist()
    request.max_jerk = (np.asarray(jerk, dtype=np.float64) / limits).tolist()
    request.synchronization = ruckig.Synchronization.Phase
    found = ruckig.Trajectory(n)
    problem = ""
    try:
        if ruckig.Ruckig(n).calculate(request, found) not in (ruckig.Result.Working, ruckig.Result.Finished):
            problem = "within the limits, between these states"
    except ruckig.RuckigError as error:
        problem = " ".join(str(error).removeprefix("\n[ruckig]").split())
    if problem:
        del request, found  # an error that holds them until the end of the program would have it print a warning
        raise TrajectoryError(f"no jerk-limited motion is found: {problem}")
    [profiles] = found.profiles
    return _joined([_phases(profile) for profile in profiles], float(found.duration), start, limits)


_Phase = tuple[float, float, float, float, float]
"""Duration, and position, velocity, acceleration and jerk at the start."""


def _phases(profile: ruckig.Profile) -> list[_Phase]:
    """Return the phases of one joint's motion that take time."""
    brake = profile.brake
    phases = list(zip(brake.t, brake.p, brake.v, brake.a, brake.j, strict=False)) if brake.duration > 0.0 else []
    phases += zip(profile.t, profile.p, profile.v, profile.a, profile.j, strict=False)
    kept = [phase for phase in phases if phase[0] > 0.0]
    return [*kept, (math.inf, profile.pf, profile.vf, profile.af, 0.0)]


def _joined(joints: list[list[_Phase]], duration: float, start: Array, units: Array) -> PiecewisePolynomial:
    """Return one curve of the phases of all joints."""
    ends = [np.cumsum([phase[0] for phase in phases[:-1]]) for phases in joints]
    times = np.unique(np.concatenate([[0.0], *ends]))
    # phases of joints that move in step end together but for rounding
    times = times[(times < duration) & (np.diff(times, append=np.inf) > 1e-12 * max(duration, 1e-300))]
    breaks = np.concatenate([[0.0], times[times > 0.0], [duration]]) if duration > 0.0 else np.array([0.0, 1.0])
    terms = np.zeros((len(breaks) - 1, 4, len(joints)))
    for joint, (phases, own) in enumerate(zip(joints, ends, strict=True)):
        begins = np.concatenate([[0.0], own])
        middle = 0.5 * (breaks[:-1] + breaks[1:])
        which = np.searchsorted(begins, middle, side="right") - 1
        _, p, v, a, j = np.array([(0.0, *phase[1:]) for phase in phases]).T[:, which]
        x = breaks[:-1] - begins[which]
        terms[:, 0, joint] = p + x * (v + x * (a / 2 + x * j / 6))
        terms[:, 1, joint] = v + x * (a + x * j / 2)
        terms[:, 2, joint] = (a + x * j) / 2
        terms[:, 3, joint] = j / 6
    terms *= units
    terms[:, 0] += start
    return PiecewisePolynomial.of(breaks, terms)
