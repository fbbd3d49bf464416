"""Equations of motion in print: collected as textbooks do, and compared with numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from dh2sim.errors import Dh2simError
from dh2sim.symbolic.angles import rate, trig_of
from dh2sim.symbolic.check import SampledConfigurations, check_form, scattered
from dh2sim.symbolic.dynamics import Bodies, EquationsOfMotion, equations_of_motion, framed
from dh2sim.symbolic.expression import Factor, Nesting, Sum, Term, name_sums, tidied
from dh2sim.symbolic.form import Equation, Form
from dh2sim.symbolic.harmonics import Harmonics
from dh2sim.symbolic.polynomial import Atom, Matrix, Polynomial
from dh2sim.symbolic.table import SymbolicTable
from dh2sim.typing import Array

MOST_JOINTS: Final = 4
READABLE_JOINTS: Final = 3


def dynamics_form(table: SymbolicTable, bodies: Bodies | None, *, names: bool, joint_names: str) -> Form:
    """Return the mass matrix, the Coriolis matrix and the gravity vector.

    Args:
        table: The robot.
        bodies: What its links and its tool weigh; None for letters: masses m_i, centres of mass at lc_i along
            the link, and the moments of inertia along the link's axes.
        names: Whether sums that recur are named #1, #2, …
        joint_names: ``theta`` or ``q``.

    Raises:
        Dh2simError: The robot has too many joints.
        MismatchError: The equations differ from the sums over bodies at random configurations.
    """
    n = len(table.moving)
    name = table.spec.name
    if n == 0 or n > MOST_JOINTS:
        raise Dh2simError(
            f"{name}: has {n} joints that move; equations of motion are printed for 1 to {MOST_JOINTS}. "
            "Write inverse dynamics as code instead"
        )
    motion = equations_of_motion(table, bodies)
    table = replace(table, letters={**table.letters, **motion.letters})
    equations, named = _equations(motion, table, names)
    form = Form(
        what="dynamics",
        table=table,
        equations=equations,
        named=named,
        notes=tuple(_notes(table, motion)),
        joint_names=joint_names,
    )
    return replace(form, error=_error(form, bodies, motion))


# ---------------------------------------------------------------------------- print


def _equations(
    motion: EquationsOfMotion, table: SymbolicTable, names: bool
) -> tuple[tuple[Equation, ...], Mapping[Atom, Sum]]:
    masses = [name for name in motion.letters if name.startswith("m")]
    gravity = [name for name in motion.letters if name.startswith("g")]
    groups = ([rate(i) for i in table.moving], gravity, masses)
    shapes = {"M": motion.M, "C": motion.C, "g": [[entry] for entry in motion.g]}
    meanings = {
        "M": "mass matrix",
        "C": "Coriolis and centrifugal terms, times the joint velocities",
        "g": "torques of gravity",
    }
    cells = {name: [[_nested(entry, groups) for entry in row] for row in matrix] for name, matrix in shapes.items()}
    flat = [entry for matrix in cells.values() for row in matrix for entry in row]
    named, flat = name_sums(flat) if names else ({}, flat)
    rest = iter(flat)
    equations = []
    for name, meaning in meanings.items():
        entries = tuple(tuple(next(rest) for _ in row) for row in cells[name])
        labels = tuple(
            tuple(f"{name}{a}{b}" if name != "g" else f"g{a}" for b in range(1, len(row) + 1))
            for a, row in enumerate(entries, start=1)
        )
        equations.append(Equation(name=name, entries=entries, entry_names=labels, meaning=meaning))
    return tuple(equations), named


def _nested(entry: Harmonics, groups: Sequence[Sequence[Atom]]) -> Sum:
    """Return an entry collected by rates, gravity and masses."""
    return tidied(_collected(_with_squares(entry.as_polynomial()), groups))


def _with_squares(polynomial: Polynomial) -> Polynomial:
    """Exchange x - x*c2^2 for x*s2^2."""
    terms = dict(polynomial.terms)
    for monomial, number in polynomial.terms.items():
        for k, (atom, power) in enumerate(monomial):
            trig = trig_of(atom)
            if power != 2 or trig is None or trig.function != "cos" or monomial not in terms:
                continue
            rest = (*monomial[:k], *monomial[k + 1 :])
            if terms.get(rest) == -number:
                del terms[rest], terms[monomial]
                other = Polynomial({rest: -number}) * trig.angle.cos_sin()[1] ** 2
                for new, value in other.terms.items():
                    terms[new] = terms.get(new, 0) + value
    return Polynomial({monomial: number for monomial, number in terms.items() if number})


def _square_root(polynomial: Polynomial) -> Polynomial | None:
    """Return a + b for a^2 + 2*a*b + b^2, None for any other polynomial."""
    squares = {
        tuple((atom, power // 2) for atom, power in monomial): number
        for monomial, number in polynomial.terms.items()
        if all(power % 2 == 0 for _, power in monomial) and number > 0
    }
    if len(polynomial.terms) != 3 or len(squares) != 2:
        return None
    roots = {monomial: math.isqrt(int(number)) for monomial, number in squares.items()}
    (one, m), (other, n) = roots.items()
    for sign in (1, -1):
        candidate = Polynomial({one: m, other: sign * n})
        if candidate * candidate == polynomial:
            return candidate
    return None


def _collected(polynomial: Polynomial, groups: Sequence[Sequence[Atom]]) -> Sum:
    for k, group in enumerate(groups):
        parts: dict[Any, dict[Any, Any]] = {}
        for monomial, number in polynomial.terms.items():
            outside = tuple(pair for pair in monomial if pair[0] in group)
            inside = tuple(pair for pair in monomial if pair[0] not in group)
            parts.setdefault(outside, {})[inside] = number
        if set(parts) - {()}:
            terms: list[Term] = []
            for outside in sorted(parts, key=lambda m: (not m, m)):
                rest = _collected(Polynomial(parts[outside]), groups[k + 1 :])
                factors = tuple(Factor(atom, power) for atom, power in outside)
                if not outside:
                    terms += rest.terms
                elif len(rest.terms) == 1:
                    terms.append(Term(rest.terms[0].number, (*factors, *rest.terms[0].factors)))
                elif all(term.number < 0 for term in rest.terms):
                    terms.append(Term(-1, (*factors, Factor(-rest))))
                else:
                    terms.append(Term(1, (*factors, Factor(rest))))
            return Sum(tuple(terms))
    root = _square_root(polynomial)
    if root is not None:
        return Sum((Term(1, (Factor(Nesting([])(root), 2),)),))
    return Nesting([])(polynomial)


def _notes(table: SymbolicTable, motion: EquationsOfMotion) -> list[str]:
    unit = table.unit.value
    notes = []
    if motion.letters:
        notes.append(
            "m_i, I_i: mass, and moment of inertia about the centre of mass along the axes of link i, which is at "
            "lc_i from the joint."
        )
    if not any(motion.g):
        notes.append("Gravity does no work on this arm.")
    if unit != "m":
        notes.append(f"Lengths are in {unit}: M is in kg {unit}^2 between turning joints.")
    if len(table.moving) > READABLE_JOINTS:
        notes.append("Four joints are the most that is printed; inverse dynamics as code is shorter.")
    return notes


# ---------------------------------------------------------------------------- check


def _error(form: Form, bodies: Bodies | None, motion: EquationsOfMotion) -> float:
    """Compare M, C and g with sums over bodies at random configurations, for random values of letters.

    Returns:
        The largest difference, as a share of the size of what they are made of.

    Raises:
        MismatchError: It is larger than 1e-13.
    """
    table, letters = form.table, motion.letters
    configurations = SampledConfigurations(table)
    count = len(configurations.q)
    sizes = scattered(1, len(letters), seed=1)[0].tolist()
    extra: dict[Atom, Any] = {name: 0.5 + size for name, size in zip(letters, sizes, strict=True)}
    rates = 2.0 * scattered(count, len(table.moving), seed=2).T - 1.0
    extra |= {rate(i): values for i, values in zip(table.moving, rates, strict=True)}
    metre = table.spec.units.metres(1.0)

    def value(polynomial: Polynomial) -> float:
        known = {**{name: letter.value for name, letter in table.letters.items()}, **extra}
        renamed = {f"I{axis}{axis}{name[1:]}": known[name] for name in letters for axis in "xyz" if name[0] == "I"}
        return math.fsum(
            math.prod([float(number), *(({**renamed, **known})[atom] ** power for atom, power in monomial)])
            for monomial, number in polynomial.terms.items()
            if all(atom in known or atom in renamed for atom, _ in monomial)
        )

    if bodies is None:
        weights = [
            (b.frame, value(b.mass), [value(c) for c in b.com], _values(b.inertia, value)) for b in motion.bodies
        ]
    else:
        weights = [(f, b.mass, (b.com / metre).tolist(), b.inertia / metre**2) for f, b in framed(bodies)]

    def mass_matrix(q: Array) -> tuple[Array, Array]:
        at = SampledConfigurations(table, q=q)
        M = np.zeros((len(q), q.shape[1], q.shape[1]))
        g = np.zeros((len(q), q.shape[1]))
        acceleration = np.array([value(entry) for entry in motion.gravity])
        for frame, mass, com, inertia in weights:
            J, R = at.body_jacobian(frame, np.array(com))
            M += mass * np.einsum("nki,nkj->nij", J[:, :3], J[:, :3])
            local = np.einsum("nlk,nlj->nkj", R, J[:, 3:])
            M += np.einsum("nki,kl,nlj->nij", local, inertia, local)
            g -= mass * np.einsum("nki,k->ni", J[:, :3], acceleration)
        return M, g

    M, g = mass_matrix(configurations.q)
    slope = np.stack([_exact_slope(mass_matrix, configurations, k) for k in range(M.shape[1])])
    C = 0.5 * (
        np.einsum("inkj,in->nkj", slope, rates)
        + np.einsum("jnki,in->nkj", slope, rates)
        - np.einsum("knij,in->nkj", slope, rates)
    )
    size = max(1.0, float(np.abs(slope).max()), float(np.abs(M).max()))
    expected = {"M": M, "C": C, "g": g[:, :, None]}
    scales = {"M": size, "C": size, "g": max(1.0, float(np.abs(g).max()))}
    return check_form(form, expected, configurations, extra, scales)


def _values(matrix: Matrix, value: Callable[[Polynomial], float]) -> Array:
    return np.array([[value(entry) for entry in row] for row in matrix])


def _exact_slope(mass_matrix: Any, configurations: SampledConfigurations, k: int) -> Array:
    """Return dM/dq_k: M is a trigonometric polynomial of degree 2, or a quadratic one, so differences are exact.

    Turning joints: L. N. Trefethen, Spectral Methods in MATLAB, 2000, chapter 3, for five points.
    """
    q = configurations.q
    table = configurations.table

    def at(shift: float) -> Array:
        moved = q.copy()
        moved[:, k] += shift
        result: Array = mass_matrix(moved)[0]
        return result

    row = table.spec.rows[table.moving[k] - 1]
    if not row.type.turns:
        step = configurations.reach
        return (at(step) - at(-step)) / (2 * step) * table.spec.units.metres(1.0)
    angle = math.tau / 5
    total: Array = np.zeros_like(at(0.0))
    for j in range(1, 5):
        total -= 0.5 * (-1) ** j / math.sin(j * angle / 2) * at(j * angle)
    return total
