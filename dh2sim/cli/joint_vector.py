"""The argument Q of commands: a joint vector, as numbers in some unit or as the name of a configuration."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.errors import ConfigurationError

if TYPE_CHECKING:
    from dh2sim.kinematics.tree import KinematicTree
    from dh2sim.robot.row import Row
    from dh2sim.robot.spec import RobotSpec
    from dh2sim.robot.units import Units

QArgument = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="Q",
        help="Joint coordinates in the robot file's units, or the name of a configuration such as home or zero. "
        "May contain expressions such as pi/2, commas and brackets.",
    ),
]
DegreesOption = Annotated[bool, typer.Option("--degrees", help="Read Q in deg and m.")]
RadiansOption = Annotated[bool, typer.Option("--radians", help="Read Q in rad and m.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class JointVector:
    """A joint vector and how it was given."""

    q: tuple[float, ...]
    """rad and m."""
    name: str
    """Of the configuration; empty for numbers."""
    units: Units
    """Units that it was read in."""
    rows: tuple[Row, ...]
    """The moving rows."""

    def __str__(self) -> str:
        """Return the coordinates in the units that they were read in."""
        values = zip(self.rows, self.q, strict=True)
        text = ", ".join(f"{_in_units(value, row, self.units)} {_unit(row, self.units)}" for row, value in values)
        return f"{self.name}: {text}" if self.name and text else text or self.name


def read_joint_vector(spec: RobotSpec, texts: Sequence[str] | None, *, degrees: bool, radians: bool) -> JointVector:
    """Read the argument Q; print a warning for coordinates outside their limits.

    Args:
        spec: The robot.
        texts: The argument; without any the robot is at home.
        degrees: Whether the command was called with ``--degrees``.
        radians: Whether it was called with ``--radians``.

    Raises:
        ConfigurationError: The number of coordinates is wrong, one is not a number, or a name is unknown.
    """
    from dh2sim.robot.units import AngleUnit, Units

    if degrees and radians:
        raise typer.BadParameter("cannot be combined", param_hint="--degrees, --radians")
    units = Units(angle=AngleUnit.DEG if degrees else AngleUnit.RAD) if degrees or radians else spec.units
    words = list(texts or ["home"])
    known = spec.named_configurations
    rows = spec.moving_rows
    if len(words) == 1 and words[0] in known:
        vector = JointVector(q=_named(spec, words[0]), name=words[0], units=units, rows=rows)
    else:
        vector = JointVector(q=_coordinates(spec, words, units), name="", units=units, rows=rows)
    _warn_outside(vector)
    return vector


def _named(spec: RobotSpec, name: str) -> tuple[float, ...]:
    """Return a named configuration; the loops of a mechanism are closed there."""
    if not spec.closures:
        return tuple(spec.named_configurations[name].tolist())
    from dh2sim.kinematics.loop_motion import named_configuration

    return tuple(named_configuration(spec, name).tolist())


def _coordinates(spec: RobotSpec, words: Sequence[str], units: Units) -> tuple[float, ...]:
    """Return the coordinates that are given; of a mechanism either of all joints, or of those that are driven."""
    from dh2sim.robot.expressions import ExpressionError, evaluate

    rows = spec.moving_rows
    if spec.closures and spec.actuated:
        driven = {row.name: row for row in rows}
        some = tuple(driven[name] for name in spec.actuated)
        if len(some) < len(rows) and len(split(words, len(some))) == len(some):
            rows = some
    parts = split(words, len(rows))
    if len(parts) != len(rows):
        raise ConfigurationError(_wrong_count(spec, words, parts, units))
    values = []
    for row, part in zip(rows, parts, strict=True):
        try:
            values.append(units.coordinate(evaluate(part, {}), turns=row.type.turns))
        except ExpressionError as error:
            raise ConfigurationError(f"{row.name}: {_unit_hint(part, _unit(row, units)) or error}") from None
    if len(rows) < len(spec.moving_rows):
        from dh2sim.kinematics.loop_motion import mechanism_configuration

        return tuple(mechanism_configuration(spec, values).tolist())
    return tuple(values)


def _unit_hint(text: str, unit: str) -> str:
    """Return what is wrong with a number that has a unit; empty for other mistakes."""
    from dh2sim.messages import shown
    from dh2sim.robot.fields import WITH_UNIT

    if re.fullmatch(WITH_UNIT, text.strip()) is None:
        return ""
    return f"{shown(text)} has a unit; write the number alone, in {unit}"


def split(words: Sequence[str], count: int) -> list[str]:
    """Split the argument into coordinates, at its words and at commas; '[' and ']' may enclose it.

    A single word, as of a vector that was pasted in quotation marks, is split at blanks if that gives ``count``.
    """
    text = "\0".join(words).strip()
    if text.startswith("["):
        text = text[1:].removesuffix("]")
    parts = [part.strip() for part in _split_outside_parentheses(text, ",\0") if part.strip("\0 ")]
    if len(parts) != count and len(words) == 1:
        blanks = [part for part in _split_outside_parentheses(text.replace(",", " "), " ") if part]
        if len(blanks) == count:
            return blanks
    return parts


def _split_outside_parentheses(text: str, separators: str) -> list[str]:
    parts, depth = [""], 0
    for character in text:
        depth += (character == "(") - (character == ")")
        if character in separators and (depth <= 0 or character == "\0"):
            parts.append("")
        else:
            parts[-1] += character
    return parts


def _wrong_count(spec: RobotSpec, words: Sequence[str], parts: Sequence[str], units: Units) -> str:
    rows = spec.moving_rows
    if len(words) == 1 and words[0].isidentifier():
        spec.configuration(words[0])  # refuses the name
    names = ", ".join(f"{row.name} ({_unit(row, units)})" for row in rows)
    count = "1 joint coordinate" if len(rows) == 1 else f"{len(rows) or 'no'} joint coordinates"
    return f"{spec.name} has {count}, got {len(parts)}" + (f": {names}" if names else "")


def warn_open_loops(tree: KinematicTree, vector: JointVector) -> None:
    """Print a warning if the loops of a mechanism are not closed."""
    from dh2sim.kinematics.loop_closure import closure_gaps, is_closed

    if tree.closures and not is_closed(tree, vector.q):
        gaps = "; ".join(map(str, closure_gaps(tree, vector.q)))
        print(f"dh2sim: warning: the loops are not closed at these coordinates: {gaps}", file=sys.stderr)


def _warn_outside(vector: JointVector) -> None:
    for row, value in zip(vector.rows, vector.q, strict=True):
        if row.limits.position is None:
            continue
        lower, upper = row.limits.position
        slack = 1e-9 * (upper - lower)  # a limit that is written in rad with few digits
        if not lower - slack <= value <= upper + slack:
            value_, lower_, upper_ = (_in_units(x, row, vector.units) for x in (value, lower, upper))
            print(
                f"dh2sim: warning: {row.name}: {value_} {_unit(row, vector.units)} is outside the limits "
                f"{lower_} to {upper_}",
                file=sys.stderr,
            )


def _unit(row: Row, units: Units) -> str:
    return units.angle.value if row.type.turns else units.length.value


def _in_units(value: float, row: Row, units: Units) -> str:
    scale = units.coordinate(1.0, turns=row.type.turns)
    return f"{round(value / scale, 9) + 0.0:.10g}"


def format_numbers(values: Iterable[float], width: int = 0) -> str:
    """Return numbers to nine places, without -0."""
    return " ".join(f"{round(float(value), 9) + 0.0:{width}.9f}" for value in values)
