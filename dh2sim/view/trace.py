"""Where tool0 has been."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.kinematics.transforms import compose
from dh2sim.view.items import Vector
from dh2sim.view.solids import position_of
from dh2sim.view.state import Part, ViewState

LONGEST: Final = 2000
"""Points: older ones are forgotten."""
_NEAR: Final = 1e-3
"""Points nearer to the last one than this share of the reach are left out."""


def traced(before: ViewState, after: ViewState) -> ViewState:
    """Return the state ``after`` with the way of tool0, in the world, since ``before``; none where it is not shown.

    Another robot begins another trace, and so does a base that goes where it was before a recording.
    """
    moved = after.T_world_base_link != before.T_world_base_link
    brought_back = moved and after.mode is not before.mode
    if Part.TRACE not in after.shown or after.model is not before.model or brought_back:
        return replace(after, trace=()) if after.trace else after
    if after.q == before.q and not moved and after.trace:
        return after
    points = after.trace or (_tool(before),)
    place = _tool(after)
    if math.dist(points[-1], place) <= _NEAR * (after.model.reach or 1.0):
        return after if after.trace else replace(after, trace=points)
    return replace(after, trace=(*points, place)[-LONGEST:])


def _tool(state: ViewState) -> Vector:
    T_base_tool = forward_kinematics(state.model.chain, state.q)
    if not state.floats:
        return position_of(T_base_tool)
    return position_of(compose(np.array(state.T_world_base_link), T_base_tool))
