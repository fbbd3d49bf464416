"""Poses of a robot in symbols."""

from __future__ import annotations

from typing import Any, Final

from dh2sim.symbolic.check import SampledConfigurations, check_form
from dh2sim.symbolic.expression import Lengths, Nesting, Style
from dh2sim.symbolic.form import Equation, Form, equation, with_names
from dh2sim.symbolic.polynomial import Matrix, identity
from dh2sim.symbolic.table import Fold, SymbolicTable, transform

POSE_ENTRIES: Final = (
    ("r11", "r12", "r13", "px"),
    ("r21", "r22", "r23", "py"),
    ("r31", "r32", "r33", "pz"),
    ("", "", "", ""),
)
"""What the entries of a pose are called; those of the last row are 0 and 1 and have no name."""


def pose_form(
    table: SymbolicTable,
    source: str = "base_link",
    target: str = "tool0",
    *,
    style: Style = Style.BASE,
    lengths: Lengths | None = None,
    names: bool = True,
    fold: Fold = Fold.PARALLEL,
    joint_names: str = "theta",
) -> Form:
    """Return the pose of a frame in another one.

    Args:
        table: The robot.
        source: Frame that the pose is given in.
        target: The frame.
        style: How entries are nested.
        lengths: Whether lengths are outside or inside; by default as the style has them.
        names: Whether sums that recur are named #1, #2, …
        fold: Across which axes angles are added up.
        joint_names: ``theta`` or ``q``.

    Raises:
        UnknownFrameError: There is no such frame.
        MismatchError: It differs from the table's oracle.
    """
    matrix = table.pose(source, target, fold=fold)
    meaning = f"pose of {target} in {source}"
    pose = _pose_equation(_name(table, source, target), matrix, style, lengths, meaning)
    equations, named = with_names([pose], names=names)
    form = Form(what="pose", table=table, equations=equations, named=named, joint_names=joint_names)
    configurations = SampledConfigurations(table)
    check_form(form, {pose.name: configurations.pose(source, target)}, configurations)
    return form


def matrices_form(
    table: SymbolicTable,
    *,
    style: Style = Style.BASE,
    lengths: Lengths | None = None,
    names: bool = True,
    fold: Fold = Fold.PARALLEL,
    joint_names: str = "theta",
) -> Form:
    """Return the transform A_i of every row, every DH frame in frame 0, and the poses of base and tool.

    Args:
        table: The robot.
        style: How entries are nested.
        lengths: Whether lengths are outside or inside; by default as the style has them.
        names: Whether sums that recur are named #1, #2, …
        fold: Across which axes angles are added up.
        joint_names: ``theta`` or ``q``.

    Raises:
        MismatchError: They differ from the table's oracle.
    """
    configurations = SampledConfigurations(table)
    equations, expected = [], {}

    def add(name: str, source: str, target: str, meaning: str) -> None:
        matrix = table.pose(source, target, fold=fold)
        equations.append(_pose_equation(name, matrix, style, lengths, meaning))
        expected[name] = configurations.pose(source, target)

    n = len(table.spec.rows)
    if transform(table.path("base_link", "dh_0"), fold) != identity(4):
        add("T_base_0", "base_link", "dh_0", "pose of dh_0 in base_link")
    for i, row in enumerate(table.spec.rows, start=1):
        add(f"A_{i}", f"dh_{i - 1}", f"dh_{i}", row.name)
    for i in range(2, n + 1):
        add(f"T_0_{i}", "dh_0", f"dh_{i}", f"pose of dh_{i} in dh_0")
    if transform(table.path(f"dh_{n}", "tool0"), fold) != identity(4):
        add(f"T_{n}_tool", f"dh_{n}", "tool0", f"pose of tool0 in dh_{n}")
        add("T", "base_link", "tool0", "pose of tool0 in base_link")
    shown, named = with_names(equations, names=names)
    form = Form(what="matrices", table=table, equations=shown, named=named, joint_names=joint_names)
    check_form(form, expected, configurations)
    return form


def _pose_equation(
    name: str, matrix: Matrix, style: Style, lengths: Lengths | None, meaning: str, **details: Any
) -> Equation:
    nesting = Nesting([entry for row in matrix for entry in row], style, lengths)
    return equation(name, matrix, nesting, meaning=meaning, entry_names=POSE_ENTRIES, **details)


def _name(table: SymbolicTable, source: str, target: str) -> str:
    """Return what a pose is called: T_3_6; base and tool count as dh_0 and dh_n where they are the same."""

    def index(frame: str) -> str:
        for end, dh in (("base_link", "dh_0"), ("tool0", f"dh_{len(table.spec.rows)}")):
            if frame == end:
                same = transform(table.path(end, dh), Fold.PARALLEL) == identity(4)
                return dh.removeprefix("dh_") if same else end.removesuffix("_link").removesuffix("0")
        return frame.removeprefix("dh_")

    return f"T_{index(source)}_{index(target)}"
