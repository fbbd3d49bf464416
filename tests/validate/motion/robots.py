"""Robots that the physics checks are tested with."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from dh2sim import build_model, load_robot, parse_robot
from dh2sim.model.mass import MassProperties
from dh2sim.model.robot_model import RobotModel

FRICTION = """\
name: friction
convention: standard
joints:
  - type: revolute
    a: 0.4
    alpha: 1.3
    limits: {position: [-2, 2]}
    dynamics: {damping: 0.5, friction: 3, armature: 0.05}
  - {type: revolute, a: 0.3, limits: {position: [-2, 2]}, dynamics: {damping: 0.2, friction: 1, armature: 0.02}}
"""

PENDULUM = """\
name: pendulum
convention: standard
base: {rpy: [1.5707963267948966, 0, 0]}
joints:
  - type: continuous
    a: 0.5
    dynamics: {armature: 0.2}
    link: {mass: 2, com: [-0.1, 0, 0], inertia: {ixx: 0.03, iyy: 0.04, izz: 0.05, ixy: 0, ixz: 0, iyz: 0}}
"""
"""Turns about a horizontal axis; its centre of mass is 0.4 m away from that."""

TURNTABLE = "name: turntable\nconvention: standard\njoints:\n  - {type: continuous, a: 0.5}\n"

LIFT = "name: lift\nconvention: standard\njoints:\n  - {type: prismatic, limits: {position: [0, 1]}}\n"

WEAK = """\
name: weak
convention: standard
base: {rpy: [1.5707963267948966, 0, 0]}
joints:
  - {type: revolute, a: 0.5, limits: {position: [-0.5, 0.5], effort: 0.01}, link: {mass: 5, com: [0, 0, 0]}}
"""

FOLDED = """\
name: folded
convention: standard
joints:
  - {type: revolute, a: 0.5, limits: {position: [-3, 3]}}
  - {type: revolute, a: 0.5, limits: {position: [-3, 3]}}
  - {type: revolute, a: 0.5, limits: {position: [-3, 3]}}
configurations: {home: [0, 0, 0], folded: [0, 2.1, 2.1]}
"""
"""In 'folded' its links make a triangle, and the last one runs into the first."""


@cache
def built(name_or_text: str) -> RobotModel:
    """The model of a robot that comes with dh2sim, or of a robot file's text."""
    spec = parse_robot(name_or_text) if "\n" in name_or_text else load_robot(name_or_text)
    return build_model(spec)


def heavier(model: RobotModel, link: int, factor: float) -> RobotModel:
    """The robot with one link (from 0) of another mass."""
    own = model.links[link].inertial
    assert own is not None
    changed = MassProperties(mass=factor * own.mass, com=own.com, inertia=own.inertia)
    links = list(model.links)
    links[link] = replace(links[link], inertial=changed)
    return replace(model, links=tuple(links))
