"""What a drawing of a robot shows, in three dimensions: frames, lengths of the table, and a place for each joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.draw.frame_figure.scene import SAME, Pointer, Scene, Segment, distinct, pointers_of
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.forward import forward_kinematics, frame_poses
from dh2sim.robot.mechanism import ClosureType
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointPlace:
    """A joint's axis, and where the arm reaches and leaves it."""

    index: int
    """From 1: the row's number, or of a mechanism the joint's in its joint vector."""
    type: JointType
    reached: Array
    """m, shape (3,)."""
    left: Array
    """m, shape (3,)."""
    direction: Array
    """Of the frame's z along the axis, a unit vector, shape (3,)."""
    origin: Array
    """Of that frame, m, shape (3,)."""
    side: Array
    """Of the frame's x, a unit vector, shape (3,)."""
    start: Array
    """Origin of the frame before it, m, shape (3,)."""
    end: Array
    """Origin of its row's frame, m, shape (3,)."""
    driven: bool = False
    """Whether it is among the driven joints of a mechanism."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Path:
    """A line along one chain, from what carries it to its end."""

    start: tuple[Array, ...]
    """m, shape (3,) each."""
    joints: tuple[JointPlace, ...]
    """Of its rows."""
    end: tuple[Array, ...] = ()
    """m, shape (3,) each."""

    @property
    def points(self) -> Array:
        """Origins along it, shape (count, 3)."""
        return np.array([*self.start, *(joint.end for joint in self.joints), *self.end])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClosurePlace:
    """A joint that closes a loop."""

    name: str
    type: ClosureType
    T_base_a: Array
    """Pose of its first frame, shape (4, 4); the joint's axis is z."""
    T_base_b: Array
    """Pose of its second frame, shape (4, 4)."""

    @property
    def middle(self) -> Array:
        """Between the origins of its frames, m, shape (3,)."""
        return np.asarray(0.5 * (self.T_base_a[:3, 3] + self.T_base_b[:3, 3]))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arm:
    """A robot at one configuration."""

    spec: RobotSpec
    frames: Array
    """Poses of DH frames 0 … n in base_link, shape (n + 1, 4, 4)."""
    T_base_tool: Array
    """Pose of tool0 in base_link, shape (4, 4)."""
    joints: tuple[JointPlace, ...]
    """Of every row."""
    segments: tuple[Segment, ...]
    """Lengths that are not zero."""
    reach: float
    """Length of an arm from frame to frame, or the size of a mechanism, m; 1 where all points are one."""
    paths: tuple[Path, ...]
    """The lines along its chains."""
    grounds: tuple[Array, ...]
    """Where what does not move holds it, m."""
    names: tuple[str, ...] = ()
    """Of the frames of a mechanism."""
    closures: tuple[ClosurePlace, ...] = ()
    plates: tuple[Array, ...] = ()
    """Joints and closures of links that have three or more, and tool0 of that which carries it, shape (count, 3)."""

    @property
    def pointers(self) -> tuple[Pointer, ...]:
        """Axes of frames, those that coincide together."""
        return tuple(pointers_of(self.frames, SAME * self.reach))

    @property
    def scene(self) -> Scene:
        """The arm as the choice of a view takes it."""
        return Scene(
            spec=self.spec,
            segments=self.segments,
            axes=(),
            pointers=self.pointers,
            origins=tuple(distinct([T[:3, 3] for T in self.frames], SAME * self.reach)),
            tip=self.T_base_tool[:3, 3],
            last_origin=self.frames[-1][:3, 3],
            extended=(),
        )


def place_arm(spec: RobotSpec, q: ArrayLike) -> Arm:
    """Place a robot's frames, lengths and joints.

    Row i of the standard convention runs along z of frame i - 1 by d and then along x of frame i by a; of the
    modified one along x of frame i - 1 by a and then along z of frame i by d; a Hayati row has no d.

    Args:
        spec: The robot.
        q: Joint vector, rad and m, shape (n,).
    """
    chain = build_chain(spec)
    frames = frame_poses(chain, q)
    tool = forward_kinematics(chain, q)
    points = [np.zeros(3), *(T[:3, 3] for T in frames), tool[:3, 3]]
    reach = float(sum(np.linalg.norm(b - a) for a, b in pairwise(points))) or 1.0
    joints = place_joints(spec.rows, frames, range(1, len(spec.rows) + 1))
    return Arm(
        spec=spec,
        frames=frames,
        T_base_tool=tool,
        joints=joints,
        segments=lengths_of(spec.rows, joints, SAME * reach),
        reach=reach,
        paths=(Path(start=(points[0], points[1]), joints=joints, end=(points[-1],)),),
        grounds=(points[0],),
    )


def place_joints(
    rows: Sequence[Row], frames: Sequence[Array] | Array, numbers: Sequence[int], driven: Sequence[str] = ()
) -> tuple[JointPlace, ...]:
    """Place the joints of a chain.

    Args:
        rows: The chain's rows.
        frames: Poses of its DH frames 0 … n in base_link, shape (4, 4) each.
        numbers: Of the rows.
        driven: Names of joints that are driven.
    """
    joints = []
    for row, number, (before, here) in zip(rows, numbers, pairwise(frames), strict=True):
        start, end = before[:3, 3], here[:3, 3]
        modified = row.convention is Convention.MODIFIED
        axis = here if modified else before
        z = axis[:3, 2]
        if modified:
            reached, left = end - float((end - start) @ z) * z, end
        else:
            reached = start
            left = start + float((end - start) @ z) * z if row.convention is Convention.STANDARD else start
        joints.append(
            JointPlace(
                index=number,
                type=row.type,
                reached=reached,
                left=left,
                direction=z,
                origin=axis[:3, 3],
                side=axis[:3, 0],
                start=start,
                end=end,
                driven=row.name in driven,
            )
        )
    return tuple(joints)


def lengths_of(rows: Sequence[Row], joints: Sequence[JointPlace], least: float) -> tuple[Segment, ...]:
    """Return the lengths of a chain's table that are greater than ``least``, m, its joints being numbered by rows."""
    segments: list[Segment] = []
    for row, joint in zip(rows, joints, strict=True):
        if row.convention is Convention.MODIFIED:
            pieces = (
                ("a", joint.index - 1, joint.start, joint.reached),
                ("d", joint.index, joint.reached, joint.left),
            )
        else:
            pieces = (("d", joint.index, joint.reached, joint.left), ("a", joint.index, joint.left, joint.end))
        segments += [
            Segment(letter=letter, index=index, start=first, end=last)
            for letter, index, first, last in pieces
            if np.linalg.norm(last - first) > least
        ]
    return tuple(segments)
