"""Robot files that tests of several packages write."""

from __future__ import annotations

from pathlib import Path

ODD = """\
name: odd
description: Odd twists, both conventions, a slide, a flip and a row that is fixed
convention: standard
base: {xyz: [0.5, -0.4, 0.3], rpy: [0.2, -0.5, 1.3]}
tool: {xyz: [0.02, 0.03, -0.1], rpy: [-0.8, 0.6, 2.4]}
joints:
  - {name: one, type: revolute, a: 0.1, alpha: 0.651, d: 0.2, theta: 0.3, limits: {position: [-2.5, 2.7]}}
  - {name: two, type: prismatic, convention: modified, a: -0.2, alpha: -1.1, d: 0.05, theta: -0.7, flip: true}
  - {name: three, type: fixed, convention: modified, a: 0.3, alpha: 0.4, d: -0.1, theta: 1.9}
  - {name: four, type: continuous, a: 0.25, alpha: -0.651, d: 0.15, theta: -2.2, flip: true}
  - {name: five, type: revolute, convention: modified, a: 0.07, alpha: 0.651, d: 0.11, theta: -0.4}
"""

RICH = """\
name: rich
convention: standard
gravity: [0, 0, -1.62]
joints:
  - type: revolute
    a: 0.4
    limits: {position: [-2, 2], velocity: 3, effort: 80}
    dynamics: {damping: 0.1, friction: 0.2, armature: 0.05}
    link: {mass: 4, com: [-0.2, 0, 0]}
  - {name: elbow, type: revolute, a: 0.3, limits: {position: [-2, 2], velocity: 4}}
configurations: {home: [0.3, -0.4], up: [1, 1]}
actuators: {type: position, kp: 100, kv: 10}
"""


def small(name: str = "small", *, length: float = 0.4) -> str:
    """A robot of two rows; the length makes one version differ from another."""
    return f"""\
name: {name}
convention: standard
joints:
  - {{type: revolute, a: {length}, alpha: 0.651, limits: {{position: [-2, 2]}}}}
  - {{type: revolute, a: 0.3, limits: {{position: [-2, 2]}}}}
"""


def snake(rows: int) -> str:
    """A robot of many rows."""
    row = "  - {type: revolute, a: 0.1, alpha: 0.2, limits: {position: [-1, 1]}}\n"
    return f"name: snake\nconvention: standard\njoints:\n{row * rows}"


def write(folder: Path, text: str, name: str = "") -> Path:
    """Write a robot file, by default under the robot's own name."""
    path = folder / f"{name or text.split()[1]}.yaml"
    path.write_text(text, encoding="utf-8")
    return path
