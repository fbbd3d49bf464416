"""The axes file as it is written, in its own units, as pydantic models."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, TypeAlias

from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from pydantic_core import PydanticCustomError

from dh2sim.robot.fields import PROBLEM, Angles, Name, Number, Parameters, Text, Vector, one_of
from dh2sim.robot.schema import ActuatorEntry, DynamicsEntry, LimitsEntry, UnitsEntry
from dh2sim.robot.spec import Convention, JointType


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
