"""Forward kinematics of closed loops: from the assembly, the driven joints are moved to where they are wanted.

Continuation: along the straight line in the coordinates of the driven joints, a step of the passive ones along the
tangent, then Newton steps back onto the loops (E. Allgower, K. Georg, Introduction to Numerical Continuation Methods,
2003, chapter 2). Steps are as small as the distance from a singular position, so that the path neither changes
branches nor passes one unseen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.arguments import real_array
from dh2sim.errors import AssemblyError, ConfigurationError, SingularPositionError
from dh2sim.kinematics.loop_batch import LoopBatch
from dh2sim.kinematics.loop_closure import assembly, close_loops, is_closed
from dh2sim.kinematics.transforms import identity
from dh2sim.kinematics.tree import Frame, KinematicTree, body_poses, joint_values, placed
from dh2sim.messages import counted, listed
from dh2sim.robot.mechanism import ClosureType
from dh2sim.robot.spec import RobotSpec, SpecLike, spec_of
from dh2sim.typing import Array, read_only

LONGEST: Final = 0.1
"""rad, or mechanism sizes: of a step of any joint."""
_SINGULAR: Final = 1e-5
"""Least singular value of the passive joints' Jacobian, lengths in mechanism sizes, of a regular position."""
_RANK: Final = 1e-8
_MOST_STEPS: Final = 20_000


def actuated_joints(robot: SpecLike) -> tuple[int, ...]:
    """Return the places of the driven joints in a joint vector, in the order of the file's list; default all."""
    spec = spec_of(robot)
    names = [row.name for row in spec.moving_rows]
    return tuple(range(len(names))) if spec.actuated is None else tuple(names.index(name) for name in spec.actuated)


def mechanism_configuration(robot: SpecLike, q: ArrayLike) -> Array:
    """Return the joint vector of a mechanism, given that of its driven joints.

    Args:
        robot: The robot.
        q: Coordinates of the driven joints in the order of ``actuated``, rad and m, shape (k,); or of all joints,
            shape (n,), which are returned as they are.

    Returns:
        Shape (n,), read-only: the loops are closed, on the branch of motion that the assembly is on.

    Raises:
        AssemblyError: The loops cannot be closed at all.
        SingularPositionError: On the way there is a dead or singular position; the text says where.
        ConfigurationError: ``q`` has another shape or is not finite.
    """
    spec = spec_of(robot)
    tree, q0 = assembly(spec)
    driven = actuated_joints(spec)
    values = real_array("q", q)
    if values.shape == (tree.n,):
        return read_only(joint_values(tree, values))
    names = listed(tree.moving_joints[k].name for k in driven)
    if values.shape != (len(driven),):
        raise ConfigurationError(
            f"expected {len(driven)} coordinates of driven joints ({names}), or {tree.n} of all joints, got shape "
            f"{values.shape}"
        )
    if not np.isfinite(values).all():
        raise ConfigurationError(f"joint coordinates must be finite ({names}), got {values.tolist()}")
    motion = Continuation(spec, tree, driven)
    motion.check(q0)
    return read_only(motion.follow(q0, values))


def driven_motion(robot: SpecLike, q: ArrayLike, target: ArrayLike) -> Array:
    """Return where moving the driven joints straight from one configuration to a target leads.

    Args:
        robot: The robot.
        q: Joint vector at which the loops are closed, rad and m, shape (n,).
        target: Coordinates of the driven joints, in the order of a joint vector, shape (k,).

    Returns:
        Shape (n,), read-only.

    Raises:
        SingularPositionError: On the way there is a dead or singular position; the text says where.
        ConfigurationError: ``q`` has another shape or is not finite.
    """
    spec = spec_of(robot)
    tree, _ = assembly(spec)
    start = np.array(joint_values(tree, q))
    motion = Continuation(spec, tree, sorted(actuated_joints(spec)))
    motion.check(start)
    return read_only(motion.follow(start, np.asarray(target, dtype=np.float64)))


def named_configuration(robot: SpecLike, name: str) -> Array:
    """Return a named configuration of a mechanism, with its loops closed.

    Args:
        robot: The robot.
        name: One of its ``named_configurations``.

    Returns:
        Shape (n,), read-only; ``home`` is the assembly where the file has no other.

    Raises:
        AssemblyError: The loops cannot be closed near it.
        ConfigurationError: There is no such configuration.
    """
    spec = spec_of(robot)
    tree, q = assembly(spec)
    named = spec.configuration(name)
    if name == "home" and name not in spec.configurations:
        return q
    try:
        return close_loops(tree, named) if tree.closures else named
    except AssemblyError as error:
        raise AssemblyError(f"{spec.name}: configuration '{name}': {error}") from None


def mechanism_pose(robot: SpecLike, q: ArrayLike | str, frame: str = "tool0", **options: object) -> Array:
    """Return the pose of a frame of a mechanism in base_link.

    Args:
        robot: The robot.
        q: As for ``mechanism_configuration``, or the name of a configuration.
        frame: Such as tool0, dh_1 or rocker/dh_1.
        **options: Those that serial robots have are refused.

    Returns:
        Shape (4, 4).

    Raises:
        UnknownFrameError: There is no such frame.
        Dh2simError: As for ``mechanism_configuration``.
    """
    _refuse(options)
    tree, _ = assembly(robot)
    found = tree.frame(frame)
    vector = named_configuration(robot, q) if isinstance(q, str) else mechanism_configuration(robot, q)
    return np.array(placed(body_poses(tree, vector), found))


def mechanism_jacobian(robot: SpecLike, q: ArrayLike | str, frame: str = "tool0", **options: object) -> Array:
    """Return the twist of a frame for a unit velocity of each driven joint, the passive ones following.

    Args:
        robot: The robot.
        q: As for ``mechanism_pose``.
        frame: Such as tool0, dh_1 or rocker/dh_1.
        **options: Those that serial robots have are refused.

    Returns:
        Shape (6, k), in base_link, the driven joints in the order of a joint vector: rows 0-2 the velocity of the
        frame's origin, m/s, rows 3-5 its angular velocity, rad/s.

    Raises:
        SingularPositionError: The driven joints do not determine the velocities of the passive ones there, or the
            loops do not let them move independently.
        UnknownFrameError: There is no such frame.
        Dh2simError: As for ``mechanism_configuration``.
    """
    _refuse(options)
    spec = spec_of(robot)
    tree, _ = assembly(spec)
    body, T_body_frame = tree.frame(frame)
    vector = named_configuration(spec, q) if isinstance(q, str) else mechanism_configuration(spec, q)
    poses = body_poses(tree, vector)
    J = _twists(tree, poses, Frame(body, T_body_frame))
    return read_only(J @ Continuation(spec, tree, sorted(actuated_joints(spec))).followed(vector))


def _refuse(options: Mapping[str, object]) -> None:
    if options:
        raise ConfigurationError(f"a mechanism takes none of the options of serial robots, got {listed(options)}")


def _twists(tree: KinematicTree, poses: Sequence[Array], frame: Frame) -> Array:
    """Return the twist of a frame for a unit velocity of each joint of the tree, shape (6, n)."""
    origin = placed(poses, frame)[:3, 3]
    J = np.zeros((6, tree.n))
    for k in tree.path(frame.body):
        joint, column = tree.joints[k], tree.coordinates[k]
        if column < 0:
            continue
        z = joint.sign * poses[k][:3, 2]
        if joint.type.turns:
            J[:3, column], J[3:, column] = np.cross(z, origin - poses[k][:3, 3]), z
        else:
            J[:3, column] = z
    return J


class Continuation:
    """A mechanism that its driven joints move."""

    def __init__(self, spec: RobotSpec, tree: KinematicTree, driven: Sequence[int]) -> None:
        self._spec, self._tree = spec, tree
        self._driven = list(driven)
        self._passive = [k for k in range(tree.n) if k not in driven]
        self._loops = LoopBatch(tree)
        self._size, self._scale = self._loops.size, self._loops.scale
        self._determined = len(self._passive)
        """How many independent motions of the passive joints the loops determine."""

    def follow(
        self, q: Array, target: Array, passing: Callable[[float, Array], None] = lambda _share, _q: None
    ) -> Array:
        """Return the configuration that moving the driven joints straight to a target leads to.

        Args:
            q: Where to begin; ``check`` has found nothing against it or where it was reached from.
            target: Coordinates of the driven joints.
            passing: Called with the share of the way that is done, and the configuration, after each step.

        Raises:
            SingularPositionError: There is none, or a singular position is on the way.
        """
        start = q[self._driven].copy()
        way = (target - start) / self._scale[self._driven]
        length = float(np.abs(way).max(initial=0.0))
        done, step = 0.0, min(1.0, LONGEST / length) if length else 1.0
        for _ in range(_MOST_STEPS):
            if done >= 1.0:
                return q
            rates, least = self._rates(q, way)
            if least < _SINGULAR:
                raise self._stuck(start, target, done)
            fastest = max(length, float(np.abs(rates).max(initial=0.0)))
            limit = LONGEST * min(1.0, 4.0 * least) / fastest if fastest else 1.0
            step = min(2.0 * step, limit, 1.0 - done)
            while (moved := self._moved(q, start, target, done + step, step * rates)) is None:
                step /= 2.0
                if step * length < 1e-9:
                    raise self._stuck(start, target, done)
            q, done = moved, 1.0 if step == 1.0 - done else done + step
            passing(done, q)
        raise self._stuck(start, target, done)

    def _jacobian(self, q: Array) -> Array:
        return np.asarray(self._loops.evaluate(q[None])[1][0])

    def _rates(self, q: Array, way: Array) -> tuple[Array, float]:
        """Return the passive joints' rates along a way of the driven ones, and the least singular value."""
        J = self._jacobian(q)
        values = np.linalg.svd(J[:, self._passive], compute_uv=False)[: self._determined]
        rates = np.linalg.lstsq(J[:, self._passive], -J[:, self._driven] @ way, rcond=_RANK)[0]
        least = float(values.min(initial=1.0))
        return np.asarray(rates), least

    def _moved(self, q: Array, start: Array, target: Array, done: float, guess: Array) -> Array | None:
        """Return the configuration with the driven joints at a share of their way; None where Newton fails."""
        new = q.copy()
        new[self._driven] = target if done == 1.0 else start + done * (target - start)
        new[self._passive] += guess * self._scale[self._passive]
        predicted = new[self._passive].copy()
        for _ in range(8):
            residual, J = self._loops.evaluate(new[None])
            correction = np.linalg.lstsq(J[0][:, self._passive], -residual[0], rcond=_RANK)[0]
            new[self._passive] += correction * self._scale[self._passive]
            if float(np.abs(correction).max(initial=0.0)) < 1e-14:
                break
        off = np.abs(new[self._passive] - predicted) / self._scale[self._passive]
        moved = float(np.abs(guess).max(initial=0.0)) + 1e-9
        return new if is_closed(self._tree, new) and float(off.max(initial=0.0)) <= 0.3 * moved + 1e-6 else None

    def followed(self, q: Array) -> Array:
        """Return the velocities of all joints for a unit velocity of each driven one, shape (n, driven).

        Raises:
            SingularPositionError: They are not determined.
        """
        self.check(q, where="there")
        rates = self.passive_rates(self._jacobian(q)[None])[0]
        S = np.zeros((self._tree.n, len(self._driven)))
        S[self._driven, range(len(self._driven))] = 1.0
        S[self._passive] = self._scale[self._passive, None] * rates / self._scale[self._driven]
        return S

    def passive_rates(self, J: Array) -> Array:
        """Return the least velocities of passive joints for a unit velocity of each driven one, in units of scale.

        Args:
            J: Jacobians of the loops' constraints, shape (N, c, n).

        Returns:
            Shape (N, passive, driven).
        """
        u, values, v = np.linalg.svd(J[:, :, self._passive], full_matrices=False)
        kept = np.arange(values.shape[1]) < self._determined
        gains = np.where(kept, 1.0 / np.maximum(values, 1e-300), 0.0)
        moved = np.swapaxes(u, 1, 2) @ J[:, :, self._driven]
        return np.asarray(-np.swapaxes(v, 1, 2) @ (gains[:, :, None] * moved))

    def check(self, q: Array, where: str = "at the assembly") -> None:
        """Refuse driven joints that do not determine the others, or that the loops do not leave free.

        Raises:
            SingularPositionError: They do not.
        """
        J = self._jacobian(q)
        whole, passive = (_rank(matrix) for matrix in (J, J[:, self._passive]))
        free = self._tree.n - whole
        names = listed(self._tree.moving_joints[k].name for k in self._driven)
        self._determined = passive
        if passive < len(self._passive) and not self._is_idle(q, J):
            left = len(self._passive) - passive
            raise SingularPositionError(
                f"{self._spec.name}: {names} driven, {counted(free, 'freedom')} {where}: {left} of them "
                f"stay{'s' if left == 1 else ''} open, so that the passive joints are not determined"
            )
        if free < len(self._driven):
            raise SingularPositionError(
                f"{self._spec.name}: {names} driven, but the loops leave {counted(free, 'freedom')}: these joints "
                "cannot be moved independently; give the coordinates of all joints"
            )

    def _is_idle(self, q: Array, J: Array) -> bool:
        """Whether what stays open turns links about themselves only, as a rod between two ball joints.

        Then the origins of tool0, of all joints and closures rest, and closures do not turn unless they are ball
        joints; of the motions that keep the loops closed the least is taken.
        """
        tree, poses = self._tree, body_poses(self._tree, q)
        _, values, Vt = np.linalg.svd(J[:, self._passive])
        rank = int((values > _RANK * max(1.0, float(values.max(initial=0.0)))).sum())
        loose = np.zeros((tree.n, len(self._passive) - rank))
        loose[self._passive] = Vt[rank:].T
        ends = [[tree.frame(name) for name in (each.a, each.b)] for each in tree.closures]
        looped = {body for a, b in ends for body in set(tree.path(a.body)) ^ set(tree.path(b.body))}
        still = [column for body, column in enumerate(tree.coordinates) if column >= 0 and body not in looped]
        frames = [tree.frame("tool0"), *(frame for pair in ends for frame in pair)]
        frames += [Frame(body, identity()) for body, column in enumerate(tree.coordinates) if column >= 0]
        points = np.concatenate([_twists(tree, poses, frame)[:3] for frame in frames])
        turning = [
            _twists(tree, poses, a)[3:] - _twists(tree, poses, b)[3:]
            for each, (a, b) in zip(tree.closures, ends, strict=True)
            if each.type is not ClosureType.SPHERICAL
        ]
        moved = np.concatenate([points / self._size, *turning]) * self._scale @ loose
        return bool(np.abs(moved).max(initial=0.0) < _RANK and np.abs(loose[still]).max(initial=0.0) < _RANK)

    def _stuck(self, start: Array, target: Array, done: float) -> SingularPositionError:
        """Return the error of the position that stops the motion."""
        at = []
        for value, k in zip(start + done * (target - start), self._driven, strict=True):
            joint = self._tree.moving_joints[k]
            shown_value = f"{math.degrees(value):.6g} deg" if joint.type.turns else f"{value:.6g} m"
            at.append(f"{joint.name} = {shown_value}")
        return SingularPositionError(
            f"{self._spec.name}: the way there comes to a dead or singular position at {listed(at)}, "
            "where the driven joints do not determine how the passive ones go on"
        )


def _rank(matrix: Array) -> int:
    values = np.linalg.svd(matrix, compute_uv=False)
    return int((values > _RANK * max(1.0, float(values.max(initial=0.0)))).sum())
