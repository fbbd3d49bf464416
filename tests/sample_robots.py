"""Robots that tests of several packages share: those of robots/, and odd ones made up for tests."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np
import pytest

from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.links import BaseSpec, LinkSpec, Pose, ToolSpec
from dh2sim.robot.read import load_robot
from dh2sim.robot.row import Convention, JointType, Limits, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only

STANDARD, MODIFIED, HAYATI = Convention.STANDARD, Convention.MODIFIED, Convention.HAYATI
REVOLUTE, CONTINUOUS = JointType.REVOLUTE, JointType.CONTINUOUS
PRISMATIC, FIXED = JointType.PRISMATIC, JointType.FIXED
ODD = math.radians(37.3)

ROBOTS_DIR: Final = Path(__file__).parents[1] / "robots"

NAMES: Final = tuple(sorted(path.stem for path in ROBOTS_DIR.glob("*.yaml")))

KINDS: Final = frozenset({"franka_panda", "puma560", "scara", "ssrms", "stanford", "ur5e"})

COSTLY_NAMES: Final = tuple(name if name in KINDS else pytest.param(name, marks=pytest.mark.slow) for name in NAMES)
"""All robots, for tests that take long for each: the quick suite takes one of a kind."""


@cache
def robot(name: str) -> RobotSpec:
    """Load a file of robots/; a specification cannot be changed, so the tests may share it."""
    return load_robot(ROBOTS_DIR / f"{name}.yaml")


@cache
def model(name: str) -> RobotModel:
    """Build the model of a file of robots/, or the odd one; it cannot be changed, so the tests may share it."""
    return build_model(ODD_ROBOT if name == "odd" else robot(name))


def in_limits(built: RobotModel, count: int, seed: int) -> Array:
    """Joint vectors anywhere in the ranges, shape (count, n); any angle where there is none."""
    ranges = [joint.position_range or (-math.pi, math.pi) for joint in built.moving_joints]
    lower, upper = zip(*ranges, strict=True) if ranges else ((), ())
    return np.random.default_rng(seed).uniform(lower, upper, (count, len(ranges)))


def row(
    name: str,
    joint_type: str = "revolute",
    convention: Convention = STANDARD,
    *,
    a: float = 0.0,
    alpha: float = 0.0,
    d: float = 0.0,
    theta: float = 0.0,
    beta: float = 0.0,
    flip: bool = False,
) -> Row:
    return Row(
        name=name,
        type=JointType(joint_type),
        convention=convention,
        a=a,
        alpha=alpha,
        d=d,
        theta=theta,
        beta=beta,
        flip=flip,
    )


STANFORD = RobotSpec(
    name="stanford",
    rows=(
        row("waist", d=0.4, alpha=-math.pi / 2),
        row("shoulder", d=0.15, alpha=math.pi / 2),
        row("reach", "prismatic"),
        row("yaw", alpha=-math.pi / 2),
        row("pitch", alpha=math.pi / 2),
        row("roll", d=0.3),
    ),
)

ODD_ROBOT = RobotSpec(
    name="odd",
    rows=(
        Row(
            name="one",
            type=REVOLUTE,
            convention=STANDARD,
            a=0.1,
            alpha=ODD,
            d=0.2,
            theta=0.3,
            flip=True,
            limits=Limits(position=(-2.0, 1.5), velocity=3.1, effort=77.0),
        ),
        Row(
            name="two",
            type=PRISMATIC,
            convention=MODIFIED,
            a=-0.2,
            alpha=-1.1,
            d=0.05,
            theta=-0.7,
            flip=True,
            limits=Limits(position=(-0.1, 0.4)),
        ),
        Row(name="three", type=FIXED, convention=MODIFIED, a=0.3, alpha=0.4, d=-0.1, theta=1.9),
        Row(name="four", type=CONTINUOUS, convention=STANDARD, a=0.25, alpha=-ODD, d=0.15, theta=-2.2),
        Row(
            name="five",
            type=PRISMATIC,
            convention=STANDARD,
            a=0.12,
            alpha=2.1,
            d=-0.3,
            theta=0.9,
            link=LinkSpec(mass=1.7, com=read_only([0.03, -0.02, 0.05])),
        ),
        Row(name="six", type=REVOLUTE, convention=MODIFIED, a=0.07, alpha=ODD, d=0.11, theta=-0.4),
    ),
    base=BaseSpec(pose=Pose(xyz=read_only([0.5, -0.4, 0.3]), rpy=read_only([0.2, -0.5, 1.3]))),
    tool=ToolSpec(xyz=read_only([0.02, 0.03, -0.1]), rpy=read_only([-0.8, 0.6, 2.4])),
    configurations=MappingProxyType({"home": read_only([0.4, 0.2, -2.5, 0.3, 1.1])}),
)
"""Odd twists, both conventions, every joint type, flips, a base and a tool."""
