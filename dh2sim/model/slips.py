"""Likely slips in a robot: numbers that are allowed, but rarely meant.

Degrees in a file of radians, millimetres in a file of metres, a right angle rounded to 1.57, a table of the other
convention: all of them describe a robot, though seldom the one on the desk. Nothing here is an error unless somebody
asks for that (``--strict``).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum

from dh2sim.errors import Problem
from dh2sim.kinematics.far_frames import far_frames
from dh2sim.messages import Loc, loc_of, path_of
from dh2sim.model.build import model_of
from dh2sim.model.limits import NO_LENGTH
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.read import place_in
from dh2sim.robot.row import Convention, Row
from dh2sim.robot.spec import RobotSpec, SpecLike
from dh2sim.robot.units import AngleUnit, LengthUnit

TURN = 2 * math.pi
MOST_TURNS = 4
"""Limits beyond as many turns are noted: cables stand no more."""
LONGEST_REACH = 50.0
"""m."""
SHORTEST_REACH = 0.01
"""m."""
GREATEST_MASS = 1e5
"""kg."""
_NEAR = 3e-3
"""Greatest difference between pi/2 or another part of a turn and the two or three digits that people type of it."""
_MOST_DECIMALS = 10
"""A right angle in rad with more decimals is as exact as can be expected."""


class SlipKind(StrEnum):
    """What looks like a slip."""

    DEGREES = "degrees-in-rad"
    RADIANS = "radians-in-deg"
    ROUNDED = "rounded-right-angle"
    LIMITS = "limits-beyond-turns"
    REACH = "unlikely-reach"
    MASS = "unlikely-mass"
    CONVENTION = "other-convention"
    FAR_FRAMES = "far-frames"


@dataclass(frozen=True, slots=True, kw_only=True, order=True)
class Slip(Problem):
    """A likely slip, and where it is; ``message`` says what was found and what may be meant."""

    kind: SlipKind

    def to_json(self) -> dict[str, str | int]:
        """Return it as reports list it, without a place that it does not have."""
        place: dict[str, str | int] = {"file": self.file, "line": self.line, "column": self.column}
        found: dict[str, str | int] = {"rule": self.kind.value, "path": self.path, "message": self.message}
        return {**found, **place} if self.file else found


def find_slips(robot: SpecLike) -> tuple[Slip, ...]:
    """Return what looks like a slip in a robot, in the order of its file.

    Args:
        robot: The robot. In one that was read from a file, slips have their line and column.

    Raises:
        Dh2simError: The robot has no model; see ``build_model``.
    """
    model = model_of(robot)
    found = [
        Slip(kind=kind, path=path_of(loc), message=message)
        for search in (_angles, _limits, _convention, _frames, _size)
        for kind, loc, message in search(model)
    ]
    return _placed(found, model.spec)


_Found = tuple[SlipKind, Loc, str]


def _placed(slips: list[Slip], spec: RobotSpec) -> tuple[Slip, ...]:
    """Give slips their places in the file, of which each has the nearest that is written there."""
    source = spec.source_file
    if source is None or not slips:
        return tuple(slips)
    placed = []
    for slip in slips:
        line, column = place_in(source, loc_of(slip.path))
        placed.append(replace(slip, file=source.path, line=line, column=column))
    return tuple(sorted(placed))


# ---------------------------------------------------------------------------- angles


def _table_angles(spec: RobotSpec) -> Iterator[tuple[Loc, float]]:
    """Yield every angle of the table, rad, with its place."""
    for index, row in enumerate(spec.rows):
        for key in ("alpha", "theta", "beta"):
            yield ("joints", index, key), getattr(row, key)
    for part, pose in (("base", spec.base.pose), ("tool", spec.tool)):
        for k, angle in enumerate(pose.rpy):
            yield (part, "rpy", k), float(angle)


def _limit_angles(spec: RobotSpec) -> Iterator[tuple[Loc, float]]:
    """Yield both position limits, rad, of every joint that turns."""
    for index, row in enumerate(spec.rows):
        if row.type.turns and row.limits.position is not None:
            for k, angle in enumerate(row.limits.position):
                yield ("joints", index, "limits", "position", k), angle


def _angles(model: RobotModel) -> Iterator[_Found]:
    spec = model.spec
    in_degrees = spec.units.angle is AngleUnit.DEG
    for loc, angle in (*_table_angles(spec), *_limit_angles(spec)):
        limit = "limits" in loc
        if in_degrees:
            if part := _part_of_turn(math.degrees(angle)):
                yield (
                    SlipKind.RADIANS,
                    loc,
                    f"{_short(math.degrees(angle))} deg looks like {part} rad; angles of this file are in deg",
                )
        elif abs(angle) > TURN * (1 + 1e-9) and not limit and not _rounded_right_angle(angle):
            yield (
                SlipKind.DEGREES,
                loc,
                f"{_short(angle)} rad is more than a full turn; {_if_degrees(spec)}",
            )
        if (exact := _rounded_right_angle(angle)) and not limit:
            written, unit, right = (
                (_short(math.degrees(angle)), "deg", f"{90 * exact}")
                if in_degrees
                else (_short(angle), "rad", _multiple_of_pi(exact))
            )
            yield (
                SlipKind.ROUNDED,
                loc,
                f"{written} {unit} is {abs(angle - exact * math.pi / 2):.1e} rad off a right angle; "
                f"if that is meant, write {right}",
            )


def _limits(model: RobotModel) -> Iterator[_Found]:
    for index, row in enumerate(model.spec.rows):
        if not row.type.turns or row.limits.position is None:
            continue
        turns = max(map(abs, row.limits.position)) / TURN
        if turns > MOST_TURNS * (1 + 1e-9):
            meant = "a joint without limits is 'continuous'"
            if model.spec.units.angle is AngleUnit.RAD:
                meant = f"{_if_degrees(model.spec)}; {meant}"
            yield SlipKind.LIMITS, ("joints", index, "limits", "position"), f"limits of {turns:.3g} turns; {meant}"


def _if_degrees(spec: RobotSpec) -> str:
    remedy = "set 'units: {angle: deg}'" if spec.source_file is not None else "use math.radians"
    return f"if degrees are meant, {remedy}"


def _part_of_turn(degrees: float) -> str | None:
    """Return the eighth of a turn that a number is in rad if it was typed with two to four digits of it."""
    eighth = round(abs(degrees) / (math.pi / 4))
    if not 1 <= eighth <= 8 or abs(abs(degrees) - eighth * math.pi / 4) > _NEAR:
        return None
    return _multiple_of_pi(math.copysign(eighth / 2, degrees))


def _rounded_right_angle(angle: float) -> int:
    """Return which right angle, counted in quarter turns, an angle in rad is with its last decimals missing, or 0."""
    quarters = round(angle / (math.pi / 2))
    exact = quarters * math.pi / 2
    if not 1 <= abs(quarters) <= 4 or abs(angle - exact) < 1e-12:
        return 0
    for decimals in range(2, _MOST_DECIMALS + 1):
        unit = 10.0**-decimals
        typed = round(angle, decimals)
        if abs(angle - typed) < 1e-13:  # that is all that was typed, be it in deg or in rad
            rounded, cut = round(exact, decimals), math.trunc(exact / unit) * unit
            return quarters if min(abs(typed - rounded), abs(typed - cut)) < 1e-13 else 0
    return 0


def _multiple_of_pi(quarters: float) -> str:
    """Return ``pi/2`` for 1, ``-pi`` for -2, ``3*pi/4`` for 1.5."""
    sign, (top, bottom) = "-" if quarters < 0 else "", (abs(quarters) / 2).as_integer_ratio()
    return f"{sign}{'' if top == 1 else f'{top}*'}pi{'' if bottom == 1 else f'/{bottom}'}"


def _short(value: float) -> str:
    """Return a number as it was typed, but for the rounding of a conversion."""
    return f"{value:.12g}"


# ---------------------------------------------------------------------------- the whole robot


def _convention(model: RobotModel) -> Iterator[_Found]:
    """Note a table whose ends fit the other convention.

    Craig's frame 0 is placed to make a_0 and alpha_0 zero; in the standard convention a_n and alpha_n of the last row
    are free to be. A twist beyond the last joint, or before the first one, is rare where the other end is zero.
    """
    rows = model.spec.rows
    conventions = {row.convention for row in rows}
    if len(rows) < 2 or len(conventions) > 1:
        return
    first, last = rows[0], rows[-1]
    if conventions == {Convention.STANDARD} and _is_bare(first) and last.alpha:
        found, other, end = "the first row has neither a nor alpha, the last one has an alpha", "modified", last
    elif conventions == {Convention.MODIFIED} and _is_bare(last) and first.alpha:
        found, other, end = "the last row has neither a nor alpha, the first one has an alpha", "standard", first
    else:
        return
    index = 0 if end is first else len(rows) - 1
    yield SlipKind.CONVENTION, ("joints", index, "alpha"), f"{found}, as in a table of the {other} convention"


def _is_bare(row: Row) -> bool:
    return row.a == 0 and row.alpha == 0


def _frames(model: RobotModel) -> Iterator[_Found]:
    """Note frames that the table puts far from the arm, as tables of calibrated robots do."""
    far = far_frames(model.spec)
    if not far.frames:
        return
    source, first = model.spec.source_file, far.frames[0].frame
    remedy = f"'dh2sim convert {source.name} --to compact'" if source is not None else "convert('compact')"
    loc: Loc = ("base",) if first == 0 else ("joints", first - 1, "d")
    yield SlipKind.FAR_FRAMES, loc, f"{far.sentence.removesuffix('.')}; {remedy} rewrites the table without them"


def _size(model: RobotModel) -> Iterator[_Found]:
    unit = model.spec.units.length
    file = model.spec.source_file is not None
    if model.reach > LONGEST_REACH:
        meant = "set 'units: {length: mm}'" if file else "divide by 1000"
        hint = f"if millimetres are meant, {meant}" if unit is LengthUnit.M else "are its lengths right?"
        yield SlipKind.REACH, (), f"a reach of {model.reach:.4g} m is rare for a robot; {hint}"
    elif NO_LENGTH < model.reach < SHORTEST_REACH:
        hint = "are its lengths right?" if unit is LengthUnit.M else f"lengths of this file are in {unit}"
        yield SlipKind.REACH, (), f"a reach of {model.reach:.4g} m is rare for a robot; {hint}"
    estimated = any("mass" in link.estimated for link in model.links)
    if model.mass > GREATEST_MASS and not (estimated and model.reach > LONGEST_REACH):
        hint = "masses that are not given are estimated from the lengths" if estimated else "masses are in kg"
        yield SlipKind.MASS, (), f"a moving mass of {model.mass:.4g} kg is rare for a robot; {hint}"
