"""From a path of the tool to one of the joints: the branch of the inverse kinematics that the start is in.

The branch is followed from the start with a predictor and Newton's method, whose steps are kept so short that no
other branch is ever taken for it. The joints between are then Chebyshev series through exact solutions, refined until
nothing is left to add. Source of the continuation: E. Allgower, K. Georg, Numerical Continuation Methods (1990),
chapter 6.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import TrajectoryError
from dh2sim.inverse.goals import Free
from dh2sim.inverse.reach import amount_text, why_unreachable
from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.forward import forward_kinematics, geometric_jacobian
from dh2sim.messages import listed
from dh2sim.robot.spec import RobotSpec
from dh2sim.trajectory.curves import ChebyshevCurve, NotSmoothError, PiecewisePolynomial, fit
from dh2sim.trajectory.limits import MotionLimits
from dh2sim.trajectory.tool_paths import ToolPath, rotation_vector
from dh2sim.typing import Array

NEAR_SINGULAR: Final = 1e-3
"""Least singular value, lengths in units of the arm's size, below which a path crosses a singularity: there joints
are a thousand times as fast as the tool, measured so."""
_CLOSE: Final = 20.0 * NEAR_SINGULAR
"""The same, below which it passes one closely."""
_LONGEST: Final = 1.0 / 16.0
_SHORTEST: Final = 1e-8
"""Steps along the path, as shares of it."""
_AT_END: Final = 1e-3
_BLIND: Final = 1e-4
"""Singular value below which no configuration is taken for a step."""
_ODD_SHARE: Final = 0.7289
_BEND: Final = 0.25
"""rad or sizes of the arm, by which a step's end may be off its tangent's."""
_REACHED: Final = 1e-10
"""Residual, rad or sizes of the arm, up to which a pose is reached."""
_TAIL: Final = 2e-12
"""Size of the last terms of a series from which on it is accurate."""


class CannotFollowError(TrajectoryError):
    """The joints cannot follow the tool's path beyond a place; ``constrained`` if for want of joints."""

    def __init__(self, text: str, *, constrained: bool = False) -> None:
        """Keep whether fewer demands on the orientation would help."""
        super().__init__(text)
        self.constrained = constrained


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Followed:
    """The joints along a path of the tool."""

    curve: ChebyshevCurve
    """Joint vectors over the path's parameter, 0 to 1; with slow passages over another, from 0 to its end."""
    end: Array
    """The joint vector at the end, shape (n,)."""
    near: str
    """Where it passes a singularity closely, at the tool's even pace; '' where it does not."""
    rate: float
    """Greatest derivative of the path's parameter with respect to that of the curve."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Task:
    """What the joints have to meet at each place of the path: as many equations as joints, or more that agree."""

    spec: RobotSpec
    chain: KinematicChain
    path: ToolPath
    free: Free | None
    units: Array
    """Of joint coordinates: 1 for turns, the arm's size for slides, shape (n,)."""
    size: float
    spare: Array
    """Directions of self-motion that go evenly from their start to their end, shape (k, n)."""
    q0: Array
    dq: Array
    """What they change by along the path, shape (n,)."""
    rank: int = field(default=6)

    def equations(self, q: Array, x: Array) -> tuple[Array, Array]:
        """Return what is left, shape (N, m), and its Jacobian, shape (N, m, n), in units of the joints."""
        goal = self.path.poses(x)
        T, J = forward_kinematics(self.chain, q), np.array(geometric_jacobian(self.chain, q))
        position = (T[:, :3, 3] - goal[:, :3, 3]) / self.size
        rows, left = [J[:, :3] / self.size], [position]
        R = goal[:, :3, :3]
        if self.free is None:
            left.append(rotation_vector(T[:, :3, :3] @ np.swapaxes(R, 1, 2)))
            rows.append(J[:, 3:])
        elif self.free == "roll":
            z = T[:, :3, 2]
            across = np.swapaxes(R[:, :, :2], 1, 2)
            left.append((across @ z[:, :, None])[:, :, 0])
            rows.append(_crossed(across, z) @ J[:, 3:])
        if len(self.spare):
            left.append((q - self.q0 - x[:, None] * self.dq) / self.units @ self.spare.T)
        jacobian = np.concatenate(rows, axis=1) * self.units
        if len(self.spare):
            jacobian = np.concatenate([jacobian, np.broadcast_to(self.spare, (len(q), *self.spare.shape))], axis=1)
        return np.concatenate(left, axis=1), jacobian

    def tangent(self, q: Array, x: Array) -> tuple[Array, Array]:
        """Return the derivative of the joints along the path, shape (N, n), and the task's singular values."""
        goal = self.path.poses(x)
        moved = self.path.velocities(goal)
        parts = [moved[:, :3] / self.size]
        if self.free is None:
            parts.append(moved[:, 3:])
        elif self.free == "roll":
            across = np.swapaxes(goal[:, :3, :2], 1, 2)
            parts.append(
                (_crossed(across, forward_kinematics(self.chain, q)[:, :3, 2]) @ moved[:, 3:, None])[:, :, 0]
            )
        if len(self.spare):
            parts.append(np.broadcast_to(self.dq / self.units @ self.spare.T, (len(q), len(self.spare))))
        _, jacobian = self.equations(q, x)
        steps = _solve(jacobian, np.concatenate(parts, axis=1)) * self.units
        own = jacobian[:, : jacobian.shape[1] - len(self.spare)]
        return steps, np.asarray(np.linalg.svd(own, compute_uv=False))

    def polished(self, q: Array, x: Array) -> tuple[Array, Array]:
        """Return configurations moved onto the path by Newton's method, and what is left of each, shape (N,)."""
        q, before = np.array(q), np.inf
        for _ in range(12):
            left, jacobian = self.equations(q, x)
            step = _solve(jacobian, left)
            size = float(np.abs(step).max(initial=0.0))
            if not np.isfinite(size) or size > 1.0:
                break
            q -= step * self.units
            if size < 1e-15 or (size < 1e-11 and size >= 0.5 * before):
                break
            before = size
        left, _ = self.equations(q, x)
        return q, np.abs(left).max(axis=1)


def _crossed(across: Array, z: Array) -> Array:
    """Return rows r x ... : what an angular velocity w changes across · z by, for w x z, shape (N, 2, 3)."""
    return np.stack([np.cross(z, across[:, row]) for row in range(across.shape[1])], axis=1)


def _solve(jacobian: Array, right: Array) -> Array:
    """Return the shortest least-squares solutions, shape (N, n)."""
    return np.asarray((np.linalg.pinv(jacobian, rcond=1e-13) @ right[:, :, None])[:, :, 0])


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

    Raises:
        CannotFollowError: The path leaves the reach, or joints would jump.
        TrajectoryError: It crosses a singularity, or arrives in another configuration; the text says where.
    """
    task = _task(spec, chain, path, q0, q1, size=size, free=free)
    knots = _continued(task, q0)
    curve = _refined(task, *knots)
    x = curve.nodes
    place, sigma = _least_sigma(task, curve, x)
    if sigma < NEAR_SINGULAR and not through:
        names = _moved_by(task, curve.derivatives(np.array([place]))[0, 0])
        raise TrajectoryError(
            f"the path crosses a singularity at {path.place(place)}, where {names} without moving the tool; "
            "through=True passes it slowly"
        )
    _require_inside(task, curve, limits)
    end = curve.derivatives(np.array([1.0]))[0, 0]
    if q1 is not None:
        _require_same_end(task, end, q1)
    if not through:
        near = path.place(place) if sigma < _CLOSE else ""
        return Followed(curve=curve, end=end, near=near, rate=1.0)
    slowed, rate = _slowed(task, curve, limits.velocity)
    return Followed(curve=slowed, end=end, near="", rate=rate)


def _task(
    spec: RobotSpec,
    chain: KinematicChain,
    path: ToolPath,
    q0: Array,
    q1: Array | None,
    *,
    size: float,
    free: Free | None,
) -> _Task:
    turns = np.array([joint.type.turns for joint in chain.moving_joints])
    units = np.where(turns, 1.0, size)
    n = len(units)
    plain = _Task(
        spec=spec, chain=chain, path=path, free=free, units=units, size=size, spare=np.zeros((0, n)), q0=q0, dq=q0 * 0
    )
    ends = np.stack([q0] if q1 is None else [q0, q1])
    _, jacobian = plain.equations(ends, np.linspace(0.0, 1.0, len(ends)))
    spread = np.stack([q0 + units * np.sin(1.7 * np.arange(1, n + 1) + k) for k in range(4)])
    _, general = plain.equations(spread, np.zeros(len(spread)))
    values = np.linalg.svd(general, compute_uv=False)
    rank = int((values > 1e-9 * values.max(initial=0.0)).sum(axis=1).max())
    spare = np.zeros((0, n))
    if n > rank:  # the directions that move the tool least at both ends
        square = sum(J.T @ np.linalg.pinv(J @ J.T, rcond=1e-12) @ J for J in jacobian)
        spare = np.linalg.eigh(square)[1][:, : n - rank].T
    return _Task(
        spec=spec,
        chain=chain,
        path=path,
        free=free,
        units=units,
        size=size,
        spare=spare,
        q0=q0,
        dq=np.zeros(n) if q1 is None else q1 - q0,
        rank=rank,
    )


def _continued(task: _Task, q0: Array) -> tuple[Array, Array]:
    """Follow the branch from the start to the end: return places, shape (k,), and configurations, shape (k, n)."""
    x, h = 0.0, _LONGEST
    q = q0[None]
    places, found = [0.0], [q0]
    tangent, _ = task.tangent(q, np.array([x]))
    left = task.polished(q, np.array([0.0]))[1]
    if left[0] > 1e-8:
        raise CannotFollowError(f"{task.path.place(0.0)}: the start is not on the path", constrained=True)
    while x < 1.0:
        if h < _SHORTEST:
            raise _stopped(task, x, q[0])
        to = np.array([min(1.0, x + h)])
        guess = q + tangent * (to - x)
        new, left = task.polished(guess, to)
        off = float(np.abs((new - guess) / task.units).max())
        good = bool(np.isfinite(off)) and off <= _BEND * 0.4 and bool(left[0] <= _REACHED)
        if good:
            turned, values = task.tangent(new, to)
            good = bool(np.abs((turned - tangent) * (to - x) / task.units).max() <= _BEND)
            if good and to[0] < 1.0 and values[0, min(task.rank, values.shape[1]) - 1] < _BLIND:
                h *= _ODD_SHARE  # a singularity is stepped over, not on: there the equations say too little
                continue
        if good:
            q, x, tangent = new, float(to[0]), turned
            places.append(x)
            found.append(q[0])
            h = min(1.6 * h, _LONGEST)
            continue
        h *= 0.5
    return np.array(places), np.array(found)


def _stopped(task: _Task, x: float, q: Array) -> CannotFollowError:
    """Return why joints cannot follow the path beyond a place."""
    where = task.path.place(x)
    ahead = task.path.poses(np.array([min(1.0, x + 1e-4)]))[0]
    short = why_unreachable(task.spec, ahead, q0=q, free=task.free)
    few = task.rank < 6 and task.free != "rotation"
    if short is not None and (x > 1e-6 or not few):
        return CannotFollowError(f"the path is not reached beyond {where}: {short.reason}", constrained=few)
    if short is not None:
        return CannotFollowError(f"the path is not reached beyond {where}: {short.reason}", constrained=True)
    names = _moved_by(task, q)
    still = f"{names} there without moving the tool"
    if x < _AT_END or x > 1.0 - _AT_END:
        ends = "starts" if x < _AT_END else "ends"
        return CannotFollowError(f"the {task.path.kind} {ends} in a singularity, {where}: {still}", constrained=few)
    return CannotFollowError(f"the joints would jump to another branch at {where}: {still}", constrained=few)


def _moved_by(task: _Task, q: Array) -> str:
    """Return which joints move in the motion that moves the tool least: ``joint_4 and joint_6 move``."""
    _, jacobian = task.equations(q[None], np.zeros(1))
    own = jacobian[0, : jacobian.shape[1] - len(task.spare)]
    vectors = np.linalg.svd(own)[2]
    motion = np.abs(vectors[min(task.rank, len(vectors)) - 1])
    names = [joint.name for joint, part in zip(task.chain.moving_joints, motion, strict=True) if part > 0.2]
    *first, last = names or ["no joint"]
    return f"{listed(first)} and {last} move" if first else f"{last} moves"


def _refined(task: _Task, places: Array, found: Array) -> ChebyshevCurve:
    """Return the joints as series through exact solutions, with the configurations found as first guesses."""
    rates, _ = task.tangent(found, places)
    h = np.diff(places)[:, None]
    slopes = np.diff(found, axis=0) / h
    square = (3.0 * slopes - 2.0 * rates[:-1] - rates[1:]) / h
    cube = (rates[:-1] + rates[1:] - 2.0 * slopes) / (h * h)
    guide = PiecewisePolynomial.of(places, np.stack([found[:-1], rates[:-1], square, cube], axis=1))

    def exact(x: Array) -> tuple[Array, NDArray[np.bool_]]:
        guess = guide.derivatives(x)[0]
        q, left = task.polished(guess, x)
        return q, (np.abs((q - guess) / task.units).max(axis=1) < _BEND) & (left <= _REACHED)

    ends = np.array([*places[:-1:2], places[-1]])
    try:
        return fit(exact, ends, task.units, _TAIL)
    except NotSmoothError as error:
        raise _stopped(task, error.place, guide.derivatives(np.array([error.place]))[0, 0]) from None


def _least_sigma(task: _Task, curve: ChebyshevCurve, x: Array) -> tuple[float, float]:
    """Return where the least singular value on the path is, and the value."""
    for _ in range(3):
        q = curve.derivatives(x)[0]
        _, values = task.tangent(q, x)
        sigma = values[:, min(task.rank, values.shape[1]) - 1]
        least = int(sigma.argmin())
        best = float(x[least]), float(sigma[least])
        x = np.linspace(x[max(least - 1, 0)], x[min(least + 1, len(x) - 1)], 65)
    return best


def _require_same_end(task: _Task, end: Array, q1: Array) -> None:
    """Refuse to arrive in another configuration than the one that was asked for."""
    off = np.abs((end - q1) / task.units)
    if off.max() <= 1e-7:
        return
    joints = [joint for joint, far in zip(task.chain.moving_joints, off, strict=True) if far > 1e-7]
    amounts = [
        amount_text(task.spec, float(abs(end[i] - q1[i])), turns=joint.type.turns)
        for i, joint in enumerate(task.chain.moving_joints)
        if joint in joints
    ]
    parts = [f"{joint.name} by {amount}" for joint, amount in zip(joints, amounts, strict=True)]
    raise TrajectoryError(
        f"the {task.path.kind} reaches the pose at its end in another configuration: {listed(parts)} off. Give the "
        "waypoint as a pose to accept that, or move there with kind 'joint'"
    )


def _require_inside(task: _Task, curve: ChebyshevCurve, limits: MotionLimits) -> None:
    """Refuse a path on which a joint leaves its position limits."""
    x = np.unique((curve.breaks[:-1, None] + np.diff(curve.breaks)[:, None] * np.linspace(0.0, 1.0, 65)).ravel())
    q = curve.derivatives(x)[0]
    beyond = np.maximum(limits.lower - q, q - limits.upper) > 1e-9 * np.maximum(1.0, np.abs(q))
    if beyond.any():
        place, joint = (int(i) for i in np.argwhere(beyond)[0])
        amount = np.maximum(limits.lower - q, q - limits.upper)[:, joint].max()
        text = amount_text(task.spec, float(amount), turns=limits.turns[joint])
        where = task.path.place(float(x[place]))
        raise TrajectoryError(f"{limits.joints[joint]} leaves its limits at {where}, by up to {text}")


def _slowed(task: _Task, curve: ChebyshevCurve, weights: Array) -> tuple[ChebyshevCurve, float]:
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
        return q, left <= _REACHED

    try:
        return fit(joints, breaks, task.units, _TAIL), fastest
    except NotSmoothError as error:
        raise CannotFollowError(f"the joints cannot pass the singularity smoothly ({error})") from None
