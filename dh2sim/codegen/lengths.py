"""Lengths of a table as constants: the robot file's parameters where a length is made of them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from dh2sim.codegen.mechanism import Lengths
from dh2sim.kinematics.trace import Number, Trace
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import LengthUnit

if TYPE_CHECKING:
    from dh2sim.symbolic.polynomial import Polynomial


def length_constants(spec: RobotSpec, trace: Trace) -> Lengths:
    """Return what makes the constants for lengths of a table, in m.

    A length that the file computes from parameters is computed from their constants: whoever changes ``a2`` changes
    all that depends on it. In files of other units than m that holds for sums of multiples of parameters.
    """
    written = _polynomials(spec) if spec.parameters else {}

    def length(part: int | str, axis: str, value: float, name: str) -> Number:
        note = f"m, row {part}" if isinstance(part, int) else f"m, {part}"
        polynomial = written.get((part, axis))
        if polynomial is not None and polynomial.atoms and _is_length(polynomial, spec):
            made = _made_of_parameters(polynomial, spec, trace)
            if math.isclose(trace.value(made), value, rel_tol=1e-14, abs_tol=1e-300):
                return made
        return trace.constant(name, value, note)

    return length


def _polynomials(spec: RobotSpec) -> Mapping[tuple[int | str, str], Polynomial]:
    """Return the lengths of the base, every row and the tool over the parameters, in the file's unit."""
    from dh2sim.symbolic.angles import slide
    from dh2sim.symbolic.polynomial import Polynomial
    from dh2sim.symbolic.reading import symbolic_table

    table = symbolic_table(spec)
    frames = ["base_link", *(f"dh_{i}" for i in range(len(spec.rows) + 1)), "tool0"]
    parts: list[int | str] = ["base", *range(1, len(spec.rows) + 1), "tool"]
    found: dict[tuple[int | str, str], Polynomial] = {}
    for part, (start, end) in zip(parts, itertools.pairwise(frames), strict=True):
        shift = [Polynomial(), Polynomial(), Polynomial()]
        for motion in table.motions[table.frames[start] : table.frames[end]]:
            shift = [total + step for total, step in zip(shift, motion.shift, strict=True)]
        if isinstance(part, int):
            coordinate = ((slide(part), 1),)
            d = Polynomial({monomial: n for monomial, n in shift[2].terms.items() if monomial != coordinate})
            found[part, "a"], found[part, "d"] = shift[0], d
        else:
            found |= {(part, axis): total for axis, total in zip("xyz", shift, strict=True)}
    return found


def _is_length(polynomial: Polynomial, spec: RobotSpec) -> bool:
    """Whether parameters that are converted to m give the polynomial's value in m."""
    linear = all(len(monomial) == 1 and monomial[0][1] == 1 for monomial in polynomial.terms if monomial)
    return polynomial.atoms <= set(spec.parameters) and (linear or spec.units.length is LengthUnit.M)


def _made_of_parameters(polynomial: Polynomial, spec: RobotSpec, trace: Trace) -> Number:
    total: Number = 0.0
    for monomial, factor in polynomial.terms.items():
        term: Number = float(factor) if monomial else spec.units.metres(float(factor))
        for name, power in monomial:
            for _ in range(power):
                term = term * trace.constant(name, spec.units.metres(spec.parameters[name]), "m")
        total = total + term
    return total
