"""The simplest table that is a chain's within a tolerance."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from dh2sim.kinematics.assignment.assign import assign_frames
from dh2sim.kinematics.assignment.findings import Assignment
from dh2sim.kinematics.assignment.residual import Residual, measure_residual
from dh2sim.kinematics.assignment.rows import frames_on_links, to_spec
from dh2sim.kinematics.assignment.tolerances import Tolerances
from dh2sim.kinematics.serial import SerialChain
from dh2sim.robot.spec import Convention, RobotSpec
from dh2sim.typing import Array

TOLERANCE = 1e-9
"""rad, and m for a reach of up to 1 m, then of the reach: residuals above it are errors."""
CONFIGURATIONS = 1000
_SHARES = (1.0, 0.3, 0.03, 1e-3)
"""Of the tolerance: what a number may be changed by to make it simple, tried in turn."""
_LEAST = 1e-13
"""What a number is changed by at any rate: rounding."""
_TRIALS = 60
"""Configurations at which a choice of tolerances is tried before it is measured at all of them."""
_MARGIN = 0.8
"""Of the tolerance; the rest is for configurations that were not among those."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recovery:
    """A chain's table."""

    spec: RobotSpec
    """Rows, base and tool; joints keep their names and senses. Nothing of links and limits."""
    assignment: Assignment
    """How the frames were chosen."""
    T_link_dh: tuple[Array, ...] = field(repr=False)
    """Pose of DH frame i in link i's own frame, i = 1 … n, each of shape (4, 4)."""
    residual: Residual
    """At 1000 configurations, or fewer where it is above the tolerance."""
    tolerances: Tolerances
    """By what numbers were changed to make them simple."""
    reach: float
    """m: the way along the chain at coordinate zero; residuals are compared with it."""


def recover_table(
    chain: SerialChain,
    *,
    convention: Convention = Convention.STANDARD,
    tolerance: float = TOLERANCE,
    name: str = "robot",
) -> Recovery:
    """Make the Denavit-Hartenberg table of a chain.

    Numbers within the tolerance of a simple value are made simple as long as the whole table stays within it: a large
    share of the tolerance is tried first, then smaller ones.

    Args:
        chain: The chain.
        convention: Standard or modified. Where axes are nearly parallel, rows are Hayati's; of a modified table the
            rows before such a row are then standard ones.
        tolerance: Greatest residual, rad, and m for a reach of up to 1 m, then of the reach.
        name: Of the robot.

    Returns:
        The table with its residual, which can be above the tolerance: compare them.

    Raises:
        ValueError: ``convention`` is Hayati's, which is no convention for a whole table.
    """
    if convention is Convention.HAYATI:
        raise ValueError("a table is made in the standard or the modified convention")
    reach = chain_reach(chain)
    scale = reach or 1.0
    best: Recovery | None = None
    for share in (*_SHARES, 0.0):
        amount = max(share * tolerance, _LEAST)
        tolerances = Tolerances(angle=amount, length=amount * scale if reach < 1.0 else amount, reach=scale)
        found = _recover(chain, convention, tolerances, name)
        if best is None or found.residual.largest < best.residual.largest:
            best = found
        if within(found.residual, tolerance, reach):
            found = replace(found, residual=measure_residual(found.spec, chain, CONFIGURATIONS, scale))
            if within(found.residual, _MARGIN * tolerance, reach):
                return found
    assert best is not None
    return best


def within(residual: Residual, tolerance: float, reach: float) -> bool:
    """Whether a residual is small enough; not where it is NaN."""
    return residual.rotation <= tolerance and residual.position <= tolerance * max(1.0, reach)


def chain_reach(chain: SerialChain) -> float:
    """Return the length of the way from the base over all joints to the tip at coordinate zero, m."""
    place = np.zeros(3)  # of the joint before, in its own link
    lengths = []
    for joint in chain.joints:
        T = joint.T_parent_link
        lengths.append(math.dist(T[:3, :3] @ joint.point + T[:3, 3], place))
        place = joint.point
    lengths.append(math.dist(chain.T_link_tip[:3, 3], place))
    return math.fsum(lengths)


def _recover(chain: SerialChain, convention: Convention, tolerances: Tolerances, name: str) -> Recovery:
    modified = convention is Convention.MODIFIED
    assignment = assign_frames(chain, tolerances, first_link=modified, last_link=not modified)
    if modified and any(part.hayati for part in assignment.links):  # the first row is a distal one then
        assignment = assign_frames(chain, tolerances, first_link=False, last_link=False)
    spec = to_spec(assignment, chain, convention, tolerances, name)
    return Recovery(
        spec=spec,
        assignment=assignment,
        T_link_dh=frames_on_links(assignment, convention),
        residual=measure_residual(spec, chain, _TRIALS, tolerances.reach),
        tolerances=tolerances,
        reach=chain_reach(chain),
    )
