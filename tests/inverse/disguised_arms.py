"""Arms of the classes that textbooks solve, with random lengths, and in tables that do not look like a textbook's.

A disguise is another zero, flipped joints, a base and a tool anywhere, rows moved to the modified convention, fixed
rows in between, another unit of length: none of it changes the mechanism's class.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from dh2sim.kinematics.conversion import convert_rows
from dh2sim.robot.links import BaseSpec, Pose, ToolSpec
from dh2sim.robot.row import Convention, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.sample_robots import row

_RIGHT = math.pi / 2
Lengths = Callable[[], float]


def _wrist(d: float) -> list[Row]:
    return [row("j4", alpha=-_RIGHT), row("j5", alpha=_RIGHT), row("j6", d=d)]


def _slide(name: str, alpha: float = 0.0, a: float = 0.0, d: float = 0.0, theta: float = 0.0) -> Row:
    return row(name, "prismatic", alpha=alpha, a=a, d=d, theta=theta)


def _elbow(x: Lengths, *, offsets: bool) -> list[Row]:
    a1 = x() if offsets else 0.0
    return [
        row("j1", a=a1, alpha=-_RIGHT, d=x()),
        row("j2", a=x(), d=x()),
        row("j3", a=x() if offsets else 0.0, alpha=-_RIGHT, d=x(), theta=-_RIGHT),
        row("j4", d=x(), alpha=_RIGHT),
        row("j5", alpha=-_RIGHT),
        row("j6", d=x()),
    ]


def _spherical(x: Lengths, *, offsets: bool) -> list[Row]:
    a1, a2 = (x(), x()) if offsets else (0.0, 0.0)
    return [
        row("j1", a=a1, alpha=-_RIGHT, d=x()),
        row("j2", a=a2, alpha=_RIGHT, d=x()),
        _slide("j3", d=x()),
        *_wrist(x()),
    ]


def _offset_wrist(x: Lengths, *, offsets: bool) -> list[Row]:
    a1, a4 = (x(), x()) if offsets else (0.0, 0.0)
    return [
        row("j1", a=a1, alpha=_RIGHT, d=x()),
        row("j2", a=x(), d=x()),
        row("j3", a=x()),
        row("j4", a=a4, alpha=_RIGHT, d=x()),
        row("j5", alpha=-_RIGHT, d=x()),
        row("j6", d=x()),
    ]


def _planar(count: int, x: Lengths) -> list[Row]:
    return [row(f"j{i + 1}", a=x(), d=x(), alpha=math.pi if i == 1 else 0.0) for i in range(count)]


_CLASSES: Final[dict[str, tuple[int, Callable[[Lengths], list[Row]]]]] = {
    "puma": (8, lambda x: _elbow(x, offsets=False)),
    "elbow with offsets": (8, lambda x: _elbow(x, offsets=True)),
    "stanford": (8, lambda x: _spherical(x, offsets=False)),
    "spherical with offsets": (8, lambda x: _spherical(x, offsets=True)),
    "cylindrical": (4, lambda x: [row("j1", d=x()), _slide("j2", -_RIGHT), _slide("j3", d=x()), *_wrist(x())]),
    "cylindrical beside its axis": (
        4,
        lambda x: [_slide("j1", a=x()), row("j2", a=x(), alpha=_RIGHT), _slide("j3"), *_wrist(x())],
    ),
    "cartesian": (
        2,
        lambda x: [
            _slide("j1", -_RIGHT, x()),
            _slide("j2", _RIGHT, theta=_RIGHT),
            _slide("j3", d=x()),
            *_wrist(x()),
        ],
    ),
    "scara with wrist": (4, lambda x: [row("j1", a=x()), row("j2", a=x()), _slide("j3", _RIGHT), *_wrist(x())]),
    "scara": (2, lambda x: [*_planar(2, x), _slide("j3"), row("j4", d=x())]),
    "scara, slide first": (2, lambda x: [_slide("j0", a=x()), *_planar(3, x)]),
    "scara without hand": (1, lambda x: [row("j1", a=x()), _slide("j2"), row("j3", a=x())]),
    "planar 2R": (1, lambda x: _planar(2, x)),
    "planar 3R": (2, lambda x: _planar(3, x)),
    "spherical wrist": (2, lambda x: _wrist(x())),
    "offset wrist": (8, lambda x: _offset_wrist(x, offsets=False)),
    "offset wrist with more offsets": (8, lambda x: _offset_wrist(x, offsets=True)),
    "elbow alone": (1, lambda x: [row("j1", alpha=-_RIGHT, d=x()), row("j2", a=x(), d=x()), row("j3", a=x())]),
    "spherical alone": (1, lambda x: [row("j1", alpha=-_RIGHT, d=x()), row("j2", alpha=_RIGHT, d=x()), _slide("j3")]),
    "cylindrical alone": (1, lambda x: [row("j1", d=x()), _slide("j2", -_RIGHT), _slide("j3", d=x())]),
    "elbow with two-axis wrist": (
        4,
        lambda x: [
            row("j1", alpha=-_RIGHT),
            row("j2", a=x()),
            row("j3", a=x()),
            row("j4", alpha=_RIGHT),
            row("j5", d=x()),
        ],
    ),
    "elbow with pitch": (
        2,
        lambda x: [row("j1", alpha=-_RIGHT, d=x()), row("j2", a=x()), row("j3", a=x()), row("j4", a=x())],
    ),
}
CLASSES: Final = {name: count for name, (count, _) in _CLASSES.items()}
"""Greatest number of configurations that reach one pose."""


def textbook_table(name: str, seed: int) -> RobotSpec:
    """Return an arm of a class in a table like a textbook's, with random lengths."""
    rng = np.random.default_rng([seed, len(name)])

    def length() -> float:
        return float(rng.uniform(0.1, 0.6) * rng.choice([-1.0, 1.0]))

    return RobotSpec(name="arm", rows=tuple(_CLASSES[name][1](length)))


def disguised(spec: RobotSpec, seed: int) -> RobotSpec:
    """Return an arm of the same class in a table of another zero, base, tool, convention and size."""
    rng = np.random.default_rng(seed)
    scale = float(rng.choice([1e-3, 1.0, 1e3]))

    def pose() -> Pose:
        return Pose(xyz=read_only(scale * rng.uniform(-0.5, 0.5, 3)), rpy=read_only(rng.uniform(-3.0, 3.0, 3)))

    rows = []
    for given in spec.rows:
        moved = replace(given, a=given.a * scale, d=given.d * scale, flip=bool(rng.integers(2)))
        if given.type.turns:
            moved = replace(moved, theta=given.theta + float(rng.uniform(-3.0, 3.0)))
        else:
            moved = replace(moved, d=moved.d + scale * float(rng.uniform(-0.5, 0.5)))
        rows.append(moved)
        if rng.integers(3) == 0:  # a fixed row turns the zero further
            rows[-1] = replace(moved, a=0.0, alpha=0.0)
            turn = float(rng.uniform(-3.0, 3.0)) if given.type.turns else 0.0
            rows.append(row(f"{given.name}b", "fixed", theta=turn, a=moved.a, alpha=moved.alpha))
    made = replace(spec, rows=tuple(rows), base=BaseSpec(pose=pose()), tool=ToolSpec.at(pose()))
    if rng.integers(2):
        made = convert_rows(made, Convention.MODIFIED).spec
    return made


def random_configuration(spec: RobotSpec, seed: int) -> Array:
    """Return a joint vector anywhere, rad and m, shape (n,): slides over the arm's own length."""
    rng = np.random.default_rng(seed)
    size = max(abs(length) for given in spec.rows for length in (given.a, given.d))
    return read_only(
        [
            rng.uniform(-math.pi, math.pi) if given.type.turns else rng.uniform(-size, size)
            for given in spec.moving_rows
        ]
    )
