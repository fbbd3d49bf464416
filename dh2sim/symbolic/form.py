"""What is printed: matrices of expressions with the sums that they name, and what their letters mean."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from dh2sim.symbolic.angles import Angle, trig_of
from dh2sim.symbolic.expression import Named, Nesting, Sum, atoms_of, name_sums
from dh2sim.symbolic.polynomial import Atom, Matrix
from dh2sim.symbolic.table import Letter, SymbolicTable


class JointNames(StrEnum):
    """What joint coordinates are called."""

    THETA = "theta"
    """With d_i for slides."""
    Q = "q"


@dataclass(frozen=True, kw_only=True)
class Equation:
    """A named matrix of expressions; a scalar has one row of one."""

    name: str
    """Such as ``T_0_6``, ``A_2``, ``J``, ``M``, ``det J``."""
    entries: tuple[tuple[Sum, ...], ...]
    meaning: str = ""
    """Such as 'pose of tool0 in base_link'."""
    entry_names: tuple[tuple[str, ...], ...] = ()
    """What entries are called where they are printed one by one; empty for a scalar."""
    columns: tuple[str, ...] = ()
    """What columns stand for."""

    @property
    def flat(self) -> list[Sum]:
        """All entries, row by row."""
        return [entry for row in self.entries for entry in row]


@dataclass(frozen=True, kw_only=True)
class Condition:
    """Where an expression is zero."""

    expression: Sum
    name: str = ""
    """What that is called, such as 'wrist'."""
    angle: Angle | None = None
    """The angle that it fixes, if there is only one in it."""
    degrees: tuple[float, ...] = ()
    """Values of that angle."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Form:
    """Kinematics or dynamics of a robot in symbols, as printers need it."""

    what: str
    """``pose``, ``matrices``, ``jacobian`` or ``dynamics``."""
    table: SymbolicTable = field(repr=False)
    equations: tuple[Equation, ...]
    named: Named = field(default_factory=dict)
    """Sums that occur several times, by their names #1, #2, …"""
    conditions: tuple[Condition, ...] = ()
    """Where the Jacobian is singular."""
    notes: tuple[str, ...] = ()
    """Sentences to print below."""
    error: float = math.nan
    """Largest difference from numbers at random configurations, as a share of their size."""
    joint_names: str = JointNames.THETA

    @property
    def sums(self) -> list[Sum]:
        """All entries of all equations."""
        return [entry for equation in self.equations for entry in equation.flat]

    @property
    def atoms(self) -> set[Atom]:
        """The atoms of all expressions, names of sums left out."""
        sums = [*self.sums, *self.named.values(), *(condition.expression for condition in self.conditions)]
        return {atom for sum_ in sums for atom in atoms_of(sum_) if atom not in self.named}


def moving_angles(atoms: set[Atom]) -> list[Angle]:
    """Return the angles of cosines and sines that depend on the configuration, in order."""
    angles = {trig.angle for trig in map(trig_of, atoms) if trig is not None and not trig.angle.is_constant}
    return sorted(angles, key=lambda a: (a.coordinates, a.names, a.degrees))


def used_letters(table: SymbolicTable, atoms: set[Atom]) -> list[Letter]:
    """Return the letters that atoms have, in the order of the table."""
    used = atoms | {name for trig in map(trig_of, atoms) if trig is not None for name, _ in trig.angle.names}
    return [letter for name, letter in table.letters.items() if name in used]


def equation(name: str, matrix: Matrix, nesting: Nesting, **details: Any) -> Equation:
    """Return a matrix of polynomials as an equation, nested."""
    return Equation(name=name, entries=tuple(tuple(nesting(entry) for entry in row) for row in matrix), **details)


def with_names(equations: Sequence[Equation], *, names: bool) -> tuple[tuple[Equation, ...], Mapping[Atom, Sum]]:
    """Return equations with the sums that recur in them named, if that is wanted."""
    if not names:
        return tuple(equations), {}
    named, sums = name_sums([entry for equation in equations for entry in equation.flat])
    rest = iter(sums)
    return tuple(
        Equation(
            name=equation.name,
            entries=tuple(tuple(next(rest) for _ in row) for row in equation.entries),
            meaning=equation.meaning,
            entry_names=equation.entry_names,
            columns=equation.columns,
        )
        for equation in equations
    ), named
