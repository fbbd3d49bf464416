"""What an axes file says, validated and in SI units: joint axes to which frames are yet to be assigned."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from dh2sim.robot.spec import ActuatorSpec, Convention, Dynamics, JointType, Limits, Pose, SourceFile
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
