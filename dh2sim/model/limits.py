"""Limits of every joint: those of the file, and stated assumptions where it gives none."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TypeAlias

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.model.mass import MassProperties
from dh2sim.robot.spec import JointType, Limits, Row
from dh2sim.typing import Array

Range: TypeAlias = tuple[float, float]
"""Lowest and highest value of a joint coordinate or a control."""

ASSUMED_TURN_RATE = math.pi
"""rad/s, where a robot file gives no velocity limit of a joint that turns."""
ASSUMED_SLIDE_RATE = 1.0
"""m/s, where it gives none of a joint that slides."""
ASSUMED_ACCELERATION = 10.0
"""rad/s² or m/s²: an assumed effort limit lifts twice the arm's weight, stretched, at this acceleration."""
NO_LENGTH = 1e-9
"""m: what is shorter is rounding, as 0.3 * cos(pi / 2) is, and no measure of a robot's size."""


def clamped(value: float, allowed: Range | None) -> float:
    """Return a value moved inside a range; None stands for no limits."""
    return value if allowed is None else min(max(value, allowed[0]), allowed[1])


def reach_bound(chain: KinematicChain, rows: Sequence[Row]) -> float:
    """Return an upper bound, m, on the distance of any joint, DH frame or tool0 from base_link's origin.

    The sum of all distances between neighbouring frames; a prismatic joint counts with its largest displacement.
    """
    free = sum(row.type is JointType.PRISMATIC and row.limits.position is None for row in rows)
    return _limited_reach(chain, rows) + free * _assumed_travel(chain, rows)


def _assumed_travel(chain: KinematicChain, rows: Sequence[Row]) -> float:
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
            lengths.append(_greatest(row.limits.position))
        # a DH frame may be farther out than the next joint, where conventions are mixed
        reached.append(math.fsum([*lengths, _length(joint.T_joint_dh[:3, 3])]))
    tool = [_length(chain.joints[-1].T_joint_dh[:3, 3]), _length(chain.T_dhn_tool0[:3, 3])]
    return max(*reached, math.fsum([*lengths, *tool]))


def position_ranges(chain: KinematicChain, rows: Sequence[Row]) -> list[Range | None]:
    """Return the range of every row's coordinate, rad or m; None for continuous and fixed rows.

    Assumed where the file gives none: ±π, and for prismatic joints ± what the rest of the robot reaches.
    """
    travel = _assumed_travel(chain, rows)
    assumed = {JointType.REVOLUTE: (-math.pi, math.pi), JointType.PRISMATIC: (-travel, travel)}
    return [row.limits.position or assumed[row.type] if row.type in assumed else None for row in rows]


def filled_limits(row: Row, position: Range | None, load: float, inertia: float) -> tuple[Limits, tuple[str, ...]]:
    """Fill in the limits that a row leaves open.

    Args:
        row: The row.
        position: Its range, from ``position_ranges``.
        load: What gravity asks of the joint at most, N·m or N.
        inertia: What the joint moves at home, kg·m² or kg.

    Returns:
        The limits, and which of 'position', 'velocity' and 'effort' were assumed.
    """
    given = row.limits
    velocity, effort = given.velocity, given.effort
    if velocity is None:
        velocity = ASSUMED_TURN_RATE if row.type.turns else ASSUMED_SLIDE_RATE
    if effort is None:
        effort = _round_up(2 * (load + inertia * ASSUMED_ACCELERATION)) or 1.0
    filled = replace(given, position=position, velocity=velocity, effort=effort)
    assumed = [
        name
        for name in ("position", "velocity", "effort")
        if getattr(given, name) is None and getattr(filled, name) is not None
    ]
    return filled, tuple(assumed) if row.type.moves else ()


def load_bound(
    i: int,
    chain: KinematicChain,
    ranges: Sequence[Range | None],
    bodies: Sequence[MassProperties | None],
    gravity: Array,
) -> float:
    """Return an upper bound of what gravity asks of joint ``i``, counted from 0, in any pose, N·m or N.

    Args:
        i: The joint.
        chain: The chain, n rows.
        ranges: Of the n coordinates, rad or m.
        bodies: Mass properties of the n links in their joint frames; None for a massless one.
        gravity: m/s² in base_link, shape (3,); where it is zero, the earth's counts.
    """
    g = _length(gravity) or 9.81
    terms, distance = [], 0.0
    for joint, span, body in zip(chain.joints[i:], ranges[i:], bodies[i:], strict=True):
        if joint is not chain.joints[i]:
            distance += _length(joint.T_parent_joint[:3, 3])
            if joint.type is JointType.PRISMATIC and span is not None:
                distance += _greatest(span)
        if body is not None:
            arm = distance + _length(body.com) if chain.joints[i].type.turns else 1.0
            terms.append(body.mass * g * arm)
    return math.fsum(terms)


def _greatest(span: Range) -> float:
    return max(abs(span[0]), abs(span[1]))


def _length(vector: Iterable[float]) -> float:
    x, y, z = (float(component) for component in vector)
    return math.sqrt(x * x + y * y + z * z)


def _round_up(value: float) -> float:
    """Return a value rounded up to two significant digits."""
    if value == 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.ceil(value / unit - 1e-9) * unit:.6g}")
