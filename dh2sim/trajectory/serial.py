"""Trajectories of serial robots: from waypoints to motions within limits, or to what is in the way."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from dh2sim.arguments import mapping
from dh2sim.errors import SettingsError, TrajectoryError
from dh2sim.inverse.goals import Free
from dh2sim.inverse.reach import amount_text
from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.messages import listed
from dh2sim.model.robot_model import RobotModel
from dh2sim.progress import Advance, Stage, silent
from dh2sim.trajectory.curves import Curve, PiecewisePolynomial, cubic_spline, straight
from dh2sim.trajectory.follow import CannotFollowError, follow
from dh2sim.trajectory.limits import INSIDE, LimitValue, MotionLimits, requested_limits, robot_limits
from dh2sim.trajectory.motion import Motion, exceeded, fastest, require_inside, tool_rates
from dh2sim.trajectory.options import TrajectoryOptions
from dh2sim.trajectory.profiles import Profile, state_to_state
from dh2sim.trajectory.tool_paths import ToolPath, arc, circle, line
from dh2sim.trajectory.trajectory import Passage, Trajectory
from dh2sim.trajectory.waypoints import MoveKind, Waypoint, waypoints_of
from dh2sim.typing import Array, read_only

if TYPE_CHECKING:
    from dh2sim.inverse.solutions import Solutions
    from dh2sim.inverse.solver import InverseSolver

_STILL: Final = 1e-12
"""rad or m: shorter motions are rounding."""
_TOOL_MARGIN: Final = 1.001
"""The tool's greatest speed in a motion of the joints is sampled, and known to that."""
_LEFT_OPEN: Final[Mapping[Free, str]] = {
    "roll": "the roll about z of tool0 is left open",
    "rotation": "the orientation is left open",
}


def plan_serial_trajectory(
    model: RobotModel, waypoints: Iterable[Any], options: TrajectoryOptions, stage: Stage = silent
) -> Trajectory:
    """Return the trajectory of a serial robot through waypoints; see :func:`dh2sim.plan_trajectory`.

    Raises:
        SettingsError: Waypoints or options are wrong; the error holds everything that is.
        TrajectoryError: There is no such trajectory; the text says at which waypoint, where and why.
    """
    points = waypoints_of(model.spec, waypoints)
    if options.kind is MoveKind.ARC:
        points = _paired(model, points)
    if len(points) < 2:
        raise SettingsError([("", f"a trajectory needs at least two waypoints, got {len(points)}")])
    if not model.moving_joints:
        raise TrajectoryError(f"{model.name} has no joint that moves")
    limits = _limits(model, options.limits)
    if options.profile is Profile.TRAPEZOID and limits.jerk_requested:
        raise SettingsError(
            [("limits", "must not contain 'jerk' with profile 'trapezoid', whose acceleration jumps; take 'jerk'")]
        )
    if options.profile is Profile.OPTIMAL and "acceleration" in limits.assumed:
        limits = replace(limits, acceleration=read_only(np.full(len(limits.joints), np.inf)))
    return _Planner(model, limits, options, stage).plan(points)


def _limits(model: RobotModel, request: Mapping[str, LimitValue]) -> MotionLimits:
    own = robot_limits(model)
    return requested_limits(own, mapping("limits", request)) if request is not None else own


def _paired(model: RobotModel, points: Sequence[Waypoint]) -> tuple[Waypoint, ...]:
    """Return waypoints of arcs with every second one put into the next as its via, unless one has it already."""
    if any(point.via is not None or point.centre is not None for point in points):
        return tuple(points)
    if len(points) < 3 or len(points) % 2 == 0:
        rule = "waypoints of arcs are start, via, end, via, end and so on: an odd number from 3"
        raise SettingsError([("", f"{rule}, got {len(points)}")])
    pairs = zip(points[1::2], points[2::2], strict=True)
    return (points[0], *(replace(end, via=_position(model, via)) for via, end in pairs))


def _position(model: RobotModel, point: Waypoint) -> Array:
    if point.q is not None:
        return read_only(forward_kinematics(model.chain, point.q)[:3, 3])
    assert point.position is not None
    return point.position


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Move:
    """A motion, the waypoints that it passes and the one that it arrives at."""

    motion: Motion | None
    """None where it arrives where it starts."""
    fixed: bool
    """Whether its duration was given."""
    passed: tuple[tuple[Waypoint, Array, MoveKind, float], ...] = ()
    """Waypoints, their joint vectors, how they are reached, and when, as a share of the duration."""


class _Planner:
    """Plans motion by motion, each from where the last one ends."""

    def __init__(self, model: RobotModel, limits: MotionLimits, options: TrajectoryOptions, stage: Stage) -> None:
        self._model, self._limits, self._options, self._stage = model, limits, options, stage
        self._notes: dict[str, None] = {}
        self._solver: InverseSolver | None = None
        self._moves: list[_Move] = []
        self._clock = 0.0

    def plan(self, points: Sequence[Waypoint]) -> Trajectory:
        """Return the trajectory through waypoints."""
        first, *others = points
        with _at_waypoint(1, first):
            q = start = self._start(first)
        if first.wait:
            self._append(_Move(motion=_rest(q, first.wait), fixed=True))
        with self._stage("planning", "waypoints", len(points)) as advance:
            self._move_through(others, q, advance)
        return self._trajectory(first, start)

    def _move_through(self, points: Sequence[Waypoint], q: Array, advance: Advance) -> None:
        """Plan the motions to waypoints, the first of which has number 2."""
        group: list[tuple[Waypoint, Array]] = []
        for number, point in enumerate(points, start=2):
            advance(1)
            with _at_waypoint(number, point):
                kind = self._kind(point)
                if kind is MoveKind.JOINT:
                    group.append((point, self._goal(point, group[-1][1] if group else q)))
                    if not point.stop and number <= len(points):
                        continue
                    self._append(self._joint_move(q, group) if len(group) == 1 else self._passing_move(q, group))
                    q, group = group[-1][1], []
                elif group or not point.stop:
                    raise TrajectoryError(
                        "only between motions of kind 'joint' a waypoint is passed without stopping"
                    )
                else:
                    motion, q = self._along(point, kind, q)
                    motion, fixed = self._timed(motion, q, point)
                    self._append(_Move(motion=motion, fixed=fixed, passed=((point, q, kind, 1.0),)))
                if point.wait:
                    self._append(_Move(motion=_rest(q, point.wait), fixed=True))

    def _append(self, move: _Move) -> None:
        self._moves.append(move)
        self._clock += 0.0 if move.motion is None else move.motion.duration

    def _kind(self, point: Waypoint) -> MoveKind:
        if point.via is not None or point.centre is not None:
            return MoveKind.ARC
        kind = point.kind or self._options.kind
        if kind is MoveKind.ARC:
            raise TrajectoryError("an arc needs via, a point that it goes through, or centre and angle")
        return kind

    def _start(self, point: Waypoint) -> Array:
        given = [
            name
            for name, value in (("via", point.via), ("centre", point.centre), ("duration", point.duration))
            if value is not None
        ]
        if given or point.time:
            raise TrajectoryError(f"the motion starts here: there can be no {listed(given) if given else 'time'}")
        return self._goal(point, np.array(self._model.home))

    def _goal(self, point: Waypoint, q: Array) -> Array:
        """Return the joint vector of a waypoint; of a pose, the nearest to ``q`` that reaches it."""
        if point.q is not None:
            goal = np.array(point.q, dtype=np.float64)
        else:
            T, orientation = np.eye(4), point.orientation
            T[:3, 3] = point.position
            if orientation is not None:
                T[:3, :3] = orientation
            free = self._options.free if orientation is not None else "rotation"
            found = self._solved(T, q, free)
            if found.best is None:
                raise TrajectoryError(f"no configuration reaches the pose: {found.reason or 'none is found'}")
            goal = np.array(found.best)
        self._require_inside(goal)
        return goal

    def _solved(self, T: Array, q: Array, free: Free | None) -> Solutions:
        """Return the configurations inside the limits that reach a pose, those near ``q`` first."""
        from dh2sim.inverse.solver import InverseSolver

        self._solver = self._solver or InverseSolver(self._model.spec)
        found: Solutions = self._solver.solve(T, q, True, None, free)
        return found

    def _require_inside(self, q: Array) -> None:
        limits, spec = self._limits, self._model.spec
        beyond = np.maximum(limits.lower - q, q - limits.upper)
        for joint in np.flatnonzero(beyond > 1e-9 * np.maximum(1.0, np.abs(q))):
            amount = amount_text(spec, float(beyond[joint]), turns=limits.turns[joint])
            raise TrajectoryError(f"{limits.joints[joint]} is {amount} outside its limits")

    def _joint_move(self, q: Array, group: Sequence[tuple[Waypoint, Array]]) -> _Move:
        [(point, goal)] = group
        motion = None if np.abs(goal - q).max() <= _STILL else self._straight(q, goal)
        motion, fixed = self._timed(motion, goal, point)
        return _Move(motion=motion, fixed=fixed, passed=((point, goal, MoveKind.JOINT, 1.0),))

    def _straight(self, q: Array, goal: Array) -> Motion:
        if self._options.profile is Profile.JERK:
            v, a, j = self._limits.rates * INSIDE
            law = state_to_state(q, goal, velocity=v, acceleration=a, jerk=j)
            return self._for_tool(Motion(duration=law.end, law=law))
        return self._for_tool(self._fastest(straight(q, goal)))

    def _for_tool(self, motion: Motion) -> Motion:
        """Return a motion of the joints, slowed down as far as limits of the tool's speed require."""
        bounds = (self._limits.tool_speed, self._limits.tool_turn)
        if not any(map(math.isfinite, bounds)):
            return motion
        rates = tool_rates(self._model.chain, motion)
        excess = max(rate / bound for rate, bound in zip(rates, bounds, strict=True))
        return motion.stretched(max(1.0, excess * _TOOL_MARGIN))

    def _fastest(self, path: Curve, tool: tuple[float, float] = (0.0, 0.0)) -> Motion:
        if self._options.profile is Profile.OPTIMAL:
            from dh2sim.trajectory.time_optimal import time_optimal

            return time_optimal(self._model, path, self._limits, tool)
        return fastest(path, self._options.profile, self._limits, tool)

    def _passing_move(self, q: Array, group: Sequence[tuple[Waypoint, Array]]) -> _Move:
        """Return the motion along a spline of the joints that passes waypoints without stopping."""
        points = np.stack([q, *(goal for _, goal in group)])
        steps = (np.abs(np.diff(points, axis=0)) / self._limits.velocity).max(axis=1)
        if steps.min() <= _STILL:
            raise TrajectoryError("a waypoint that is passed without stopping is the same as the one before")
        timed = [point.duration is not None or point.time is not None for point, _ in group]
        if any(timed) and not all(timed):
            raise TrajectoryError("of waypoints passed without stopping all have a time, or none")
        if all(timed):
            times = [self._clock]
            for point, _ in group:
                times.append(times[-1] + point.duration if point.duration is not None else float(point.time or 0.0))
            knots = np.array(times) - self._clock
            if np.diff(knots).min() <= 0.0:
                raise TrajectoryError(f"times must increase, got {', '.join(f'{time:g}' for time in times)} s")
            motion = Motion(duration=float(knots[-1]), law=cubic_spline(knots, points))
            self._require_limits(motion)
            shares = knots[1:] / knots[-1]
        else:
            knots = np.concatenate([[0.0], np.cumsum(steps)])
            motion = self._for_tool(self._fastest(cubic_spline(knots, points)))
            shares = np.append(motion.when(knots[1:-1]) / motion.duration, 1.0)
        require_inside(motion, self._limits, "the curve between the waypoints")
        passed = [
            (point, goal, MoveKind.JOINT, float(share)) for (point, goal), share in zip(group, shares, strict=True)
        ]
        return _Move(motion=motion, fixed=all(timed), passed=tuple(passed))

    def _along(self, point: Waypoint, kind: MoveKind, q: Array) -> tuple[Motion | None, Array]:
        """Return the motion along a line or an arc of the tool, and where it ends."""
        path = self._tool_path(point, kind, q)
        goal = None if point.q is None else np.array(point.q, dtype=np.float64)
        if path.distance <= _STILL and path.angle <= _STILL:
            if goal is not None and np.abs(goal - q).max() > 1e-7:
                raise TrajectoryError(
                    f"a {kind} that does not move the tool cannot move the joints; take kind 'joint'"
                )
            return None, q
        tries: list[Free | None] = [None, "roll", "rotation"] if self._options.free is None else [self._options.free]
        for free in tries:
            try:
                followed = follow(
                    self._model.spec,
                    self._model.chain,
                    path,
                    q,
                    goal,
                    size=self._model.reach or 1.0,
                    free=free,
                    through=self._options.through,
                    limits=self._limits,
                    solutions=lambda T, free=free: self._solved(T, q, free).q,  # type: ignore[misc]
                )
            except CannotFollowError as error:
                if not error.constrained or free is tries[-1]:
                    raise
                continue
            if free is not None and self._options.free is None:
                count = len(q)
                joints = "1 joint" if count == 1 else f"{count} joints"
                self._notes[f"Along the {kind}, {_LEFT_OPEN[free]}: {joints} cannot follow it."] = None
            break
        if any(followed.singular):
            where = listed(
                [word for word, yes in zip(("starts", "ends"), followed.singular, strict=True) if yes], " and "
            )
            self._notes[f"The {kind} {where} in a singularity: the tool is slow near it."] = None
        if followed.inside:
            note = f"The {kind} is in a singularity all along: of the motions that follow it the least is taken."
            self._notes[note] = None
        if followed.near:
            note = (
                f"A singularity is passed closely at {followed.near}, and the whole {kind} is as slow as that takes"
            )
            self._notes[f"{note}; through=True slows down only there."] = None
        motion = self._fastest(followed.curve, (path.distance * followed.rate, path.angle * followed.rate))
        return motion, followed.end if goal is None else goal

    def _tool_path(self, point: Waypoint, kind: MoveKind, q: Array) -> ToolPath:
        T0 = np.array(forward_kinematics(self._model.chain, q))
        if point.centre is not None:
            axis = np.array([0.0, 0.0, 1.0]) if point.axis is None else np.asarray(point.axis)
            assert point.angle is not None
            return circle(T0, np.asarray(point.centre), axis, point.angle)
        if point.q is not None:
            self._require_inside(np.asarray(point.q))
            T1 = np.array(forward_kinematics(self._model.chain, point.q))
        else:
            T1, orientation = T0.copy(), point.orientation
            T1[:3, 3] = point.position
            if orientation is not None:
                T1[:3, :3] = orientation
        return line(T0, T1) if kind is MoveKind.LINE else arc(T0, np.asarray(point.via), T1)

    def _timed(self, motion: Motion | None, q: Array, point: Waypoint) -> tuple[Motion | None, bool]:
        """Return a motion with the duration that its waypoint asks for, and whether it does."""
        if point.duration is None and point.time is None:
            return motion, False
        duration = point.duration if point.duration is not None else float(point.time or 0.0) - self._clock
        least = 0.0 if motion is None else motion.duration
        if duration < least * (1.0 - 1e-9):
            when = "" if point.time is None else f", not before {_up(self._clock + least)} s"
            raise TrajectoryError(
                f"{duration:.6g} s are too short: within its limits the motion takes {_up(least)} s{when}"
            )
        if motion is None:
            return (_rest(q, duration) if duration > 0.0 else None), True
        return motion.stretched(max(duration / least, 1.0)), True

    def _require_limits(self, motion: Motion) -> None:
        found = exceeded([motion], self._options.profile, self._limits)
        if found is not None:
            joint, quantity, factor = found
            raise TrajectoryError(f"at these times {joint} would need {factor:.3g} times its {quantity} limit")

    def _trajectory(self, first: Waypoint, start: Array) -> Trajectory:
        """Return the trajectory, with all motions but those of given duration stretched to the duration asked for."""
        moves, factor = self._moves, 1.0
        if self._options.duration is not None:
            fixed = math.fsum(move.motion.duration for move in moves if move.motion is not None and move.fixed)
            loose = math.fsum(move.motion.duration for move in moves if move.motion is not None and not move.fixed)
            wanted = self._options.duration
            if wanted < (fixed + loose) * (1.0 - 1e-9):
                raise TrajectoryError(
                    f"{wanted:.6g} s are too short: within its limits {self._model.name} takes {_up(fixed + loose)} s"
                )
            if loose <= 0.0 and wanted > fixed * (1.0 + 1e-9):
                raise TrajectoryError(f"nothing can take longer: waypoints ask for {fixed:.6g} s in all")
            factor = max(1.0, (wanted - fixed) / loose) if loose > 0.0 else 1.0
        motions: list[Motion] = []
        clock = 0.0
        passages = [Passage(name=first.name, time=0.0, q=read_only(start), kind="start", stop=True)]
        for move in moves:
            motion = move.motion
            if motion is not None and not move.fixed:
                motion = motion.stretched(factor)
            length = 0.0 if motion is None else motion.duration
            for point, q, kind, share in move.passed:
                last = share == 1.0
                time = clock + (length if last else share * length)
                passages.append(
                    Passage(name=point.name, time=time, q=read_only(q), kind=kind.value, stop=point.stop or last)
                )
            if motion is not None:
                motions.append(motion)
                clock += length
        return Trajectory(
            model=self._model,
            motions=tuple(motions),
            waypoints=tuple(passages),
            profile=self._options.profile,
            limits=self._limits,
            notes=tuple(self._notes),
            stage=self._stage,
        )


def _up(seconds: float) -> str:
    """Return a duration rounded up, so that asking for it is enough."""
    return f"{math.ceil(seconds * 1e4) / 1e4:.10g}"


def _rest(q: Array, duration: float) -> Motion:
    return Motion(duration=duration, law=PiecewisePolynomial.of([0.0, duration], [[q]]))


@contextmanager
def _at_waypoint(number: int, point: Waypoint) -> Iterator[None]:
    """Name the waypoint of an error."""
    try:
        yield
    except TrajectoryError as error:
        named = f"waypoint {number}" + (f" ({point.name})" if point.name else "")
        raise TrajectoryError(f"{point.place}: {error}" if point.place else f"{named}: {error}") from None
