"""Whether a published and an imported table describe the same arm."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dh2sim.kinematics.sampling import random_configurations
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.kinematics.transforms import invert, pose_errors, pose_from_rpy, rpy_from_rotation
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from scripts.real_arms.published import Published

CONFIGURATIONS = 1000
SEED = 0
_DECIMALS = 9
"""Of the constant pose between two tools: metres and degrees of fewer are rounding."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Congruence:
    """How far T_published(q) = Rz(turn) T_imported(q) E holds."""

    xyz: Array
    """Position of E, m, shape (3,)."""
    rpy: Array
    """Of E, degrees, shape (3,)."""
    position: float
    """Greatest difference, m."""
    rotation: float
    """Greatest difference, rad."""


def congruence(published: Published, imported: RobotSpec) -> Congruence:
    """Compare the tool's poses of both tables at the same random joint coordinates.

    E is what remains at coordinates zero, rounded; everything else must come out by itself.
    """
    table = published.spec
    bound = np.full(len(imported.rows), math.pi)
    q = random_configurations(-bound, bound, CONFIGURATIONS, SEED)
    T_base = pose_from_rpy(read_only([0, 0, 0]), read_only([0, 0, math.radians(published.turn)]))
    home = np.zeros((1, len(imported.rows)))
    E = invert(T_base @ table_tool_pose(imported, home)[0]) @ table_tool_pose(table, home)[0]
    xyz = _rounded(E[:3, 3])
    rpy = _rounded(np.degrees(rpy_from_rotation(E[:3, :3])))
    E = pose_from_rpy(xyz, np.radians(rpy))
    position, rotation = pose_errors(table_tool_pose(table, q), T_base @ table_tool_pose(imported, q) @ E)
    return Congruence(xyz=xyz, rpy=rpy, position=float(position.max()), rotation=float(rotation.max()))


def _rounded(values: Array) -> Array:
    return read_only(np.round(values, _DECIMALS) + 0.0)
