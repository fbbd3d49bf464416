"""Models that several tests use, and MuJoCo's view of them."""

from __future__ import annotations

import math
from functools import cache
from types import MappingProxyType

import mujoco
import numpy as np

from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.spec import BaseSpec, Convention, JointType, Limits, LinkSpec, Pose, RobotSpec, Row
from dh2sim.typing import Array, read_only
from tests.robots.samples import robot

STANDARD, MODIFIED, HAYATI = Convention.STANDARD, Convention.MODIFIED, Convention.HAYATI
REVOLUTE, CONTINUOUS = JointType.REVOLUTE, JointType.CONTINUOUS
PRISMATIC, FIXED = JointType.PRISMATIC, JointType.FIXED
ODD = math.radians(37.3)

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
    tool=Pose(xyz=read_only([0.02, 0.03, -0.1]), rpy=read_only([-0.8, 0.6, 2.4])),
    configurations=MappingProxyType({"home": read_only([0.4, 0.2, -2.5, 0.3, 1.1])}),
)
"""Odd twists, both conventions, every joint type, flips, a base and a tool."""


@cache
def model(name: str) -> RobotModel:
    """Build the model of a file of robots/, or the odd one; it cannot be changed, so the tests may share it."""
    return build_model(ODD_ROBOT if name == "odd" else robot(name))


def in_limits(built: RobotModel, count: int, seed: int) -> Array:
    """Joint vectors anywhere in the ranges, shape (count, n); any angle where there is none."""
    ranges = [joint.position_range or (-math.pi, math.pi) for joint in built.moving_joints]
    lower, upper = zip(*ranges, strict=True) if ranges else ((), ())
    return np.random.default_rng(seed).uniform(lower, upper, (count, len(ranges)))


def compiled(built: RobotModel) -> mujoco.MjModel:
    """What MuJoCo makes of a model's MJCF."""
    return mujoco.MjModel.from_xml_string(to_mjcf(built))


def body_inertia(mj: mujoco.MjModel, body: int) -> Array:
    """A body's inertia about its centre of mass, along the body's axes, shape (3, 3)."""
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, mj.body_iquat[body])
    R = rotation.reshape(3, 3)
    tensor: Array = R @ np.diag(mj.body_inertia[body]) @ R.T
    return tensor
