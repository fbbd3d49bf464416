"""Limits of every joint: those of the file, and stated assumptions where it gives none."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TypeAlias

from dh2sim.kinematics.chain import Joint, KinematicChain
from dh2sim.kinematics.skeleton import Skeleton, build_skeleton
from dh2sim.model.actuators import Duty
from dh2sim.model.mass import MassProperties
from dh2sim.model.shapes import neat
from dh2sim.robot.magnitudes import LENGTH
from dh2sim.robot.row import JointType, Limits, Row
from dh2sim.typing import Array

Range: TypeAlias = tuple[float, float]
"""Lowest and highest value of a joint coordinate or a control."""

ASSUMED_TURN_RATE = math.pi
"""rad/s, where a robot file gives no velocity limit of a joint that turns."""
ASSUMED_SLIDE_RATE = 1.0
"""m/s, where it gives none of a joint that slides."""
ASSUMED_ACCELERATION = 10.0
"""rad/s² or m/s²: an assumed effort limit lifts twice the arm and its payload, stretched, at this acceleration."""
NO_LENGTH = 1e-9
"""m: what is shorter is rounding, as 0.3 * cos(pi / 2) is, and no measure of a robot's size."""


def clamped(value: float, allowed: Range | None) -> float:
    """Return a value moved inside a range; None stands for no limits."""
    return value if allowed is None else min(max(value, allowed[0]), allowed[1])


def travels_of(chain: KinematicChain, rows: Sequence[Row]) -> list[Range]:
    """Return the lowest and highest displacement along +z of every joint, m; (0, 0) of those that do not slide.

    A slide without limits is assumed to move to either side as far as the rest of the robot reaches, or 1 m if that
    is nothing.
    """
    given = [_displacements(joint, row.limits.position) for joint, row in zip(chain.joints, rows, strict=True)]
    if all(given):
        return [travel for travel in given if travel]
    rest = reach_bound(build_skeleton(chain, [travel or (0.0, 0.0) for travel in given]))
    assumed = min(neat(rest), LENGTH.most) if rest > NO_LENGTH else 1.0
    return [travel or (-assumed, assumed) for travel in given]


def _displacements(joint: Joint, span: Range | None) -> Range | None:
    if joint.type is not JointType.PRISMATIC:
        return 0.0, 0.0
    if span is None:
        return None
    ends = (joint.sign * span[0], joint.sign * span[1])
    return min(ends), max(ends)


def reach_bound(skeleton: Skeleton) -> float:
    """Return an upper bound, m, on the distance of tool0 from base_link's origin: the length of the arm, stretched.

    DH frames do not count: a table may put them anywhere along parallel axes.
    """
    return skeleton.taut_length


def frame_extent(chain: KinematicChain, travels: Sequence[Range]) -> float:
    """Return an upper bound, m, on the distance of any joint, DH frame or tool0 from base_link's origin.

    Rounding errors of poses grow with it. It is more than the reach where a table puts its frames far away.
    """
    lengths: list[float] = []  # from base_link to the joint at hand
    reached = [_length(chain.T_base_link_dh0[:3, 3])]
    for joint, travel in zip(chain.joints, travels, strict=True):
        lengths += [_length(joint.T_parent_joint[:3, 3]), max(abs(travel[0]), abs(travel[1]))]
        # a DH frame may be farther out than the next joint, where conventions are mixed
        reached.append(math.fsum([*lengths, _length(joint.T_joint_dh[:3, 3])]))
    tool = [_length(chain.joints[-1].T_joint_dh[:3, 3]), _length(chain.T_dhn_tool0[:3, 3])]
    return max(*reached, math.fsum([*lengths, *tool]))


def position_ranges(rows: Sequence[Row], travels: Sequence[Range]) -> list[Range | None]:
    """Return the range of every row's coordinate, rad or m; None for continuous and fixed rows.

    Assumed where the file gives none: ±π, and the travel of prismatic joints (see ``travels_of``), which is the same
    to both sides.
    """
    assumed = {JointType.REVOLUTE: (-math.pi, math.pi)}
    return [
        row.limits.position or (travel if row.type is JointType.PRISMATIC else assumed.get(row.type))
        for row, travel in zip(rows, travels, strict=True)
    ]


def filled_limits(row: Row, position: Range | None, duty: Duty) -> tuple[Limits, tuple[str, ...]]:
    """Fill in the limits that a row leaves open.

    Args:
        row: The row.
        position: Its range, from ``position_ranges``.
        duty: What the joint is to hold and to move.

    Returns:
        The limits, and which of 'position', 'velocity' and 'effort' were assumed.
    """
    given = row.limits
    velocity, effort = given.velocity, given.effort
    if velocity is None:
        velocity = ASSUMED_TURN_RATE if row.type.turns else ASSUMED_SLIDE_RATE
    if effort is None:
        effort = _round_up(2 * (duty.load + duty.most_inertia * ASSUMED_ACCELERATION)) or 1.0
    filled = replace(given, position=position, velocity=velocity, effort=effort)
    assumed = [
        name
        for name in ("position", "velocity", "effort")
        if getattr(given, name) is None and getattr(filled, name) is not None
    ]
    return filled, tuple(assumed) if row.type.moves else ()


def duty_bounds(
    skeleton: Skeleton, bodies: Sequence[MassProperties | None], gravity: Array
) -> list[tuple[float, float]]:
    """Return upper bounds, in any pose, of what gravity asks of each joint and of the inertia that it moves.

    Args:
        skeleton: Of the arm, n rows.
        bodies: Mass properties of the n links in their joint frames; None for a massless one.
        gravity: m/s² in base_link, shape (3,); where it is zero, the earth's counts.

    Returns:
        n pairs of N·m and kg·m², or N and kg.
    """
    g = _length(gravity) or 9.81
    steps = skeleton.steps
    arms = [0.0 if body is None else math.dist(body.com, skeleton.leaving(k + 1)) for k, body in enumerate(bodies)]
    # no principal moment is more than half of their sum
    own = [0.0 if body is None else 0.5 * math.fsum(float(body.inertia[j, j]) for j in range(3)) for body in bodies]
    bounds = []
    for i, slide in enumerate(skeleton.slides):
        loads, inertias, distance = [], [], 0.0
        for k, body in enumerate(bodies[i:], start=i):
            if k > i:
                distance += steps[k]
            if body is not None:
                arm = distance + arms[k] if slide is None else 1.0
                loads.append(body.mass * g * arm)
                inertias.append(body.mass * arm * arm + (own[k] if slide is None else 0.0))
        bounds.append((math.fsum(loads), math.fsum(inertias)))
    return bounds


def _length(vector: Iterable[float]) -> float:
    x, y, z = (float(component) for component in vector)
    return math.sqrt(x * x + y * y + z * z)


def _round_up(value: float) -> float:
    """Return a value rounded up to two significant digits."""
    if value == 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.ceil(value / unit - 1e-9) * unit:.6g}")
