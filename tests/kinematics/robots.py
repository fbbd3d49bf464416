"""Robots that several tests use."""

from __future__ import annotations

import math

from dh2sim.robot.spec import BaseSpec, Convention, JointType, Pose, RobotSpec, Row
from dh2sim.typing import read_only

STANDARD, MODIFIED, HAYATI = Convention.STANDARD, Convention.MODIFIED, Convention.HAYATI
ODD = math.radians(37.3)


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

ODD_ARM = RobotSpec(
    name="odd",
    rows=(
        row("one", a=0.1, alpha=ODD, d=0.2, theta=0.3),
        row("two", "prismatic", MODIFIED, a=-0.2, alpha=-1.1, d=0.05, theta=-0.7, flip=True),
        row("three", "fixed", MODIFIED, a=0.3, alpha=0.4, d=-0.1, theta=1.9),
        row("four", "continuous", a=0.25, alpha=-ODD, d=0.15, theta=-2.2, flip=True),
        row("five", "prismatic", a=0.12, alpha=2.1, d=-0.3, theta=0.9),
        row("six", "revolute", MODIFIED, a=0.07, alpha=ODD, d=0.11, theta=-0.4),
    ),
    base=BaseSpec(pose=Pose(xyz=read_only([0.5, -0.4, 0.3]), rpy=read_only([0.2, -0.5, 1.3]))),
    tool=Pose(xyz=read_only([0.02, 0.03, -0.1]), rpy=read_only([-0.8, 0.6, 2.4])),
)
