"""What was decided between a joint's axis and the next one, in words."""

from __future__ import annotations

import math

from dh2sim.imports.explain.words import apart, degrees, direction, equation, number, place
from dh2sim.imports.placed import PlacedFrames
from dh2sim.kinematics.assignment.findings import BaseRule, FootRule, SenseRule, Step
from dh2sim.kinematics.assignment.lines import Case
from dh2sim.kinematics.assignment.tolerances import FAR, LOOSE
from dh2sim.robot.spec import Convention


def link_words(placed: PlacedFrames, joint: int) -> str:
    """Return how frame i came about: how the axes of joints i and i + 1 lie, and what was chosen.

    Args:
        placed: The frames at joint coordinates zero.
        joint: The i, from 1 to n - 1.
    """
    step = placed.assignment.steps[joint - 1]
    match step.case:
        case Case.INTERSECTING:
            words = _intersecting(placed, joint, step)
        case Case.SKEW:
            words = _skew(placed, joint, step)
        case Case.PARALLEL:
            words = _parallel(placed, joint, step)
        case Case.COINCIDENT:
            words = _coincident(placed, joint, step)
        case Case.NEARLY_PARALLEL:
            words = _nearly_parallel(placed, joint, step)
    return f"{words} {_sense(joint, step)}".rstrip()


def numbers(placed: PlacedFrames, joint: int) -> str:
    """Return theta_i and d_i at joint coordinate zero, and a_i, alpha_i and beta_i where a row holds them."""
    i, row = joint, placed.spec.rows[joint - 1]
    hayati = row.convention is Convention.HAYATI
    parts = [equation(f"theta{i}", degrees(row.theta))]
    if not hayati:
        parts.append(equation(f"d{i}", number(row.d)))
    if joint < placed.n or joint <= placed.distal:
        a, alpha, beta = placed.link(joint)
        parts += [equation(f"a{i}", number(a)), equation(f"alpha{i}", degrees(alpha))]
        if hayati:
            parts.append(equation(f"beta{i}", degrees(beta)))
    return f"{', '.join(parts)}."


def beginning(placed: PlacedFrames, joint: int) -> str:
    """Return what the point is called where the row of a joint begins, on the joint's own axis."""
    if joint == 1:
        leads = placed.assignment.base_rule is BaseRule.FIRST_LINK
        return f"where x0 meets z{placed.axis_index(1)}" if leads else "o0"
    if joint <= placed.distal + 1:
        return f"o{joint - 1}"
    return f"where x{joint - 1} meets z{joint}"


def _z(placed: PlacedFrames, joint: int) -> tuple[str, str]:
    return f"z{placed.axis_index(joint)}", f"z{placed.following_index(joint)}"


def _x(placed: PlacedFrames, joint: int) -> str:
    return f"x{joint}, {direction(placed.normal(joint))},"


def _origin(placed: PlacedFrames, joint: int) -> str:
    return equation(f"o{joint}", place(placed.frames[joint][:3, 3], placed.reach))


def _intersecting(placed: PlacedFrames, joint: int, step: Step) -> str:
    z, following = _z(placed, joint)
    a = placed.link(joint)[0]
    but = f" (but for {number(abs(a))})" if a != 0.0 else ""
    return (
        f"{z} and {following} intersect {apart(step.angle)}{but}, at {_origin(placed, joint)}. "
        f"{_x(placed, joint)} is normal to both."
    )


def _skew(placed: PlacedFrames, joint: int, step: Step) -> str:
    z, following = _z(placed, joint)
    foot, a = placed.foot(joint), placed.link(joint)[0]
    if joint <= placed.distal:
        ends = f"from {place(foot, placed.reach)} on {z} to {_origin(placed, joint)} on {following}"
    else:
        next_foot = foot + a * placed.frames[joint][:3, 0]
        ends = f"between {_origin(placed, joint)} on {z} and {place(next_foot, placed.reach)} on {following}"
    return (
        f"{z} and {following} are skew, {apart(step.angle)}, {number(step.distance)} apart. {_x(placed, joint)} lies "
        f"along their common normal, {ends}."
    )


def _parallel(placed: PlacedFrames, joint: int, step: Step) -> str:
    z, following = _z(placed, joint)
    how = "antiparallel" if step.antiparallel else "parallel"
    return (
        f"{z} and {following} are {how}, {number(step.distance)} apart, so that any common normal would do. "
        f"{_x(placed, joint)} lies along the one {_free_foot(placed, joint, step)}. {_stand(placed, joint)}"
    )


def _coincident(placed: PlacedFrames, joint: int, step: Step) -> str:
    z, following = _z(placed, joint)
    opposite = ", pointing opposite ways" if step.antiparallel else ""
    return (
        f"{z} and {following} are one line{opposite}: frame {joint} may stand anywhere on it, turned any way about "
        f"it. {_origin(placed, joint)} is {_free_foot(placed, joint, step)}; {_x(placed, joint)} stays as "
        f"x{joint - 1} is, so that theta{joint} is zero."
    )


def _stand(placed: PlacedFrames, joint: int) -> str:
    """At which end of the common normal frame i stands."""
    on = placed.following_index(joint) if joint <= placed.distal else placed.axis_index(joint)
    return f"On z{on}: {_origin(placed, joint)}."


def _free_foot(placed: PlacedFrames, joint: int, step: Step) -> str:
    if step.foot_rule is FootRule.NEXT_JOINT:
        height = f"at the height of joint {joint + 1}"
        return f"{height}, which d1 then holds" if joint == 1 else f"{height}, from where that slides"
    start = beginning(placed, joint)
    return f"{start if start.startswith('where') else f'at {start}'}, so that d{joint} is zero"


def _nearly_parallel(placed: PlacedFrames, joint: int, step: Step) -> str:
    z, following = _z(placed, joint)
    tilt = math.degrees(math.pi - step.angle if step.antiparallel else step.angle)
    if step.normal_at is None:
        why = f"That is below {LOOSE:.0e} rad, so that noise would decide where their common normal is."
    else:
        why = (
            f"Their common normal is {number(step.normal_at)} away, more than {FAR:.0f} times the reach of "
            f"{number(placed.reach)}."
        )
    start = beginning(placed, joint)
    leads = f"{_x(placed, joint)} leads, normal to {z}, from {start} to {following}, {number(step.distance)} away"
    if step.sense_rule is SenseRule.FREE:
        leads = f"{following} crosses {z} at {start}; {_x(placed, joint)} is normal to {z}"
    return (
        f"{z} and {following} are nearly {'antiparallel' if step.antiparallel else 'parallel'}, {tilt:.3g} degrees "
        f"apart. {why} So row {joint} is Hayati's: {leads}; alpha and beta turn {z} onto {following}. "
        f"{_stand(placed, joint)}"
    )


def _sense(joint: int, step: Step) -> str:
    match step.sense_rule:
        case SenseRule.LEAST_THETA:
            return ""
        case SenseRule.FREE if step.case is Case.COINCIDENT:  # told already
            return ""
        case SenseRule.FREE:
            return f"x{joint} stays as x{joint - 1} is, so that theta{joint} is zero."
        case SenseRule.TOWARDS_NEXT:
            return f"Either way theta{joint} is a quarter turn; x{joint} points towards the next axis."
        case SenseRule.QUARTER_TURN:
            return f"Either way theta{joint} is a quarter turn; +90 is taken."
