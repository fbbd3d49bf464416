"""Poses and Jacobians of a chain's frames, for any number of configurations at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import UnknownFrameError
from dh2sim.kinematics.batch_frame import (
    BLOCK,
    BlockFrame,
    Column,
    cross,
    difference,
    sines_and_cosines,
    write_column,
)
from dh2sim.kinematics.chain import ChainLike, KinematicChain, chain_of, joint_vector, joint_vectors
from dh2sim.kinematics.transforms import compose, identity, joint_part
from dh2sim.messages import did_you_mean, shown
from dh2sim.typing import Array


def forward_kinematics(chain: ChainLike, q: ArrayLike) -> Array:
    """Return the pose of tool0 in base_link.

    Args:
        chain: The robot, in any form.
        q: Joint vectors, rad and m, shape (..., n).

    Returns:
        Shape (..., 4, 4).

    Raises:
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """
    robot = chain_of(chain)
    T_joint_tool0 = compose(robot.joints[-1].T_joint_dh, robot.T_dhn_tool0)

    def fill(out: Array, columns: Array) -> None:
        for frame in joint_frames(robot, columns):
            last = frame
        last.then(T_joint_tool0).write(out)

    return in_blocks(robot, q, (4, 4), fill)


def frame_poses(chain: ChainLike, q: ArrayLike) -> Array:
    """Return the poses of all DH frames in base_link.

    Args:
        chain: The robot, in any form.
        q: Joint vectors, rad and m, shape (..., n).

    Returns:
        Poses of DH frames 0 … number of rows, shape (..., number of rows + 1, 4, 4).

    Raises:
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """
    robot = chain_of(chain)

    def fill(out: Array, columns: Array) -> None:
        out[:, 0] = robot.T_base_link_dh0
        for i, frame in enumerate(joint_frames(robot, columns)):
            frame.then(robot.joints[i].T_joint_dh).write(out[:, i + 1])

    return in_blocks(robot, q, (len(robot.joints) + 1, 4, 4), fill)


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

    def fill(out: Array, columns: Array) -> None:
        for i, frame in enumerate(joint_frames(chain, columns)):
            frame.write(out[:, i])

    return in_blocks(chain, q, (len(chain.joints), 4, 4), fill)


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
    coordinates = iter(joint_vector(chain, q).tolist())
    poses: list[Array] = []
    for joint in chain.joints:
        pose = compose(poses[-1], joint.T_parent_joint) if poses else joint.T_parent_joint
        if joint.type.moves:
            moved = joint.sign * next(coordinates)
            pose = compose(pose, joint_part(moved, 0.0) if joint.type.turns else joint_part(0.0, moved))
        poses.append(pose)
    return tuple(poses)


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


def in_blocks(
    chain: KinematicChain, q: ArrayLike, shape: tuple[int, ...], fill: Callable[[Array, Array], None]
) -> Array:
    """Compute something of ``shape`` for every joint vector, a block at a time.

    Args:
        chain: The robot.
        q: Joint vectors, rad and m, shape (..., n).
        shape: Shape of one result.
        fill: Called with the results of a block, shape (N, *shape), to be filled, and its joint coordinates,
            shape (n, N).

    Returns:
        Shape (..., *shape).

    Raises:
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """
    vectors, batch = joint_vectors(chain, q)
    results = np.empty((len(vectors), *shape))
    for start in range(0, len(vectors), BLOCK):
        block = slice(start, start + BLOCK)
        fill(results[block], np.ascontiguousarray(vectors[block].T))
    return results.reshape(*batch, *shape)


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
    if frame not in names:
        n = len(chain.joints)
        found, hint = (shown(frame), did_you_mean(frame, names)) if isinstance(frame, str) else (repr(frame), "")
        raise UnknownFrameError(
            f"unknown frame {found}.{hint} Frames: base_link, link_1 to link_{n}, dh_0 to dh_{n}, tool0"
        )


def frame_pose(chain: ChainLike, frame: str, q: ArrayLike) -> Array:
    """Return the pose of a named frame in base_link.

    Args:
        chain: The robot, in any form.
        frame: One of ``frame_names``; link_i is at joint i, dh_i is the table's frame i.
        q: Joint vectors, rad and m, shape (..., n).

    Returns:
        Shape (..., 4, 4).

    Raises:
        UnknownFrameError: The frame is unknown.
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """
    robot = chain_of(chain)
    require_frame(robot, frame)
    tool = forward_kinematics(robot, q)
    if frame == "tool0":
        return tool
    if frame == "base_link":
        return np.broadcast_to(identity(), tool.shape).copy()
    kind, index = frame.split("_")
    poses, number = (frame_poses(robot, q), int(index)) if kind == "dh" else (joint_poses(robot, q), int(index) - 1)
    return np.asarray(poses[..., number, :, :])


_NOTHING: Column = (0.0, 0.0, 0.0)


def geometric_jacobian(chain: ChainLike, q: ArrayLike, *, frame: str = "tool0") -> Array:
    """Return the Jacobian of a frame in base_link: [velocity; angular velocity] = J · dq/dt.

    For a joint that turns about the unit axis z through p the column is [z x (p_frame - p); z], for one that
    slides along z it is [z; 0], and for one behind the frame it is zero. Source: M. W. Spong, S. Hutchinson,
    M. Vidyasagar, Robot Modeling and Control, 2006, section 4.6.

    Args:
        chain: The robot, in any form.
        q: Joint vectors, rad and m, shape (..., n).
        frame: One of ``frame_names``.

    Returns:
        Shape (..., 6, n): rows 0-2 velocity of the frame's origin, m/s; rows 3-5 angular velocity, rad/s; both
        along the axes of base_link, for each rad/s or m/s of a joint coordinate.

    Raises:
        UnknownFrameError: The frame is unknown.
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """
    robot = chain_of(chain)
    carriers, T_joint_frame = _place(robot, frame)

    def fill(out: Array, columns: Array) -> None:
        out[...] = 0.0
        frames = list(joint_frames(robot, columns))[:carriers]
        if not frames:
            return
        target = frames[-1].then(T_joint_frame)
        pairs = zip(robot.joints, frames, strict=False)
        for i, (joint, axis) in enumerate(pair for pair in pairs if pair[0].type.moves):
            _write(out[:, :, i], axis, target, turns=joint.type.turns, sign=joint.sign * axis.signs[2])

    return in_blocks(robot, q, (6, robot.n), fill)


def _place(chain: KinematicChain, frame: str) -> tuple[int, Array]:
    """Return how many joints carry a named frame, and its pose in the last of them."""
    require_frame(chain, frame)
    n = len(chain.joints)
    if frame == "tool0":
        return n, compose(chain.joints[-1].T_joint_dh, chain.T_dhn_tool0)
    kind, _, index = frame.partition("_")
    if kind == "dh" and index != "0":
        return int(index), chain.joints[int(index) - 1].T_joint_dh
    return (int(index) if kind == "link" else 0), identity()


def _write(out: Array, frame: BlockFrame, tool: BlockFrame, *, turns: bool, sign: float) -> None:
    """Put one joint's column, shape (N, 6), into ``out``."""
    linear, angular = (cross(frame.z, difference(tool.p, frame.p)), frame.z) if turns else (frame.z, _NOTHING)
    write_column(linear, sign, out[:, :3])
    write_column(angular, sign, out[:, 3:])
