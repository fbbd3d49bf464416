"""Limits, masses, inertias, gains of two robots, compared where both give them.

Position limits of B are compared as A counts the coordinate; centres of mass and inertias where link i of A is taken
to that of B. What one of them leaves open is not a difference: dh2sim would estimate it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dh2sim.compare.words import degrees, millimetres, number
from dh2sim.kinematics.table_oracle import table_frame_poses
from dh2sim.robot.links import LinkSpec
from dh2sim.robot.row import ActuatorType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array

_ROUNDING = 1e-9
"""By which numbers may differ at any tolerance, as a share of the larger."""


@dataclass(frozen=True, slots=True, kw_only=True)
class QuantityDifference:
    """A quantity that both robots give, and give differently."""

    joint: str
    """Of A; of a link's quantity, the joint that moves it."""
    quantity: str
    a: str
    """The value in A, with its unit."""
    b: str
    """The value in B, as A counts."""

    def __str__(self) -> str:
        between = f"{self.a} in A, {self.b} in B" if self.a else f"in B {self.b}"
        return f"{self.joint}: {self.quantity} {between}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointPair:
    """A joint of each robot: q_B = sense q_A + zero."""

    a: int
    """Index among the moving rows of A."""
    b: int
    sense: float
    zero: float
    T_b_a: Array
    """Motion that takes the link of A, at coordinate zero and in base_link, to that of B, shape (4, 4)."""


def quantity_differences(
    a: RobotSpec, b: RobotSpec, pairs: Sequence[JointPair], tolerance: float
) -> tuple[QuantityDifference, ...]:
    """Return the quantities that two robots of the same mechanism give differently.

    Args:
        a: Robot A.
        b: Robot B.
        pairs: Their joints.
        tolerance: Greatest difference, as a share of the larger value; of lengths and angles, m and rad.
    """
    bodies_a, bodies_b = _bodies(a), _bodies(b)
    found: list[QuantityDifference] = []
    for pair in pairs:
        row_a, row_b = a.moving_rows[pair.a], b.moving_rows[pair.b]
        found += _limits(row_a, row_b, pair, tolerance)
        found += _numbers(row_a, row_b, tolerance)
        found += _masses(row_a.name, bodies_a[pair.a], bodies_b[pair.b], pair.T_b_a, tolerance)
    return tuple(found)


def _limits(a: Row, b: Row, pair: JointPair, tolerance: float) -> Iterator[QuantityDifference]:
    if a.limits.position is None or b.limits.position is None:
        return
    ends = sorted(pair.sense * (end - pair.zero) for end in b.limits.position)
    gap = max(abs(x - y) for x, y in zip(a.limits.position, ends, strict=True))
    if gap > max(tolerance, _ROUNDING):
        text = degrees if a.type.turns else millimetres
        values = (f"{text(lower)} … {text(upper)}" for lower, upper in (a.limits.position, ends))
        yield _difference(a.name, "position limits", *values)


def _numbers(a: Row, b: Row, tolerance: float) -> Iterator[QuantityDifference]:
    turns = a.type.turns
    of_a, of_b = (
        {
            ("velocity limit", "rad/s" if turns else "m/s"): row.limits.velocity,
            ("effort limit", "N·m" if turns else "N"): row.limits.effort,
            ("acceleration limit", "rad/s²" if turns else "m/s²"): row.limits.acceleration,
            ("jerk limit", "rad/s³" if turns else "m/s³"): row.limits.jerk,
            ("damping", "N·m·s/rad" if turns else "N·s/m"): row.dynamics.damping or None,
            ("friction", "N·m" if turns else "N"): row.dynamics.friction or None,
            ("armature", "kg·m²" if turns else "kg"): row.dynamics.armature or None,
            ("kp", "N·m/rad" if turns else "N/m"): row.actuator.kp,
            ("kv", "N·m·s/rad" if turns else "N·s/m"): row.actuator.kv,
        }
        for row in (a, b)
    )
    for (quantity, unit), x in of_a.items():
        y = of_b[quantity, unit]
        if x is not None and y is not None and abs(x - y) > max(tolerance, _ROUNDING) * max(abs(x), abs(y)):
            yield _difference(a.name, quantity, f"{number(x)} {unit}", f"{number(y)} {unit}")
    types = a.actuator.type, b.actuator.type
    if types[0] is not types[1] and ActuatorType.NONE not in types:
        yield _difference(a.name, "actuator", types[0].value, types[1].value)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Body:
    mass: float
    com: Array | None
    """In base_link at coordinate zero."""
    inertia: Array | None
    """About com, along base_link's axes."""


def _bodies(spec: RobotSpec) -> list[_Body | None]:
    """Return what each moving joint carries until the next, as far as the robot gives it."""
    frames = table_frame_poses(spec, np.zeros(len(spec.moving_rows)))
    groups: list[list[tuple[LinkSpec, Array]]] = []
    for row, frame in zip(spec.rows, frames[1:], strict=True):
        if row.type.moves:
            groups.append([])
        if groups:
            groups[-1].append((row.link, frame))
    if groups and spec.tool.mass is not None:
        tool = LinkSpec(mass=spec.tool.mass, com=spec.tool.com, inertia=spec.tool.inertia)
        groups[-1].append((tool, frames[-1]))
    return [_body(group) for group in groups]


def _body(links: Sequence[tuple[LinkSpec, Array]]) -> _Body | None:
    given = [(link, T) for link, T in links if link.mass is not None]
    if not given or any(link.density is not None for link, _ in links):
        return None
    mass = sum(link.mass or 0.0 for link, _ in given)
    places = [None if link.com is None else T[:3, :3] @ link.com + T[:3, 3] for link, T in given if link.mass]
    if mass == 0.0 or any(place is None for place in places):
        return _Body(mass=mass, com=None, inertia=None)
    heavy = [(link, T) for link, T in given if link.mass]
    known = [place for place in places if place is not None]
    com = sum((link.mass or 0.0) * place for (link, _), place in zip(heavy, known, strict=True)) / mass
    if any(link.inertia is None for link, _ in heavy):
        return _Body(mass=mass, com=np.asarray(com), inertia=None)
    inertia = np.zeros((3, 3))
    for (link, T), place in zip(heavy, known, strict=True):
        arm = place - com
        inertia += T[:3, :3] @ np.asarray(link.inertia) @ T[:3, :3].T
        inertia += (link.mass or 0.0) * (float(arm @ arm) * np.eye(3) - np.outer(arm, arm))
    return _Body(mass=mass, com=np.asarray(com), inertia=inertia)


def _masses(
    name: str, a: _Body | None, b: _Body | None, T_b_a: Array, tolerance: float
) -> Iterator[QuantityDifference]:
    if a is None or b is None:
        return
    share = max(tolerance, _ROUNDING)
    if abs(a.mass - b.mass) > share * max(a.mass, b.mass):
        yield _difference(name, "mass", f"{number(a.mass)} kg", f"{number(b.mass)} kg")
    R = T_b_a[:3, :3]
    if a.com is not None and b.com is not None:
        gap = float(np.linalg.norm(R @ a.com + T_b_a[:3, 3] - b.com))
        if gap > max(share, 1e-7):
            yield _difference(name, "centre of mass", "", f"{millimetres(gap)} away")
    if a.inertia is not None and b.inertia is not None:
        gap = float(np.abs(R @ a.inertia @ R.T - b.inertia).max())
        largest = max(float(np.trace(a.inertia)), float(np.trace(b.inertia)))
        if gap > max(share, 1e-6) * largest:
            moments = (np.linalg.eigvalsh(body.inertia) for body in (a, b) if body.inertia is not None)
            texts = (f"{' '.join(f'{moment:.3g}' for moment in values)} kg·m²" for values in moments)
            yield _difference(name, "inertia", *texts)


def _difference(joint: str, quantity: str, a: str, b: str) -> QuantityDifference:
    return QuantityDifference(joint=joint, quantity=quantity, a=a, b=b)
