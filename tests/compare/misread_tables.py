"""Tables with one misreading in them, made by hand here: what ``dh2sim diff`` must call them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dh2sim.compare.misreadings import MisreadingKind
from dh2sim.robot.row import Convention, Row
from dh2sim.robot.spec import RobotSpec
from tests.compare.disguises import random_table

KINDS = ("sign", "swapped rows", "convention", "offset", "mm", "degrees")
LENGTHS, ANGLES = ("a", "d"), ("alpha", "theta")


@dataclass(frozen=True, slots=True, kw_only=True)
class Misread:
    """A right table, the same with a misreading, and what that is."""

    right: RobotSpec
    wrong: RobotSpec
    kind: MisreadingKind
    rows: tuple[int, ...]
    columns: tuple[str, ...]

    @property
    def size(self) -> float:
        """Sum of all lengths of the wrong table, m: an upper bound of its reach."""
        return sum(abs(row.a) + abs(row.d) for row in self.wrong.rows)


def misread(seed: int) -> Misread:
    """Make a table, and one of the misreadings in it, both by the seed."""
    rng = np.random.default_rng(seed)
    right = random_table(rng, int(rng.integers(3, 8)), odd=seed % 2 == 0)
    while not (any(row.d or row.a for row in right.rows) and any(row.alpha for row in right.rows)):
        right = random_table(rng, int(rng.integers(3, 8)), odd=seed % 2 == 0)
    if rng.random() < 0.3:
        right = replace(right, rows=tuple(replace(row, convention=Convention.MODIFIED) for row in right.rows))
    rows = list(right.rows)
    match KINDS[seed % len(KINDS)]:
        case "sign":
            i, column = _filled(rows, ("a", "alpha", "d"), rng)
            rows[i] = _with(rows[i], column, -getattr(rows[i], column))
            return _made(right, rows, MisreadingKind.SIGN, (i,), (column,))
        case "swapped rows":
            i, k = sorted(rng.choice(len(rows), 2, replace=False).tolist())
            rows[i], rows[k] = rows[k], rows[i]
            return _made(right, rows, MisreadingKind.SWAPPED_ROWS, (i, k), ())
        case "convention":
            other = {Convention.STANDARD: Convention.MODIFIED, Convention.MODIFIED: Convention.STANDARD}
            rows = [replace(row, convention=other[row.convention]) for row in rows]
            return _made(right, rows, MisreadingKind.CONVENTION, (), ())
        case "offset":
            i, column = _filled(rows, LENGTHS, rng)
            rows[i] = _with(rows[i], column, 0.0)
            return _made(right, rows, MisreadingKind.LOST, (i,), (column,))
        case "mm":
            if rng.random() < 0.5:
                i, column = _filled(rows, LENGTHS, rng)
                rows[i] = _with(rows[i], column, 1000.0 * getattr(rows[i], column))
                return _made(right, rows, MisreadingKind.LENGTH_UNIT, (i,), (column,))
            rows = [replace(row, a=1000.0 * row.a, d=1000.0 * row.d) for row in rows]
            return _made(right, rows, MisreadingKind.LENGTH_UNIT, (), LENGTHS)
        case _:
            if rng.random() < 0.5:
                i, column = _filled(rows, ("alpha",), rng)
                rows[i] = _with(rows[i], column, math.degrees(getattr(rows[i], column)))
                return _made(right, rows, MisreadingKind.ANGLE_UNIT, (i,), (column,))
            rows = [replace(row, alpha=math.degrees(row.alpha), theta=math.degrees(row.theta)) for row in rows]
            return _made(right, rows, MisreadingKind.ANGLE_UNIT, (), ANGLES)


def _made(
    right: RobotSpec, rows: list[Row], kind: MisreadingKind, where: tuple[int, ...], columns: tuple[str, ...]
) -> Misread:
    wrong = replace(right, rows=tuple(replace(row, name=f"joint_{i + 1}") for i, row in enumerate(rows)))
    return Misread(right=right, wrong=wrong, kind=kind, rows=tuple(i + 1 for i in where), columns=columns)


def _filled(rows: list[Row], columns: tuple[str, ...], rng: np.random.Generator) -> tuple[int, str]:
    """Return one of the cells of some columns that are not 0."""
    cells = [(i, column) for i, row in enumerate(rows) for column in columns if getattr(row, column)]
    return cells[int(rng.integers(len(cells)))]


def _with(row: Row, column: str, value: float) -> Row:
    values: dict[str, Any] = {column: value}
    return replace(row, **values)
