"""The first and the last frame, and where sliding joints' axes were put, in words."""

from __future__ import annotations

import numpy as np

from dh2sim.imports.explain.links import beginning
from dh2sim.imports.explain.words import degrees, direction, equation, number, place, pose
from dh2sim.imports.placed import PlacedFrames
from dh2sim.kinematics.assignment.findings import BaseRule, SlideRule, TipRule
from dh2sim.kinematics.assignment.tolerances import LOOSE


def axes_words(placed: PlacedFrames) -> str:
    """Return which way every joint's axis points; names are told where they say more than the number."""
    parts = []
    for joint, row in enumerate(placed.spec.rows, start=1):
        name = "" if row.name == f"joint_{joint}" else row.name
        notes = ", ".join(filter(None, (name, "" if row.type.turns else "sliding")))
        i = placed.axis_index(joint)
        shared = f"z{i - 1} and " if 0 < placed.distal == joint - 1 else ""  # the last distal frame stands on it too
        along = direction(placed.axis(joint).direction)
        parts.append(f"{shared}z{i} along {along}{f' ({notes})' if notes else ''}")
    return f"{', '.join(parts)}."


def slide_words(placed: PlacedFrames) -> list[str]:
    """Return a sentence for every sliding joint: where its axis was put, and why."""
    sliding = [joint for joint, row in enumerate(placed.spec.rows, start=1) if not row.type.turns]
    return [_slide(placed, joint, slide.rule) for joint, slide in zip(sliding, placed.assignment.slides, strict=True)]


def _slide(placed: PlacedFrames, joint: int, rule: SlideRule) -> str:
    i = placed.axis_index(joint)
    free = f"Of z{i}, joint {joint} needs the direction only. It is put"
    match rule:
        case SlideRule.NEXT_AXIS:
            return f"{free} on z{placed.following_index(joint)}, which is parallel to it."
        case SlideRule.TIP:
            return f"{free} through tool0, so that the row can lead there."
        case SlideRule.PREVIOUS_AXIS:
            return f"{free} on z{placed.axis_index(joint - 1)}, which is parallel to it."
        case SlideRule.MEETS_BOTH:
            before, behind = placed.axis_index(joint - 1), placed.following_index(joint)
            return f"{free} where it meets both z{before} and z{behind}: a{joint - 1} and a{joint} are zero."
        case SlideRule.PREVIOUS_ORIGIN:
            start = beginning(placed, joint - 1)
            through = start if start.startswith("where") else f"through {start}"
            return f"{free} {through}: a{joint - 1} is zero."
        case SlideRule.BASE_ORIGIN:
            return f"{free} through the origin of base_link."


def base_words(placed: PlacedFrames) -> str:
    """Return how frame 0 came about, and what is left to the base."""
    left = pose(placed.spec.base.pose)
    base = f"Left to base: {left}." if left else "Nothing is left to base."
    return f"{_frame_0(placed)} {base}"


def _frame_0(placed: PlacedFrames) -> str:
    rule, i = placed.assignment.base_rule, placed.axis_index(1)
    T = placed.frames[0]
    if rule is BaseRule.FIRST_LINK:
        a, alpha, _ = placed.link(0)
        return (
            f"It is base_link, for x0 meets z{i} at a right angle: {equation('a0', number(a))} and "
            f"{equation('alpha0', degrees(alpha))} in row 1 lead there."
        )
    z0 = "z0" if i == 0 else f"z0, which lies on z{i},"
    nearest = (
        f"{equation('o0', place(T[:3, 3], placed.reach))} is the point of {z0} nearest to the origin of base_link;"
    )
    x = direction(T[:3, 0])
    match rule:
        case BaseRule.BASE_X if abs(float(T[0, 0]) - 1.0) <= LOOSE:
            how = f"x0 is the base's, {x}."
        case BaseRule.BASE_X:
            how = f"x0, {x}, is as near to the base's x as z0 lets it."
        case BaseRule.BASE_Y:
            how = f"x0 is the base's y, {x}, for z0 is its x."
        case _:
            how = f"x0, {x}, lies along the common normal of the first two axes, for z0 is oblique."
    return f"{nearest} {how}"


def tip_words(placed: PlacedFrames) -> str:
    """Return how frame n came about, and what is left to the tool."""
    left = pose(placed.spec.tool)
    tool = f"Left to tool: {left}." if left else "Nothing is left to tool."
    return f"{_last_frame(placed, 'all but tool0' if left else 'tool0')} {tool}"


def _last_frame(placed: PlacedFrames, tip: str) -> str:
    n = placed.n
    z = f"z{placed.axis_index(n)}"
    match placed.assignment.tip_rule:
        case TipRule.TIP:
            a, alpha, _ = placed.link(n)
            if a == 0.0 and alpha == 0.0:
                return f"tool0 stands on {z}, turned about it: frame {n} is {tip}."
            return f"x of tool0 meets {z} at a right angle, as x{n} has to: frame {n} is {tip}."
        case TipRule.TIP_AXES:
            beside = "antiparallel" if placed.link(n)[1] != 0.0 else "parallel"
            return f"tool0 stands beside {z}, its z {beside} to it: frame {n} has its axes, and its height on {z}."
        case TipRule.TIP_HEIGHT:
            return f"tool0 stands on {z}, turned otherwise than about it: frame {n} has its origin, theta{n} is zero."
        case TipRule.TOOL:
            gap = placed.T_base_tip[:3, 3] - placed.axis(n).foot_of(placed.T_base_tip[:3, 3])
            far = number(float(np.linalg.norm(gap)))
            return f"tool0 stands {far} beside {z}, and no row leads there: frame {n} stays where row {n} begins."
