"""Motions over time: a path with the law by which it is run through, its greatest rates, and the limits that hold."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Self

import numpy as np

from dh2sim.errors import TrajectoryError
from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.forward import geometric_jacobian
from dh2sim.trajectory.curves import Curve, PiecewisePolynomial
from dh2sim.trajectory.limits import INSIDE, QUANTITIES, MotionLimits
from dh2sim.trajectory.profiles import Profile, quintic, state_to_state, trapezoid
from dh2sim.typing import Array

SAMPLES: Final = 64
"""Samples of a piece in which its greatest rates are looked for first."""
_FINER: Final = 32
_TOP: Final = 3
"""Local maxima that are looked at more closely, each twice."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """A motion over time from 0 to its duration."""

    duration: float
    """s."""
    law: PiecewisePolynomial
    """Parameter of the path over time; or without a path the joint vector itself."""
    path: Curve | None = field(default=None, repr=False)
    """Joint vectors over the parameter."""

    def at(self, t: Array) -> Array:
        """Return position, velocity, acceleration and jerk at times, shape (4, N, n)."""
        found = self.law.derivatives(t)
        if self.path is None:
            return found
        u, first, second, third = (each[:, :1] for each in found)
        q, q1, q2, q3 = self.path.derivatives(u[:, 0])
        return np.stack(
            [
                q,
                q1 * first,
                q2 * first * first + q1 * second,
                q3 * first * first * first + 3.0 * q2 * first * second + q1 * third,
            ]
        )

    def stretched(self, factor: float) -> Self:
        """Return the same motion, ``factor`` times as slow."""
        return replace(self, duration=self.duration * factor, law=self.law.stretched(factor))

    def times(self) -> Array:
        """Return times that show the motion: a few in every piece, and both sides of every break."""
        breaks = self.law.breaks
        if self.path is not None and len(self.path.breaks) > 2:
            breaks = np.union1d(breaks, self.when(self.path.breaks[1:-1]))
        shares = np.linspace(0.0, 1.0, SAMPLES // (4 if len(breaks) > SAMPLES else 1) + 1)
        inside = breaks[:-1, None] + np.diff(breaks)[:, None] * shares
        near = 1e-9 * self.duration
        both = [breaks[1:] - near, breaks[:-1] + near, inside.ravel(), np.array([self.duration])]
        return np.unique(np.clip(np.concatenate(both), 0.0, self.duration))

    def when(self, u: Array) -> Array:
        """Return when the parameter of the path, which does not decrease, has given values, s, shape (N,)."""
        low, high = np.zeros(len(u)), np.full(len(u), self.duration)
        for _ in range(60):
            middle = 0.5 * (low + high)
            before = self.law.derivatives(middle)[0, :, 0] < u
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        return np.asarray(0.5 * (low + high))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Peaks:
    """The greatest values that a motion reaches."""

    lower: Array
    """Least positions, rad or m, shape (n,)."""
    upper: Array
    """Greatest positions."""
    rates: Array
    """Greatest velocity, acceleration and jerk without their signs, shape (3, n)."""
    times: Array
    """When these rates are reached, s, shape (3, n)."""

    def shares(self, limits: MotionLimits) -> Array:
        """Return the rates over their limits, shape (3, n)."""
        return np.asarray(self.rates / limits.rates)


def peaks_of(motion: Motion) -> Peaks:
    """Return the greatest values of a motion: exactly where pieces are cubic, else sampled ever more closely."""
    if motion.path is None and motion.law.coefficients.shape[1] <= 4:
        times = _cubic_extremes(motion.law)
        found = motion.at(times)
        near = np.concatenate([times, times[1:] - 1e-12 * motion.duration])  # jerk jumps at breaks
        rates, at = np.abs(motion.at(near)[1:]), near
    else:
        times = motion.times()
        found = motion.at(times)
        finer = _near_maxima(times, np.abs(found[1:]))
        finer = _near_maxima(finer, np.abs(motion.at(finer)[1:]))
        at = np.union1d(times, finer)
        found = motion.at(at)
        rates = np.abs(found[1:])
    which = rates.argmax(axis=1)
    greatest = np.take_along_axis(rates, which[:, None], axis=1)[:, 0]
    return Peaks(lower=found[0].min(axis=0), upper=found[0].max(axis=0), rates=greatest, times=at[which])


def _cubic_extremes(curve: PiecewisePolynomial) -> Array:
    """Return where a cubic curve, its rate or its second derivative may be extreme."""
    h = np.diff(curve.breaks)[:, None]
    terms = np.zeros((len(h), 4, curve.coefficients.shape[2]))
    terms[:, : curve.coefficients.shape[1]] = curve.coefficients
    _, b, c, d = np.moveaxis(terms, 1, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(c * c - 3.0 * b * d)
        flips = [-c / (3.0 * d), (-c + root) / (3.0 * d), (-c - root) / (3.0 * d), -b / (2.0 * c)]
    inner = [(curve.breaks[:-1, None] + flip)[np.isfinite(flip) & (flip > 0.0) & (flip < h)] for flip in flips]
    return np.unique(np.concatenate([curve.breaks, *inner]))


def _near_maxima(times: Array, rates: Array) -> Array:
    """Return finer times around the largest local maxima of rates, shape (3, N, n)."""
    padded = np.pad(rates, ((0, 0), (1, 1), (0, 0)), constant_values=-1.0)
    local = (padded[:, 1:-1] >= padded[:, :-2]) & (padded[:, 1:-1] >= padded[:, 2:])
    heights = np.where(local, rates, -1.0)
    top = np.unique(np.argpartition(-heights, min(_TOP, len(times) - 1), axis=1)[:, :_TOP])
    low, high = times[np.maximum(top - 1, 0)], times[np.minimum(top + 1, len(times) - 1)]
    return np.unique(low + (high - low) * np.linspace(0.0, 1.0, _FINER)[:, None])


def fastest(path: Curve, profile: Profile, limits: MotionLimits, tool: tuple[float, float] = (0.0, 0.0)) -> Motion:
    """Return the motion along a path, from rest to rest, as fast as limits and the profile allow.

    Its shape in time is chosen from the greatest derivatives of the path, and then stretched evenly until all limits
    hold exactly: by k, velocities fall as k, accelerations as k², jerks as k³.

    Args:
        path: Joint vectors over the parameter, from 0.
        profile: 'quintic', 'trapezoid' or 'jerk'.
        limits: They hold everywhere; that of jerk not for 'trapezoid', whose acceleration jumps.
        tool: Distance, m, and angle, rad, that the tool moves in a unit of the parameter, to limit its speed.
    """
    length = float(path.breaks[-1])
    rates = _path_rates(path)
    v, a, j = limits.rates * INSIDE
    first, second, third = (_greatest(rate) for rate in rates)
    # half of acceleration and jerk at most are spent on the path's own curvature
    with np.errstate(divide="ignore", over="ignore"):
        speed = float(min((v / first).min(), np.sqrt(a / (2.0 * second)).min(), np.cbrt(j / (4.0 * third)).min()))
        speed = min(speed, *(limit / moved for limit, moved in _tool(limits, tool) if moved > 0.0), math.inf)
        rise = float(((a - second * speed * speed) / first).min())
        rise = min(rise, float((j / (12.0 * second * speed)).min()))
        onset = float((0.5 * j / first).min()) if second.any() or third.any() else float((j / first).min())
    match profile:
        case Profile.TRAPEZOID:
            law = trapezoid(length, speed, rise)
        case Profile.JERK:
            law = state_to_state([0.0], [length], velocity=[speed], acceleration=[rise], jerk=[onset])
        case _:
            law = quintic(length, length / speed)
    motion = Motion(duration=law.end, law=law, path=path)
    return motion.stretched(needed_stretch(motion, profile, limits, tool))


def _greatest(rate: Array) -> Array:
    return np.asarray(np.maximum(np.abs(rate).max(axis=0), 1e-300))


def _path_rates(path: Curve) -> Array:
    """Return the path's first three derivatives at many parameters, shape (3, N, n)."""
    breaks = np.asarray(path.breaks)
    shares = np.linspace(0.0, 1.0, 33)
    inside = (breaks[:-1, None] + np.diff(breaks)[:, None] * shares).ravel()
    return path.derivatives(inside)[1:]


def _tool(limits: MotionLimits, tool: tuple[float, float]) -> list[tuple[float, float]]:
    return [(limits.tool_speed * INSIDE, tool[0]), (limits.tool_turn * INSIDE, tool[1])]


def needed_stretch(
    motion: Motion, profile: Profile, limits: MotionLimits, tool: tuple[float, float] = (0.0, 0.0)
) -> float:
    """Return by what a motion has to be stretched, or may be shortened if below 1, so that limits just hold."""
    shares = peaks_of(motion).shares(limits) / INSIDE
    powers = [shares[0].max(), math.sqrt(shares[1].max())]
    if profile in (Profile.QUINTIC, Profile.JERK):
        powers.append(float(np.cbrt(shares[2].max())))
    speed = float(np.abs(motion.law.derivatives(motion.times())[1, :, 0]).max())
    powers += [speed * moved / limit for limit, moved in _tool(limits, tool) if math.isfinite(limit)]
    return float(max(powers))


def tool_rates(chain: KinematicChain, motion: Motion) -> tuple[float, float]:
    """Return the greatest speed of tool0, m/s, and of its turning, rad/s, at the times that show a motion."""
    q, qd, _, _ = motion.at(motion.times())
    twist = (geometric_jacobian(chain, q) @ qd[:, :, None])[:, :, 0]
    speed, turn = (float(np.linalg.norm(part, axis=1).max()) for part in (twist[:, :3], twist[:, 3:]))
    return speed, turn


def require_inside(motion: Motion, limits: MotionLimits, where: str) -> None:
    """Refuse a motion that leaves the position limits.

    Raises:
        TrajectoryError: It does; the text says which joint, and when.
    """
    peaks = peaks_of(motion)
    slack = 1e-9 * np.maximum(1.0, np.abs(np.where(np.isfinite(limits.upper), limits.upper, 0.0)))
    beyond = (peaks.lower < limits.lower - slack) | (peaks.upper > limits.upper + slack)
    if not beyond.any():
        return
    joint = int(np.flatnonzero(beyond)[0])
    times = motion.times()
    q = motion.at(times)[0, :, joint]
    out = np.flatnonzero((q < limits.lower[joint] - slack[joint]) | (q > limits.upper[joint] + slack[joint]))
    share = float(times[out[0]] / motion.duration) if out.size else 1.0
    raise TrajectoryError(f"{where}: {limits.joints[joint]} leaves its limits at {100 * share:.0f} % of the time")


def exceeded(motions: Sequence[Motion], profile: Profile, limits: MotionLimits) -> tuple[str, str, float] | None:
    """Return the joint and the limit that motions exceed most, and by what factor; None if they keep them."""
    worst = max(
        (
            (float(share), limits.joints[joint], QUANTITIES[order])
            for motion in motions
            for order, row in enumerate(peaks_of(motion).shares(limits))
            if QUANTITIES[order] != "jerk" or profile in (Profile.QUINTIC, Profile.JERK)
            for joint, share in enumerate(row)
        ),
        default=(0.0, "", ""),
    )
    return (worst[1], worst[2], worst[0]) if worst[0] > 1.0 + 1e-9 else None
