"""Solutions of inverse kinematics as a person reads them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from dh2sim.cli.output import WIDTH, wrapped
from dh2sim.inverse.reach import amount_text, beyond_limits
from dh2sim.messages import printable

if TYPE_CHECKING:
    from dh2sim.inverse.solutions import Curve, Solutions
    from dh2sim.robot.spec import RobotSpec
    from dh2sim.typing import Array

MOST: Final = 32
"""Solutions that are printed; JSON lists them all."""


def print_solutions(
    spec: RobotSpec, robot: RobotSpec, solutions: Solutions, *, frame: str, given: Array | None, behind: Array
) -> None:
    """Print solutions, two lines each: joint values, and what there is to say of them.

    Args:
        spec: The robot up to the frame that gets there.
        robot: The robot.
        solutions: The solutions.
        frame: The frame.
        given: A joint vector that is one of them, shape (n,).
        behind: Coordinates of the joints behind the frame.
    """
    print("\n".join(solution_lines(spec, robot, solutions, frame=frame, given=given, behind=behind)))


def solution_lines(
    spec: RobotSpec, robot: RobotSpec, solutions: Solutions, *, frame: str, given: Array | None, behind: Array
) -> list[str]:
    """Return the lines that ``print_solutions`` prints; its arguments are the same."""
    import numpy as np

    what = "the pose" if frame == "tool0" else f"the pose with {frame}"
    # the nearest of those that differ by whole turns stands for all
    _, first, counts = np.unique(solutions.same, return_index=True, return_counts=True)
    order = np.argsort(first)
    first, counts = first[order], counts[order]
    count, turned = len(first), len(solutions) - len(first)
    inside = int(solutions.within_limits[first].sum())
    if solutions.reason:
        lines = wrapped(f"{robot.name}: no joint vector reaches {what}: {solutions.reason}")
    else:
        text = "1 joint vector reaches" if count == 1 else f"{count} joint vectors reach"
        text += f" {what}" + (f", {inside} within limits" if inside < count else "")
        text += f"; {turned} more by whole turns" if turned else ""
        lines = wrapped(f"{robot.name}: {text}")
    if solutions.nearest is not None and not count:
        lines += ["", "The nearest that was found:", *_table(spec, solutions.nearest[None], [""])]
    if count:
        shown = first[:MOST]
        beyond = beyond_limits(spec.moving_rows, solutions.q[shown])
        remarks = []
        for k, by, turns in zip(shown.tolist(), beyond, counts, strict=False):
            same = given is not None and bool(np.abs(_turned(spec, solutions.q[k] - given)).max() < 1e-6)
            parts = [
                printable(solutions.branch[k]),
                f"sigma_min {solutions.sigma_min[k]:.3g}",
                f"residual {solutions.residual[k]:.1e}",
                _outside(spec, by),
                "as given" if same else "",
                f"{turns - 1} more by whole turns" if turns > 1 else "",
            ]
            remarks.append(" · ".join(part for part in parts if part))
        lines += ["", *_table(spec, solutions.q[shown], remarks, marked=beyond)]
        if count > MOST:
            lines.append(f"and {count - MOST} more, which --json lists")
    for number, curve in enumerate(solutions.curves, start=1):
        lines += wrapped(f"curve {number}: {_curve_text(spec, curve)}")
    if solutions.found_share < 1.0:
        share = math.floor(1000.0 * solutions.found_share) / 10.0  # never 100
        lines += wrapped(f"There may be more: in trials {share:.1f}% of all solutions were found.")
    if len(behind):
        names = ", ".join(row.name for row in robot.moving_rows[len(spec.moving_rows) :])
        lines += wrapped(f"Not moved, being behind {frame}: {names}")
    return lines + _notes(solutions.notes)


def _turned(spec: RobotSpec, difference: Array) -> Array:
    """Return differences of joint vectors, whole turns left out."""
    import numpy as np

    turns = np.array([row.type.turns for row in spec.moving_rows])
    return np.where(turns, (difference + np.pi) % (2.0 * np.pi) - np.pi, difference)


def _outside(spec: RobotSpec, beyond: Array) -> str:
    """Return which limits a joint vector exceeds, and by how much."""
    offences = [
        f"{row.name} by {amount_text(spec, abs(float(by)), turns=row.type.turns)}"
        for row, by in zip(spec.moving_rows, beyond, strict=True)
        if by
    ]
    return f"outside limits: {', '.join(offences)}" if offences else ""


def _table(spec: RobotSpec, q: Array, remarks: Sequence[str], marked: Array | None = None) -> list[str]:
    """Return joint vectors in columns, each with a remark below it; coordinates outside limits have an asterisk."""
    rows = spec.moving_rows
    units = [(spec.units.angle if row.type.turns else spec.units.length).value for row in rows]
    cells = [
        [
            _value(spec, float(value), turns=row.type.turns) + ("*" if marked is not None and marked[k][i] else " ")
            for i, (row, value) in enumerate(zip(rows, vector, strict=True))
        ]
        for k, vector in enumerate(q)
    ]
    names = [row.name for row in rows]
    number = len(str(len(q)))

    def widths(heads: Sequence[str]) -> list[int]:
        return [
            max(len(head) + 1, len(unit) + 1, *(len(row[i]) for row in cells))
            for i, (head, unit) in enumerate(zip(heads, units, strict=True))
        ]

    lines = []
    wide = widths(names)
    if number + sum(width + 1 for width in wide) > WIDTH:
        short = [f"q{i + 1}" for i in range(len(names))]
        lines += wrapped(", ".join(f"{a} {b}" for a, b in zip(short, names, strict=True)))
        names, wide = short, widths(short)
    for head in ([f"{name} " for name in names], [f"{unit} " for unit in units]):
        lines.append(
            (" " * number + "".join(f" {cell:>{width}}" for cell, width in zip(head, wide, strict=True))).rstrip()
        )
    lines.append("─" * (number + sum(width + 1 for width in wide)))
    for k, (row, remark) in enumerate(zip(cells, remarks, strict=True), start=1):
        label = str(k) if remark else ""
        values = "".join(f" {cell:>{width}}" for cell, width in zip(row, wide, strict=True))
        lines.append(f"{label:>{number}}{values}".rstrip())
        indent = " " * (number + 3)
        if remark:
            lines += wrapped(remark, first=indent, rest=indent)
    return lines


def _value(spec: RobotSpec, value: float, *, turns: bool) -> str:
    """Return a coordinate in the robot file's unit, as exactly as a few characters can."""
    from dh2sim.robot.units import AngleUnit, LengthUnit

    unit = spec.units.angle if turns else spec.units.length
    places = {AngleUnit.DEG: 3, AngleUnit.RAD: 5, LengthUnit.M: 5, LengthUnit.CM: 3, LengthUnit.MM: 2}.get(unit, 4)
    return f"{round(value / spec.units.coordinate(1.0, turns=turns), places) + 0.0:.{places}f}"


def _curve_text(spec: RobotSpec, curve: Curve) -> str:
    """Return what a family of solutions is, and the range of the joint that moves most along it."""
    import numpy as np

    ends = "closed" if curve.closed else "open"
    most = int(np.ptp(curve.q, axis=0).argmax())
    row = spec.moving_rows[most]
    unit = (spec.units.angle if row.type.turns else spec.units.length).value
    values = curve.q[:, most]
    if curve.closed and row.type.turns:  # the last step leads to the first point, or to it and whole turns on
        values = np.append(values, values[0] + 2.0 * np.pi * np.round((values[-1] - values[0]) / (2.0 * np.pi)))
    low, high = (_value(spec, float(end), turns=row.type.turns) for end in (values.min(), values.max()))
    return f"{curve.kind}, {ends}, {row.name} from {low} to {high} {unit}"


def _notes(notes: Sequence[str]) -> list[str]:
    lines: list[str] = []
    for note in notes:
        lines += wrapped(f"note: {note}")
    return lines
