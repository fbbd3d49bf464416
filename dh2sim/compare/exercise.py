"""Random arms for exercises: joint axes in words and numbers, and the table that is asked for.

Arms are made of axes with round numbers, not of a table, so that the exercise can be done by hand. Random numbers are
those of Python's Mersenne Twister, of which only ``random()`` is used: its sequence is the same in all versions.
"""

from __future__ import annotations

import random
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dh2sim.errors import Dh2simError
from dh2sim.importing.axes import import_axes
from dh2sim.robot.axes_file import AxesSpec, AxisJoint
from dh2sim.robot.links import Pose
from dh2sim.robot.row import Convention, JointType
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import read_only

LEVELS = {
    1: "a planar arm: two or three joints that turn about parallel axes",
    2: "three or four joints at right angles, with offsets, one of them sliding",
    3: "four or five joints, some at odd angles, with offsets",
    4: "six joints with a wrist, whose last three axes meet in a point",
}
"""What the levels are."""
_STEP = 0.05
"""m: of which all coordinates are multiples."""
_WIDTH = 80
"""Of lines, so that they fit into a terminal."""
_ALONG = ((1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1))
_ODD = ((0, 3, 4), (3, 0, 4), (0, 4, 3), (1, 0, 1), (0, 1, 1), (2, 1, 2), (1, 2, 2), (0, -3, 4), (-1, 0, 1))
Vector = tuple[int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AxisInWords:
    """A joint of an exercise."""

    name: str
    turns: bool
    point: tuple[float, float, float]
    """m, in base_link"""
    direction: Vector
    """Of any length."""

    @property
    def sentence(self) -> str:
        """Where the axis lies, and how the joint moves."""
        where = " ".join(f"{1000 * value:g}" for value in self.point)
        if self.turns:
            return f"{self.name} turns about the line through ({where.replace(' ', ', ')}) mm along {self._way}."
        return f"{self.name} slides along {self._way}, through ({where.replace(' ', ', ')}) mm."

    @property
    def _way(self) -> str:
        names = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}
        for name, vector in names.items():
            if self.direction == vector:
                return f"+{name}"
            if self.direction == tuple(-value for value in vector):
                return f"-{name}"
        return f"the vector ({', '.join(map(str, self.direction))})"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Exercise:
    """An arm whose table is asked for."""

    seed: int
    level: int
    joints: tuple[AxisInWords, ...]
    tool: tuple[float, float, float]
    """Of the tool's tip at coordinates zero, in base_link, m."""
    solution: RobotSpec
    """The arm with a right table, of which there are many."""
    solution_text: str
    """Its robot file."""

    def text(self, drawing: str = "") -> str:
        """Return the exercise in Markdown; ``drawing`` is the file of a picture to show."""
        tip = ", ".join(f"{1000 * value:g}" for value in self.tool)
        items = [f"{i}. {joint.sentence}" for i, joint in enumerate(self.joints, 1)]
        lines = [
            f"# Exercise {self.seed}, level {self.level}",
            "",
            f"An arm has {len(self.joints)} joints. With all joint coordinates at zero, in the frame base_link",
            "(z upwards, lengths in mm):",
            "",
            *(line for item in items for line in _wrapped(item)),
            "",
            f"The tip of the tool is at ({tip}) mm.",
            "",
            *([f"![The arm at coordinates zero]({drawing})", ""] if drawing else []),
            "Assign Denavit-Hartenberg frames, and give the table: a, alpha, d and theta of",
            "each row, and which convention it is in. Any right choice of frames counts.",
            "",
        ]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, object]:
        """Return the exercise as plain data, with the robot file of the solution."""
        return {
            "seed": self.seed,
            "level": self.level,
            "joints": [
                {
                    "name": joint.name,
                    "type": "revolute" if joint.turns else "prismatic",
                    "point": list(joint.point),
                    "direction": list(joint.direction),
                }
                for joint in self.joints
            ],
            "tool": list(self.tool),
            "text": self.text(),
            "solution": self.solution_text,
        }


def make_exercise(seed: int, level: int) -> Exercise:
    """Make a random arm; the same seed and level give the same arm.

    Args:
        seed: At least 0.
        level: 1 to 4, see ``LEVELS``.

    Raises:
        Dh2simError: The seed or the level is not allowed.
    """
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < 2**63:
        raise Dh2simError(f"seed must be a whole number from 0 to 2**63 - 1, got {seed!r}")
    if isinstance(level, bool) or level not in LEVELS:
        raise Dh2simError(f"level must be a whole number from 1 to {max(LEVELS)}, got {level!r}")
    dice = _Dice(seed * 16 + level)
    joints, tip = {1: _planar, 2: _right_angled, 3: _odd, 4: _wristed}[level](dice)
    tool = (tip[0] * _STEP, tip[1] * _STEP, tip[2] * _STEP)
    axes = AxesSpec(
        name=f"exercise_{seed}_{level}",
        description=f"Exercise {seed} of level {level}: {LEVELS[level]}",
        joints=tuple(
            AxisJoint(
                name=joint.name,
                type=JointType.REVOLUTE if joint.turns else JointType.PRISMATIC,
                point=read_only(joint.point),
                direction=_unit(joint.direction),
            )
            for joint in joints
        ),
        tool=Pose(xyz=read_only(tool)),
    )
    made = import_axes(axes, convention=Convention.STANDARD)
    return Exercise(
        seed=seed, level=level, joints=tuple(joints), tool=tool, solution=made.spec, solution_text=made.text
    )


class _Dice:
    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)

    def number(self, least: int, most: int) -> int:
        """Return a whole number, both ends included."""
        return least + int(self._random.random() * (most - least + 1))

    def pick(self, options: Sequence[Vector]) -> Vector:
        return options[self.number(0, len(options) - 1)]


def _planar(dice: _Dice) -> tuple[list[AxisInWords], list[int]]:
    along, plane = ((0, 0, 1), 0) if dice.number(0, 1) else ((0, -1, 0), 0)
    place = [0, 0, 0]
    joints = []
    for i in range(dice.number(2, 3)):
        joints.append(_joint(i, True, place, along))
        place[plane] += dice.number(3, 10)
    return joints, place


def _right_angled(dice: _Dice) -> tuple[list[AxisInWords], list[int]]:
    count = dice.number(3, 4)
    slide = dice.number(1, count - 1)
    place, way = [0, 0, dice.number(2, 8)], (0, 0, 1)
    joints = [_joint(0, True, place, way)]
    for i in range(1, count):
        way = dice.pick([other for other in _ALONG if _crosses(way, other)])
        _move(dice, place)
        joints.append(_joint(i, i != slide, place, way))
    _move(dice, place)
    return joints, place


def _odd(dice: _Dice) -> tuple[list[AxisInWords], list[int]]:
    place, way = [0, 0, dice.number(2, 8)], (0, 0, 1)
    joints = [_joint(0, True, place, way)]
    for i in range(1, dice.number(4, 5)):
        ways = _ODD if i % 2 else (*_ALONG, *_ODD)
        way = dice.pick([other for other in ways if _crosses(way, other)])
        _move(dice, place)
        joints.append(_joint(i, True, place, way))
    _move(dice, place)
    return joints, place


def _wristed(dice: _Dice) -> tuple[list[AxisInWords], list[int]]:
    place = [0, 0, dice.number(4, 10)]
    joints = [_joint(0, True, place, (0, 0, 1))]
    side = (0, 1, 0) if dice.number(0, 1) else (0, -1, 0)
    place[0] += dice.number(0, 4)
    joints.append(_joint(1, True, place, side))
    place[2] += dice.number(5, 12)
    place[1] += dice.number(-2, 2)
    joints.append(_joint(2, True, place, side))
    place[2] += dice.number(0, 3)
    place[0] += dice.number(6, 12)
    for i, way in enumerate(((1, 0, 0), side, (1, 0, 0)), 3):
        joints.append(_joint(i, True, place, way))
    place[0] += dice.number(1, 4)
    return joints, place


def _wrapped(item: str) -> list[str]:
    """Return the lines of an item of a list, with points and vectors in one piece."""
    lines = textwrap.wrap(item.replace(", ", ",_"), _WIDTH, subsequent_indent="   ", break_long_words=False)
    return [line.replace(",_", ", ") for line in lines]


def _move(dice: _Dice, place: list[int]) -> None:
    """Move on by one or two round steps, never by none."""
    first = dice.number(0, 2)
    place[first] += dice.number(2, 8)
    if dice.number(0, 1):
        place[(first + 1) % 3] += dice.number(1, 5)


def _joint(i: int, turns: bool, place: Sequence[int], way: Vector) -> AxisInWords:
    x, y, z = (round(value * _STEP, 3) for value in place)
    return AxisInWords(name=f"joint_{i + 1}", turns=turns, point=(x, y, z), direction=way)


def _crosses(u: Vector, v: Vector) -> bool:
    """Whether two vectors are not parallel."""
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]) != (0, 0, 0)


def _unit(vector: Vector) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    length = float(sum(value * value for value in vector)) ** 0.5
    return read_only([value / length for value in vector])
