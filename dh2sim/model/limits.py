"""Limits of every joint: those of the file, and stated assumptions where it gives none."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.robot.spec import JointType, Row

ASSUMED_TURN_RATE = math.pi
"""rad/s, where a robot file gives no velocity limit of a joint that turns."""
ASSUMED_SLIDE_RATE = 1.0
"""m/s, where it gives none of a joint that slides."""

NO_LENGTH = 1e-9
"""m: what is shorter is rounding, as 0.3 * cos(pi / 2) is, and no measure of a robot's size."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PositionRange:
    """Range of a joint coordinate, rad or m."""

    lower: float
    upper: float
    assumed: bool
    """Whether dh2sim chose it because the robot file gives none."""


def reach_bound(chain: KinematicChain, rows: Sequence[Row]) -> float:
    """Upper bound, m, on the distance of any joint, DH frame or tool0 from base_link's origin.

    The sum of all distances between neighbouring frames; a prismatic joint counts with its largest displacement.
    """
    free = sum(row.type is JointType.PRISMATIC and row.limits.position is None for row in rows)
    return _limited_reach(chain, rows) + free * assumed_travel(chain, rows)


def assumed_travel(chain: KinematicChain, rows: Sequence[Row]) -> float:
    """How far, m, a prismatic joint without limits is assumed to move to either side.

    It is what the rest of the robot reaches, or 1 m if that is nothing.
    """
    reach = _limited_reach(chain, rows)
    return reach if reach > NO_LENGTH else 1.0


def _limited_reach(chain: KinematicChain, rows: Sequence[Row]) -> float:
    lengths: list[float] = []  # from base_link to the joint at hand
    reached = [_length(chain.T_base_link_dh0[:3, 3])]
    for joint, row in zip(chain.joints, rows, strict=True):
        lengths.append(_length(joint.T_parent_joint[:3, 3]))
        if row.type is JointType.PRISMATIC and row.limits.position is not None:
            lengths.append(max(abs(row.limits.position[0]), abs(row.limits.position[1])))
        # a DH frame may stand farther out than the next joint, where conventions are mixed
        reached.append(math.fsum([*lengths, _length(joint.T_joint_dh[:3, 3])]))
    tool = [_length(chain.joints[-1].T_joint_dh[:3, 3]), _length(chain.T_dhn_tool0[:3, 3])]
    return max(*reached, math.fsum([*lengths, *tool]))


def position_range(row: Row, chain: KinematicChain, rows: Sequence[Row]) -> PositionRange | None:
    """Range of a row's coordinate; None for a row that has no limits by its type (continuous, fixed).

    Assumed where the file gives none: ±π, and for prismatic joints ± what the rest of the robot reaches.
    """
    match row.type:
        case JointType.FIXED | JointType.CONTINUOUS:
            return None
        case _ if row.limits.position is not None:
            lower, upper = row.limits.position
            return PositionRange(lower=lower, upper=upper, assumed=False)
        case JointType.REVOLUTE:
            return PositionRange(lower=-math.pi, upper=math.pi, assumed=True)
        case JointType.PRISMATIC:
            travel = assumed_travel(chain, rows)
            return PositionRange(lower=-travel, upper=travel, assumed=True)


def _length(vector: Iterable[float]) -> float:
    x, y, z = (float(component) for component in vector)
    return math.sqrt(x * x + y * y + z * z)
