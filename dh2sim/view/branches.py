"""All ways of a robot to hold its tool where it is: what a page lists and draws pale beside it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dh2sim.inverse.branches import branch_names
from dh2sim.inverse.goals import Free
from dh2sim.inverse.solver import InverseSolver
from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.model.robot_model import RobotModel
from dh2sim.view.state import ViewState, within

SAME: float = 1e-5
"""Coordinates that differ by less, rad and m, are the same: a page's own are rounded."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Branch:
    """A configuration that reaches the pose of tool0."""

    q: tuple[float, ...]
    """rad and m, inside the limits."""
    name: str
    """Empty where no name applies."""
    here: bool
    """Whether the robot is there, whole turns aside."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Branches:
    """What reaches a pose."""

    branches: tuple[Branch, ...]
    """In an order that does not depend on which of them the robot is in."""
    locked: tuple[str, ...]
    """Joints that stay where they are, as there is one to spare."""
    point_only: bool
    """Whether only the origin of tool0 is held: an arm of few joints has one orientation there in each branch."""


def branch_name_of(state: ViewState) -> str:
    """Return the name of the branch that the robot is in; empty where no name applies."""
    return branch_names(state.model.chain, [state.q])[0] if state.q else ""


def branches_of(state: ViewState) -> Branches:
    """Return all configurations inside the limits that hold tool0 where it is, one of those that differ by turns."""
    return _branches_of(state.model, state.q)


@lru_cache(maxsize=8)  # the scene and the panel ask for the same
def _branches_of(model: RobotModel, q: tuple[float, ...]) -> Branches:
    if not q:
        return Branches(branches=(), locked=(), point_only=False)
    solver = InverseSolver(model)
    point_only = model.chain.n <= 3 and not solver.joints_to_lock("rotation")
    free: Free | None = "rotation" if point_only else None
    spare = solver.joints_to_lock(free)
    names = [joint.name for joint in model.moving_joints]
    lock = {name: q[names.index(name)] for name in spare}
    T = forward_kinematics(model.chain, q)
    # sorted by distance from home, not from where the robot is: the list stays while it is clicked through
    found = solver.solve(T, model.home, lock=lock, free=free)
    turns = np.array([joint.type.turns for joint in model.moving_joints])
    branches, seen = [], set()
    for vector, name, number in zip(found.q, found.branch, found.same.tolist(), strict=True):
        if number not in seen:
            seen.add(number)
            gaps = np.where(turns, (vector - q + np.pi) % (2.0 * np.pi) - np.pi, vector - q)
            here = bool(np.abs(gaps).max() <= SAME)
            branches.append(Branch(q=q if here else within(model, tuple(vector.tolist())), name=name, here=here))
    return Branches(branches=tuple(branches), locked=spare, point_only=point_only)
