"""Robots given by their joint axes, for tests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dh2sim.importing.axes import import_axes
from dh2sim.importing.result import Imported
from dh2sim.robot.axes_file import AxesSpec, AxisJoint
from dh2sim.robot.links import Pose
from dh2sim.robot.row import Convention, JointType, Limits
from dh2sim.typing import read_only

TURN, SLIDE = JointType.REVOLUTE, JointType.PRISMATIC
STANDARD, MODIFIED = Convention.STANDARD, Convention.MODIFIED
Axis = tuple[JointType, Sequence[float], Sequence[float]]
"""Type, point and direction."""


def axes_spec(
    *axes: Axis,
    tip: Sequence[float],
    rpy: Sequence[float] = (0, 0, 0),
    names: Sequence[str] = (),
    limits: Sequence[Limits] = (),
) -> AxesSpec:
    joints = [
        AxisJoint(
            name=names[i] if names else f"joint_{i + 1}",
            type=kind,
            point=read_only(point),
            direction=read_only(np.array(direction) / np.linalg.norm(direction)),
            limits=limits[i] if limits else Limits(),
        )
        for i, (kind, point, direction) in enumerate(axes)
    ]
    tool = Pose(xyz=read_only(tip), rpy=read_only(np.radians(rpy)))
    return AxesSpec(name="sample", joints=tuple(joints), tool=tool)


def made_of(
    *axes: Axis,
    tip: Sequence[float],
    convention: Convention = STANDARD,
    rpy: Sequence[float] = (0, 0, 0),
    names: Sequence[str] = (),
    limits: Sequence[Limits] = (),
) -> Imported:
    spec = axes_spec(*axes, tip=tip, rpy=rpy, names=names, limits=limits)
    return import_axes(spec, convention=convention)


def random_axes(seed: int) -> list[Axis]:
    """Axes of which each is one line with the one before, or parallel, intersecting or skew to it."""
    rng = np.random.default_rng(seed)
    point, z = rng.choice([0.0, 0.3], 3), np.array([0.0, 0.0, 1.0])
    axes: list[Axis] = []
    for _ in range(int(rng.integers(2, 8))):
        kind = JointType(rng.choice([TURN, TURN, SLIDE]))
        axes.append((kind, tuple(point.tolist()), tuple(z.tolist())))
        across = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
        across /= np.linalg.norm(across)
        turn = np.radians(rng.choice([0.0, 180.0, 90.0, -37.3, 123.4]))
        point = point + rng.choice([0.0, 0.4]) * z + rng.choice([0.0, 0.2]) * across
        z = np.cos(turn) * z + np.sin(turn) * np.cross(across, z)
        point = point + rng.choice([0.0, 0.3]) * z
    return axes
