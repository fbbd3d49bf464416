"""Serial chains with axes in every special position, and their kinematics by products of exponentials.

A chain is drawn as axes in the base at coordinates zero; its links' frames are anything. The oracle knows only the
axes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dh2sim.kinematics.serial_chain import SerialChain, SerialJoint
from dh2sim.robot.row import JointType
from dh2sim.typing import Array

CASES = (
    "coincident",
    "coincident antiparallel",
    "parallel",
    "antiparallel",
    "intersecting",
    "intersecting at 37.3 degrees",
    "skew",
    "skew at -123.4 degrees",
)


@dataclass(frozen=True)
class Axis:
    """A joint axis in the base at coordinates zero."""

    point: Array
    direction: Array
    type: JointType = JointType.REVOLUTE


def unit(vector: object) -> Array:
    array = np.asarray(vector, dtype=float)
    return np.asarray(array / np.linalg.norm(array))


def turn(axis: Array, angle: float) -> Array:
    """A rotation matrix by Rodrigues' formula."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * (K @ K))


def pose(R: Array, p: Array) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, p
    return T


def random_pose(rng: np.random.Generator) -> Array:
    return pose(turn(unit(rng.normal(size=3)), rng.uniform(-3, 3)), rng.uniform(-0.5, 0.5, 3))


def chain_of(axes: list[Axis], T_base_tip: Array, rng: np.random.Generator | None = None) -> SerialChain:
    """Return the chain with these axes; links' frames stand on the axes, or with a generator anywhere."""
    joints, previous = [], np.eye(4)
    for i, axis in enumerate(axes, start=1):
        T = pose(np.eye(3), axis.point) if rng is None else random_pose(rng)
        to_link = np.linalg.inv(T)
        joints.append(
            SerialJoint(
                name=f"joint_{i}",
                type=axis.type,
                T_parent_link=np.linalg.inv(previous) @ T,
                axis=unit(to_link[:3, :3] @ axis.direction),
                point=to_link[:3, :3] @ axis.point + to_link[:3, 3],
            )
        )
        previous = T
    return SerialChain(joints=tuple(joints), T_link_tip=np.linalg.inv(previous) @ T_base_tip)


def tip_by_exponentials(axes: list[Axis], T_base_tip: Array, q: Array) -> Array:
    """e^(S1 q1) … e^(Sn qn) M: K. M. Lynch, F. C. Park, Modern Robotics, 2017, section 4.1.1."""
    T = np.eye(4)
    for axis, coordinate in zip(axes, q, strict=True):
        if axis.type.turns:
            R = turn(axis.direction, coordinate)
            T = T @ pose(R, axis.point - R @ axis.point)
        else:
            T = T @ pose(np.eye(3), coordinate * axis.direction)
    return T @ T_base_tip


def random_axes(rng: np.random.Generator, count: int, noise: float) -> tuple[list[Axis], Array]:
    """Draw axes, each in a special position to the one before, off by the noise, and a tip."""
    point = np.zeros(3) if rng.random() < 0.7 else rng.uniform(-0.5, 0.5, 3)
    z = np.array([0.0, 0.0, 1.0]) if rng.random() < 0.6 else unit(rng.normal(size=3))
    axes = []
    for _ in range(count):
        kind = JointType(rng.choice(["revolute", "continuous", "prismatic"]))
        axes.append(Axis(point=point, direction=z, type=kind))
        x = unit(np.cross(z, rng.normal(size=3) if rng.random() < 0.5 else [0.3, 1.0, 0.2]))
        point, z = next_axis(str(rng.choice(CASES)), point, z, x, rng)
        point = point + noise * rng.uniform(-1, 1, 3)
        z = unit(z + noise * rng.uniform(-1, 1, 3))
    return axes, tip(axes[-1], rng)


def next_axis(case: str, point: Array, z: Array, x: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return point and direction of an axis in a special position to one at ``point`` along ``z``."""
    point = point + rng.choice([0.0, 0.3, 1.0]) * z
    y = np.cross(z, x)
    angle = {"intersecting": 90.0, "skew": -90.0}.get(case, 37.3 if "37.3" in case else -123.4)
    if "antiparallel" in case:
        turned = -z
    elif "coincident" in case or "parallel" in case:
        turned = z
    else:
        turned = math.cos(math.radians(angle)) * z + math.sin(math.radians(angle)) * y
    if "coincident" not in case and "intersecting" not in case:
        point = point + rng.choice([0.0203, 0.4318]) * x
    return point + rng.choice([0.0, 0.3]) * turned, turned


def tip(last: Axis, rng: np.random.Generator) -> Array:
    """A tip on the last axis, beside it, or anywhere."""
    where = rng.integers(3)
    if where == 0:
        return random_pose(rng)
    x = unit(np.cross(last.direction, [0.1, 0.5, 0.9]))
    R = np.array([x, np.cross(last.direction, x), last.direction]).T
    return pose(R, last.point + 0.1 * last.direction + (0.2 * x if where == 1 else 0.0))
