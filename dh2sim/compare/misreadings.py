"""Which single misreading of a table would make one robot of another; each is tested by making it and comparing.

Misreadings are made in the table of A and compared with B, and undone in the table of B and compared with A: one of
the two may come from a URDF, whose table dh2sim made, and then only the other's rows are those that somebody wrote.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import combinations
from typing import Any

from dh2sim.compare.fitting import any_fit
from dh2sim.compare.screws import ScrewAxes, axes_of, axes_of_rows, joint_lines
from dh2sim.compare.words import degrees, millimetres, told_apart
from dh2sim.kinematics.transforms import identity
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec

_MOST_ROWS = 12
"""Of tables in which any two rows are exchanged; in longer ones, neighbours."""
_EXACT = 1e-9
"""rad, and m for a reach of up to 1 m: a misreading that is this close explains everything."""
_ASKEW = 0.1
"""Squared sine of axes whose common normal is well determined."""
_LEVER = 30.0
"""By which errors of directions move the foot of such a normal at most."""
_UNITS = (("mm", 1000.0), ("cm", 100.0), ("inches", 1.0 / 0.0254))
_ANGLES = ("alpha", "theta")
_LENGTHS = ("a", "d")


class MisreadingKind(StrEnum):
    """What a table was misread by."""

    CONVENTION = "convention"
    """Standard and modified exchanged."""
    SHIFTED = "shifted"
    """a and alpha are those of a neighbouring row."""
    SIGN = "sign"
    SWAPPED_ROWS = "swapped-rows"
    REVERSED = "reversed"
    """The rows are in reverse order."""
    SWAPPED_COLUMNS = "swapped-columns"
    """a and d, or alpha and theta, exchanged."""
    ANGLE_UNIT = "angle-unit"
    """Degrees and radians exchanged."""
    LENGTH_UNIT = "length-unit"
    """mm, cm or inches, and m exchanged."""
    LOST = "lost"
    """A number is missing."""
    ADDED = "added"
    """There is a number where there should be none."""
    TYPE = "type"
    """A joint turns instead of sliding, or the other way round."""
    MISSING_ROW = "missing-row"
    EXTRA_ROW = "extra-row"
    VALUE = "value"
    """One number is another one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Misreading:
    """A single misreading that makes robot B of robot A."""

    kind: MisreadingKind
    rows: tuple[int, ...]
    """Rows of the table concerned, from 1; empty for the whole table."""
    columns: tuple[str, ...]
    """Columns concerned: a, alpha, d, theta."""
    sentence: str
    """What is wrong in B, if A is right."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Edit:
    """A table with a misreading in it; in both directions, as what is made in A is undone in B."""

    rows: tuple[Row, ...]
    made: Misreading
    undone: Misreading


def misreadings(a: RobotSpec, b: RobotSpec, tolerance: float) -> tuple[Misreading, ...]:
    """Return the single misreadings that explain how robot B differs from robot A.

    Args:
        a: The robot that is right.
        b: The one that is to be explained: another mechanism.
        tolerance: As for comparing them.

    Returns:
        All that fit, but those that fit worse than others only because of the tolerance; a number that is simply
        another one only where nothing else explains it.
    """
    into_b, into_a = _Target(axes_of(b), tolerance), _Target(axes_of(a), tolerance)
    found: dict[tuple[object, ...], tuple[float, Misreading]] = {}

    def add(misreading: Misreading, target: _Target, own: _Target, rows: Sequence[Row]) -> None:
        gap = target.gap(rows)
        if gap is not None and own.gap(rows) is None:
            found.setdefault((misreading.kind, misreading.rows, misreading.columns), (gap, misreading))

    for edit in _edits(a.rows):
        add(edit.made, into_b, into_a, edit.rows)
    for edit in _edits(b.rows):
        add(edit.undone, into_a, into_b, edit.rows)
    if not found:
        for edit in _values(a.rows, b.rows):
            add(edit.made, into_b, into_a, edit.rows)
    least = max(_EXACT, 10.0 * min((gap for gap, _ in found.values()), default=0.0))
    return tuple(misreading for gap, misreading in found.values() if gap <= least)


class _Target:
    """The mechanism that an edited table is to be."""

    def __init__(self, axes: ScrewAxes, tolerance: float) -> None:
        self._axes, self._tolerance = axes, tolerance
        self._pairs = _pairs(axes.turns, axes.points.tolist(), axes.directions.tolist())

    def gap(self, rows: Sequence[Row]) -> float | None:
        """Return the residual, rad, and m for a reach of up to 1 m, if the rows are the same mechanism; else None."""
        turns, points, directions, _ = joint_lines(rows, identity())
        if turns != self._axes.turns:
            return None
        slack = 20.0 * self._tolerance + 1e-9
        far = slack * max(1.0, self._axes.reach, sum(abs(row.a) + abs(row.d) for row in rows))
        for ours, theirs in zip(_pairs(turns, points, directions), self._pairs, strict=True):
            if abs(ours[0] - theirs[0]) > slack or abs(ours[1] - theirs[1]) > far:
                return None
            if abs(ours[2] - theirs[2]) > _LEVER * far:  # NaN where there is none
                return None
        axes = axes_of_rows(rows, identity(), identity())
        fit = any_fit(axes, self._axes, self._tolerance)
        if fit is None:
            return None
        return max(fit.residual.rotation, fit.residual.position / max(1.0, axes.reach, self._axes.reach))


def _pairs(
    turns: Sequence[bool], points: Sequence[Sequence[float]], directions: Sequence[Sequence[float]]
) -> list[tuple[float, float, float]]:
    """Return quick invariants of neighbouring axes, for each pair.

    They are |cosine|; the moment |gap · z x z'|, m, 0 where one slides; and how far along the first of the two its
    common normals with both neighbours are apart, m, NaN unless all three turn and are far from parallel.
    """
    pairs = []
    before = math.nan
    for i in range(len(turns) - 1):
        (x1, y1, z1), (x2, y2, z2) = directions[i], directions[i + 1]
        cosine = x1 * x2 + y1 * y2 + z1 * z2
        moment = offset = behind = math.nan
        if turns[i] and turns[i + 1]:
            (px, py, pz), (qx, qy, qz) = points[i], points[i + 1]
            gx, gy, gz = qx - px, qy - py, qz - pz
            moment = abs(gx * (y1 * z2 - z1 * y2) + gy * (z1 * x2 - x1 * z2) + gz * (x1 * y2 - y1 * x2))
            squared = 1.0 - cosine * cosine
            if squared > _ASKEW:
                along, across = gx * x1 + gy * y1 + gz * z1, gx * x2 + gy * y2 + gz * z2
                offset = abs((along - cosine * across) / squared - before)
                behind = (cosine * along - across) / squared
        pairs.append((abs(cosine), moment if moment == moment else 0.0, offset))
        before = behind
    return pairs


# ---------------------------------------------------------------------------- all misreadings of a table


def _edits(rows: tuple[Row, ...]) -> Iterator[_Edit]:
    """Yield a table with every single misreading that changes it."""
    for edit in _all_edits(rows):
        if any(_numbers(old) != _numbers(new) for old, new in zip(rows, edit.rows, strict=False)) or len(
            edit.rows
        ) != len(rows):
            yield edit


def _all_edits(rows: tuple[Row, ...]) -> Iterator[_Edit]:
    yield from _conventions(rows)
    yield from _shifts(rows)
    yield from _signs(rows)
    yield from _orders(rows)
    yield from _columns(rows)
    yield from _scales(rows)
    yield from _losses(rows)
    yield from _types(rows)
    yield from _missing(rows)


def _numbers(row: Row) -> tuple[object, ...]:
    return row.type.turns, row.type.moves, row.convention, row.a, row.alpha, row.d, row.theta, row.beta


def _edit(
    rows: Iterable[Row],
    kind: MisreadingKind,
    where: Iterable[int],
    columns: Iterable[str],
    sentence: str,
    *,
    undone: str | None = None,
    undone_kind: MisreadingKind | None = None,
) -> _Edit:
    indices, names = tuple(i + 1 for i in where), tuple(columns)
    made = Misreading(kind=kind, rows=indices, columns=names, sentence=sentence)
    back = Misreading(
        kind=undone_kind or kind, rows=indices, columns=names, sentence=sentence if undone is None else undone
    )
    return _Edit(rows=tuple(rows), made=made, undone=back)


def _conventions(rows: tuple[Row, ...]) -> Iterator[_Edit]:
    used = {row.convention for row in rows}
    if len(used) != 1 or Convention.HAYATI in used:
        return
    [own] = used
    other = Convention.MODIFIED if own is Convention.STANDARD else Convention.STANDARD
    yield _edit(
        (replace(row, convention=other) for row in rows),
        MisreadingKind.CONVENTION,
        (),
        (),
        f"a table in the {own.value} convention is read as {other.value}",
        undone=f"a table in the {other.value} convention is read as {own.value}",
    )


def _shifts(rows: tuple[Row, ...]) -> Iterator[_Edit]:
    links = [(row.a, row.alpha) for row in rows]
    down, up = [(0.0, 0.0), *links[:-1]], [*links[1:], (0.0, 0.0)]
    texts = {way: f"a and alpha are one row too {way}" for way in ("low", "high")}
    for shifted, way, back in ((down, "low", "high"), (up, "high", "low")):
        yield _edit(
            (replace(row, a=a, alpha=alpha) for row, (a, alpha) in zip(rows, shifted, strict=True)),
            MisreadingKind.SHIFTED,
            (),
            ("a", "alpha"),
            texts[way],
            undone=texts[back],
        )


def _changed(rows: tuple[Row, ...], where: Iterable[int], column: str, value: Callable[[float], float]) -> list[Row]:
    edited = list(rows)
    for i in where:
        edited[i] = _with(edited[i], column, value(getattr(edited[i], column)))
    return edited


def _with(row: Row, column: str, value: float) -> Row:
    values: dict[str, Any] = {column: value}
    return replace(row, **values)


def _cells(rows: tuple[Row, ...], columns: Sequence[str]) -> Iterator[tuple[tuple[int, ...], str, str]]:
    """Yield cells that are not 0 and have a say, and whole columns of them: rows, column, and name in a text."""
    for column in columns:
        filled = [i for i, row in enumerate(rows) if getattr(row, column) and not _is_free(rows, i, column)]
        for i in filled:
            yield (i,), column, f"{column} of row {i + 1}"
        if len(filled) > 1:
            yield tuple(filled), column, f"all {column}"


def _is_free(rows: tuple[Row, ...], i: int, column: str) -> bool:
    """Whether a number is but the zero of the joint, or part of base or tool, which every robot may choose."""
    row = rows[i]
    if column == "theta":
        return row.type.turns
    if column == "d":
        return row.type is JointType.PRISMATIC or (row.type.turns and i in (0, len(rows) - 1))
    at_base = row.convention is Convention.MODIFIED
    return i == (0 if at_base else len(rows) - 1)


def _signs(rows: tuple[Row, ...]) -> Iterator[_Edit]:
    for where, column, name in _cells(rows, ("a", "alpha", "d", "theta")):
        text = f"{name} {'has' if len(where) == 1 else 'have'} the wrong sign"
        yield _edit(_changed(rows, where, column, lambda x: -x), MisreadingKind.SIGN, _named(where), (column,), text)


def _named(where: tuple[int, ...]) -> tuple[int, ...]:
    """Return the rows to name: none for a whole column."""
    return where if len(where) == 1 else ()


def _orders(rows: tuple[Row, ...]) -> Iterator[_Edit]:
    n = len(rows)
    pairs = combinations(range(n), 2) if n <= _MOST_ROWS else ((i, i + 1) for i in range(n - 1))
    for i, k in pairs:
        text = f"rows {i + 1} and {k + 1} are swapped"
        swapped = list(rows)
        swapped[i], swapped[k] = rows[k], rows[i]
        yield _edit(swapped, MisreadingKind.SWAPPED_ROWS, (i, k), (), text)
        if rows[i].type is not rows[k].type:
            swapped[i], swapped[k] = (replace(swapped[x], type=rows[x].type) for x in (i, k))
            yield _edit(swapped, MisreadingKind.SWAPPED_ROWS, (i, k), (*_LENGTHS, *_ANGLES), f"the numbers of {text}")
    if n > 2:
        yield _edit(reversed(rows), MisreadingKind.REVERSED, (), (), "the rows are in reverse order")


def _columns(rows: tuple[Row, ...]) -> Iterator[_Edit]:
    for first, second in (_LENGTHS, ("alpha", "theta")):
        for where in (*((i,) for i in range(len(rows))), tuple(range(len(rows)))):
            edited = list(rows)
            for i in where:
                row = rows[i]
                edited[i] = _with(_with(row, first, getattr(row, second)), second, getattr(row, first))
            place = f"row {where[0] + 1}" if len(where) == 1 else "all rows"
            text = f"{first} and {second} are swapped in {place}"
            yield _edit(edited, MisreadingKind.SWAPPED_COLUMNS, _named(where), (first, second), text)


def _scales(rows: tuple[Row, ...]) -> Iterator[_Edit]:
    for where, columns, name in _quantities(rows, _ANGLES, "all angles"):
        for factor, given, taken in (
            (180.0 / math.pi, "degrees", "radians"),
            (math.pi / 180.0, "radians", "degrees"),
        ):
            yield _edit(
                _scaled(rows, where, columns, factor),
                MisreadingKind.ANGLE_UNIT,
                _named(where),
                columns,
                f"{given} are read as {taken} in {name}",
                undone=f"{taken} are read as {given} in {name}",
            )
    for where, columns, name in _quantities(rows, _LENGTHS, "all lengths"):
        for unit, size in _UNITS:
            for factor, given, taken in ((size, unit, "m"), (1.0 / size, "m", unit)):
                yield _edit(
                    _scaled(rows, where, columns, factor),
                    MisreadingKind.LENGTH_UNIT,
                    _named(where),
                    columns,
                    f"{given} are read as {taken} in {name}",
                    undone=f"{taken} are read as {given} in {name}",
                )


def _quantities(
    rows: tuple[Row, ...], columns: tuple[str, str], name: str
) -> Iterator[tuple[tuple[int, ...], tuple[str, ...], str]]:
    yield tuple(range(len(rows))), columns, name
    for where, column, text in _cells(rows, columns):
        yield where, (column,), text


def _scaled(rows: tuple[Row, ...], where: Iterable[int], columns: Iterable[str], factor: float) -> list[Row]:
    edited, places = rows, tuple(where)
    for column in columns:
        edited = tuple(_changed(edited, places, column, lambda x: factor * x))
    return list(edited)


def _losses(rows: tuple[Row, ...]) -> Iterator[_Edit]:
    for where, column, name in _cells(rows, ("a", "alpha", "d", "theta")):
        if len(where) == 1:
            value = _value_text(column, getattr(rows[where[0]], column))
            lost, added = f"{name} is missing, {value}", f"{name} should be 0, not {value}"
        else:
            lost, added = f"{name} are missing", f"{name} should be 0"
        yield _edit(
            _changed(rows, where, column, lambda _: 0.0),
            MisreadingKind.LOST,
            _named(where),
            (column,),
            lost,
            undone=added,
            undone_kind=MisreadingKind.ADDED,
        )


def _types(rows: tuple[Row, ...]) -> Iterator[_Edit]:
    for i, row in enumerate(rows):
        if not row.type.moves:
            continue
        other = JointType.PRISMATIC if row.type.turns else JointType.REVOLUTE
        edited = [*rows[:i], replace(row, type=other), *rows[i + 1 :]]
        does, should = ("slides", "turn") if row.type.turns else ("turns", "slide")
        back, rather = ("turns", "slide") if row.type.turns else ("slides", "turn")
        yield _edit(
            edited,
            MisreadingKind.TYPE,
            (i,),
            (),
            f"row {i + 1} {does}, but should {should}",
            undone=f"row {i + 1} {back}, but should {rather}",
        )


def _missing(rows: tuple[Row, ...]) -> Iterator[_Edit]:
    for i in range(len(rows) if len(rows) > 1 else 0):
        yield _edit(
            (*rows[:i], *rows[i + 1 :]),
            MisreadingKind.MISSING_ROW,
            (i,),
            (),
            f"row {i + 1} is missing",
            undone=f"row {i + 1} is one too many",
            undone_kind=MisreadingKind.EXTRA_ROW,
        )


def _values(a: tuple[Row, ...], b: tuple[Row, ...]) -> Iterator[_Edit]:
    """Yield table A with a single number of table B, where both have the same form."""
    if len(a) != len(b) or any(x.convention is not y.convention for x, y in zip(a, b, strict=True)):
        return
    for i, (row, other) in enumerate(zip(a, b, strict=True)):
        for column in ("a", "alpha", "d", "theta", "beta"):
            right, wrong = getattr(row, column), getattr(other, column)
            if right != wrong:
                edited = [*a[:i], _with(row, column, wrong), *a[i + 1 :]]
                is_now, was = told_apart(millimetres if column in _LENGTHS else degrees, wrong, right)
                text = f"{column} of row {i + 1} is {is_now}, not {was}"
                yield _edit(edited, MisreadingKind.VALUE, (i,), (column,), text)


def _value_text(column: str, value: float) -> str:
    return millimetres(value) if column in _LENGTHS else degrees(value)
