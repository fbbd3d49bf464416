"""What a user, a simulation or a recording can do to a page."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias

from dh2sim.draw.projection import Pinhole
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.row import Convention
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.view.state import Ghost, LinkDrag, Matrix, Mode, Part

if TYPE_CHECKING:
    from dh2sim.workspace.workspace import Workspace


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveJoint:
    """Move a joint to a coordinate, as far as its limits allow."""

    joint: int
    """Of the moving joints, from 0."""
    value: float
    """rad or m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetJoints:
    """Move all joints, as far as their limits allow."""

    q: tuple[float, ...]
    """rad and m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Nudge:
    """Move a joint by a step: 3 degrees, or 1 % of a prismatic joint's travel."""

    joint: int
    """Of the moving joints, from 0."""
    direction: Literal[-1, 1]


@dataclass(frozen=True, slots=True, kw_only=True)
class SetConfiguration:
    """Go to a configuration by its name: home, zero, or one of the robot file's."""

    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class RandomConfiguration:
    """Go to a random configuration inside the limits."""

    seed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Follow:
    """Show the joints where a simulation or a recording has them, perhaps slightly beyond their limits."""

    q: tuple[float, ...]
    """rad and m."""
    T_world_base_link: Matrix | None = None
    """Pose of base_link in a recording; None if it does not move."""
    jumps: bool = False
    """Whether it is not a motion from where the joints were: a recording starts, starts again or is searched."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetMode:
    """Choose what moves the joints."""

    mode: Mode


@dataclass(frozen=True, slots=True, kw_only=True)
class Pause:
    """Pause or continue the simulation or the recording."""

    on: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """Simulate one time step, or go to the recording's next time; then pause."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DragLink:
    """Drag a link of a simulated robot with the mouse."""

    drag: LinkDrag


@dataclass(frozen=True, slots=True, kw_only=True)
class ReleaseLink:
    """Stop dragging."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EditCell:
    """Type into a cell of the table, whose row is then the selected one, or into a parameter."""

    row: int | str
    """From 0; ``PARAMETERS`` for a parameter."""
    column: str
    """One of ``COLUMNS``, or ``CONVENTION``; a parameter's name."""
    text: str
    """A number in the file's units, or an expression over its parameters."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetConvention:
    """Read the same numbers in another convention, which makes another robot of them."""

    row: int | None
    """From 0; None for all rows."""
    convention: Convention


@dataclass(frozen=True, slots=True, kw_only=True)
class ConvertTable:
    """Write the table of the same robot in another convention, with other numbers."""

    convention: Convention


@dataclass(frozen=True, slots=True, kw_only=True)
class SetUnits:
    """Write the table of the same robot in other units."""

    angle: AngleUnit
    length: LengthUnit


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplaceText:
    """Replace the text of the robot file, as by an earlier one."""

    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenText:
    """Open another robot file, with its robot at home."""

    text: str | bytes = field(repr=False)
    """The file's content."""
    file: str
    """Its name, for messages."""
    folder: Path | None = None
    """Where paths in it start; None for an uploaded file, which may name no files."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Undo:
    """Undo the last edit of the table."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectRow:
    """Select the row that is edited and explained."""

    row: int
    """From 0."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlayRow:
    """Run or pause the animation of the selected row."""

    on: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class SeekRow:
    """Show the selected row as far as some of its elementary steps are done, and pause there."""

    steps: float


@dataclass(frozen=True, slots=True, kw_only=True)
class AdvanceRow:
    """Let the animation of the selected row go on."""

    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Show:
    """Show or hide a part of the scene."""

    part: Part
    on: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class SetOpacity:
    """Make the robot's shapes more or less translucent."""

    opacity: float
    """From 0 to 1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShowAngles:
    """Show angles in degrees or radians."""

    unit: AngleUnit


@dataclass(frozen=True, slots=True, kw_only=True)
class ChooseFrame:
    """Choose the frame whose pose is shown."""

    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ChooseReference:
    """Choose the frame that it is shown in."""

    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveTool:
    """Move the tool towards a goal; ``q`` is the result of inverse kinematics."""

    T_base_link_tool0: Matrix
    """The goal."""
    q: tuple[float, ...] | None
    """rad and m; None to leave the robot as it is."""
    reached: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Compare:
    """Draw a second robot beside the first, or none."""

    ghost: Ghost | None


@dataclass(frozen=True, slots=True, kw_only=True)
class CompareMisread:
    """Draw the robot that the same table describes in the other convention."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetCamera:
    """Look at the scene from elsewhere."""

    pinhole: Pinhole


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchWorkspace:
    """Report how far the search of a robot's workspace is."""

    model: RobotModel = field(repr=False)
    """The robot; a report of another one than the page's changes nothing."""
    doing: str
    share: float
    """Of what it is doing, from 0 to 1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundWorkspace:
    """Report what tool0 of a robot reaches."""

    model: RobotModel = field(repr=False)
    """The robot."""
    workspace: Workspace | None = field(repr=False)
    """None where it cannot be computed."""
    note: str = ""
    """Why it cannot, or why it has no section."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Notify:
    """Show the user a notice; an empty one removes the last."""

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
    | DragLink
    | ReleaseLink
    | EditCell
    | SetConvention
    | ConvertTable
    | SetUnits
    | ReplaceText
    | OpenText
    | Undo
    | SelectRow
    | PlayRow
    | SeekRow
    | AdvanceRow
    | Show
    | SetOpacity
    | ShowAngles
    | ChooseFrame
    | ChooseReference
    | MoveTool
    | Compare
    | CompareMisread
    | SetCamera
    | SearchWorkspace
    | FoundWorkspace
    | Notify
)
