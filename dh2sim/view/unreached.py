"""A goal that tool0 has not reached: told, and shown."""

from __future__ import annotations

from typing import Final

import numpy as np

from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.view.ghost import Gap
from dh2sim.view.items import Color, Path
from dh2sim.view.readings import difference
from dh2sim.view.solids import position_of
from dh2sim.view.state import Goal, Part, ViewState

_COLOR: Final[Color] = (0.85, 0.20, 0.10)


def told_unreached(state: ViewState) -> str:
    """Return how far tool0 is from where the user has dragged it, a sentence; empty if it is there."""
    goal = _unreached(state)
    if goal is None:
        return ""
    distance, angle = difference(forward_kinematics(state.model.chain, state.q), np.array(goal.T_base_link_tool0))
    gap = Gap(distance=distance, angle=angle)
    return f"The handle is out of reach, or too far for one step: tool0 is {gap.text}."


def line_to_unreached(state: ViewState) -> Path | None:
    """Return a line in base_link from tool0 to where the user has dragged it; None if it is there."""
    goal = _unreached(state)
    if goal is None:
        return None
    tool = position_of(forward_kinematics(state.model.chain, state.q))
    return Path(points=(tool, position_of(np.array(goal.T_base_link_tool0))), color=_COLOR, width=3.0)


def _unreached(state: ViewState) -> Goal | None:
    shown = Part.HANDLE in state.shown and state.goal is not None and not state.goal.reached
    return state.goal if shown else None
