"""Equations of motion as textbooks print them: M(q) q'' + C(q, q') q' + g(q) = tau.

M is the sum over bodies of m Jvᵀ Jv + Jwᵀ I Jw, C has the Christoffel symbols of M, and g is the gradient of the
potential energy (M. W. Spong, S. Hutchinson, M. Vidyasagar, Robot Modeling and Control, 2006, sections 7.2 and 7.3).
Everything is in the normal form of ``harmonics``. The number of terms grows with a power of the number of joints:
beyond four joints nobody could read them, and straight-line code is the form of choice.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import Any, Final, Protocol, TypeAlias

import numpy as np

from dh2sim.errors import Dh2simError
from dh2sim.robot.spec import Convention
from dh2sim.symbolic.angles import derivative_by, rate, slide, trig_of
from dh2sim.symbolic.check import SampledConfigurations, check_form, scattered
from dh2sim.symbolic.expression import Factor, Nesting, Sum, Term, name_sums, tidied
from dh2sim.symbolic.form import Equation, Form
from dh2sim.symbolic.harmonics import Harmonics, Runs
from dh2sim.symbolic.polynomial import ZERO, Atom, Matrix, Polynomial, simple
from dh2sim.symbolic.table import Fold, Letter, SymbolicTable, exact_number, transform
from dh2sim.typing import Array

MOST_JOINTS: Final = 4
READABLE_JOINTS: Final = 3


class Inertial(Protocol):
    """What a frame of the arm carries, SI units."""

    @property
    def mass(self) -> float:
        """Kg."""

    @property
    def com(self) -> Array:
        """Centre of mass in the frame, m, shape (3,)."""

    @property
    def inertia(self) -> Array:
        """About the centre of mass, along the frame's axes, kg·m², shape (3, 3)."""


Bodies: TypeAlias = Sequence[Inertial | None]
"""What link_1 … link_n weigh, each in its frame; None for one that weighs nothing."""


@dataclass(frozen=True, eq=False)
class _SymbolicBody:
    """A body with polynomials for what is known of it; lengths in the file's unit."""

    frame: str
    mass: Polynomial
    com: list[Polynomial]
    inertia: Matrix


def dynamics_form(
    table: SymbolicTable,
    bodies: Bodies | None,
    *,
    names: bool = True,
    joint_names: str = "theta",
) -> Form:
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
    letters: dict[str, Letter] = {}
    masses = (
        _lettered(table, letters)
        if bodies is None
        else [_exact_body(table, frame, body) for frame, body in _framed(bodies)]
    )
    gravity = _gravity(table, letters if bodies is None else None)
    parts = [_motion_of(table, body) for body in masses]
    runs = Runs({atom for part in parts for entry in part.entries for atom in entry.atoms})
    M = _mass_matrix(table, masses, parts, runs)
    C = _coriolis_matrix(table, M)
    g = _gravity_vector(table, masses, parts, runs, gravity)
    if bodies is None:
        M, C, g = _with_single_inertias(letters, M, C, g)
    table = replace(table, letters={**table.letters, **letters})
    equations = _equations(M, C, g, table, names)
    form = Form(
        what="dynamics",
        table=table,
        equations=equations[0],
        named=equations[1],
        notes=tuple(_notes(table, letters, n, not any(g))),
        joint_names=joint_names,
    )
    return replace(form, error=_error(form, bodies, masses, gravity, letters))


# ---------------------------------------------------------------------------- what bodies are


def _framed(bodies: Bodies) -> list[tuple[str, Inertial]]:
    return [(f"link_{i}", body) for i, body in enumerate(bodies, start=1) if body is not None]


def _exact_body(table: SymbolicTable, frame: str, body: Inertial) -> _SymbolicBody:
    unit = table.exact_unit

    def number(value: float, power: int) -> Polynomial:
        return Polynomial.number(simple(exact_number(value) / unit**power))

    return _SymbolicBody(
        frame,
        Polynomial.number(exact_number(body.mass)),
        [number(value, 1) for value in body.com.tolist()],
        [[number(value, 2) for value in row] for row in body.inertia.tolist()],
    )


def _lettered(table: SymbolicTable, letters: dict[str, Letter]) -> list[_SymbolicBody]:
    """Return bodies of letters: the centre of mass is on the line that the link follows, its axes are principal."""
    taken = {*table.letters, *table.spec.parameters}

    def letter(name: str, kind: str) -> Polynomial:
        while name in taken:
            name += "_"
        taken.add(name)
        letters[name] = Letter(name, math.nan, "length" if kind == "length" else "number")
        return Polynomial.atom(name)

    bodies = []
    for i, row in enumerate(table.spec.rows, start=1):
        along = ZERO if row.type.moves and not row.type.turns else letter(f"lc{i}", "length")
        com = [along, ZERO, ZERO] if _follows_x(table, i) else [ZERO, ZERO, along]
        moments = [letter(f"I{axis}{axis}{i}", "number") for axis in "xyz"]
        inertia = [[moments[k] if j == k else ZERO for j in range(3)] for k in range(3)]
        bodies.append(_SymbolicBody(f"link_{i}", letter(f"m{i}", "number"), com, inertia))
    return bodies


def _follows_x(table: SymbolicTable, i: int) -> bool:
    """Whether link i goes along x of its frame, and not along z."""
    rows = table.spec.rows
    if rows[i - 1].convention is not Convention.MODIFIED:
        return rows[i - 1].a != 0.0
    if i < len(rows):
        return rows[i].a != 0.0
    tool = table.spec.tool.xyz
    return bool(tool[0] != 0.0 or tool[2] == 0.0)


def _gravity(table: SymbolicTable, letters: dict[str, Letter] | None) -> list[Polynomial]:
    """Return gravity in base_link: numbers in the file's length unit, or multiples of the letter g along an axis."""
    values = table.spec.gravity.tolist()
    size = math.sqrt(sum(value * value for value in values))
    if letters is not None and size and any(abs(value) == size for value in values):
        name = "g"
        while name in table.letters or name in letters:
            name += "_"
        letters[name] = Letter(name, size / table.spec.units.metres(1.0), "acceleration")
        return [Polynomial.atom(name).scaled(round(value / size)) for value in values]
    return [Polynomial.number(simple(exact_number(value) / table.exact_unit)) for value in values]


# ---------------------------------------------------------------------------- sums over bodies


@dataclass(frozen=True, eq=False)
class _BodyMotion:
    """Position of a centre of mass, and columns of velocities for each coordinate."""

    position: list[Polynomial]
    linear: list[list[Polynomial]]
    """In base_link."""
    angular: list[list[Polynomial]]
    """In the body's frame."""

    @property
    def entries(self) -> list[Polynomial]:
        return [entry for column in (self.position, *self.linear, *self.angular) for entry in column]


def _motion_of(table: SymbolicTable, body: _SymbolicBody) -> _BodyMotion:
    T = table.pose("base_link", body.frame)
    position = []
    for row in T[:3]:
        total = row[3]
        for k in range(3):
            if body.com[k] and row[k]:
                total = total + row[k] * body.com[k]
        position.append(total)
    linear, angular = [], []
    for i in table.moving:
        row_spec = table.spec.rows[i - 1]
        carried = table.frames[f"link_{i}"] <= table.frames[body.frame]
        linear.append([entry.derivative(partial(derivative_by, i)) if carried else ZERO for entry in position])
        if carried and row_spec.type.turns:
            turns = [motion for motion in table.path(body.frame, f"link_{i}") if motion.kind != "T"]
            sign = -1 if row_spec.flip else 1
            angular.append([row[2].scaled(sign) for row in transform(turns, Fold.PARALLEL)[:3]])
        else:
            angular.append([ZERO, ZERO, ZERO])
    return _BodyMotion(position, linear, angular)


_Square = list[list[Harmonics]]


def _mass_matrix(
    table: SymbolicTable, bodies: Sequence[_SymbolicBody], parts: Sequence[_BodyMotion], runs: Runs
) -> _Square:
    n = len(table.moving)
    zero = Harmonics(runs)
    M = [[zero] * n for _ in range(n)]
    for body, part in zip(bodies, parts, strict=True):
        linear = [[Harmonics.of(runs, entry) for entry in column] for column in part.linear]
        angular = [[Harmonics.of(runs, entry) for entry in column] for column in part.angular]
        momentum = [
            [_total(runs, (column[k].times(body.inertia[r][k]) for k in range(3))) for r in range(3)]
            for column in angular
        ]
        for a in range(n):
            for b in range(a, n):
                moved = _total(runs, (p * q for p, q in zip(linear[a], linear[b], strict=True) if p and q))
                turned = _total(runs, (p * q for p, q in zip(angular[a], momentum[b], strict=True) if p and q))
                M[a][b] = M[a][b] + moved.times(body.mass) + turned
    for a in range(n):
        for b in range(a):
            M[a][b] = M[b][a]
    return M


def _total(runs: Runs, summands: Any) -> Harmonics:
    total = Harmonics(runs)
    for summand in summands:
        total = total + summand
    return total


def _coriolis_matrix(table: SymbolicTable, M: _Square) -> _Square:
    """C[k][j] = sum over i of (dM_kj/dq_i + dM_ki/dq_j - dM_ij/dq_k) / 2 q'_i."""
    moving = table.moving
    n = len(moving)
    slope = [[[M[a][b].derivative(i, slide(i)) for b in range(n)] for a in range(n)] for i in moving]
    half = Polynomial.number(Fraction(1, 2))
    C = []
    for k in range(n):
        row = []
        for j in range(n):
            symbols = (slope[i][k][j] + slope[j][k][i] - slope[k][i][j] for i in range(n))
            rates = (half * Polynomial.atom(rate(i)) for i in moving)
            row.append(_total(M[0][0].runs, (s.times(r) for s, r in zip(symbols, rates, strict=True) if s)))
        C.append(row)
    return C


def _gravity_vector(
    table: SymbolicTable,
    bodies: Sequence[_SymbolicBody],
    parts: Sequence[_BodyMotion],
    runs: Runs,
    gravity: Sequence[Polynomial],
) -> list[Harmonics]:
    return [
        _total(
            runs,
            (
                Harmonics.of(runs, part.linear[k][r]).times(-(body.mass * gravity[r]))
                for body, part in zip(bodies, parts, strict=True)
                for r in range(3)
                if gravity[r]
            ),
        )
        for k in range(len(table.moving))
    ]


def _with_single_inertias(
    letters: dict[str, Letter], M: _Square, C: _Square, g: list[Harmonics]
) -> tuple[_Square, _Square, list[Harmonics]]:
    """Call the only moment of inertia of a body that matters I_i, and drop letters that do not occur."""
    used = {
        atom
        for entry in (*(e for row in (*M, *C) for e in row), *g)
        for value in entry.terms.values()
        for atom in value.atoms
    }
    renamed: dict[Atom, Polynomial] = {}
    for name in [name for name in letters if name not in used]:
        del letters[name]
    for i in sorted({name[3:] for name in letters if name.startswith(("Ixx", "Iyy", "Izz"))}):
        own = [name for name in letters if name.startswith("I") and name[3:] == i]
        if len(own) == 1 and f"I{i}" not in letters:
            position = list(letters).index(own[0])
            items = list(letters.items())
            items[position] = (f"I{i}", Letter(f"I{i}", math.nan, "number"))
            letters.clear()
            letters.update(items)
            renamed[own[0]] = Polynomial.atom(f"I{i}")

    def exchanged(entry: Harmonics) -> Harmonics:
        return Harmonics(entry.runs, {key: value.substituted(renamed) for key, value in entry.terms.items()})

    return (
        [[exchanged(e) for e in row] for row in M],
        [[exchanged(e) for e in row] for row in C],
        [exchanged(e) for e in g],
    )


# ---------------------------------------------------------------------------- print


def _equations(
    M: _Square, C: _Square, g: list[Harmonics], table: SymbolicTable, names: bool
) -> tuple[tuple[Equation, ...], Mapping[Atom, Sum]]:
    n = len(g)
    masses = [name for name in table.letters if name.startswith("m")]
    rates = [rate(i) for i in table.moving]
    gravity = [name for name in table.letters if name.startswith("g")]
    shapes = [("M", M, "mass matrix"), ("C", C, "Coriolis and centrifugal terms, times the joint velocities")]
    cells = {
        name: [[_nested(entry, (rates, gravity, masses)) for entry in row] for row in matrix]
        for name, matrix, _ in [*shapes, ("g", [[entry] for entry in g], "")]
    }
    flat = [entry for matrix in cells.values() for row in matrix for entry in row]
    named, flat = name_sums(flat) if names else ({}, flat)
    rest = iter(flat)
    equations = []
    for name, meaning in (*((name, meaning) for name, _, meaning in shapes), ("g", "torques of gravity")):
        entries = tuple(tuple(next(rest) for _ in row) for row in cells[name])
        labels = tuple(
            tuple(f"{name}{a}{b}" if name != "g" else f"g{a}" for b in range(1, len(row) + 1))
            for a, row in enumerate(entries, start=1)
        )
        equations.append(Equation(name=name, entries=entries, entry_names=labels, meaning=meaning))
    assert len(equations[0].entries) == n
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


def _notes(table: SymbolicTable, letters: Mapping[str, Letter], n: int, weightless: bool) -> list[str]:
    unit = table.unit.value
    notes = []
    if letters:
        notes.append(
            "m_i, I_i: mass, and moment of inertia about the centre of mass along the axes of link i, which is at "
            "lc_i from the joint."
        )
    if weightless:
        notes.append("Gravity does no work on this arm.")
    if unit != "m":
        notes.append(f"Lengths are in {unit}: M is in kg {unit}^2 between turning joints.")
    if n > READABLE_JOINTS:
        notes.append("Four joints are the most that is printed; inverse dynamics as code is shorter.")
    return notes


# ---------------------------------------------------------------------------- check


def _error(
    form: Form,
    bodies: Bodies | None,
    symbolic: Sequence[_SymbolicBody],
    gravity: Sequence[Polynomial],
    letters: Mapping[str, Letter],
) -> float:
    """Compare M, C and g with sums over bodies at random configurations, for random values of letters.

    Returns:
        The largest difference, as a share of the size of what they are made of.

    Raises:
        MismatchError: It is larger than 1e-13.
    """
    table = form.table
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
        weights = [(b.frame, value(b.mass), [value(c) for c in b.com], _values(b.inertia, value)) for b in symbolic]
    else:
        weights = [(f, b.mass, (b.com / metre).tolist(), b.inertia / metre**2) for f, b in _framed(bodies)]

    def mass_matrix(q: Array) -> tuple[Array, Array]:
        at = SampledConfigurations(table, q=q)
        M = np.zeros((len(q), q.shape[1], q.shape[1]))
        g = np.zeros((len(q), q.shape[1]))
        acceleration = np.array([value(entry) for entry in gravity])
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
