"""From a path of the tool to one of the joints, or to what is in the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import TrajectoryError
from dh2sim.inverse.goals import Free
from dh2sim.inverse.reach import amount_text, why_unreachable
from dh2sim.kinematics.chain import KinematicChain
from dh2sim.messages import listed
from dh2sim.robot.spec import RobotSpec
from dh2sim.trajectory.branch import BLIND, REACHED, TAIL, StuckError, Task, branch_through
from dh2sim.trajectory.curves import ChebyshevCurve, NotSmoothError, fit
from dh2sim.trajectory.limits import MotionLimits
from dh2sim.trajectory.tool_paths import ToolPath
from dh2sim.typing import Array

NEAR_SINGULAR: Final = 1e-3
"""Least singular value, lengths in units of the arm's size, below which a path crosses a singularity: there joints
are a thousand times as fast as the tool, measured so."""
_CLOSE: Final = 20.0 * NEAR_SINGULAR
"""The same, below which it passes one closely."""
_AT_END: Final = 1e-3
"""Share of the path from an end within which it starts or ends in a singularity."""
_SIDEWAYS: Final = 1e-6
"""Share of the tool's motion that joints do not make, above which they cannot make it."""
_MOST_BRANCHES: Final = 16
_SAME: Final = 1e-7
"""rad or sizes of the arm, up to which configurations are the same."""


class CannotFollowError(TrajectoryError):
    """The joints cannot follow the tool's path beyond a place; ``constrained`` if for want of joints."""

    def __init__(self, text: str, *, constrained: bool = False, explained: bool = False) -> None:
        """Keep whether fewer demands on the orientation would help, and whether the text says what to do instead."""
        super().__init__(text)
        self.constrained, self.explained = constrained, explained


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Followed:
    """The joints along a path of the tool."""

    curve: ChebyshevCurve
    """Joint vectors over a parameter, 0 to 1; with slow passages over another, from 0 to its end."""
    end: Array
    """The joint vector at the end, shape (n,)."""
    near: str
    """Where it passes a singularity closely, at the tool's even pace; '' where it does not."""
    singular: tuple[bool, bool]
    """Whether it starts, and ends, in a singularity that it has to be slow near."""
    rate: float
    """Greatest derivative of the path's parameter with respect to that of the curve."""
    inside: bool = False
    """Whether it is in a singularity all along."""


def follow(
    spec: RobotSpec,
    chain: KinematicChain,
    path: ToolPath,
    q0: Array,
    q1: Array | None,
    *,
    size: float,
    free: Free | None,
    through: bool,
    limits: MotionLimits,
    solutions: Callable[[Array], Array],
) -> Followed:
    """Return the joints along a path of the tool, in the branch of the configuration at its start.

    A joint to spare goes evenly along its self-motion from the start to the configuration at the end.

    Args:
        spec: The robot.
        chain: Its chain.
        path: Starts at the pose of ``q0``.
        q0: Joint vector at the start, rad and m, shape (n,).
        q1: At the end, where it is given: the end that is reached must be the same.
        size: Of the arm, m.
        free: What the path leaves open of the orientation.
        through: Whether to slow down where joints are much faster than the tool, in place of refusing that.
        limits: Of the joints' positions; those of their velocities tell what is slow.
        solutions: Takes a pose, shape (4, 4); returns the configurations that reach it, shape (k, n), those near
            ``q0`` first.

    Raises:
        CannotFollowError: The path leaves the reach, or joints would jump.
        TrajectoryError: It crosses a singularity, or arrives in another configuration; the text says where.
    """
    task, within = Task.of(chain, path, q0, q1, size=size, free=free), False
    try:
        task, curve = _branch(spec, task, q1, solutions)
    except CannotFollowError as error:
        inside = Task.of(chain, path, q0, q1, size=size, free=free, inside=True)
        if inside.rank >= task.rank:
            raise
        task, curve, within = inside, _branch_inside(inside, error), True
    place, sigma = _least_sigma(task, curve)
    if sigma < NEAR_SINGULAR and not through:
        names = _moved_by(task, curve.derivatives(np.array([place]))[0, 0])
        raise TrajectoryError(
            f"the path crosses a singularity at {task.place(place)}, where {names} without moving the tool; "
            "through=True passes it slowly"
        )
    _require_inside(spec, task, curve, limits)
    end = curve.derivatives(np.array([1.0]))[0, 0]
    if q1 is not None:
        _require_same_end(spec, task, end, q1)
    if not through:
        near = task.place(place) if sigma < _CLOSE else ""
        if (even := _even(task, curve)) is not None:
            return Followed(curve=even, end=end, near=near, singular=(False, False), rate=1.0)
        return Followed(curve=curve, end=end, near=near, singular=task.singular, rate=task.fastest, inside=within)
    slowed, rate = _slowed(task, curve, limits.velocity)
    rate *= task.fastest
    return Followed(curve=slowed, end=end, near="", singular=task.singular, rate=rate, inside=within)


def _branch(
    spec: RobotSpec, task: Task, q1: Array | None, solutions: Callable[[Array], Array]
) -> tuple[Task, ChebyshevCurve]:
    """Return the joints along the path, and the task with a parameter that suits them.

    Raises:
        CannotFollowError: They cannot follow it.
    """
    q0, start = task.q0[None], np.array([0.0])
    if task.polished(q0, start)[1][0] > 1e-8:
        raise CannotFollowError(f"{task.place(0.0)}: the start is not on the path", constrained=True)
    sigma = task.tangent(q0, start)[1][0]
    even: tuple[Task, ChebyshevCurve] | None = None
    for at_end in (False, True):
        task = replace(task, singular=(bool(sigma < NEAR_SINGULAR), at_end))
        try:
            if sigma >= BLIND:
                curve = branch_through(task, 0.0, task.q0)
            else:
                curve = _branch_from_singularity(spec, task, q1, solutions)
        except StuckError as error:
            if even is not None:
                return even
            if at_end or error.u < 1.0 - _AT_END:
                raise _stopped(spec, task, error) from None
            continue
        end = np.array([1.0])
        if at_end or task.tangent(curve.derivatives(end)[0], end)[1][0] >= NEAR_SINGULAR:
            return task, curve
        even = task, curve
    raise AssertionError("unreachable")


def _branch_inside(task: Task, otherwise: CannotFollowError) -> ChebyshevCurve:
    """Return the joints along a path that is in a singularity all along.

    Raises:
        CannotFollowError: There is no such path; ``otherwise`` where nothing better can be said.
    """
    try:
        return branch_through(task, 0.0, task.q0)
    except StuckError:
        pass
    if not otherwise.explained and (off := task.unmoved()) > _SIDEWAYS:
        how = "no joint moves the tool along it" if off > 0.999 else "the joints cannot move the tool along it"
        names = _moved_by(replace(task, rank=task.rank + 1), task.q0)
        raise CannotFollowError(
            f"the {task.path.kind} starts in a singularity, {task.place(0.0)}, where {how}, while {names} without "
            "moving it; move with kind 'joint'",
            constrained=otherwise.constrained,
        )
    raise otherwise


def _branch_from_singularity(
    spec: RobotSpec, task: Task, q1: Array | None, solutions: Callable[[Array], Array]
) -> ChebyshevCurve:
    """Return the joints along a path that starts in a singularity, where branches meet: followed from its middle.

    Raises:
        StuckError: No branch can be followed.
        CannotFollowError: None starts in the configuration at the start.
    """
    middle = np.array([0.5])
    stuck = StuckError(0.0, task.q0)
    starts: list[Array] = []
    elsewhere: ChebyshevCurve | None = None
    for found in solutions(task.pose(0.5))[:_MOST_BRANCHES]:
        q, left = task.polished(found[None], middle)
        if left[0] > REACHED or task.tangent(q, middle)[1][0] < BLIND:
            continue
        try:
            curve = branch_through(task, 0.5, q[0])
        except StuckError as error:
            stuck = max(stuck, error, key=lambda each: each.u)
            continue
        start, end = curve.derivatives(np.array([0.0, 1.0]))[0]
        if _apart(task, start, task.q0) > _SAME:
            starts.append(start)
        elif q1 is None or _apart(task, end, q1) <= _SAME:
            return curve
        else:
            elsewhere = elsewhere or curve
    if elsewhere is not None:
        return elsewhere
    if not starts:
        raise stuck
    best = min(starts, key=lambda start: _apart(task, start, task.q0))
    joints = zip(task.chain.moving_joints, best.tolist(), np.abs(best - task.q0) / task.units, strict=True)
    values = [
        f"{joint.name} at {value / spec.units.coordinate(1.0, turns=joint.type.turns):.10g}"
        for joint, value, apart in joints
        if apart > _SAME
    ]
    raise CannotFollowError(
        f"the {task.path.kind} starts in a singularity, {task.place(0.0)}, which it can leave only with "
        f"{listed(values)}: move there first",
        explained=True,
    )


def _even(task: Task, curve: ChebyshevCurve) -> ChebyshevCurve | None:
    """Return the joints over the path's own parameter; None where they go into a singularity as a square root."""
    if not any(task.singular):
        return None

    def joints(x: Array) -> tuple[Array, NDArray[np.bool_]]:
        u = task.parameter(x)
        q, left = task.polished(curve.derivatives(u)[0], u)
        return q, left <= REACHED

    try:
        return fit(joints, np.linspace(0.0, 1.0, 4), task.units, TAIL, task.singular)
    except NotSmoothError:
        return None


def _apart(task: Task, q: Array, other: Array) -> float:
    return float(np.abs((q - other) / task.units).max())


def _stopped(spec: RobotSpec, task: Task, error: StuckError) -> CannotFollowError:
    """Return why joints cannot follow the path beyond a place."""
    u, q = error.u, error.q
    where = task.place(u)
    short = why_unreachable(spec, task.pose(min(1.0, u + _AT_END)), q0=q, free=task.free)
    few = task.rank < 6 and task.free != "rotation"
    if short is not None:
        constrained = few or u <= 1e-6
        text = f"the path is not reached beyond {where}: {short.reason}"
        return CannotFollowError(text, constrained=constrained, explained=True)
    names = _moved_by(task, q)
    still = f"{names} there without moving the tool"
    if u < _AT_END or u > 1.0 - _AT_END:
        ends = "starts" if u < _AT_END else "ends"
        text = f"the {task.path.kind} {ends} in a singularity, {where}: {still}; move with kind 'joint'"
        return CannotFollowError(text, constrained=few)
    return CannotFollowError(f"the joints would jump to another branch at {where}: {still}", constrained=few)


def _moved_by(task: Task, q: Array) -> str:
    """Return which joints move in the motion that moves the tool least: ``joint_4 and joint_6 move``."""
    _, jacobian = task.equations(q[None], np.zeros(1))
    own = jacobian[0, : jacobian.shape[1] - len(task.spare)]
    vectors = np.linalg.svd(own)[2]
    motion = np.abs(vectors[min(task.rank, len(vectors)) - 1])
    names = [joint.name for joint, part in zip(task.chain.moving_joints, motion, strict=True) if part > 0.2]
    *first, last = names or ["no joint"]
    return f"{listed(first)} and {last} move" if first else f"{last} moves"


def _least_sigma(task: Task, curve: ChebyshevCurve) -> tuple[float, float]:
    """Return where the least singular value on the path is, and the value; its approach to singular ends aside."""
    u = curve.nodes
    sigma = task.tangent(curve.derivatives(u)[0], u)[1]
    first, last = 0, len(u) - 1
    if task.singular[1]:
        while last > 0 and sigma[last] < _CLOSE and sigma[last - 1] >= sigma[last]:
            last -= 1
    if task.singular[0]:
        while first < last and sigma[first] < _CLOSE and sigma[first + 1] >= sigma[first]:
            first += 1
    u, sigma = u[first : last + 1], sigma[first : last + 1]
    for _ in range(3):
        least = int(sigma.argmin())
        best = float(u[least]), float(sigma[least])
        u = np.linspace(u[max(least - 1, 0)], u[min(least + 1, len(u) - 1)], 65)
        sigma = task.tangent(curve.derivatives(u)[0], u)[1]
    return best


def _require_same_end(spec: RobotSpec, task: Task, end: Array, q1: Array) -> None:
    """Refuse to arrive in another configuration than the one that was asked for."""
    off = np.abs((end - q1) / task.units)
    if off.max() <= _SAME:
        return
    joints = [joint for joint, far in zip(task.chain.moving_joints, off, strict=True) if far > _SAME]
    amounts = [
        amount_text(spec, float(abs(end[i] - q1[i])), turns=joint.type.turns)
        for i, joint in enumerate(task.chain.moving_joints)
        if joint in joints
    ]
    parts = [f"{joint.name} by {amount}" for joint, amount in zip(joints, amounts, strict=True)]
    raise TrajectoryError(
        f"the {task.path.kind} reaches the pose at its end in another configuration: {listed(parts)} off. Give the "
        "waypoint as a pose to accept that, or move there with kind 'joint'"
    )


def _require_inside(spec: RobotSpec, task: Task, curve: ChebyshevCurve, limits: MotionLimits) -> None:
    """Refuse a path on which a joint leaves its position limits."""
    x = np.unique((curve.breaks[:-1, None] + np.diff(curve.breaks)[:, None] * np.linspace(0.0, 1.0, 65)).ravel())
    q = curve.derivatives(x)[0]
    beyond = np.maximum(limits.lower - q, q - limits.upper) > 1e-9 * np.maximum(1.0, np.abs(q))
    if beyond.any():
        place, joint = (int(i) for i in np.argwhere(beyond)[0])
        amount = np.maximum(limits.lower - q, q - limits.upper)[:, joint].max()
        text = amount_text(spec, float(amount), turns=limits.turns[joint])
        where = task.place(float(x[place]))
        raise TrajectoryError(f"{limits.joints[joint]} leaves its limits at {where}, by up to {text}")


def _slowed(task: Task, curve: ChebyshevCurve, weights: Array) -> tuple[ChebyshevCurve, float]:
    """Return the same joints over another parameter, which grows where joints move, not where the tool does.

    The second result is the greatest derivative of the old parameter with respect to the new one.

    Its rate is sqrt(g² + c²), where g is the norm of the joints' velocities over their limits and c a tenth of its
    mean: smooth, and nowhere zero.
    """
    x = curve.nodes
    mean = float(np.sqrt(np.mean(np.square(curve.derivatives(x)[1] / weights).sum(axis=1))))

    def rate(x: Array) -> tuple[Array, NDArray[np.bool_]]:
        speed = np.sqrt(np.square(curve.derivatives(x)[1] / weights).sum(axis=1) + (0.1 * mean) ** 2)
        return speed[:, None], np.ones(len(x), dtype=np.bool_)

    fastest = float(1.0 / rate(x)[0].min())
    way = fit(rate, curve.breaks, np.array([mean]), 1e-9).integral()
    breaks = way.derivatives(way.breaks)[0, :, 0]

    def joints(u: Array) -> tuple[Array, NDArray[np.bool_]]:
        low, high = np.zeros(len(u)), np.ones(len(u))
        for _ in range(56):
            middle = 0.5 * (low + high)
            before = way.derivatives(middle)[0, :, 0] < u
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        places = 0.5 * (low + high)
        guess = curve.derivatives(places)[0]
        q, left = task.polished(guess, places)
        return q, left <= REACHED

    try:
        return fit(joints, breaks, task.units, TAIL, task.singular), fastest
    except NotSmoothError as error:
        raise CannotFollowError(f"the joints cannot pass the singularity smoothly ({error})") from None
