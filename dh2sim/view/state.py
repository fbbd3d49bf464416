"""What one page shows: one immutable value, of which the scene and the panel are derived."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np

from dh2sim.model.robot_model import JointModel, RobotModel
from dh2sim.robot.spec import AngleUnit, Convention, JointType, RobotSpec, Units
from dh2sim.view.scene.items import Vector
from dh2sim.view.scene.pinhole import Sight

Matrix: TypeAlias = tuple[tuple[float, ...], ...]
"""A pose of shape (4, 4), as tuples, so that states compare by value."""
IDENTITY: Final[Matrix] = tuple(tuple(float(i == j) for j in range(4)) for i in range(4))

COLUMNS: Final = ("a", "alpha", "d", "theta", "beta")
"""Columns of numbers of the table."""
CONVENTION: Final = "convention"
"""The column that names a row's convention."""


class Mode(StrEnum):
    """Who moves the joints."""

    STILL = "still"
    """The user."""
    PHYSICS = "physics"
    REPLAY = "replay"


class Part(StrEnum):
    """What can be shown or hidden."""

    SHAPES = "shapes"
    FRAMES = "frames"
    FRAME_NAMES = "frame names"
    ANNOTATIONS = "annotations"
    TRACE = "trace"
    GHOST = "ghost"
    GRID = "grid"
    SHADING = "shading"
    """Surfaces with soft lights, rather than in a few steps, which a browser without a graphics card draws faster."""
    HANDLE = "handle"
    """To drag tool0 by."""


INITIALLY: Final = frozenset({Part.SHAPES, Part.FRAMES, Part.FRAME_NAMES, Part.GRID, Part.GHOST, Part.SHADING})
"""What a page shows at first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Complaint:
    """What is wrong with a cell of the table."""

    row: int
    """From 0."""
    column: str
    """One of ``COLUMNS``, or ``CONVENTION``."""
    text: str
    """As typed."""
    message: str
    """In the words of the robot file's reader."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DraftRow:
    """A row of the table as it is typed."""

    name: str
    type: JointType
    convention: Convention
    cells: tuple[str, ...]
    """Texts of ``COLUMNS``, in the file's units; may be expressions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """The table as it is typed; where it is wrong, the robot is the one of before."""

    rows: tuple[DraftRow, ...]
    convention: Convention
    """Of rows that name none."""
    units: Units
    complaints: tuple[Complaint, ...] = ()

    def complaint(self, row: int, column: str) -> Complaint | None:
        """Return what is wrong with a cell, or None."""
        return next((found for found in self.complaints if (found.row, found.column) == (row, column)), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """Where the tool is wanted."""

    T_base_link_tool0: Matrix
    reached: bool
    """Whether the robot can bring tool0 there, and did."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pull:
    """A link that the mouse pulls at, in a simulation."""

    link: str
    point_in_link: Vector
    """Where it was grabbed, in the link's frame, m."""
    target: Vector
    """Where the mouse is, in base_link, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ghost:
    """A second robot, drawn pale beside the first, at the same joint coordinates."""

    model: RobotModel = field(repr=False)
    label: str
    reading: bool = False
    """Whether it is the first robot's own table in the other convention, and changes with it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewState:
    """Everything that a page shows."""

    model: RobotModel = field(repr=False)
    """Of the last table that was right."""
    text: str = field(repr=False)
    """The robot file that ``model`` was read from."""
    file: str
    """Name of that file, for messages."""
    folder: Path | None
    """Where paths in it start; None of a file that was uploaded."""
    draft: Draft
    q: tuple[float, ...]
    """Joint coordinates, rad and m."""
    earlier: tuple[str, ...] = field(default=(), repr=False)
    """Robot files of before the last edits, the newest at the end."""
    typed: tuple[int, str] | None = None
    """Row and column of the cell that the last edit was typed into."""
    target: tuple[float, ...] | None = None
    """Where a simulation's actuators hold the joints; None where there is no simulation."""
    shown: frozenset[Part] = INITIALLY
    selected_row: int = 0
    """Row of the table that is explained, from 0."""
    angle: AngleUnit = AngleUnit.DEG
    """Unit that angles are shown in, outside of the table."""
    frame: str = "tool0"
    """Whose pose is shown; one of ``frame_names``."""
    ghost: Ghost | None = None
    trace: tuple[Vector, ...] = ()
    """Where tool0 was since ``Part.TRACE`` is shown, m."""
    goal: Goal | None = None
    mode: Mode = Mode.STILL
    paused: bool = False
    """Whether the simulation or the recording stands."""
    T_world_base_link: Matrix = IDENTITY
    """Where base_link is: elsewhere than at the world's origin only in a recording in which it floats."""
    sight: Sight | None = None
    """How the page's eye sees the scene; None where the browser has not told yet."""
    steps: int = 0
    """Single steps that were asked for since it began."""
    pull: Pull | None = None
    notice: str = ""
    """What the user is told, in a sentence or two; empty where there is nothing to tell."""

    @property
    def wanted(self) -> tuple[float, ...]:
        """Where the user wants the joints: what sliders show."""
        return self.q if self.target is None else self.target

    @property
    def floats(self) -> bool:
        """Whether base_link is elsewhere than at the world's origin."""
        return self.T_world_base_link != IDENTITY

    @property
    def spec(self) -> RobotSpec:
        """The robot as its file describes it."""
        return self.model.spec


def within(model: RobotModel, q: tuple[float, ...]) -> tuple[float, ...]:
    """Return joint coordinates moved inside the limits; those of continuous joints are turned whole turns.

    Args:
        model: The robot.
        q: rad and m, finite, one for each moving joint.
    """
    return tuple(_within(joint, value) for joint, value in zip(model.moving_joints, q, strict=True))


def _within(joint: JointModel, value: float) -> float:
    lower, upper = joint.travel
    if joint.position_range is None and not lower <= value <= upper:
        return math.remainder(value, 2.0 * math.pi)
    return joint.clamped(value)


def configurations(model: RobotModel) -> dict[str, tuple[float, ...]]:
    """Return the configurations that have a name, rad and m, inside the limits: home, zero and the file's."""
    zero = (0.0,) * model.chain.n
    named = {name: tuple(np.asarray(vector).tolist()) for name, vector in model.spec.configurations.items()}
    return {
        name: within(model, vector)
        for name, vector in {"home": tuple(model.home.tolist()), "zero": zero, **named}.items()
    }
