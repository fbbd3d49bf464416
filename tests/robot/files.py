"""Robot files as text, and what is said of wrong ones."""

from __future__ import annotations

import textwrap
from pathlib import Path

from dh2sim.errors import RobotFileError
from dh2sim.robot.read import parse_robot
from dh2sim.robot.spec import RobotSpec

MINIMAL = "name: r\nconvention: standard\njoints:\n- {type: revolute}\n"

FULL = """\
name: full
description: Every key there is
source: made up
convention: modified
units: {angle: deg, length: mm}
parameters: {d1: 400, a2: d1 / 2}
base: {xyz: [0, 0, 100], rpy: [0, 0, 90], color: [1, 1, 1]}
tool: {xyz: [0, 0, 10], rpy: [0, 45, 0]}
gravity: [0, 0, -1.62]
joints:
- name: turn
  type: revolute
  convention: standard
  a: a2
  alpha: -90
  d: d1
  theta: 45
  flip: true
  limits: {position: [-170, 170], velocity: 90, effort: 50}
  dynamics: {damping: 0.1, friction: 0.2, armature: 0.3}
  link:
    mass: 9.29
    com: [1, 2, 3]
    inertia: {ixx: 2, iyy: 3, izz: 4, ixy: 0.1, ixz: 0.2, iyz: 0.3}
    density: 2700
    radius: 40
    color: [0.8, 0.4, 0.1, 0.5]
  actuator: {kp: 7}
- {type: prismatic, a: 10, limits: {position: [0, 300], velocity: 100}}
- {type: fixed, d: 5}
- {type: continuous, actuator: {type: motor}}
configurations: {home: [90, 100, "180 / 2"]}
actuators: {type: position, kp: 100, kv: 10}
"""


def robot(text: str, directory: Path | None = None) -> RobotSpec:
    return parse_robot(textwrap.dedent(text), file="r.yaml", directory=directory)


def complaints(text: str | bytes, directory: Path | None = None) -> list[str]:
    """Return every problem of a wrong file, as a user sees it."""
    if isinstance(text, str):
        text = textwrap.dedent(text)
    try:
        parse_robot(text, file="r.yaml", directory=directory)
    except RobotFileError as error:
        return str(error).split("\n")
    return []


def with_joint(joint: str) -> str:
    """Return a robot file whose only row stands at line 4, column 3."""
    return f"name: r\nconvention: standard\njoints:\n- {joint}\n"


def with_keys(keys: str) -> str:
    """Return a robot file with more keys, from line 5."""
    return MINIMAL + textwrap.dedent(keys)
