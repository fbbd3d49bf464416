"""Trajectories: motions one after another, with what they reach, and samples of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import SettingsError
from dh2sim.model.robot_model import RobotModel
from dh2sim.progress import Stage, silent
from dh2sim.trajectory.curves import ORDERS
from dh2sim.trajectory.limits import QUANTITIES, MotionLimits
from dh2sim.trajectory.motion import Motion, Peaks, peaks_of, tool_rates
from dh2sim.trajectory.profiles import Profile
from dh2sim.typing import Array, read_only

if TYPE_CHECKING:
    import os

    from dh2sim.trajectory.files import SampledTrajectory

MOST_SAMPLES: Final = 10_000_000
DEFAULT_RATE: Final = 1000.0
"""Hz."""
_BLOCK: Final = 65536
"""Times that are computed together."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Passage:
    """A waypoint of a trajectory, and when it is passed."""

    name: str
    """'' without one."""
    time: float
    """s; where the motion rests there, when it arrives."""
    q: Array
    """rad and m, shape (n,)."""
    kind: str
    """How the motion got here: 'start', 'joint', 'line' or 'arc'."""
    stop: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class Trajectory:
    """Joint positions over time through waypoints, within limits everywhere."""

    model: RobotModel = field(repr=False)
    motions: tuple[Motion, ...] = field(repr=False)
    waypoints: tuple[Passage, ...] = field(repr=False)
    profile: Profile
    limits: MotionLimits = field(repr=False)
    notes: tuple[str, ...] = ()
    """What was chosen, one sentence each."""
    stage: Stage = field(default=silent, repr=False)
    """Shows the progress of what takes long."""

    @cached_property
    def starts(self) -> Array:
        """When each motion starts, and when the last ends, s, shape (motions + 1,)."""
        return read_only(np.cumsum([0.0, *(motion.duration for motion in self.motions)]))

    @property
    def duration(self) -> float:
        """Of the whole, s."""
        return float(self.starts[-1])

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints."""
        return self.limits.joints

    def at(self, t: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """Return the state at times; before the start and after the end, that at rest there.

        Args:
            t: s, any shape (...).

        Returns:
            Positions, velocities, accelerations and jerks, rad and m and their rates, each of shape (..., n). Where
            acceleration or jerk jumps, they are those that follow; waypoints are met exactly at their times.
        """
        given = np.asarray(t, dtype=np.float64)
        times = np.clip(given.ravel(), 0.0, self.duration)
        found = np.zeros((ORDERS, len(times), len(self.joints)))
        which = np.clip(np.searchsorted(self.starts, times, side="right") - 1, 0, max(len(self.motions) - 1, 0))
        order = np.argsort(which, kind="stable")
        ends = np.searchsorted(which[order], np.arange(len(self.motions) + 1))
        for number in np.unique(which).tolist() if self.motions else []:
            mine = order[ends[number] : ends[number + 1]]
            for here in (mine[k : k + _BLOCK] for k in range(0, len(mine), _BLOCK)):
                found[:, here] = self.motions[number].at(times[here] - self.starts[number])
        passed = {waypoint.time: waypoint.q for waypoint in self.waypoints}
        for k in np.flatnonzero(np.isin(times, list(passed))).tolist():
            found[0, k] = passed[float(times[k])]
        outside = (given.ravel() < 0.0) | (given.ravel() > self.duration)
        found[1:, outside] = 0.0
        q, qd, qdd, qddd = found.reshape(ORDERS, *given.shape, len(self.joints))
        return q, qd, qdd, qddd

    def sample(self, rate: float | None = None, samples: int | None = None) -> SampledTrajectory:
        """Return the trajectory at evenly spaced times, the last of which is its end.

        Args:
            rate: Samples per second, 1000 by default; the last interval may be shorter.
            samples: Their number, instead, at least 2.

        Raises:
            SettingsError: Both are given, one is not possible, or there would be more than ten million.
        """
        from dh2sim.trajectory.files import SampledTrajectory

        time = self.sample_times(rate, samples)
        q, qd, qdd, qddd = self.at(time)
        return SampledTrajectory.of(
            self.joints, time, q, qd=qd, qdd=qdd, qddd=qddd, turns=self.limits.turns, robot=self.model.name
        )

    def sample_times(self, rate: float | None = None, samples: int | None = None) -> Array:
        """Return the times of :meth:`sample`, s."""
        if rate is not None and samples is not None:
            raise SettingsError([("rate", "must not be given together with samples")])
        if samples is not None:
            if not 2 <= samples <= MOST_SAMPLES:
                raise SettingsError([("samples", f"must be from 2 to {MOST_SAMPLES}, got {samples}")])
            return read_only(np.append(self.duration / (samples - 1) * np.arange(samples - 1), self.duration))
        hertz = DEFAULT_RATE if rate is None else float(rate)
        if not (math.isfinite(hertz) and hertz > 0.0):
            raise SettingsError([("rate", f"must be a finite number above 0 Hz, got {rate}")])
        if self.duration * hertz > MOST_SAMPLES:
            raise SettingsError(
                [("rate", f"{hertz:g} Hz make more than {MOST_SAMPLES} samples of {self.duration:g} s")]
            )
        count = math.floor(self.duration * hertz * (1.0 + 1e-12))
        time = np.arange(count + 1) / hertz
        if self.duration - time[-1] > 1e-9 * max(self.duration, 1.0):
            time = np.append(time, self.duration)
        else:
            time[-1] = self.duration
        return read_only(time)

    @cached_property
    def peaks(self) -> Peaks:
        """The greatest rates and the range of positions of every joint."""
        found = [peaks_of(motion) for motion in self.motions]
        if not found:
            q = self.waypoints[0].q
            zero = np.zeros((len(QUANTITIES), len(q)))
            return Peaks(lower=q, upper=q, rates=zero, times=zero)
        rates = np.stack([peaks.rates for peaks in found])
        when = np.stack([peaks.times + start for peaks, start in zip(found, self.starts[:-1], strict=True)])
        which = rates.argmax(axis=0)[None]
        return Peaks(
            lower=np.min([peaks.lower for peaks in found], axis=0),
            upper=np.max([peaks.upper for peaks in found], axis=0),
            rates=np.take_along_axis(rates, which, axis=0)[0],
            times=np.take_along_axis(when, which, axis=0)[0],
        )

    @cached_property
    def tool_peaks(self) -> tuple[float, float]:
        """The greatest speed of tool0's origin, m/s, and of its turning, rad/s, as sampled."""
        found = [tool_rates(self.model.chain, motion) for motion in self.motions]
        return max((speed for speed, _ in found), default=0.0), max((turn for _, turn in found), default=0.0)

    @cached_property
    def torques(self) -> Array:
        """The greatest torques and forces that the motion takes, by MuJoCo, N·m and N, shape (n,)."""
        from dh2sim.trajectory.time_optimal import torque_peaks

        return torque_peaks(self.model, self.motions)

    @property
    def limiting(self) -> tuple[str, str, float]:
        """The joint, or tool0, and the quantity nearest to its limit, and the share of it that is used."""
        shares = self.peaks.shares(self.limits)
        if self.profile in (Profile.TRAPEZOID, Profile.OPTIMAL):
            shares = shares[:2]
        order, joint = np.unravel_index(int(shares.argmax()), shares.shape)
        if self.profile is Profile.OPTIMAL:
            of_torques = self.torques / np.array([joint.effort for joint in self.model.moving_joints])
            if of_torques.max() > shares.max():
                return self.joints[int(of_torques.argmax())], "effort", float(of_torques.max())
        bounds = (self.limits.tool_speed, self.limits.tool_turn)
        if any(map(math.isfinite, bounds)):
            for quantity, limit, peak in zip(("speed", "turn"), bounds, self.tool_peaks, strict=True):
                if peak / limit > shares.max():
                    return "tool0", quantity, peak / limit
        return self.joints[joint], QUANTITIES[order], float(shares[order, joint])

    def tool_path(self, count: int = 200) -> Array:
        """Return positions of tool0 in base_link at even times, m, shape (count, 3)."""
        from dh2sim.kinematics.forward import forward_kinematics

        q = self.at(np.linspace(0.0, self.duration, count))[0]
        return np.asarray(forward_kinematics(self.model.chain, q)[:, :3, 3])

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        rate: float | None = None,
        samples: int | None = None,
        overwrite: bool = False,
    ) -> None:
        """Write samples to a .csv or .npz file, which rollouts, the viewer and plots read.

        Args:
            path: The file. A .csv has the columns time and the joints' names; an .npz has the arrays ``time``, ``q``,
                ``qd``, ``qdd``, ``qddd``, ``joints`` and ``units``.
            rate: As for :meth:`sample`.
            samples: Likewise.
            overwrite: Whether to replace a file.

        Raises:
            OutputError: There is a file already, or it cannot be written.
            SettingsError: The file has another ending.
        """
        self.sample(rate, samples).save(path, overwrite=overwrite, stage=self.stage)

    def to_json(self) -> dict[str, Any]:
        """Return what is to be said of the trajectory as JSON values, in s, rad and m."""
        joint, quantity, share = self.limiting
        peaks, limits = self.peaks, self.limits
        rows = zip(self.joints, self.limits.turns, strict=True)
        return {
            "robot": self.model.name,
            "duration": self.duration,
            "profile": self.profile.value,
            "waypoints": [
                {"name": p.name, "time": p.time, "kind": p.kind, "stop": p.stop, "q": p.q.tolist()}
                for p in self.waypoints
            ],
            "joints": [
                {
                    "name": name,
                    "unit": "rad" if turns else "m",
                    "lower": float(peaks.lower[i]),
                    "upper": float(peaks.upper[i]),
                    **{
                        quantity: {
                            "peak": float(peaks.rates[k, i]),
                            "time": float(peaks.times[k, i]),
                            "limit": float(limits.rates[k, i]) if math.isfinite(limits.rates[k, i]) else None,
                        }
                        for k, quantity in enumerate(QUANTITIES)
                    },
                }
                for i, (name, turns) in enumerate(rows)
            ],
            "tool": {"speed": self.tool_peaks[0], "turn": self.tool_peaks[1]},
            "limiting": {"joint": joint, "quantity": quantity, "share": share},
            "assumed": list(limits.assumed),
            "notes": list(self.notes),
        }

    def __repr__(self) -> str:
        """Return robot, number of waypoints, profile and duration."""
        count = len(self.waypoints)
        return f"<Trajectory of '{self.model.name}': {count} waypoints, {self.profile.value}, {self.duration:.4g} s>"
