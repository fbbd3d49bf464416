"""The geometric Jacobian in symbols, its determinant in factors, and the singular configurations that they name.

If all six rows are there, the determinant does not depend on the frame in which velocities are expressed, nor on the
point of the last body whose velocity is meant. So the frame and the point are chosen that make most entries zero: for
an arm with a spherical wrist, the wrist's centre and a frame of the forearm. What is block triangular then falls into
factors, as B. Siciliano, L. Sciavicco, L. Villani, G. Oriolo show for anthropomorphic arms (Robotics: Modelling,
Planning and Control, 2009, section 3.3).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Final

import numpy as np

from dh2sim.symbolic.angles import Angle, derivative_by, slide_row, trig_of
from dh2sim.symbolic.check import SampledConfigurations
from dh2sim.symbolic.harmonics import is_zero, reduced
from dh2sim.symbolic.polynomial import ONE, ZERO, Matrix, Polynomial, Rational, magnitude, simple
from dh2sim.symbolic.table import Fold, SymbolicTable, constant_value, transform
from dh2sim.typing import Array

MOST_DETERMINANT_TERMS: Final = 400
"""Of the entries of a block, multiplied out: what has more is not a factor anybody could read."""
_ZERO: Final = 1e-12
"""Below this, as a share of the largest one, a number at random configurations is taken for a zero."""
_LARGEST_BLOCK: Final = 4
"""Rows of a block whose determinant somebody could read."""
_TRIED: Final = 2
"""Frames and points in which a determinant is computed: the most promising ones."""


def geometric_jacobian_matrix(table: SymbolicTable, source: str, target: str, *, fold: Fold) -> Matrix:
    """Return the Jacobian of a frame: 6 rows, a column for each coordinate.

    Args:
        table: The robot.
        source: Frame in which velocities are expressed, and relative to which they are meant.
        target: The frame that moves; rows 0-2 are the velocity of its origin, rows 3-5 its angular velocity.
        fold: Across which axes angles are added up.

    Raises:
        UnknownFrameError: There is no such frame.
    """
    position = [row[3] for row in table.pose(source, target, fold=fold)[:3]]
    forward = table.frames[source] <= table.frames[target]
    columns = []
    for i, moves in zip(table.moving, moving_between(table, source, target), strict=True):
        row = table.spec.rows[i - 1]
        linear = [entry.derivative(partial(derivative_by, i)) for entry in position]
        angular = [ZERO, ZERO, ZERO]
        if row.type.turns and moves:
            sign = (-1 if row.flip else 1) * (1 if forward else -1)
            turns = [motion for motion in table.path(source, f"link_{i}") if motion.kind != "T"]
            axis = transform(turns, fold)
            angular = [entry[2].scaled(sign) for entry in axis[:3]]
        columns.append(linear + angular)
    return [list(entries) for entries in zip(*columns, strict=True)] if columns else [[] for _ in range(6)]


@dataclass(frozen=True)
class Determinant:
    """A determinant in factors."""

    rows: tuple[int, ...]
    """Of the Jacobian: 0-2 linear, 3-5 angular."""
    number: Rational
    """Without its sign."""
    factors: tuple[Polynomial, ...]
    """Atoms come first; empty, with number 0, where the determinant is zero everywhere."""


def moving_between(table: SymbolicTable, source: str, target: str) -> list[bool]:
    """Return for each coordinate whether it moves one frame in the other."""
    first, last = sorted((table.frames[source], table.frames[target]))
    return [first < table.frames[f"link_{i}"] <= last for i in table.moving]


def square_rows(J: Matrix) -> tuple[int, ...] | None:
    """Return rows that make a Jacobian square: all that are not zero, the linear or the angular ones; else None."""
    n = len(J[0])
    alive = [i for i in range(6) if any(J[i])]
    for rows in (alive, [i for i in alive if i < 3], [i for i in alive if i > 2]):
        if n and len(rows) == n and not (len(rows) < 6 and _vanishes([J[i] for i in rows])):
            return tuple(rows)
    return None


def _vanishes(square: Matrix) -> bool:
    determinant = _cofactors(square)
    return determinant is not None and is_zero(determinant)


def factored_determinant(
    table: SymbolicTable,
    J: Matrix,
    rows: tuple[int, ...],
    moves: Sequence[bool],
    configurations: SampledConfigurations,
    *,
    fold: Fold,
) -> Determinant | None:
    """Return the determinant of a square Jacobian up to its sign; None where it has no readable factors.

    Args:
        table: The robot.
        J: The Jacobian, with the columns of the coordinates that move its frame.
        rows: Those of ``J`` that are taken.
        moves: For each coordinate of the robot, whether it has a column.
        configurations: Random ones, at which zeros are looked for.
        fold: Across which axes angles are added up.
    """
    squares = [[J[i] for i in rows]]
    if len(rows) == 6:
        squares = [_in_frame(table, *choice, moves, fold) for choice in _promising(table, moves, configurations)]
    best: Determinant | None = None
    for square in squares:
        found = _determinant(square)
        if found is not None:
            candidate = Determinant(rows, found[0], tuple(found[1]))
            if best is None or _cost(candidate) < _cost(best):
                best = candidate
    return best


def _cost(determinant: Determinant) -> tuple[int, int]:
    return sum(len(factor.terms) for factor in determinant.factors), -len(determinant.factors)


def _promising(
    table: SymbolicTable, moves: Sequence[bool], configurations: SampledConfigurations
) -> list[tuple[str, str]]:
    """Return frames and points for which the Jacobian falls into the smallest blocks, going by numbers."""
    n = len(table.spec.rows)

    def difficulty(choice: tuple[str, str]) -> tuple[int, int, int]:
        J = np.abs(configurations.jacobian(*choice)).max(axis=0)[:, moves]
        pattern = _ZERO * J.max() < J
        sizes = [len(rows) for rows, _ in _blocks(pattern) or []]
        return max(sizes, default=0), sum(size**4 for size in sizes), int(pattern.sum())

    points = [f"dh_{m}" for m in range(n, max(n - 4, 0), -1)]
    choices = [(f"dh_{k}", point) for k in range(n + 1) for point in points]
    hardness = {choice: difficulty(choice) for choice in choices}
    best = sorted(choices, key=lambda choice: hardness[choice])[:_TRIED]
    return [choice for choice in best if hardness[choice][0] <= _LARGEST_BLOCK]


def _in_frame(table: SymbolicTable, frame: str, point: str, moves: Sequence[bool], fold: Fold) -> Matrix:
    """Return the Jacobian in the axes of ``frame``, of the origin of ``point`` as a point of the last body."""
    columns = []
    for i in itertools.compress(table.moving, moves):
        row = table.spec.rows[i - 1]
        link = f"link_{i}"
        R = table.pose(frame, link, fold=fold)
        sign = -1 if row.flip else 1
        axis = [entry[2].scaled(sign) for entry in R[:3]]
        if row.type.turns:
            x, y, _ = (entry[3] for entry in table.pose(link, point, fold=fold)[:3])
            linear = [reduced(entry[1] * x - entry[0] * y).scaled(sign) for entry in R[:3]]
            columns.append([*linear, *axis])
        else:
            columns.append([*axis, ZERO, ZERO, ZERO])
    return [list(entries) for entries in zip(*columns, strict=True)]


def _blocks(square: Matrix | Array) -> list[tuple[list[int], list[int]]] | None:
    """Return rows and columns of the diagonal blocks of a block triangular form; None where it is singular."""
    n = len(square)
    match = _matching(square)
    if match is None:
        return None
    # row i needs column match[i]; i reaches j if row i has an entry in j's column
    reach = [{j for j in range(n) if square[i][match[j]]} for i in range(n)]
    closed = [set(r) | {i} for i, r in enumerate(reach)]
    for k in range(n):
        for i in range(n):
            if k in closed[i]:
                closed[i] |= closed[k]
    seen: set[int] = set()
    blocks = []
    for i in range(n):
        if i not in seen:
            component = sorted(j for j in range(n) if j in closed[i] and i in closed[j])
            seen.update(component)
            blocks.append((component, [match[j] for j in component]))
    return blocks


def _matching(square: Matrix | Array) -> dict[int, int] | None:
    """Return a column for each row, each used once, where entries are not zero."""
    owner: dict[int, int] = {}

    def place(row: int, tried: set[int]) -> bool:
        for column, entry in enumerate(square[row]):
            if bool(entry) and column not in tried:
                tried.add(column)
                if column not in owner or place(owner[column], tried):
                    owner[column] = row
                    return True
        return False

    if not all(place(row, set()) for row in range(len(square))):
        return None
    return {row: column for column, row in owner.items()}


def _determinant(square: Matrix) -> tuple[Rational, list[Polynomial]] | None:
    """Return number and factors of a determinant up to its sign."""
    blocks = _blocks(square)
    if blocks is None:
        return 0, []
    number: Rational = 1
    factors: list[Polynomial] = []
    for rows, columns in blocks:
        block = _cofactors([[square[i][j] for j in columns] for i in rows])
        if block is None:
            return None
        block = reduced(block)
        if not block:
            return 0, []
        own, pieces = _split(block)
        number *= magnitude(own)
        factors += [_positive(piece) for piece in pieces]
    factors.sort(key=lambda f: (len(f.terms), sorted(f.atoms)))
    return number, factors


def _positive(factor: Polynomial) -> Polynomial:
    """Return a factor or its opposite, whichever has more positive terms."""
    negative = sum(number < 0 for number in factor.terms.values())
    return -factor if 2 * negative > len(factor.terms) else factor


def _cofactors(square: Matrix) -> Polynomial | None:
    """Return a determinant by expansion along the sparsest row, None where it has too many terms."""
    n = len(square)
    if n == 0:
        return ONE
    if n == 1:
        return square[0][0]
    k = min(range(n), key=lambda i: (sum(map(bool, square[i])), sum(len(e.terms) for e in square[i])))
    total = ZERO
    for j, entry in enumerate(square[k]):
        if not entry:
            continue
        minor = _cofactors([[*row[:j], *row[j + 1 :]] for i, row in enumerate(square) if i != k])
        if minor is None or len(entry.terms) * len(minor.terms) > MOST_DETERMINANT_TERMS:
            return None
        total = total + (entry * minor).scaled((-1) ** (k + j))
    return total


def _split(polynomial: Polynomial) -> tuple[Rational, list[Polynomial]]:
    """Return the number and the atoms that all terms have, and what is left."""
    monomials = list(polynomial.terms)
    common = dict(monomials[0])
    for monomial in monomials[1:]:
        powers = dict(monomial)
        common = {atom: min(power, powers[atom]) for atom, power in common.items() if atom in powers}
    rest = {
        tuple((a, p - common.get(a, 0)) for a, p in monomial if p > common.get(a, 0)): number
        for monomial, number in polynomial.terms.items()
    }
    factors = [Polynomial.atom(atom) for atom, power in common.items() for _ in range(power)]
    if len(rest) == 1:
        return next(iter(rest.values())), factors
    numbers = list(rest.values())
    shared = min(map(magnitude, numbers)) if len({magnitude(number) for number in numbers}) == 1 else 1
    return shared, [*factors, Polynomial({m: simple(Fraction(number) / shared) for m, number in rest.items()})]


# ---------------------------------------------------------------------------- what a factor means


@dataclass(frozen=True)
class Singularity:
    """What makes a determinant zero."""

    factor: Polynomial
    name: str
    """'shoulder', 'elbow' or 'wrist' for arms that have them, else empty."""
    angle: Angle | None = None
    """The angle that the factor fixes, if it has a single one."""
    degrees: tuple[float, ...] = ()
    """Values of that angle."""


def singularities(table: SymbolicTable, determinant: Determinant) -> list[Singularity]:
    """Return the factors of a determinant that can be zero, each once, and where they are."""
    factors = dict.fromkeys(factor for factor in determinant.factors if coordinates_of(factor))
    return [Singularity(factor, _name(table, factor), *_zeros(table, factor)) for factor in factors]


def _zeros(table: SymbolicTable, factor: Polynomial) -> tuple[Angle | None, tuple[float, ...]]:
    """Return the only angle of a factor a*c + b*s + k and where it is zero, or None."""
    angles: set[Angle] = set()
    a = b = k = 0.0
    for monomial, number in factor.terms.items():
        value, function = float(number), ""
        for atom, power in monomial:
            trig = trig_of(atom)
            if trig is not None and not trig.angle.is_constant:
                if function or power > 1:
                    return None, ()
                function = trig.function
                angles.add(trig.angle)
            elif (constant := constant_value(table, atom)) is not None:
                value *= constant**power
            else:
                return None, ()
        if function == "cos":
            a += value
        elif function:
            b += value
        else:
            k += value
    if len(angles) != 1:
        return None, ()
    radius = math.hypot(a, b)
    if radius < abs(k) or not radius:
        return angles.pop(), ()
    middle, half = math.atan2(b, a), math.acos(-k / radius)
    zeros = {round(math.degrees(math.remainder(middle + side * half, math.tau)), 9) + 0.0 for side in (-1, 1)}
    return angles.pop(), tuple(sorted(180.0 if zero == -180.0 else zero for zero in zeros))


def _name(table: SymbolicTable, factor: Polynomial) -> str:
    """Return what a factor is called: by its joints, for an arm whose last three of six joints are a wrist."""
    moving = table.moving
    turns = [table.spec.rows[i - 1].type.turns for i in moving]
    if len(moving) != 6 or not all(turns[3:]):
        return ""
    places = {moving.index(row) + 1 for row in coordinates_of(factor)}
    if places == {5}:
        return "wrist"
    if not all(turns):
        return ""
    if places == {3}:
        return "elbow"
    return "shoulder" if 2 in places and places <= {2, 3, 4, 5} else ""


def coordinates_of(polynomial: Polynomial) -> set[int]:
    """Return the rows whose coordinates are in a polynomial."""
    rows: set[int] = set()
    for atom in polynomial.atoms:
        trig = trig_of(atom)
        if trig is not None:
            rows |= {row for row, _ in trig.angle.coordinates}
        elif (row := slide_row(atom)) is not None:
            rows.add(row)
    return rows
