"""Equations of motion as textbooks print them: M(q) q'' + C(q, q') q' + g(q) = tau.

M is the sum over bodies of m Jvᵀ Jv + Jwᵀ I Jw, C has the Christoffel symbols of M, and g is the gradient of the
potential energy (M. W. Spong, S. Hutchinson, M. Vidyasagar, Robot Modeling and Control, 2006, sections 7.2 and 7.3).
Everything is in the normal form of ``harmonics``. The number of terms grows with a power of the number of joints:
beyond four joints nobody could read them, and straight-line code is the form of choice.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any, Protocol, TypeAlias

from dh2sim.robot.row import Convention
from dh2sim.symbolic.angles import derivative_by, rate, slide
from dh2sim.symbolic.harmonics import Harmonics, Runs
from dh2sim.symbolic.polynomial import ZERO, Atom, Matrix, Polynomial, exact_number, simple
from dh2sim.symbolic.table import Fold, Letter, SymbolicTable, transform
from dh2sim.typing import Array


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


Square: TypeAlias = list[list[Harmonics]]


@dataclass(frozen=True, eq=False)
class SymbolicBody:
    """A body with polynomials for what is known of it; lengths in the file's unit."""

    frame: str
    mass: Polynomial
    com: list[Polynomial]
    inertia: Matrix


@dataclass(frozen=True, eq=False)
class EquationsOfMotion:
    """M(q) q'' + C(q, q') q' + g(q), and what it is made of."""

    M: Square
    C: Square
    g: list[Harmonics]
    bodies: list[SymbolicBody]
    gravity: list[Polynomial]
    """In base_link, the file's length unit per s²."""
    letters: Mapping[str, Letter]
    """Of masses, centres of mass, inertias and gravity; empty for numbers."""


def equations_of_motion(table: SymbolicTable, bodies: Bodies | None) -> EquationsOfMotion:
    """Return the equations of motion of an arm.

    Args:
        table: The robot.
        bodies: What its links weigh; None for letters.
    """
    letters: dict[str, Letter] = {}
    if bodies is None:
        masses = _lettered(table, letters)
    else:
        masses = [_exact_body(table, frame, body) for frame, body in framed(bodies)]
    gravity = _gravity(table, letters if bodies is None else None)
    parts = [_motion_of(table, body) for body in masses]
    runs = Runs({atom for part in parts for entry in part.entries for atom in entry.atoms})
    M = _mass_matrix(table, masses, parts, runs)
    C = _coriolis_matrix(table, M)
    g = _gravity_vector(table, masses, parts, runs, gravity)
    if bodies is None:
        M, C, g = _with_single_inertias(table, letters, M, C, g)
    return EquationsOfMotion(M, C, g, masses, gravity, letters)


# ---------------------------------------------------------------------------- what bodies are


def framed(bodies: Bodies) -> list[tuple[str, Inertial]]:
    """Return what weighs something, with the frame that it is given in."""
    return [(f"link_{i}", body) for i, body in enumerate(bodies, start=1) if body is not None]


def _exact_body(table: SymbolicTable, frame: str, body: Inertial) -> SymbolicBody:
    unit = table.exact_unit

    def number(value: float, power: int) -> Polynomial:
        return Polynomial.number(simple(exact_number(value) / unit**power))

    return SymbolicBody(
        frame,
        Polynomial.number(exact_number(body.mass)),
        [number(value, 1) for value in body.com.tolist()],
        [[number(value, 2) for value in row] for row in body.inertia.tolist()],
    )


def _lettered(table: SymbolicTable, letters: dict[str, Letter]) -> list[SymbolicBody]:
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
        bodies.append(SymbolicBody(f"link_{i}", letter(f"m{i}", "number"), com, inertia))
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


def _motion_of(table: SymbolicTable, body: SymbolicBody) -> _BodyMotion:
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


def _mass_matrix(
    table: SymbolicTable, bodies: Sequence[SymbolicBody], parts: Sequence[_BodyMotion], runs: Runs
) -> Square:
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


def _coriolis_matrix(table: SymbolicTable, M: Square) -> Square:
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
    bodies: Sequence[SymbolicBody],
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
    table: SymbolicTable, letters: dict[str, Letter], M: Square, C: Square, g: list[Harmonics]
) -> tuple[Square, Square, list[Harmonics]]:
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
        if len(own) == 1 and f"I{i}" not in table.letters:
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
