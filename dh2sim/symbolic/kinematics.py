"""Poses and Jacobians of a robot in symbols."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from dh2sim.errors import Dh2simError
from dh2sim.symbolic.check import SampledConfigurations, check_form
from dh2sim.symbolic.expression import Factor, Lengths, Nesting, Style, Sum, Term, evaluated
from dh2sim.symbolic.form import Condition, Equation, Form, equation, with_names
from dh2sim.symbolic.jacobian import (
    Determinant,
    factored_determinant,
    geometric_jacobian_matrix,
    moving_between,
    singularities,
    square_rows,
)
from dh2sim.symbolic.polynomial import Matrix, identity
from dh2sim.symbolic.table import Fold, SymbolicTable, transform
from dh2sim.typing import Array

POSE_ENTRIES: Final = (
    ("r11", "r12", "r13", "px"),
    ("r21", "r22", "r23", "py"),
    ("r31", "r32", "r33", "pz"),
    ("", "", "", ""),
)
"""What the entries of a pose are called; those of the last row are 0 and 1 and have no name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FormNotation:
    """How a form is written."""

    style: Style
    """How entries are nested."""
    lengths: Lengths | None
    """Whether lengths are outside or inside; None: as the style has them."""
    names: bool
    """Whether sums that recur are named #1, #2, …"""
    fold: Fold
    """Across which axes angles are added up."""
    joint_names: str
    """``theta`` or ``q``."""

    def nesting(self, matrix: Matrix, table: SymbolicTable, source: str, target: str) -> Nesting:
        """Return what nests the entries of a matrix between two frames."""
        outermost = table.outermost(source, target, from_tool=self.style is Style.TOOL)
        return Nesting([entry for row in matrix for entry in row], self.style, self.lengths, outermost)


def pose_form(table: SymbolicTable, source: str, target: str, notation: FormNotation) -> Form:
    """Return the pose of a frame in another one.

    Args:
        table: The robot.
        source: Frame that the pose is given in.
        target: The frame.
        notation: How it is written.

    Raises:
        UnknownFrameError: There is no such frame.
        MismatchError: It differs from the table's oracle.
    """
    meaning = f"pose of {target} in {source}"
    pose = _pose_equation(_name(table, source, target), table, source, target, notation, meaning)
    equations, named = with_names([pose], names=notation.names)
    form = Form(what="pose", table=table, equations=equations, named=named, joint_names=notation.joint_names)
    configurations = SampledConfigurations(table)
    expected = {pose.name: configurations.pose(source, target)}
    return replace(form, error=check_form(form, expected, configurations))


def matrices_form(table: SymbolicTable, notation: FormNotation) -> Form:
    """Return the transform A_i of every row, every DH frame in frame 0, and the poses of base and tool.

    Args:
        table: The robot.
        notation: How it is written.

    Raises:
        MismatchError: They differ from the table's oracle.
    """
    configurations = SampledConfigurations(table)
    equations, expected = [], {}

    def add(name: str, source: str, target: str, meaning: str) -> None:
        equations.append(_pose_equation(name, table, source, target, notation, meaning))
        expected[name] = configurations.pose(source, target)

    n = len(table.spec.rows)
    if transform(table.path("base_link", "dh_0"), notation.fold) != identity(4):
        add("T_base_0", "base_link", "dh_0", "pose of dh_0 in base_link")
    for i, row in enumerate(table.spec.rows, start=1):
        add(f"A_{i}", f"dh_{i - 1}", f"dh_{i}", row.name)
    for i in range(2, n + 1):
        add(f"T_0_{i}", "dh_0", f"dh_{i}", f"pose of dh_{i} in dh_0")
    if transform(table.path(f"dh_{n}", "tool0"), notation.fold) != identity(4):
        add(f"T_{n}_tool", f"dh_{n}", "tool0", f"pose of tool0 in dh_{n}")
        add("T", "base_link", "tool0", "pose of tool0 in base_link")
    shown, named = with_names(equations, names=notation.names)
    form = Form(what="matrices", table=table, equations=shown, named=named, joint_names=notation.joint_names)
    return replace(form, error=check_form(form, expected, configurations))


VELOCITIES: Final = ("vx", "vy", "vz", "wx", "wy", "wz")


def jacobian_form(table: SymbolicTable, source: str, target: str, notation: FormNotation) -> Form:
    """Return the geometric Jacobian of a frame in another one, and its determinant in factors.

    The determinant is that of the joints that move the frame. If they are fewer than six, it is that of the rows that
    are not zero, of the linear rows or of the angular ones, if they make it square.

    Args:
        table: The robot.
        source: Frame in which velocities are expressed.
        target: The frame that moves.
        notation: How it is written.

    Raises:
        UnknownFrameError: There is no such frame.
        MismatchError: It differs from the table's oracle.
        Dh2simError: No row moves.
    """
    if not table.moving:
        raise Dh2simError(f"{table.spec.name}: has no joint that moves, and so no Jacobian")
    configurations = SampledConfigurations(table)
    J = geometric_jacobian_matrix(table, source, target, fold=notation.fold)
    numbers = configurations.jacobian(source, target)
    moves = moving_between(table, source, target)
    forward = table.frames[source] <= table.frames[target]
    numbers = numbers * np.array(moves, dtype=np.float64) * (1.0 if forward else -1.0)
    nesting = notation.nesting(J, table, source, target)
    columns = tuple(f"q{i}" for i in table.moving)
    shown = equation(
        "J",
        J,
        nesting,
        meaning=f"Jacobian of {target} in {source}: vx vy vz wx wy wz",
        entry_names=tuple(tuple(f"J{r}{c}" for c in range(1, len(columns) + 1)) for r in range(1, 7)),
        columns=columns,
    )
    equations, named = with_names([shown], names=notation.names)
    expected = {"J": numbers}
    length = configurations.length
    scales: dict[str, Array | float] = {"J": np.array([[length]] * 3 + [[1.0]] * 3)}
    conditions: tuple[Condition, ...] = ()
    notes: tuple[str, ...] = ()
    own = [list(itertools.compress(row, moves)) for row in J]
    rows = square_rows(own)
    if rows is not None:
        found = factored_determinant(table, own, rows, moves, configurations, fold=notation.fold)
        if found is None:
            notes = ("The determinant has no factors that its structure shows; it is left out.",)
        else:
            determinant = np.linalg.det(numbers[:, list(rows)][:, :, moves])
            term = _signed(found, nesting, determinant, configurations)
            of = "" if len(rows) == 6 else "(" + ", ".join(VELOCITIES[i] for i in rows) + ")"
            equations = (*equations, Equation(name=f"det J{of}", entries=((Sum((term,) if term.number else ()),),)))
            name = equations[-1].name
            expected[name] = determinant[:, None, None]
            scales[name] = max(float(np.abs(determinant).max()), length ** sum(i < 3 for i in rows))
            conditions = tuple(
                Condition(expression=nesting(s.factor), name=s.name, angle=s.angle, degrees=s.degrees)
                for s in singularities(table, found)
            )
            if not term.number:
                notes = ("The Jacobian is singular at all configurations.",)
        if not all(moves):
            notes = (*notes, f"The determinant is that of the joints between {source} and {target}.")
    form = Form(
        what="jacobian",
        table=table,
        equations=equations,
        named=named,
        conditions=conditions,
        notes=notes,
        joint_names=notation.joint_names,
    )
    return replace(form, error=check_form(form, expected, configurations, scales=scales))


def _signed(
    determinant: Determinant, nesting: Nesting, numbers: Array, configurations: SampledConfigurations
) -> Term:
    """Return a determinant as a product, with the sign that the numbers have."""
    factors: list[Factor] = []
    for factor in dict.fromkeys(determinant.factors):
        nested = nesting(factor)
        power = determinant.factors.count(factor)
        single = nested.terms[0].factors if len(nested.terms) == 1 else ()
        factors.append(Factor(single[0].base if len(single) == 1 else nested, power))
    term = Term(determinant.number, tuple(factors))
    values = configurations.values({atom for factor in determinant.factors for atom in factor.atoms})
    (value,) = evaluated([Sum((term,))], {}, values)
    where = int(np.abs(numbers).argmax())
    return -term if (np.broadcast_to(value, numbers.shape)[where] < 0) != (numbers[where] < 0) else term


def _pose_equation(
    name: str, table: SymbolicTable, source: str, target: str, notation: FormNotation, meaning: str
) -> Equation:
    matrix = table.pose(source, target, fold=notation.fold)
    nesting = notation.nesting(matrix, table, source, target)
    return equation(name, matrix, nesting, meaning=meaning, entry_names=POSE_ENTRIES)


def _name(table: SymbolicTable, source: str, target: str) -> str:
    """Return what a pose is called: T_3_6; base and tool count as dh_0 and dh_n where they are the same."""

    def index(frame: str) -> str:
        for end, dh in (("base_link", "dh_0"), ("tool0", f"dh_{len(table.spec.rows)}")):
            if frame == end:
                same = transform(table.path(end, dh), Fold.PARALLEL) == identity(4)
                return dh.removeprefix("dh_") if same else end.removesuffix("_link").removesuffix("0")
        return frame.removeprefix("dh_")

    return f"T_{index(source)}_{index(target)}"
