"""Trajectories of mechanisms: the driven joints are planned like those of an arm, and the passive ones follow.

A motion goes from rest to rest through waypoints of the driven joints. The loops are closed by continuation along it,
so that dead positions, and limits of passive joints, are found on the way and not by whoever drives there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, Final, Unpack

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import SettingsError, SingularPositionError, TrajectoryError
from dh2sim.kinematics.driven_branch import DrivenBranch, DrivenPath
from dh2sim.kinematics.loop_batch import LoopBatch
from dh2sim.kinematics.loop_motion import LONGEST, actuated_joints, mechanism_configuration
from dh2sim.messages import listed
from dh2sim.model.mechanism import MechanismModel
from dh2sim.model.robot_model import RobotModel
from dh2sim.progress import Stage, silent
from dh2sim.trajectory.files import SampledTrajectory
from dh2sim.trajectory.limits import INSIDE
from dh2sim.trajectory.motion import peaks_of
from dh2sim.trajectory.options import TrajectoryKeywords, TrajectoryOptions
from dh2sim.trajectory.profiles import Profile
from dh2sim.trajectory.serial import plan_serial_trajectory
from dh2sim.trajectory.trajectory import Trajectory
from dh2sim.trajectory.waypoints import MoveKind, Waypoint, waypoints_of
from dh2sim.typing import Array, read_only

RATE: Final = 100.0
"""Hz, of samples: closing loops takes longer than evaluating polynomials."""
_KNOTS: Final = 40
"""Least number of places in each motion at which passive joints are looked at."""
_MOST_KNOTS: Final = 2_000_000
_FINER: Final = 16
"""Parts that the times beside a greatest value are divided into, twice: it is then missed by some 1e-7 of it."""
_RIVAL: Final = 0.02
"""Of what a passive joint moves by, or of its greatest velocity: a peak that is lower by less may be the greatest."""
_BRANCH: Final = 1e-6
"""rad or m: configurations nearer to each other are the same."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class MechanismTrajectory(Trajectory):
    """Positions of the driven joints over time within limits; ``sample`` has those of the passive ones, too."""

    mechanism: MechanismModel = field(repr=False)
    start: Array = field(repr=False)
    """Joint vector of all joints at the beginning, shape (n,)."""

    @cached_property
    def knots(self) -> tuple[Array, DrivenPath]:
        """Times, s, that show the motion, and the mechanism at them."""
        times = self._times
        path = self._followed(times)
        for _ in range(2):
            finer = np.setdiff1d(self._beside_peaks(times, path), times)
            if len(finer):
                found = self._followed(finer)
                times = np.concatenate([times, finer])
                order = np.argsort(times)
                times = times[order]
                path = DrivenPath(*(np.concatenate(parts)[order] for parts in zip(path, found, strict=True)))
        return read_only(times), path

    @cached_property
    def _times(self) -> Array:
        """Times, s, between which no driven joint moves by more than a step of continuation.

        Raises:
            TrajectoryError: There would be too many.
        """
        driven = list(actuated_joints(self.mechanism.spec))
        scale = LoopBatch(self.mechanism.tree).scale[driven]
        lengths = [motion.duration * float((peaks_of(motion).rates[0] / scale).max()) for motion in self.motions]
        counts = [max(_KNOTS, math.ceil(length / LONGEST)) for length in lengths]
        if sum(counts) > _MOST_KNOTS:
            raise TrajectoryError(
                f"the driven joints go too far: the loops would be closed at {sum(counts):,} places on the way, and "
                f"at most {_MOST_KNOTS:,} can be"
            )
        inner = [
            start + motion.duration * np.linspace(0.0, 1.0, count + 1)
            for start, motion, count in zip(self.starts, self.motions, counts, strict=False)
        ]
        return np.unique(np.concatenate([*inner, [passage.time for passage in self.waypoints]]))

    @cached_property
    def _branch(self) -> DrivenBranch:
        """The branch of motion that the mechanism is on.

        Raises:
            TrajectoryError: The driven joints come to a dead or singular position.
        """
        times = self._times
        with self.stage("following loops", "steps", len(times)) as advance:
            try:
                return DrivenBranch(self.mechanism.spec, self.start, times, self.at(times)[0], advance)
            except SingularPositionError as error:
                raise TrajectoryError(str(error)) from None

    def _followed(self, times: Array) -> DrivenPath:
        with self.stage("closing loops", "configurations", len(times)) as advance:
            try:
                return self._branch.at(times, self.at(times)[0], advance)
            except SingularPositionError as error:
                raise TrajectoryError(str(error)) from None

    def _beside_peaks(self, times: Array, path: DrivenPath) -> Array:
        """Return times, s, beside those at which passive joints are farthest or fastest."""
        qd = np.abs(path.rates @ self.at(times)[1][:, :, None])[:, :, 0]
        finer = [np.zeros(0)]
        for k, joint in enumerate(self.mechanism.moving_joints):
            for values in [] if joint.name in self.joints else [path.q[:, k], -path.q[:, k], qd[:, k]]:
                beside = np.concatenate([[-np.inf], values, [-np.inf]])
                same = 1e-9 * np.abs(values).max()  # of what does not change, one place is enough
                peaks = (values > beside[:-2] + same) & (values >= beside[2:] - same)
                for at in np.flatnonzero(peaks & (values >= values.max() - _RIVAL * np.ptp(values))).tolist():
                    for low, up in zip(times[max(at - 1, 0) : at + 1], times[max(at, 1) : at + 2], strict=False):
                        finer.append(np.linspace(low, up, _FINER + 1))
        return np.concatenate(finer)

    def all_joints(self, t: ArrayLike) -> tuple[Array, Array]:
        """Return positions and velocities of all joints at times, with the loops closed.

        Args:
            t: s, shape (N,).

        Returns:
            Shapes (N, n), in the order of the mechanism's joint vector.
        """
        times = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.duration)
        path = self._followed(times)
        return path.q, (path.rates @ self.at(times)[1][:, :, None])[:, :, 0]

    def sample(self, rate: float | None = None, samples: int | None = None) -> SampledTrajectory:
        """Return all joints at evenly spaced times, the last of which is the end.

        Args:
            rate: Samples per second, 100 by default.
            samples: Their number, instead, at least 2.

        Raises:
            SettingsError: Both are given, one is not possible, or there would be more than ten million.
        """
        times = self.sample_times(rate, samples)
        q, qd = self.all_joints(times)
        joints = self.mechanism.moving_joints
        return SampledTrajectory.of(
            [joint.name for joint in joints],
            times,
            q,
            qd=qd,
            turns=tuple(joint.type.turns for joint in joints),
            robot=self.mechanism.name,
        )

    def sample_times(self, rate: float | None = None, samples: int | None = None) -> Array:
        """Return the times of :meth:`sample`, s."""
        return super().sample_times(RATE if rate is None and samples is None else rate, samples)

    @cached_property
    def tool_peaks(self) -> tuple[float, float]:
        """The greatest speed of tool0's origin, m/s, and of its turning, rad/s, at the knots."""
        times, path = self.knots
        twists = (path.tool @ self.at(times)[1][:, :, None])[:, :, 0]
        speed, turn = (float(np.linalg.norm(part, axis=1).max()) for part in (twists[:, :3], twists[:, 3:]))
        return speed, turn

    def tool_path(self, count: int = 200) -> Array:
        """Return positions of tool0 in base_link at even times, m, shape (count, 3)."""
        q, _ = self.all_joints(np.linspace(0.0, self.duration, count))
        loops, tool = LoopBatch(self.mechanism.tree), self.mechanism.tree.frame("tool0")
        return np.array(loops.placed(loops.poses(q), tool, count)[:, :3, 3])

    @cached_property
    def passive(self) -> dict[str, tuple[float, float, float]]:
        """Least and greatest position, and the greatest velocity, of each passive joint at the knots, rad and m."""
        times, path = self.knots
        qd = np.abs(path.rates @ self.at(times)[1][:, :, None])[:, :, 0].max(axis=0)
        low, high = path.q.min(axis=0), path.q.max(axis=0)
        return {
            joint.name: (float(low[k]), float(high[k]), float(qd[k]))
            for k, joint in enumerate(self.mechanism.moving_joints)
            if joint.name not in self.joints
        }

    def to_json(self) -> dict[str, Any]:
        """Return what is to be said of the trajectory as JSON values, in s, rad and m."""
        passive = [
            {"name": name, "lower": low, "upper": high, "velocity": {"peak": peak}}
            for name, (low, high, peak) in self.passive.items()
        ]
        return {**super().to_json(), "passive": passive}


def plan_mechanism_trajectory(
    model: MechanismModel, waypoints: Iterable[Any], *, stage: Stage = silent, **options: Unpack[TrajectoryKeywords]
) -> MechanismTrajectory:
    """Return the trajectory of a mechanism through waypoints, from rest to rest.

    Args:
        model: The mechanism.
        waypoints: Names of configurations, or coordinates of the driven joints in the order of ``actuated``. The
            mechanism starts at the first, on the branch of motion of its assembly or of the configuration that is
            named.
        stage: Shows the progress of what takes long.
        **options: ``profile`` ('quintic', 'trapezoid' or 'jerk'), ``duration``, and ``limits`` of the driven joints,
            as for :func:`dh2sim.plan_trajectory`. Where a passive joint would exceed the limit that its file gives,
            all is slowed down, or refused if it leaves its range.

    Raises:
        SettingsError: Waypoints or options are wrong; the error holds everything that is.
        TrajectoryError: There is no such trajectory; the text says why.
    """
    _refuse(options)
    if not actuated_joints(model.spec):
        raise TrajectoryError(f"{model.name} has no driven joint: its file says 'actuated: []'")
    stand_in = driven_joints(model)
    points = waypoints_of(stand_in.spec, waypoints)
    for number, point in enumerate(points, start=1):
        if point.q is None or point.via is not None or point.kind not in (None, MoveKind.JOINT):
            raise TrajectoryError(
                f"waypoint {number}: a mechanism is moved by its driven joints; give the coordinates of "
                f"{listed(joint.name for joint in stand_in.moving_joints)}, or the name of a configuration"
            )
    start = _start(model, points[0]) if points else model.q
    planned = _planned(model, stand_in, start, points, stage, options)
    excess = _excess(planned)
    if excess > 1.0:
        if options.get("duration") is not None:
            raise TrajectoryError(
                f"{planned.duration:.6g} s are too short: a passive joint would need {excess:.3g} times its velocity "
                "limit"
            )
        slower: TrajectoryKeywords = {**options, "duration": planned.duration * excess}
        planned = _planned(model, stand_in, start, points, stage, slower)
        if (left := _excess(planned)) > 1.0 / INSIDE:
            raise TrajectoryError(f"a passive joint would need {left:.3g} times its velocity limit")
    _check_ranges(planned)
    _check_branches(planned, points)
    return planned


def driven_joints(model: MechanismModel) -> RobotModel:
    """Return the driven joints of a mechanism as if they were a robot, whose frames mean nothing."""
    spec = model.spec
    driven = actuated_joints(spec)
    rows, joints = spec.moving_rows, model.moving_joints
    configurations = {name: read_only(q[list(driven)]) for name, q in model.configurations().items()}
    alone = replace(
        spec,
        rows=tuple(rows[k] for k in driven),
        branches=MappingProxyType({}),
        closures=(),
        actuated=None,
        assembly=None,
        configurations=MappingProxyType(configurations),
        source_file=None,
    )
    return replace(model.main, spec=alone, joints=tuple(joints[k] for k in driven), home=configurations["home"])


def _refuse(options: Mapping[str, Any]) -> None:
    """Refuse what is of serial robots.

    Raises:
        SettingsError: There is such an option.
    """
    problems = []
    if str(options.get("profile") or "") == Profile.OPTIMAL:
        problems.append(("profile", "must be one of quintic, trapezoid, jerk for a mechanism, got 'optimal'"))
    if str(options.get("kind") or MoveKind.JOINT) != MoveKind.JOINT:
        problems.append(("kind", f"must be 'joint' for a mechanism, got {str(options['kind'])!r}"))
    problems += [
        (name, "is of lines and arcs, which mechanisms do not follow")
        for name in ("through", "free")
        if options.get(name)
    ]
    given = options.get("limits")
    if isinstance(given, Mapping):
        problems += [
            ("limits", f"must not contain {name!r} for a mechanism")
            for name in ("tool_speed", "tool_turn")
            if name in given
        ]
    if problems:
        raise SettingsError(problems)


def _start(model: MechanismModel, point: Waypoint) -> Array:
    named = model.configurations().get(point.name)
    driven = list(actuated_joints(model.spec))
    if named is not None and np.array_equal(named[driven], np.asarray(point.q)):
        return read_only(named)
    try:
        return mechanism_configuration(model.spec, np.asarray(point.q)) if len(driven) < model.tree.n else model.q
    except SingularPositionError as error:
        raise TrajectoryError(f"waypoint 1: {error}") from None


def _planned(
    model: MechanismModel,
    stand_in: RobotModel,
    start: Array,
    points: tuple[Waypoint, ...],
    stage: Stage,
    options: TrajectoryKeywords,
) -> MechanismTrajectory:
    plan = plan_serial_trajectory(stand_in, points, TrajectoryOptions.of(options), stage)
    given = {each.name: getattr(plan, each.name) for each in fields(Trajectory)}
    return MechanismTrajectory(**given, mechanism=model, start=start)


def _excess(planned: MechanismTrajectory) -> float:
    """Return the greatest velocity of a passive joint as a share of the limit that its file gives."""
    limits = {joint.name: joint for joint in planned.mechanism.moving_joints}
    shares = [
        peak / (limits[name].velocity * INSIDE)
        for name, (_, _, peak) in planned.passive.items()
        if "velocity" not in limits[name].assumed
    ]
    return max(shares, default=0.0)


def _check_ranges(planned: MechanismTrajectory) -> None:
    """Refuse a motion on which a passive joint leaves its limits.

    Raises:
        TrajectoryError: One does.
    """
    times, path = planned.knots
    units = planned.mechanism.spec.units
    for k, joint in enumerate(planned.mechanism.moving_joints):
        if joint.name in planned.joints or joint.limits.position is None:
            continue
        lower, upper = joint.limits.position
        slack = 1e-9 * max(1.0, abs(lower), abs(upper))
        outside = np.flatnonzero((path.q[:, k] < lower - slack) | (path.q[:, k] > upper + slack))
        if outside.size:
            scale = units.coordinate(1.0, turns=joint.type.turns)
            at, low, high = (value / scale for value in (float(path.q[outside[0], k]), lower, upper))
            unit = units.angle.value if joint.type.turns else units.length.value
            raise TrajectoryError(
                f"passive joint {joint.name} leaves its limits of {low:.6g} to {high:.6g} {unit} at "
                f"{times[outside[0]]:.4g} s: it is at {at:.6g} {unit}"
            )


def _check_branches(planned: MechanismTrajectory, points: tuple[Waypoint, ...]) -> None:
    """Refuse a motion to a configuration that is named but on another branch of motion.

    Raises:
        TrajectoryError: One is.
    """
    times, path = planned.knots
    known = planned.mechanism.configurations()
    joints = planned.mechanism.moving_joints
    for number, (point, passage) in enumerate(zip(points, planned.waypoints, strict=True), start=1):
        goal = known.get(point.name)
        if goal is None or number == 1:
            continue
        here = path.q[int(np.argmin(np.abs(times - passage.time)))]
        for k, joint in enumerate(joints):
            off = abs(float(here[k] - goal[k]))
            off = min(off % (2.0 * np.pi), -off % (2.0 * np.pi)) if joint.type.turns else off
            if joint.name not in planned.joints and off > _BRANCH:
                raise TrajectoryError(
                    f"waypoint {number}: the driven joints lead to another assembly than configuration "
                    f"'{point.name}' has: {joint.name} differs"
                )
