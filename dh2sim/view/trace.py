"""Where tool0 has been."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.view.items import Vector
from dh2sim.view.solids import position_of
from dh2sim.view.state import Part, ViewState

LONGEST: Final = 2000
"""Points: older ones are forgotten."""
_NEAR: Final = 1e-3
"""Points nearer to the last one than this share of the reach are left out."""


def traced(before: ViewState, after: ViewState) -> ViewState:
    """Return the state ``after`` with the way of tool0 since ``before``; none where it is not shown, or jumped.

    Another robot begins another trace.
    """
    if Part.TRACE not in after.shown or after.model is not before.model:
        return replace(after, trace=()) if after.trace else after
    if after.q == before.q and after.trace:
        return after
    points = after.trace or (_tool(before),)
    place = _tool(after)
    if math.dist(points[-1], place) <= _NEAR * (after.model.reach or 1.0):
        return after if after.trace else replace(after, trace=points)
    return replace(after, trace=(*points, place)[-LONGEST:])


def _tool(state: ViewState) -> Vector:
    return position_of(forward_kinematics(state.model.chain, state.q))
