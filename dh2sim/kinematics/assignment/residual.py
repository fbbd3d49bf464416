"""How far a table is from the chain that it was made from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dh2sim.kinematics.comparison import pose_errors
from dh2sim.kinematics.sampling import random_configurations
from dh2sim.kinematics.serial import SerialChain, serial_link_poses
from dh2sim.kinematics.table import table_frame_poses, table_tool_pose
from dh2sim.robot.spec import Convention, RobotSpec
from dh2sim.typing import Array

SEED = 0
_BLOCK_POSES = 40_000
"""Poses held at a time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Residual:
    """The greatest differences over all configurations, of the joint axes and the tip."""

    position: float
    """m: of the tip, and of a joint's place from its axis in the table."""
    rotation: float
    """rad: of the tip, and of the directions of axes."""
    worst: str
    """The joint, or ``the tip``, where it is greatest, of the larger of the two."""
    configurations: int

    @property
    def largest(self) -> float:
        """The larger number of the two."""
        return max(self.position, self.rotation)


def measure_residual(spec: RobotSpec, chain: SerialChain, configurations: int, slide: float) -> Residual:
    """Compare a table with a chain at random configurations, whatever the joints' limits.

    Both sides are computed straight from their own numbers: the textbooks' matrices of the table's rows, and the
    file's transforms and axes.

    Args:
        spec: The table; one moving row for every joint of the chain, in the same order.
        chain: The chain.
        configurations: How many, drawn with a fixed seed.
        slide: Sliding joints are drawn from this far on both sides of zero, m; turning ones from a whole turn.
    """
    bound = np.array([np.pi if joint.type.turns else slide for joint in chain.joints])
    q = random_configurations(-bound, bound, configurations, SEED)
    block = max(1, _BLOCK_POSES // (chain.n + 2))
    positions, rotations = [], []
    for start in range(0, configurations, block):
        position, rotation = _errors(spec, chain, q[start : start + block])
        positions.append(position)
        rotations.append(rotation)
    position, rotation = np.max(positions, axis=0), np.max(rotations, axis=0)
    names = [*(f"joint '{joint.name}'" for joint in chain.joints), "the tip"]
    return Residual(
        position=float(position.max()),
        rotation=float(rotation.max()),
        worst=names[int(np.argmax(np.maximum(position, rotation)))],
        configurations=configurations,
    )


def _errors(spec: RobotSpec, chain: SerialChain, q: Array) -> tuple[Array, Array]:
    """Return the greatest position and rotation errors of every joint's axis and of the tip, each (n + 1,)."""
    links = serial_link_poses(chain, q)
    frames = table_frame_poses(spec, q)
    position, rotation = np.zeros(chain.n + 1), np.zeros(chain.n + 1)
    moving = [(i, row) for i, row in enumerate(spec.rows) if row.type.moves]
    for k, (joint, (i, row)) in enumerate(zip(chain.joints, moving, strict=True)):
        frame = frames[:, i + 1 if row.convention is Convention.MODIFIED else i]
        z = -frame[:, :3, 2] if row.flip else frame[:, :3, 2]
        axis = links[:, k, :3, :3] @ joint.axis
        rotation[k] = 2.0 * np.arcsin(np.minimum(1.0, 0.5 * np.linalg.norm(axis - z, axis=1))).max()
        if joint.type.turns:
            gap = links[:, k, :3, :3] @ joint.point + links[:, k, :3, 3] - frame[:, :3, 3]
            along = np.sum(gap * z, axis=1, keepdims=True)
            position[k] = np.linalg.norm(gap - along * z, axis=1).max()
    tip_position, tip_rotation = pose_errors(links[:, -1], table_tool_pose(spec, q))
    position[-1], rotation[-1] = tip_position.max(), tip_rotation.max()
    return position, rotation
