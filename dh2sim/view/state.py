"""The state of a page: one immutable value, from which the scene and the panel are derived."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeAlias

from dh2sim.draw.projection import Pinhole
from dh2sim.model.robot_model import JointModel, RobotModel
from dh2sim.robot.row import Convention, JointType
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit, Units
from dh2sim.view.scene.items import Vector

if TYPE_CHECKING:
    from dh2sim.workspace.workspace import Workspace

Matrix: TypeAlias = tuple[tuple[float, ...], ...]
"""A pose of shape (4, 4), as tuples, so that states compare by value."""
IDENTITY: Final[Matrix] = tuple(tuple(float(i == j) for j in range(4)) for i in range(4))

COLUMNS: Final = ("a", "alpha", "d", "theta", "beta")
"""The table's columns of numbers."""
CONVENTION: Final = "convention"
"""The table's column of conventions."""


class Mode(StrEnum):
    """What moves the joints."""

    MANUAL = "manual"
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
    """Soft shading of surfaces, instead of a few steps, which a browser without a graphics card draws faster."""
    HANDLE = "handle"
    """That tool0 is dragged by."""
    ELLIPSOID = "ellipsoid"
    """Of the velocities that tool0's origin can have."""
    FORCE = "force ellipsoid"
    """Of the forces at tool0's origin that the joints can hold."""
    WORKSPACE = "workspace"
    """Points that tool0 reaches."""
    CUT = "cut"
    """Without those in front of base_link's x-z plane, so that the inside is seen."""
    SECTION = "section"
    """Of the workspace, with what bounds it."""
    BRANCHES = "branches"
    """All other ways to hold tool0 where it is."""


_ON_REQUEST: Final = {Part.TRACE, Part.ELLIPSOID, Part.FORCE, Part.BRANCHES, Part.WORKSPACE, Part.SECTION}
INITIALLY: Final = frozenset(Part) - _ON_REQUEST
"""Parts that a page shows at first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CellError:
    """An error in a cell of the table."""

    row: int | str
    """From 0; ``PARAMETERS`` for a parameter."""
    column: str
    """One of ``COLUMNS``, or ``CONVENTION``; a parameter's name."""
    text: str
    """As typed."""
    message: str
    """Of the robot file's reader."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TableRow:
    """A row of the table as typed."""

    name: str
    type: JointType
    convention: Convention
    cells: tuple[str, ...]
    """Texts of ``COLUMNS``, in the file's units; may be expressions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TableState:
    """The table as typed; while it has errors, the robot does not change."""

    rows: tuple[TableRow, ...]
    convention: Convention
    """Of rows that name none."""
    units: Units
    parameters: Mapping[str, str] = field(default_factory=dict)
    """Texts by name."""
    errors: tuple[CellError, ...] = ()

    def error(self, row: int | str, column: str) -> CellError | None:
        """Return the error in a cell, or None."""
        return next((found for found in self.errors if (found.row, found.column) == (row, column)), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """The pose that the user has dragged the tool's handle to."""

    T_base_link_tool0: Matrix
    reached: bool
    """Whether tool0 is there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkDrag:
    """A link that the mouse drags in a simulation."""

    link: str
    point_in_link: Vector
    """Where it was grabbed, in the link's frame, m."""
    target: Vector
    """Position of the mouse in base_link, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ghost:
    """A second robot, drawn pale beside the first, at the same joint coordinates."""

    model: RobotModel = field(repr=False)
    label: str
    misread: bool = False
    """Whether it is the first robot's table in the other convention, and changes with it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewState:
    """Everything that a page shows."""

    model: RobotModel = field(repr=False)
    """The robot of the last table without errors."""
    text: str = field(repr=False)
    """The robot file that ``model`` was read from."""
    file: str
    """Name of that file, for messages."""
    folder: Path | None
    """Where paths in it start; None for an uploaded file."""
    table: TableState
    q: tuple[float, ...]
    """Joint coordinates, rad and m."""
    undo_texts: tuple[str, ...] = field(default=(), repr=False)
    """Texts of the robot file before the last edits, the newest last."""
    edited_cell: tuple[int | str, str] | None = None
    """Row and column of the cell, or ``PARAMETERS`` and the name, that the last edit was in."""
    target: tuple[float, ...] | None = None
    """Targets of a simulation's actuators; None without a simulation."""
    shown: frozenset[Part] = INITIALLY
    opacity: float = 0.45
    """Of the robot's shapes, from 0 to 1, so that frames inside them are seen."""
    selected_row: int = 0
    """Row of the table that is edited and explained, from 0."""
    row_progress: float | None = None
    """How many of that row's elementary steps are drawn, such as 1.5; None for all, without an animation."""
    row_playing: bool = False
    """Whether its animation is running."""
    angle: AngleUnit = AngleUnit.DEG
    """Unit of angles outside of the table."""
    frame: str = "tool0"
    """Frame whose pose is shown, one of ``frame_names``."""
    reference: str = "base_link"
    """Frame that it is shown in, one of ``frame_names``."""
    ghost: Ghost | None = None
    trace: tuple[Vector, ...] = ()
    """Path of tool0 in the world since ``Part.TRACE`` is shown, m."""
    planned: tuple[Vector, ...] = ()
    """Path of tool0 in the trajectory that pages play, m; empty once the robot is another."""
    workspace: Workspace | None = field(default=None, repr=False)
    """What tool0 reaches; None until it is computed for this robot."""
    workspace_note: str = ""
    """Why it cannot be computed, or why it has no section."""
    searching: tuple[str, float] | None = None
    """What the search of the workspace is doing, and its share of that from 0 to 1; None while there is none."""
    goal: Goal | None = None
    mode: Mode = Mode.MANUAL
    paused: bool = False
    """Whether the simulation or the recording is paused."""
    T_world_base_link: Matrix = IDENTITY
    """Pose of base_link; not the identity only in a recording with a floating base."""
    pinhole: Pinhole | None = None
    """The page's camera; None before the browser has reported it."""
    steps: int = 0
    """Single steps requested since the simulation or the recording was started."""
    drag: LinkDrag | None = None
    notice: str = ""
    """A message to the user, a sentence or two; may be empty."""

    @property
    def commanded(self) -> tuple[float, ...]:
        """Joint coordinates that the user has set, rad and m, which the sliders show."""
        return self.q if self.target is None else self.target

    @property
    def floats(self) -> bool:
        """Whether base_link is not at the world's origin."""
        return self.T_world_base_link != IDENTITY

    @property
    def spec(self) -> RobotSpec:
        """The robot as its file describes it."""
        return self.model.spec


def within(model: RobotModel, q: tuple[float, ...]) -> tuple[float, ...]:
    """Return joint coordinates moved inside the limits, and continuous joints by whole turns.

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
    """Return the named configurations inside the limits, rad and m: home, zero and the robot file's."""
    named = model.spec.named_configurations
    return {name: within(model, tuple(vector.tolist())) for name, vector in named.items()}
