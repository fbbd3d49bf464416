"""Poses and Jacobians of a chain's frames, for any number of configurations at once."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import UnknownFrameError
from dh2sim.kinematics.batch_frame import (
    BlockFrame,
    Column,
    cross,
    difference,
    sines_and_cosines,
    write_column,
)
from dh2sim.kinematics.batches import (
    BatchOptions,
    Fill,
    JacobianOptions,
    checked_options,
    in_blocks,
    require_shape,
)
from dh2sim.kinematics.chain import (
    ChainLike,
    KinematicChain,
    chain_of,
    configuration_of,
    joint_vector,
    joint_vectors,
    mechanism_of,
    require_finite,
)
from dh2sim.kinematics.straight_line import JACOBIAN, POSE, Kind, of_one
from dh2sim.kinematics.transforms import compose, identity, joint_part
from dh2sim.kinematics.trig import sin_cos
from dh2sim.messages import did_you_mean, shown
from dh2sim.typing import Array, read_only


def forward_kinematics(
    chain: ChainLike, q: ArrayLike, *, frame: str = "tool0", **options: Unpack[BatchOptions]
) -> Array:
    """Return the pose of a frame in base_link.

    Args:
        chain: The robot, in any form.
        q: Joint vectors, rad and m, shape (..., n); or the name of a configuration. Of a mechanism one vector, of all
            joints or of the driven ones, which move the others from the assembly.
        frame: tool0, base_link, dh_0 … dh_n or link_1 … link_n; rocker/dh_1 … of a branch.
        **options: ``out``, ``rows``, ``threads``, ``backend``: see :class:`BatchOptions`.

    Returns:
        Shape (..., 4, 4).

    Raises:
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite; or an option is wrong.
        UnknownFrameError: The frame is unknown.
        SingularPositionError: A dead or singular position of a mechanism is on the way.
    """
    return frame_pose(chain, frame, q, **options)


def frame_poses(chain: ChainLike, q: ArrayLike, *, out: Array | None = None, threads: int = 1) -> Array:
    """Return the poses of all DH frames in base_link.

    Args:
        chain: The robot, in any form.
        q: Joint vectors, rad and m, shape (..., n).
        out: Takes the result, of its shape; by default a new array.
        threads: See :class:`BatchOptions`.

    Returns:
        Poses of DH frames 0 … number of rows, shape (..., number of rows + 1, 4, 4).

    Raises:
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """
    robot = chain_of(chain)

    def fill(results: Array, columns: Array) -> None:
        results[:, 0] = robot.T_base_link_dh0
        for i, frame in enumerate(joint_frames(robot, columns)):
            frame.then(robot.joints[i].T_joint_dh).write(results[:, i + 1])

    return in_blocks(*joint_vectors(robot, q), (len(robot.joints) + 1, 4, 4), fill, out, threads)


def joint_poses(chain: KinematicChain, q: ArrayLike) -> Array:
    """Return the poses of all joint-placed bodies in base_link; each turns with its own joint.

    Args:
        chain: The robot.
        q: Joint vectors, rad and m, shape (..., n).

    Returns:
        One pose for each row of the table, shape (..., number of rows, 4, 4).

    Raises:
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """

    def fill(results: Array, columns: Array) -> None:
        for i, frame in enumerate(joint_frames(chain, columns)):
            frame.write(results[:, i])

    return in_blocks(*joint_vectors(chain, q), (len(chain.joints), 4, 4), fill)


def reference_joint_poses(chain: KinematicChain, q: ArrayLike) -> tuple[Array, ...]:
    """Return what :func:`joint_poses` does for one configuration, with the same bits on every machine.

    Args:
        chain: The robot.
        q: Joint vector, rad and m, shape (n,).

    Returns:
        One pose of shape (4, 4), read-only, for each row of the table.

    Raises:
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """
    return _reference_joint_poses(chain, tuple(joint_vector(chain, q).tolist()))


@lru_cache(maxsize=8)  # those of zero and home are asked for several times while a model is built
def _reference_joint_poses(chain: KinematicChain, q: tuple[float, ...]) -> tuple[Array, ...]:
    coordinates = iter(q)
    poses: list[Array] = []
    for joint in chain.joints:
        pose = compose(poses[-1], joint.T_parent_joint) if poses else joint.T_parent_joint
        if joint.type.moves:
            moved = joint.sign * next(coordinates)
            pose = compose(pose, joint_part(moved, 0.0) if joint.type.turns else joint_part(0.0, moved))
        poses.append(pose)
    return tuple(poses)


def reference_joint_frames(chain: KinematicChain, q: Array) -> Array:
    """Return what :func:`reference_joint_poses` does, with the same bits, for several configurations.

    Computed element by element, which rounds as Python's own arithmetic does.

    Args:
        chain: The robot.
        q: Joint vectors, rad and m, shape (N, n).

    Returns:
        Shape (number of rows, N, 4, 4).
    """
    columns = iter(q.T)
    poses = np.zeros((len(chain.joints), len(q), 4, 4))
    poses[:, :, 3, 3] = 1.0
    before = np.broadcast_to(np.eye(4)[:3], (len(q), 3, 4))
    for joint, pose in zip(chain.joints, poses, strict=True):
        before = _composed(before, joint.T_parent_joint[None, :3])
        if joint.type.moves:
            before = _composed(before, _moved(joint.type.turns, (joint.sign * next(columns)).tolist()))
        pose[:, :3] = before
    return poses


def _moved(turns: bool, amounts: list[float]) -> Array:
    """Return the upper rows of rotations about z, or of motions along it, shape (N, 3, 4)."""
    parts = np.zeros((len(amounts), 3, 4))
    parts[:, 2, 2] = 1.0
    sines, cosines = np.array([sin_cos(amount) for amount in amounts]).T if turns else (0.0, 1.0)
    parts[:, 0, 0] = parts[:, 1, 1] = cosines
    parts[:, 1, 0], parts[:, 0, 1] = sines, -sines
    if not turns:
        parts[:, 2, 3] = amounts
    parts += 0.0  # no zero is negative
    return parts


def _composed(T_a_b: Array, T_b_c: Array) -> Array:
    """Return the upper rows of products of poses, of which the upper rows are given, shape (N, 3, 4)."""
    product: Array = (
        T_a_b[:, :, 0:1] * T_b_c[:, 0:1] + T_a_b[:, :, 1:2] * T_b_c[:, 1:2] + T_a_b[:, :, 2:3] * T_b_c[:, 2:3]
    )
    product[:, :, 3] += T_a_b[:, :, 3]
    product += 0.0  # no zero is negative
    return product


def joint_frames(chain: KinematicChain, columns: Array) -> Iterator[BlockFrame]:
    """Walk along the chain and yield the frame of each joint-placed body in base_link.

    Args:
        chain: The robot.
        columns: Joint coordinates, rad and m, shape (n, N).

    Yields:
        The frame of each joint, first to last, for N configurations.
    """
    moving = chain.moving_joints
    sines, cosines = sines_and_cosines(columns[np.array([joint.type.turns for joint in moving], dtype=np.bool_)])
    turns, coordinates = iter(zip(sines, cosines, strict=True)), iter(columns)
    frame = BlockFrame()
    for joint in chain.joints:
        frame = frame.then(joint.T_parent_joint)
        if joint.type.moves:
            coordinate = next(coordinates)
            if joint.type.turns:
                frame = frame.turned(*next(turns), joint.sign)
            else:
                frame = frame.slid(coordinate, joint.sign)
        yield frame


def frame_names(chain: KinematicChain) -> tuple[str, ...]:
    """Return the names: base_link, link_1 … link_n, dh_0 … dh_n, tool0."""
    n = len(chain.joints)
    links = (f"link_{i}" for i in range(1, n + 1))
    return ("base_link", *links, *(f"dh_{i}" for i in range(n + 1)), "tool0")


def require_frame(chain: KinematicChain, frame: str) -> None:
    """Check that the robot has a frame of this name.

    Raises:
        UnknownFrameError: It has not; the text lists the names.
    """
    names = frame_names(chain)
    if not isinstance(frame, str) or frame not in names:
        n = len(chain.joints)
        found, hint = (shown(frame), did_you_mean(frame, names)) if isinstance(frame, str) else (repr(frame), "")
        raise UnknownFrameError(
            f"unknown frame {found}.{hint} Frames: base_link, link_1 to link_{n}, dh_0 to dh_{n}, tool0"
        )


def frame_pose(chain: ChainLike, frame: str, q: ArrayLike, **options: Unpack[BatchOptions]) -> Array:
    """Return the pose of a named frame in base_link.

    Args:
        chain: The robot, in any form.
        frame: One of ``frame_names``; link_i is at joint i, dh_i is the table's frame i.
        q: As for :func:`forward_kinematics`.
        **options: ``out``, ``rows``, ``threads``, ``backend``: see :class:`BatchOptions`.

    Returns:
        Shape (..., 4, 4).

    Raises:
        UnknownFrameError: The frame is unknown.
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite; or an option is wrong.
    """
    if chain.__class__ is KinematicChain:
        robot = chain
    elif (mechanism := mechanism_of(chain)) is not None:
        from dh2sim.kinematics.loop_motion import mechanism_pose  # costs what serial robots need not pay

        return mechanism_pose(mechanism, q, frame, **options)
    else:
        robot, q = chain_of(chain), configuration_of(chain, q)
    if not options:
        evaluate = robot.code.pose.get(frame) if isinstance(frame, str) else None
        if evaluate is not None:
            pose = evaluate(q)
            if pose is not None:
                return pose
    carriers, T_joint_frame = frame_place(robot, frame)

    def fill(results: Array, columns: Array) -> None:
        if carriers == 0:
            results[...] = T_joint_frame[: results.shape[1]]
            return
        for last, _ in zip(joint_frames(robot, columns), range(carriers), strict=False):  # noqa: B007
            pass
        last.then(T_joint_frame).write(results)

    return _computed(POSE, robot, (frame, carriers, T_joint_frame), q, fill, options)


_NOTHING: Column = (0.0, 0.0, 0.0)


def geometric_jacobian(
    chain: ChainLike, q: ArrayLike, *, frame: str = "tool0", **options: Unpack[JacobianOptions]
) -> Array:
    """Return the Jacobian of a frame in base_link: [velocity; angular velocity] = J · dq/dt.

    For a joint that turns about the unit axis z through p the column is [z x (p_frame - p); z], for one that
    slides along z it is [z; 0], and for one behind the frame it is zero. Source: M. W. Spong, S. Hutchinson,
    M. Vidyasagar, Robot Modeling and Control, 2006, section 4.6.

    Args:
        chain: The robot, in any form.
        q: As for :func:`forward_kinematics`.
        frame: One of ``frame_names``.
        **options: ``out``, ``threads``, ``backend``: see :class:`BatchOptions`.

    Returns:
        Shape (..., 6, n): rows 0-2 velocity of the frame's origin, m/s; rows 3-5 angular velocity, rad/s; both
        along the axes of base_link, for each rad/s or m/s of a joint coordinate. Of a mechanism (6, k), for its k
        driven joints.

    Raises:
        UnknownFrameError: The frame is unknown.
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite; or an option is wrong.
    """
    if chain.__class__ is KinematicChain:
        robot = chain
    elif (mechanism := mechanism_of(chain)) is not None:
        from dh2sim.kinematics.loop_motion import mechanism_jacobian

        return mechanism_jacobian(mechanism, q, frame, **options)
    else:
        robot, q = chain_of(chain), configuration_of(chain, q)
    if not options:
        evaluate = robot.code.jacobian.get(frame) if isinstance(frame, str) else None
        if evaluate is not None:
            jacobian = evaluate(q)
            if jacobian is not None:
                return jacobian
    carriers, T_joint_frame = frame_place(robot, frame)

    def fill(results: Array, columns: Array) -> None:
        results[...] = 0.0
        frames = list(joint_frames(robot, columns))[:carriers]
        if not frames:
            return
        target = frames[-1].then(T_joint_frame)
        pairs = zip(robot.joints, frames, strict=False)
        for i, (joint, axis) in enumerate(pair for pair in pairs if pair[0].type.moves):
            _write(results[:, :, i], axis, target, turns=joint.type.turns, sign=joint.sign * axis.signs[2])

    return _computed(JACOBIAN, robot, (frame, carriers, T_joint_frame), q, fill, options)


def _computed(
    kind: Kind,
    robot: KinematicChain,
    place: tuple[str, int, Array],
    q: ArrayLike,
    fill: Fill,
    options: BatchOptions | JacobianOptions,
) -> Array:
    """Compute a pose or a Jacobian of a frame for joint vectors, one or a batch."""
    out, rows, threads, compiled = checked_options(kind, options)
    vectors, batch = joint_vectors(robot, q, finite=False)
    kernel = None
    if compiled and batch:
        from dh2sim.kinematics.numba_kernels import numba_kernel

        kernel = numba_kernel(kind, robot, *place, rows)
    if kernel is None:
        require_finite(robot, vectors.reshape(*batch, robot.n))
    if not batch:
        result = of_one(kind, robot, *place, vectors[0])[:rows]
        if out is None:
            return result if rows == kind.rows else result.copy()
        require_shape(out, result.shape)[...] = result
        return out
    shape = (rows, kind.columns or robot.n)

    def fill_finite(results: Array, columns: Array) -> None:  # a kernel leaves to NumPy what is not finite, too
        if not np.isfinite(columns).all():
            require_finite(robot, vectors.reshape(*batch, robot.n))
        fill(results, columns)

    return in_blocks(vectors, batch, shape, fill if kernel is None else fill_finite, out, threads, kernel)


def frame_place(chain: KinematicChain, frame: str) -> tuple[int, Array]:
    """Return how many joints carry a named frame, and its pose in the last of them, or in base_link."""
    known = chain.code.places
    if not isinstance(frame, str) or frame not in known:
        require_frame(chain, frame)
        known[frame] = _frame_place(chain, frame)
    return known[frame]


def _frame_place(chain: KinematicChain, frame: str) -> tuple[int, Array]:
    n = len(chain.joints)
    if frame == "tool0":
        return n, read_only(compose(chain.joints[-1].T_joint_dh, chain.T_dhn_tool0))
    if frame == "dh_0":
        return 0, chain.T_base_link_dh0
    kind, _, index = frame.partition("_")
    if kind == "dh":
        return int(index), chain.joints[int(index) - 1].T_joint_dh
    return (int(index) if kind == "link" else 0), read_only(identity())


def _write(out: Array, frame: BlockFrame, tool: BlockFrame, *, turns: bool, sign: float) -> None:
    """Put one joint's column, shape (N, 6), into ``out``."""
    linear, angular = (cross(frame.z, difference(tool.p, frame.p)), frame.z) if turns else (frame.z, _NOTHING)
    write_column(linear, sign, out[:, :3])
    write_column(angular, sign, out[:, 3:])
