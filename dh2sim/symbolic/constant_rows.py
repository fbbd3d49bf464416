"""Rows that do not move, between joints: one transform in numbers, so that what is printed stays short.

Odd angles of several fixed rows would be multiplied out in letters, into expressions of hundreds of terms that are
nothing but constants. Two axes have one common normal: along the first axis and about it, along the normal and about
it, and the same of the second axis, are six numbers, which get names.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Final

from dh2sim.symbolic.angles import Angle
from dh2sim.symbolic.polynomial import ZERO, Polynomial
from dh2sim.symbolic.table import Letter, Motion, Run, constant_angle

_ROUNDING: Final = 2e-15
"""Sine of an angle between axes that are parallel, and share of a length that is none."""
_NEARLY_PARALLEL: Final = 1e-6
"""Sine of an angle below which the common normal is too far away for the digits of a double."""

Vector = tuple[float, float, float]


def constant_runs(
    motions: Sequence[Motion],
    frames: Mapping[str, int],
    fixed: Sequence[int],
    letters: Mapping[str, Letter],
    angle: Callable[[float, str], Angle],
    length: Callable[[float, str], Polynomial],
) -> Iterator[Run]:
    """Yield the stretches of constant motions between joints that are shorter as one transform.

    Args:
        motions: From base_link to tool0.
        frames: How many of them lead to each frame.
        fixed: Rows that do not move, counted from 1.
        letters: The constants that have names, all of which have numbers.
        angle: Names an angle, rad.
        length: Names a length, in the file's unit.
    """
    first, last = frames["dh_0"], frames[f"dh_{sum(name.startswith('dh_') for name in frames) - 1}"]
    moving = [index for index in range(first, last) if not _is_constant(motions[index], letters)]
    for before, after in pairwise([first - 1, *moving, last]):
        start, end = before + 1, after
        row = next((i for i in fixed if start <= frames[f"dh_{i - 1}"] and frames[f"dh_{i}"] <= end), None)
        if row is None:
            continue
        replacement = _common_normal(motions[start:end], letters, row, angle, length)
        if replacement and _odd(replacement) < _odd(motions[start:end]):
            yield Run(start, end, replacement)


def _is_constant(motion: Motion, letters: Mapping[str, Letter]) -> bool:
    """Whether a motion depends on neither a coordinate nor a parameter of the file."""
    names = {name for name, _ in motion.angle.names} | {atom for entry in motion.shift for atom in entry.atoms}
    known = all(name in letters and not letters[name].definition for name in names)
    return motion.angle.is_constant and known


def _odd(motions: Sequence[Motion]) -> int:
    """Return how many odd angles there are, besides those at either end that add to the angle of a joint."""
    turns = [motion for motion in motions if motion.kind != "T" and motion.angle]
    inner = [k for k, motion in enumerate(turns) if motion.kind != "Rz"]
    return sum(bool(motion.angle.names) for motion in turns[inner[0] : inner[-1] + 1]) if inner else 0


def _common_normal(
    motions: Sequence[Motion],
    letters: Mapping[str, Letter],
    row: int,
    angle: Callable[[float, str], Angle],
    length: Callable[[float, str], Polynomial],
) -> list[Motion]:
    """Return constant motions as Tz Rz Tx Rx Tz Rz; empty where the common normal is too far away."""
    R, p = _product(motions, letters)
    (xx, _, zx), (xy, _, zy), (r20, r21, zz) = R
    sine = math.hypot(zx, zy)
    if sine <= _ROUNDING:
        zeta = math.atan2(p[1], p[0]) if math.hypot(p[0], p[1]) > _ROUNDING else 0.0
        turn = math.atan2(xy, xx)
        xi, psi = (0.0, turn - zeta) if zz > 0 else (math.pi, zeta - turn)
        u, v, w = p[2], math.hypot(p[0], p[1]), 0.0
    elif sine < _NEARLY_PARALLEL:
        return []
    else:
        zeta, xi, psi = math.atan2(zx, -zy), math.atan2(sine, zz), math.atan2(r20, r21)
        v = p[0] * math.cos(zeta) + p[1] * math.sin(zeta)
        w = (p[0] * math.sin(zeta) - p[1] * math.cos(zeta)) / sine
        u = p[2] - w * zz
    least = _ROUNDING * max(1.0, *map(abs, p))

    def along(value: float, name: str) -> Polynomial:
        return ZERO if abs(value) <= least else length(value, f"{name}_{row}")

    return [
        Motion("T", shift=(ZERO, ZERO, along(u, "u"))),
        Motion("Rz", angle(zeta, f"zeta_{row}")),
        Motion("T", shift=(along(v, "v"), ZERO, ZERO)),
        Motion("Rx", angle(xi, f"xi_{row}")),
        Motion("T", shift=(ZERO, ZERO, along(w, "w"))),
        Motion("Rz", angle(psi, f"psi_{row}")),
    ]


def _product(motions: Sequence[Motion], letters: Mapping[str, Letter]) -> tuple[list[Vector], Vector]:
    """Return the rotation, by rows, and the position that constant motions come to."""
    values = {name: letter.value for name, letter in letters.items()}
    columns: list[Vector] = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    position: Vector = (0.0, 0.0, 0.0)
    for motion in motions:
        if motion.kind == "T":
            for entry, column in zip(motion.shift, columns, strict=True):
                size = entry.value(values)
                position = _sum(position, 1.0, column, size)
            continue
        theta = constant_angle(motion.angle, letters)
        c, s = math.cos(theta), math.sin(theta)
        i, j = {"Rx": (1, 2), "Ry": (2, 0), "Rz": (0, 1)}[motion.kind]
        columns[i], columns[j] = _sum(columns[i], c, columns[j], s), _sum(columns[j], c, columns[i], -s)
    return [(x, y, z) for x, y, z in zip(*columns, strict=True)], position


def _sum(left: Vector, m: float, right: Vector, n: float) -> Vector:
    x, y, z = (m * a + n * b for a, b in zip(left, right, strict=True))
    return x, y, z
