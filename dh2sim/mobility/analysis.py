"""The analysis of a mechanism's mobility: counted, instantaneous, finite, and what makes the difference."""

from __future__ import annotations

import numpy as np

from dh2sim.mobility.constraints import LoopEquations, Rank, rank_of
from dh2sim.mobility.count import count_freedoms
from dh2sim.mobility.mechanism import Mechanism
from dh2sim.mobility.redundancy import IdleFreedom, idle_freedoms, redundant_joints, redundant_limbs
from dh2sim.mobility.result import Actuation, Mobility
from dh2sim.mobility.walk import walk


def mobility_of(mechanism: Mechanism) -> Mobility:
    """Count the degrees of freedom of a mechanism, and find out what they are.

    Position limits and collisions are not looked at.

    Args:
        mechanism: As it is at the assembly, where every loop is closed.

    Returns:
        Gruebler's count; the instantaneous mobility, by the rank of the loops' constraints; the finite one, by
        walking along them; and which links and joints make the difference.
    """
    count = count_freedoms(mechanism)
    equations = LoopEquations(mechanism)
    rank = rank_of(equations.jacobian(np.zeros(mechanism.freedoms)))
    independent = rank.rank == sum(count.loop_dimensions)
    walked = None if independent else walk(equations, rank)
    finite = rank.mobility if walked is None else walked.dimension
    idle = idle_freedoms(mechanism)
    return Mobility(
        mechanism=mechanism,
        count=count,
        rank=rank,
        finite=finite,
        walk=walked,
        redundant_joints=() if independent else redundant_joints(mechanism, rank.mobility),
        redundant_limbs=redundant_limbs(mechanism, finite) if finite > count.by_loop else (),
        idle=idle,
        actuation=_actuation(mechanism, rank, idle),
    )


def _actuation(mechanism: Mechanism, rank: Rank, idle: tuple[IdleFreedom, ...]) -> Actuation | None:
    """Return what is left of the velocities at the assembly when the driven joints are held."""
    if mechanism.actuated is None:
        return None
    driven = np.array([mechanism.joints[owner].name in mechanism.actuated for owner in mechanism.owners])
    held = np.linalg.matrix_rank(rank.motions[:, driven], tol=1e-6) if rank.mobility and driven.any() else 0
    return Actuation(
        joints=mechanism.actuated,
        freedoms=int(driven.sum()),
        free=rank.mobility - int(held) - len(idle),
    )
