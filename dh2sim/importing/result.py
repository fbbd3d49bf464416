"""The result of an import, whatever the format, and its assigned frames placed at a configuration."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.importing.mechanics import MechanicsResidual
from dh2sim.kinematics.frame_assignment.lines import Line
from dh2sim.kinematics.frame_assignment.recover import Residual, bounded_reach
from dh2sim.kinematics.frame_assignment.result import Assignment
from dh2sim.kinematics.serial_chain import SerialChain
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Imported:
    """A robot file made from another source, and how it was made."""

    text: str = field(repr=False)
    """The robot file."""
    spec: RobotSpec
    """The robot, read back from the text."""
    notes: tuple[str, ...]
    """What was chosen, changed or left out, one sentence each."""
    residual: Residual | None = None
    """Measured on the text; None where there is no other kinematics to compare with."""
    mechanics: MechanicsResidual | None = None
    """Of the masses; None where the source gives none."""
    chain: SerialChain | None = field(default=None, repr=False)
    """The source's own kinematics."""
    assignment: Assignment | None = field(default=None, repr=False)
    """How the frames were assigned."""

    def __repr__(self) -> str:
        return f"<Imported '{self.spec.name}': {len(self.spec.rows)} rows, {len(self.notes)} notes>"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedFrames:
    """A table's frames at one configuration, with the indices that its convention gives to axes and numbers."""

    spec: RobotSpec
    """Every row of it moves."""
    assignment: Assignment
    frames: Array = field(repr=False)
    """Poses of DH frames 0 … n in base_link, shape (n + 1, 4, 4)."""
    T_base_tip: Array = field(repr=False)
    """Pose of tool0 in base_link, shape (4, 4)."""
    reach: float
    """Of the chain, m, greater than 0."""

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.spec.rows)

    @property
    def distal(self) -> int:
        """How many rows, from the first on, have their link part behind the joint; the others are modified ones."""
        return sum(row.convention is not Convention.MODIFIED for row in self.spec.rows)

    def axis_index(self, joint: int) -> int:
        """Return the i of the z_i that lies along the axis of a joint, counted from 1."""
        return joint - 1 if joint <= self.distal else joint

    def following_index(self, joint: int) -> int:
        """Return the i of the z_i along the next joint's axis, as the link between the two sees it."""
        return self.axis_index(joint) + 1

    def axis(self, joint: int) -> Line:
        """Return a joint's axis in base_link, the joint counted from 1."""
        T = self.frames[self.axis_index(joint)]
        return Line(point=T[:3, 3], direction=T[:3, 2])

    def link(self, index: int) -> tuple[float, float, float]:
        """Return a, alpha and beta of X_index, 0 … n, from the row that holds them; m and rad."""
        if index == 0:
            row = self.spec.rows[0] if self.distal == 0 else None
        elif index <= self.distal:
            row = self.spec.rows[index - 1]
        else:
            row = self.spec.rows[index] if index < self.n else None
        return (0.0, 0.0, 0.0) if row is None else (row.a, row.alpha, row.beta)

    def normal(self, joint: int) -> Array:
        """Return the x of X_i, the link part of joint i; that is x_i but for the second twist of a Hayati row.

        Returns:
            Unit vector in base_link, shape (3,).
        """
        T, (_, _, beta) = self.frames[joint], self.link(joint)
        return np.asarray(math.cos(beta) * T[:3, 0] + math.sin(beta) * T[:3, 2])

    def foot(self, joint: int) -> Array:
        """Return where x of a joint's link starts on the joint's own axis, in base_link, m, shape (3,)."""
        origin: Array = self.frames[joint][:3, 3]
        return self.axis(joint).foot_of(origin) if joint <= self.distal else origin


def placed_frames(imported: Imported, q: ArrayLike | None = None) -> PlacedFrames:
    """Place the frames that an import assigned.

    Args:
        imported: An import with a chain: not of a table.
        q: Joint vector, rad and m, shape (n,); by default zero.

    Raises:
        ValueError: The import was of a table, for which no frames were assigned.
    """
    if imported.assignment is None or imported.chain is None:
        raise ValueError("frames were not assigned: the source is a table")
    spec = imported.spec
    vector = np.zeros(len(spec.rows)) if q is None else np.asarray(q, dtype=np.float64)
    return PlacedFrames(
        spec=spec,
        assignment=imported.assignment,
        frames=read_only(table_frame_poses(spec, vector)),
        T_base_tip=read_only(table_tool_pose(spec, vector)),
        reach=bounded_reach(imported.chain) or 1.0,
    )
