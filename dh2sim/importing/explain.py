"""An assignment of frames explained step by step, as in a textbook: axes, first frame, every link, last frame."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Iterator

import numpy as np

from dh2sim.importing.result import Imported, PlacedFrames, placed_frames
from dh2sim.importing.serial import residual_text
from dh2sim.kinematics.frame_assignment.lines import Case
from dh2sim.kinematics.frame_assignment.result import (
    LOOSE,
    BaseRule,
    FootRule,
    SenseRule,
    SlideRule,
    Step,
    TipRule,
)
from dh2sim.robot.links import Pose
from dh2sim.robot.row import Convention
from dh2sim.typing import Array

GLUE = "\N{NO-BREAK SPACE}"
"""A space at which no line ends, such as those inside a point."""
_LEAST = 1e-9
"""Of the reach: lengths below it are rounding."""
_NEARLY = math.radians(0.5)
"""Directions closer than this to an axis are named as that axis, with the angle between them."""


def number(value: float) -> str:
    """Return a number with at most six significant digits."""
    text = f"{value:.6g}"
    return "0" if float(text) == 0.0 else text


def degrees(angle: float) -> str:
    """Return an angle, given in rad, in degrees."""
    return number(math.degrees(angle))


def apart(angle: float) -> str:
    """Return how two directions lie: ``at right angles`` or ``at 37.3 degrees``; rad."""
    if abs(angle - math.pi / 2) <= LOOSE:
        return "at right angles"
    if math.pi - angle <= _NEARLY:
        return f"at {degrees(math.pi - angle)} degrees to opposite directions"
    return f"at {degrees(angle)} degrees"


def place(point: Array, reach: float) -> str:
    """Return a point as ``(0.4318, 0, 0)``; what is rounding, compared with the reach, is zero."""
    values = [0.0 if abs(value) <= _LEAST * reach else value for value in point.tolist()]
    return _listed(map(number, values))


def direction(vector: Array) -> str:
    """Return a unit vector as ``+x``, ``-z`` or, where it is oblique, as ``(0.6, 0.8, 0)``."""
    largest = int(np.argmax(np.abs(vector)))
    name = f"{'+' if vector[largest] > 0.0 else '-'}{'xyz'[largest]}"
    off = math.asin(min(1.0, float(np.linalg.norm(np.delete(vector, largest)))))
    if off <= LOOSE:
        return name
    if off <= _NEARLY:
        return f"{name} but for {math.degrees(off):.2g} degrees"
    return _listed(number(round(value, 6)) for value in vector.tolist())


def pose(value: Pose) -> str:
    """Return a pose's numbers that are not zero, as ``xyz (0, 0, 0.1), rpy (0, 90, 0)``; empty for the identity."""
    parts = []
    if value.xyz.any():
        parts.append(f"xyz{GLUE}{_listed(map(number, value.xyz.tolist()))}")
    if value.rpy.any():
        parts.append(f"rpy{GLUE}{_listed(map(degrees, value.rpy.tolist()))}")
    return ", ".join(parts)


def equation(name: str, value: str) -> str:
    """Return ``name = value``, kept on one line."""
    return f"{name}{GLUE}={GLUE}{value}"


def _listed(values: Iterable[str]) -> str:
    return f"({f',{GLUE}'.join(values)})"


def link_words(placed: PlacedFrames, joint: int) -> str:
    """Explain frame i: how the axes of joints i and i + 1 lie, and what was chosen.

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
    """Return the name of the point at which the row of a joint begins, on the joint's own axis."""
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
        f"{_x(placed, joint)} lies along the one {_free_foot(placed, joint, step)}. {_end_of_normal(placed, joint)}"
    )


def _coincident(placed: PlacedFrames, joint: int, step: Step) -> str:
    z, following = _z(placed, joint)
    opposite = ", pointing opposite ways" if step.antiparallel else ""
    return (
        f"{z} and {following} are one line{opposite}: frame {joint} may be anywhere on it, turned any way about "
        f"it. {_origin(placed, joint)} is {_free_foot(placed, joint, step)}; {_x(placed, joint)} stays as "
        f"x{joint - 1} is, so that theta{joint} is zero."
    )


def _end_of_normal(placed: PlacedFrames, joint: int) -> str:
    """Return at which end of the common normal frame i is."""
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
            f"Their common normal is {number(step.normal_at)} away, far from the arm, whose reach is "
            f"{number(placed.reach)}."
        )
    start = beginning(placed, joint)
    leads = f"{_x(placed, joint)} leads, normal to {z}, from {start} to {following}, {number(step.distance)} away"
    if step.sense_rule is SenseRule.FREE:
        leads = f"{following} crosses {z} at {start}; {_x(placed, joint)} is normal to {z}"
    return (
        f"{z} and {following} are nearly {'antiparallel' if step.antiparallel else 'parallel'}, {tilt:.3g} degrees "
        f"apart. {why} So row {joint} is Hayati's: {leads}; alpha and beta turn {z} onto {following}. "
        f"{_end_of_normal(placed, joint)}"
    )


def _sense(joint: int, step: Step) -> str:
    match step.sense_rule:
        case SenseRule.LEAST_THETA:
            return ""
        case SenseRule.FREE if step.case is Case.COINCIDENT:  # explained already
            return ""
        case SenseRule.FREE:
            return f"x{joint} stays as x{joint - 1} is, so that theta{joint} is zero."
        case SenseRule.TOWARDS_NEXT:
            return f"Either way theta{joint} is a quarter turn; x{joint} points towards the next axis."
        case SenseRule.QUARTER_TURN:
            return f"Either way theta{joint} is a quarter turn; +90 is taken."


def axes_words(placed: PlacedFrames) -> str:
    """Explain which way every joint's axis points, with the joint's name unless it is the default."""
    parts = []
    for joint, row in enumerate(placed.spec.rows, start=1):
        name = "" if row.name == f"joint_{joint}" else row.name
        notes = ", ".join(filter(None, (name, "" if row.type.turns else "sliding")))
        i = placed.axis_index(joint)
        shared = f"z{i - 1} and " if 0 < placed.distal == joint - 1 else ""  # the last distal frame is on it, too
        along = direction(placed.axis(joint).direction)
        parts.append(f"{shared}z{i} along {along}{f' ({notes})' if notes else ''}")
    return f"{', '.join(parts)}."


def slide_words(placed: PlacedFrames) -> list[str]:
    """Explain for every sliding joint where its axis was put, and why."""
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
    """Explain frame n, and what is left to the tool."""
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
                return f"tool0 is on {z}, turned about it: frame {n} is {tip}."
            return f"x of tool0 meets {z} at a right angle, as x{n} has to: frame {n} is {tip}."
        case TipRule.TIP_AXES:
            beside = "antiparallel" if placed.link(n)[1] != 0.0 else "parallel"
            return f"tool0 is beside {z}, its z {beside} to it: frame {n} has its axes, and its height on {z}."
        case TipRule.TIP_HEIGHT:
            return f"tool0 is on {z}, and not just turned about it: frame {n} has its origin, theta{n} is zero."
        case TipRule.TOOL:
            gap = placed.T_base_tip[:3, 3] - placed.axis(n).foot_of(placed.T_base_tip[:3, 3])
            far = number(float(np.linalg.norm(gap)))
            return f"tool0 is {far} away from {z}, and no row leads there: frame {n} stays where row {n} begins."


WIDTH = 98
"""Columns of a line at most, so that it fits a robot file as a comment."""
_INDENT = 10


def explanation(imported: Imported) -> tuple[str, ...]:
    """Explain how the frames of a robot were assigned.

    The rules are those of ``kinematics.frame_assignment``, the words those of M. W. Spong, S. Hutchinson,
    M. Vidyasagar, Robot Modeling and Control, 2006, section 3.2 (standard), and of J. J. Craig, Introduction to
    Robotics, 3rd ed., 2005, section 3.4 (modified).

    Args:
        imported: A robot made of a chain.

    Returns:
        Lines of plain text, at most 98 columns each: degrees and metres, with six significant digits.

    Raises:
        ValueError: The robot was made of a table, to which no frames were assigned.
    """
    placed = placed_frames(imported)
    lines = _wrapped(_opening(placed))
    for label, text in _paragraphs(imported, placed):
        lines += _wrapped(text, label, _INDENT)
    return tuple(lines)


def _paragraphs(imported: Imported, placed: PlacedFrames) -> Iterator[tuple[str, str]]:
    n = placed.n
    yield "z axes", axes_words(placed)
    yield from (("sliding", sentence) for sentence in slide_words(placed))
    yield "frame 0", base_words(placed)
    for joint in range(1, n):
        yield f"frame {joint}", link_words(placed, joint)
        yield "", numbers(placed, joint)
    yield f"frame {n}", tip_words(placed)
    yield "", numbers(placed, n)
    if imported.residual is not None:
        residual = imported.residual
        yield (
            "residual",
            f"At {residual.configurations} random configurations all joint axes and tool0 differ from the source's "
            f"by at most {residual_text(residual)}.",
        )


def _opening(placed: PlacedFrames) -> str:
    return (
        f"{_convention(placed)} Points and directions are in base_link at joint coordinates zero, in m and degrees "
        "to six digits. x(i) can point two ways; unless stated otherwise, the one with the smaller theta is "
        "taken."
    )


def _convention(placed: PlacedFrames) -> str:
    name = placed.spec.name
    standard = "z(i-1) is the axis of joint i, x(i) lies along the common normal from z(i-1) to z(i)"
    if placed.spec.convention is Convention.STANDARD:
        return f"Frames of {name}, standard convention: {standard}."
    modified = (
        "z(i) is the axis of joint i, x(i) lies along the common normal from z(i) to z(i+1); "
        "a(i) and alpha(i) are in row i+1"
    )
    p = placed.distal
    if p == 0:
        return f"Frames of {name}, modified convention: {modified}."
    rows = "Row 1 ends" if p == 1 else f"Rows 1 to {p} end"
    return (
        f"Frames of {name}. {rows} with the link part, as Hayati's row {p} has to: {standard}. "
        f"The rows behind are modified ones: {modified}."
    )


def _wrapped(text: str, label: str = "", indent: int = 0) -> list[str]:
    lines = textwrap.wrap(
        text,
        WIDTH,
        initial_indent=f"{label:<{indent}}",
        subsequent_indent=" " * indent,
        break_on_hyphens=False,
        break_long_words=False,
    )
    return [line.replace(GLUE, " ") for line in lines]
