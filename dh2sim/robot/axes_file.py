"""Axes files to AxesSpecs.

What an axes file says, validated and in SI units: joint axes to which frames are yet to be assigned.

The axes file as it is written, in its own units, as pydantic models.

Checks between parts of an axes file; each works on what is well-formed and leaves the rest alone.
"""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, TypeAlias

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from pydantic_core import PydanticCustomError

from dh2sim.errors import ImportedFileError
from dh2sim.messages import closest
from dh2sim.robot.checks import RowView, check_actuators, check_configurations, check_names, check_type, row_views
from dh2sim.robot.expressions import evaluate_parameters
from dh2sim.robot.read import read_model, to_spec
from dh2sim.robot.schema import (
    PROBLEM,
    ActuatorEntry,
    Angles,
    Context,
    DynamicsEntry,
    JointEntry,
    LimitsEntry,
    Name,
    Number,
    Parameters,
    RobotEntry,
    Text,
    UnitsEntry,
    Vector,
    one_of,
)
from dh2sim.robot.spec import (
    ActuatorSpec,
    Convention,
    Dynamics,
    JointType,
    Limits,
    Pose,
    RobotSpec,
    SourceFile,
    Units,
)
from dh2sim.robot.yaml_tree import Node, Report, compose, decode
from dh2sim.typing import Array, read_only


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AxisJoint:
    """A joint, and its axis in base_link at joint coordinates zero."""

    name: str
    type: JointType
    """Revolute, continuous or prismatic; never fixed."""
    direction: Array
    """Unit vector, shape (3,): the positive coordinate turns about it, or slides along it."""
    point: Array | None = None
    """A point of the axis, m, shape (3,); None only for a prismatic joint, whose axis may be put anywhere."""
    limits: Limits = field(default_factory=Limits)
    dynamics: Dynamics = field(default_factory=Dynamics)
    actuator: ActuatorSpec = field(default_factory=ActuatorSpec)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AxesSpec:
    """A serial robot as an axes file describes it; every number is finite and in SI units."""

    name: str
    joints: tuple[AxisJoint, ...]
    """Base first; at least one."""
    description: str = ""
    source: str = ""
    """Where the numbers come from, in the author's words."""
    convention: Convention | None = None
    """Of the table that is asked for, standard or modified; None where the file names none."""
    tool: Pose = field(default_factory=Pose)
    """Pose of tool0 in base_link at joint coordinates zero."""
    gravity: Array = field(default_factory=lambda: read_only([0, 0, -9.81]))
    """m/s² in base_link, shape (3,)."""
    configurations: Mapping[str, Array] = field(default_factory=lambda: MappingProxyType({}))
    """Named joint vectors, each of shape (number of joints,)."""
    source_file: SourceFile | None = None
    """None for axes made in code."""


class AxisType(StrEnum):
    """How a joint moves about or along its axis."""

    REVOLUTE = JointType.REVOLUTE.value
    CONTINUOUS = JointType.CONTINUOUS.value
    PRISMATIC = JointType.PRISMATIC.value


class TableConvention(StrEnum):
    """Conventions of which a table can be asked for."""

    STANDARD = Convention.STANDARD.value
    MODIFIED = Convention.MODIFIED.value


def _points_somewhere(direction: tuple[float, float, float]) -> tuple[float, float, float]:
    if not any(direction):  # NaN counts as something: it has been reported
        message = "the direction is of length 0; any other vector along the axis is allowed"
        raise PydanticCustomError(PROBLEM, "{message}", {"message": message})
    return direction


Direction: TypeAlias = Annotated[Vector, AfterValidator(_points_somewhere)]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)


class AxisEntry(_Model):
    """A joint axis, in base_link at joint coordinates zero."""

    name: Name | None = Field(default=None, description="Default joint_<i>, counted from 1.")
    type: Annotated[AxisType, one_of(AxisType)] = Field(description="How the joint moves.")
    point: Vector | None = Field(
        default=None, description="A point of the axis, in the file's length unit; a prismatic joint needs none."
    )
    direction: Direction = Field(
        description="Along the axis, of any length: the coordinate turns about it, or slides along it."
    )
    limits: LimitsEntry = Field(default_factory=LimitsEntry, description="Limits, in the file's units.")
    dynamics: DynamicsEntry = Field(default_factory=DynamicsEntry, description="Joint dynamics, SI.")
    actuator: ActuatorEntry = Field(default_factory=ActuatorEntry, description="Overrides the file's actuators.")


class ToolEntry(_Model):
    """Pose of tool0 in base_link at joint coordinates zero."""

    xyz: Vector | None = Field(
        default=None,
        description="Position, in the file's length unit; default the last axis's point, or 0, 0, 0 if it has none.",
    )
    rpy: Angles = Field(default=(0.0, 0.0, 0.0), description="Roll, pitch, yaw, in the file's angle unit.")


class AxesEntry(_Model):
    """A serial robot described by its joint axes; numbers may be expressions, as in a robot file."""

    name: Name = Field(description="Name of the robot.")
    description: Text = Field(default="", description="What the robot is.")
    source: Text = Field(default="", description="Where the numbers come from.")
    convention: Annotated[TableConvention, one_of(TableConvention)] | None = Field(
        default=None, description="Of the table that is to be made; default standard."
    )
    units: UnitsEntry = Field(default_factory=UnitsEntry, description="Units of this file; default rad and m.")
    parameters: Parameters = Field(
        default_factory=dict, description="Named constants for expressions, in the file's units."
    )
    axes: list[AxisEntry] = Field(min_length=1, description="The joint axes, base first.")
    tool: ToolEntry = Field(default_factory=ToolEntry, description="tool0 in base_link at joint coordinates zero.")
    gravity: Vector = Field(default=(0.0, 0.0, -9.81), description="m/s² in base_link.")
    configurations: dict[str, list[Number]] = Field(
        default={}, description="Named joint vectors, a number for each axis, in the file's units."
    )
    actuators: ActuatorEntry = Field(default_factory=ActuatorEntry, description="What drives every joint.")


def check_axes(root: Node, names: Mapping[str, float], report: Report) -> None:
    """Note in ``report`` what does not go together; ``names`` are the evaluated parameters."""
    axes = [_never_fixed(axis) for axis in row_views(root, names, "axes")]
    check_names(axes, report)
    for axis in axes:
        check_type(axis, report)
        _check_point(axis, report)
    check_configurations(root, axes, names, report, each="axis")
    check_actuators(root, axes, report)


def _never_fixed(axis: RowView) -> RowView:
    """Return a view whose type is unknown where it is one that only a row of a table can have."""
    return dataclasses.replace(axis, type=None) if axis.type is JointType.FIXED else axis


def _check_point(axis: RowView, report: Report) -> None:
    """A turning joint has a point that its axis goes through; a misspelt one has been told."""
    keys = axis.node.value
    if axis.type is None or not axis.type.turns or not isinstance(keys, dict) or axis.node.wrong:
        return
    allowed = AxisEntry.model_fields
    if "point" not in keys and all(key in allowed or closest(key, allowed) != "point" for key in keys):
        message = f"missing key 'point': a {axis.type} joint needs a point of its axis; only a prismatic one does not"
        report.add(axis.node.line, axis.node.column, axis.loc, message)


class _AxesReport(Report):
    """Collects the problems of an axes file."""

    def error(self) -> ImportedFileError:
        return ImportedFileError(dict.fromkeys(self.problems))


def read_axes(data: bytes, *, file: str, directory: Path) -> AxesSpec:
    """Return the joint axes that an axes file describes.

    Args:
        data: The file's content.
        file: Its name, for messages.
        directory: Where paths in it start.

    Raises:
        ImportedFileError: The file is wrong; the error holds everything that is.
    """
    report = _AxesReport(file)
    text = decode(data, report)
    root = compose(text, report, needs="axes need at least name and axes")
    parameters = evaluate_parameters(root, report)
    entry = read_model(AxesEntry, root, Context(parameters=parameters, directory=directory), report)
    check_axes(root, parameters, report)
    if entry is None or report.problems:
        raise report.error()
    source = SourceFile(name=Path(file).name, path=file, text=text, sha256=hashlib.sha256(data).hexdigest())
    return _to_axes(entry, _without_table(entry, root, source))


def _without_table(entry: AxesEntry, root: Node, source: SourceFile) -> RobotSpec:
    """Return a robot of rows without numbers: it has all that an axes file shares with a robot file, in SI units."""
    rows = [
        JointEntry.model_construct(
            name=axis.name,
            type=JointType(axis.type),
            limits=axis.limits,
            dynamics=axis.dynamics,
            actuator=axis.actuator,
        )
        for axis in entry.axes
    ]
    robot = RobotEntry.model_construct(
        name=entry.name,
        description=entry.description,
        source=entry.source,
        convention=Convention(entry.convention or Convention.STANDARD),
        units=entry.units,
        parameters=entry.parameters,
        gravity=entry.gravity,
        joints=rows,
        configurations=entry.configurations,
        actuators=entry.actuators,
    )
    return to_spec(robot, root, source)


def _to_axes(entry: AxesEntry, robot: RobotSpec) -> AxesSpec:
    units = Units(angle=entry.units.angle, length=entry.units.length)
    joints = tuple(
        AxisJoint(
            name=row.name,
            type=row.type,
            direction=_unit(axis.direction),
            point=None if axis.point is None else _lengths(axis.point, units),
            limits=row.limits,
            dynamics=row.dynamics,
            actuator=row.actuator,
        )
        for axis, row in zip(entry.axes, robot.rows, strict=True)
    )
    return AxesSpec(
        name=robot.name,
        joints=joints,
        description=robot.description,
        source=robot.source,
        convention=None if entry.convention is None else robot.convention,
        tool=_tool(entry, units),
        gravity=robot.gravity,
        configurations=robot.configurations,
        source_file=robot.source_file,
    )


def _tool(entry: AxesEntry, units: Units) -> Pose:
    """Return the tool's pose, its position by default a point of the last axis."""
    xyz = entry.tool.xyz or entry.axes[-1].point or (0.0, 0.0, 0.0)
    return Pose(xyz=_lengths(xyz, units), rpy=read_only([units.radians(angle) for angle in entry.tool.rpy]))


def _lengths(values: Sequence[float], units: Units) -> Array:
    return read_only([units.metres(value) for value in values])


def _unit(direction: Sequence[float]) -> Array:
    """Return a vector of length 1; scaled first, so that no square is too large or too small."""
    vector = np.array(direction) / np.abs(direction).max()
    return read_only(vector / np.linalg.norm(vector))
