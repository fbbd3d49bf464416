"""Forward kinematics of a chain, for any number of configurations at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.block import BLOCK, BlockFrame, sines_and_cosines
from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.configurations import joint_vectors
from dh2sim.kinematics.transforms import compose, joint_part
from dh2sim.typing import Array


def forward_kinematics(chain: KinematicChain, q: ArrayLike) -> Array:
    """Return the pose of tool0 in base_link.

    Args:
        chain: The robot.
        q: Joint vectors, rad and m, shape (..., n).

    Returns:
        Shape (..., 4, 4).

    Raises:
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """
    T_joint_tool0 = compose(chain.joints[-1].T_joint_dh, chain.T_dhn_tool0)

    def fill(out: Array, columns: Array) -> None:
        for frame in joint_frames(chain, columns):
            last = frame
        last.then(T_joint_tool0).write(out)

    return in_blocks(chain, q, (4, 4), fill)


def frame_poses(chain: KinematicChain, q: ArrayLike) -> Array:
    """Return the poses of all DH frames in base_link.

    Args:
        chain: The robot.
        q: Joint vectors, rad and m, shape (..., n).

    Returns:
        Poses of DH frames 0 … number of rows, shape (..., number of rows + 1, 4, 4).

    Raises:
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """

    def fill(out: Array, columns: Array) -> None:
        out[:, 0] = chain.T_base_link_dh0
        for i, frame in enumerate(joint_frames(chain, columns)):
            frame.then(chain.joints[i].T_joint_dh).write(out[:, i + 1])

    return in_blocks(chain, q, (len(chain.joints) + 1, 4, 4), fill)


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
    vectors, batch = joint_vectors(chain, q)
    if batch:
        raise ConfigurationError(f"expected one joint vector of shape ({chain.n},), got shape {np.shape(q)}")
    coordinates = iter(vectors[0].tolist())
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
