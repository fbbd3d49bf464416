"""What a user, a simulation or a recording can do to a page."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, TypeAlias

from dh2sim.robot.spec import AngleUnit, Convention, LengthUnit
from dh2sim.view.scene.pinhole import Sight
from dh2sim.view.state import Ghost, Matrix, Mode, Part, Pull


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveJoint:
    """Bring a joint to a coordinate, or as near as its limits allow."""

    joint: int
    """Of the moving joints, from 0."""
    value: float
    """rad or m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetJoints:
    """Bring all joints somewhere, or as near as their limits allow."""

    q: tuple[float, ...]
    """rad and m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Nudge:
    """Move a joint a step: 3 degrees, or 1 % of a sliding joint's travel."""

    joint: int
    """Of the moving joints, from 0."""
    direction: Literal[-1, 1]


@dataclass(frozen=True, slots=True, kw_only=True)
class SetConfiguration:
    """Take a configuration by its name: home, zero, or one of the robot file's."""

    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class RandomConfiguration:
    """Take any configuration inside the limits."""

    seed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Follow:
    """Show where a simulation or a recording has the joints; it may have passed their limits a little."""

    q: tuple[float, ...]
    """rad and m."""
    T_world_base_link: Matrix | None = None
    """Where a recording has base_link; None where that stands still."""
    leaps: bool = False
    """Whether the way from where the joints were is left out: a recording begins, ends or is wound."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetMode:
    """Let somebody else move the joints."""

    mode: Mode


@dataclass(frozen=True, slots=True, kw_only=True)
class Pause:
    """Let the simulation or the recording stand, or go on."""

    on: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """Make a single time step of the simulation, or go to the recording's next instant; then stand."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PullLink:
    """Pull at a link of a simulated robot with the mouse, or go on so with the mouse elsewhere."""

    pull: Pull


@dataclass(frozen=True, slots=True, kw_only=True)
class LetGo:
    """Pull no more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EditCell:
    """Type into a cell of the table."""

    row: int
    """From 0."""
    column: str
    """One of ``COLUMNS``, or ``CONVENTION``."""
    text: str
    """A number in the file's units, or an expression over its parameters."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetConvention:
    """Read the same numbers in another convention: the robot becomes another one."""

    row: int | None
    """From 0; None for all rows."""
    convention: Convention


@dataclass(frozen=True, slots=True, kw_only=True)
class ConvertTable:
    """Write the same robot's table in another convention: the numbers become others."""

    convention: Convention


@dataclass(frozen=True, slots=True, kw_only=True)
class SetUnits:
    """Write the table in other units; the robot stays the same."""

    angle: AngleUnit
    length: LengthUnit


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplaceText:
    """Take another text for the robot file: the one opened at first, or one taken back."""

    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenText:
    """Open another robot file, one that was uploaded or the one opened at first; its robot is at home."""

    text: str | bytes = field(repr=False)
    """The file's content."""
    file: str
    """Its name, for messages."""
    folder: Path | None = None
    """Where paths in it start; None of a file that was uploaded, which may name no files."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Undo:
    """Take the last edit of the table back."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectRow:
    """Choose the row that is edited, and explained."""

    row: int
    """From 0."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Show:
    """Show or hide something."""

    part: Part
    on: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class ShowAngles:
    """Show angles in degrees or radians."""

    unit: AngleUnit


@dataclass(frozen=True, slots=True, kw_only=True)
class ChooseFrame:
    """Choose the frame whose pose is shown."""

    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveTool:
    """Want the tool somewhere; ``q`` is what inverse kinematics found."""

    T_base_link_tool0: Matrix
    q: tuple[float, ...] | None
    """rad and m; None where the robot stays as it is."""
    reached: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Compare:
    """Draw a second robot beside the first, or none."""

    ghost: Ghost | None


@dataclass(frozen=True, slots=True, kw_only=True)
class CompareReading:
    """Draw what the same table is in the other convention, or what an edit makes of it, beside the robot."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """See the scene from elsewhere."""

    sight: Sight


@dataclass(frozen=True, slots=True, kw_only=True)
class Tell:
    """Tell the user something; with an empty text, nothing any more."""

    notice: str


Event: TypeAlias = (
    MoveJoint
    | SetJoints
    | Nudge
    | SetConfiguration
    | RandomConfiguration
    | Follow
    | SetMode
    | Pause
    | Step
    | PullLink
    | LetGo
    | EditCell
    | SetConvention
    | ConvertTable
    | SetUnits
    | ReplaceText
    | OpenText
    | Undo
    | SelectRow
    | Show
    | ShowAngles
    | ChooseFrame
    | MoveTool
    | Compare
    | CompareReading
    | Look
    | Tell
)
