"""A robot of several chains as a tree of joint-placed bodies, with frames by name and the joints that close loops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError, UnknownFrameError
from dh2sim.kinematics.chain import Joint, placed_joints
from dh2sim.kinematics.transforms import compose, identity, joint_part, pose_from_rpy
from dh2sim.messages import did_you_mean, listed, shown
from dh2sim.robot.mechanism import ClosureType
from dh2sim.robot.mechanism_checks import chain_frames
from dh2sim.robot.spec import RobotSpec, SpecLike, spec_of
from dh2sim.typing import Array

BASE = -1
"""Stands for base_link where joints are counted from 0."""


class Frame(NamedTuple):
    """A frame that is fixed in a body."""

    body: int
    """Index of the joint that carries it, or ``BASE``."""
    T_body_frame: Array
    """Its pose in that joint's frame, or in base_link; shape (4, 4)."""


class Closure(NamedTuple):
    """A joint that closes a loop: its axis is the z axis of both frames."""

    name: str
    type: ClosureType
    a: str
    """Name of one frame."""
    b: str
    """Name of the other one, which moves against the first as the type allows."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KinematicTree:
    """Chains of joint-placed bodies, one body for every row: the main chain, then the branches in file order."""

    name: str
    joints: tuple[Joint, ...]
    parents: tuple[int, ...]
    """Index of the joint that each joint is placed in, or ``BASE``; always less than its own."""
    frames: Mapping[str, Frame] = field(repr=False)
    """base_link, link_1 …, dh_0 …, tool0; then rocker/link_1 …, rocker/dh_0 … of each branch."""
    closures: tuple[Closure, ...]
    coordinates: tuple[int, ...]
    """Index of each joint's coordinate in a joint vector, -1 for a joint that is fixed."""

    @property
    def moving_joints(self) -> tuple[Joint, ...]:
        """The joints that have a coordinate, in the order of a joint vector."""
        return tuple(joint for joint in self.joints if joint.type.moves)

    @property
    def n(self) -> int:
        """Number of joint coordinates."""
        return len(self.moving_joints)

    def frame(self, name: str) -> Frame:
        """Return a frame by its name.

        Raises:
            UnknownFrameError: There is none; the text lists the names.
        """
        if name in self.frames:
            return self.frames[name]
        found, hint = (shown(name), did_you_mean(name, self.frames)) if isinstance(name, str) else (repr(name), "")
        raise UnknownFrameError(f"unknown frame {found}.{hint} Frames: {listed(self.frames)}")

    def path(self, body: int) -> tuple[int, ...]:
        """Return the joints from base_link to a body, base first."""
        joints = []
        while body != BASE:
            joints.append(body)
            body = self.parents[body]
        return tuple(reversed(joints))


def build_tree(robot: SpecLike) -> KinematicTree:
    """Turn a robot's tables into a tree of joint-placed bodies; a serial robot's tree has one chain.

    Args:
        robot: The robot; loops are not closed by this.

    Returns:
        One joint for every row; transforms are the same bits on every machine.
    """
    spec = spec_of(robot)
    T_base_link_dh0 = pose_from_rpy(spec.base.pose.xyz, spec.base.pose.rpy)
    joints = list(placed_joints(spec.rows, T_base_link_dh0))
    parents = list(range(BASE, len(joints) - 1))
    T_dhn_tool0 = pose_from_rpy(spec.tool.xyz, spec.tool.rpy)
    frames = _frames("", BASE, T_base_link_dh0, joints, T_dhn_tool0)
    for name, branch in spec.branches.items():
        body, T_body_origin = frames[branch.origin]
        T_body_dh0 = compose(T_body_origin, pose_from_rpy(branch.pose.xyz, branch.pose.rpy))
        chain = placed_joints(branch.rows, T_body_dh0)
        first = len(joints)
        parents += [body, *range(first, first + len(chain) - 1)]
        joints += chain
        frames |= _frames(name, body, T_body_dh0, joints[first:], identity(), first=first)
    return KinematicTree(
        name=spec.name,
        joints=tuple(joints),
        parents=tuple(parents),
        frames=MappingProxyType(frames),
        closures=_closures(spec),
        coordinates=_coordinates(joints),
    )


def _frames(
    branch: str, body: int, T_body_dh0: Array, joints: Sequence[Joint], T_dhn_tool0: Array, *, first: int = 0
) -> dict[str, Frame]:
    """Return the frames of a chain whose joints are counted from ``first``; its DH frame 0 is fixed in ``body``."""
    frames: dict[str, Frame] = {}
    for name, carried in chain_frames(len(joints), branch):
        carrier = first + carried - 1 if carried else body
        kind = name.rpartition("/")[2].partition("_")[0]
        if kind == "dh":
            frames[name] = Frame(carrier, joints[carried - 1].T_joint_dh if carried else T_body_dh0)
        elif kind == "tool0":
            frames[name] = Frame(carrier, compose(joints[-1].T_joint_dh, T_dhn_tool0))
        else:
            frames[name] = Frame(carrier, identity())
    return frames


def _closures(spec: RobotSpec) -> tuple[Closure, ...]:
    return tuple(Closure(each.name, each.type, *each.between) for each in spec.closures)


def _coordinates(joints: Sequence[Joint]) -> tuple[int, ...]:
    count = 0
    indices = []
    for joint in joints:
        indices.append(count if joint.type.moves else -1)
        count += joint.type.moves
    return tuple(indices)


def joint_values(tree: KinematicTree, q: ArrayLike) -> list[float]:
    """Check one joint vector and return its coordinates, rad and m.

    Raises:
        ConfigurationError: It has the wrong shape or is not finite.
    """
    try:
        array = np.asarray(q, dtype=np.float64)
    except (TypeError, ValueError):
        raise ConfigurationError("joint coordinates must be real numbers") from None
    names = ", ".join(joint.name for joint in tree.moving_joints)
    if array.shape != (tree.n,):
        raise ConfigurationError(f"expected {tree.n} joint coordinates ({names}), got shape {array.shape}")
    if not np.isfinite(array).all():
        raise ConfigurationError(f"joint coordinates must be finite ({names}), got {array.tolist()}")
    return [float(value) for value in array]


def body_poses(tree: KinematicTree, q: ArrayLike) -> tuple[Array, ...]:
    """Return the poses of all joint-placed bodies in base_link, the same bits on every machine.

    Args:
        tree: The robot.
        q: Joint vector, rad and m, shape (n,); loops need not be closed.

    Returns:
        One pose of shape (4, 4), read-only, for each row.

    Raises:
        ConfigurationError: ``q`` has the wrong shape or is not finite.
    """
    values = joint_values(tree, q)
    poses: list[Array] = []
    for joint, parent, index in zip(tree.joints, tree.parents, tree.coordinates, strict=True):
        pose = joint.T_parent_joint if parent == BASE else compose(poses[parent], joint.T_parent_joint)
        if index >= 0:
            moved = joint.sign * values[index]
            pose = compose(pose, joint_part(moved, 0.0) if joint.type.turns else joint_part(0.0, moved))
        poses.append(pose)
    return tuple(poses)


def tree_frames(tree: KinematicTree, q: ArrayLike) -> dict[str, Array]:
    """Return the poses of all frames in base_link by name, the same bits on every machine.

    Args:
        tree: The robot.
        q: Joint vector, rad and m, shape (n,): main chain, then branches; loops need not be closed.

    Returns:
        Poses of shape (4, 4), read-only.

    Raises:
        ConfigurationError: ``q`` has the wrong shape or is not finite.
    """
    poses = body_poses(tree, q)
    return {name: placed(poses, frame) for name, frame in tree.frames.items()}


def placed(poses: Sequence[Array], frame: Frame) -> Array:
    """Return the pose in base_link of a frame, given those of the bodies."""
    return frame.T_body_frame if frame.body == BASE else compose(poses[frame.body], frame.T_body_frame)
