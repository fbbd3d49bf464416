"""Robots that tests of rollouts simulate."""

from __future__ import annotations

from types import MappingProxyType

from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.links import LinkSpec
from dh2sim.robot.row import ActuatorSpec, ActuatorType, Convention, Dynamics, JointType, Limits, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import read_only


def worm() -> RobotModel:
    """Five links that curl until they touch, with dry friction and limits: all that needs MuJoCo's solver."""
    rows = tuple(
        Row(
            name=f"joint_{i}",
            type=JointType.REVOLUTE,
            convention=Convention.STANDARD,
            a=0.35,
            alpha=0.02,
            flip=i == 4,
            limits=Limits(position=(-2.9, 2.9), effort=5.0),
            dynamics=Dynamics(damping=0.1, friction=0.05, armature=0.02),
            link=LinkSpec(radius=0.05),
        )
        for i in range(1, 6)
    )
    curled = read_only([0.3, 1.2, 1.5, -1.7, 0.9])
    return build_model(
        RobotSpec(
            name="worm",
            rows=rows,
            gravity=read_only([0.0, -9.81, 0.0]),
            configurations=MappingProxyType({"home": read_only([0.1] * 5), "curled": curled}),
        )
    )


def arm(actuators: ActuatorType = ActuatorType.POSITION, *, joints: int = 2, armature: float = 0.05) -> RobotModel:
    """Some links in a plane, and the last joint slides if there are more than one."""
    rows = tuple(
        Row(
            name=f"joint_{i}",
            type=JointType.PRISMATIC if 1 < i == joints else JointType.REVOLUTE,
            convention=Convention.STANDARD,
            a=0.3,
            alpha=0.4,
            limits=Limits(position=(-0.5, 0.75) if 1 < i == joints else (-1.5, 2.0), velocity=3.0, effort=40.0),
            dynamics=Dynamics(damping=0.5, armature=armature),
            actuator=ActuatorSpec(type=actuators),
        )
        for i in range(1, joints + 1)
    )
    return build_model(RobotSpec(name="arm", rows=rows))


def actuator(kind: str) -> ActuatorSpec:
    """An actuator of a kind, its gains left open."""
    return ActuatorSpec(type=ActuatorType(kind))
