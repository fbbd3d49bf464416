"""What a drawing of a robot shows, in three dimensions: frames, lengths of the table, and a place for each joint."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.draw.frame_figure.scene import SAME, Pointer, Scene, Segment, distinct, pointers_of
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.forward import forward_kinematics, frame_poses
from dh2sim.robot.spec import Convention, JointType, RobotSpec
from dh2sim.typing import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointPlace:
    """A joint's axis, and where the arm reaches and leaves it."""

    index: int
    """From 1, the row's number."""
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
    """Greatest distance between points of the arm along it, m; 1 where all are one."""

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
    joints, segments = [], []
    for i, row in enumerate(spec.rows, start=1):
        before, here = frames[i - 1], frames[i]
        start, end = before[:3, 3], here[:3, 3]
        modified = row.convention is Convention.MODIFIED
        axis = here if modified else before
        z = axis[:3, 2]
        if modified:
            corner = end - float((end - start) @ z) * z
            pieces, ends = (("a", i - 1, start, corner), ("d", i, corner, end)), (corner, end)
        else:
            corner = start + float((end - start) @ z) * z if row.convention is Convention.STANDARD else start
            pieces, ends = (("d", i, start, corner), ("a", i, corner, end)), (start, corner)
        joints.append(
            JointPlace(
                index=i,
                type=row.type,
                reached=ends[0],
                left=ends[1],
                direction=z,
                origin=axis[:3, 3],
                side=axis[:3, 0],
            )
        )
        segments += [
            Segment(letter=letter, index=index, start=first, end=last)
            for letter, index, first, last in pieces
            if np.linalg.norm(last - first) > SAME * reach
        ]
    return Arm(
        spec=spec, frames=frames, T_base_tool=tool, joints=tuple(joints), segments=tuple(segments), reach=reach
    )
