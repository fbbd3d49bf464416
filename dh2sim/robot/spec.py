"""What a robot file says, validated and in SI units (m, rad, kg, N, N·m).

Units that a robot file may be written in, and their way to SI.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType

from dh2sim.typing import Array, read_only


class AngleUnit(StrEnum):
    """Unit of the file's angles."""

    RAD = "rad"
    DEG = "deg"


class LengthUnit(StrEnum):
    """Unit of the file's lengths."""

    M = "m"
    MM = "mm"
    CM = "cm"
    IN = "in"


@dataclass(frozen=True, slots=True, kw_only=True)
class Units:
    """The units of one file."""

    angle: AngleUnit = AngleUnit.RAD
    length: LengthUnit = LengthUnit.M

    def radians(self, angle: float) -> float:
        """Return an angle of the file in rad."""
        return math.radians(angle) if self.angle is AngleUnit.DEG else angle

    def metres(self, length: float) -> float:
        """Return a length of the file in m; dividing by a power of ten rounds only once."""
        match self.length:
            case LengthUnit.M:
                return length
            case LengthUnit.MM:
                return length / 1000
            case LengthUnit.CM:
                return length / 100
            case LengthUnit.IN:
                return length * 0.0254

    def coordinate(self, value: float, *, turns: bool) -> float:
        """Return a joint coordinate, or its rate, in rad or m."""
        return self.radians(value) if turns else self.metres(value)


class Convention(StrEnum):
    """Where a row's link part stands beside its joint part."""

    STANDARD = "standard"
    """A_i = Rz(theta) Tz(d) Tx(a) Rx(alpha); distal (Paul, Spong)."""
    MODIFIED = "modified"
    """A_i = Tx(a) Rx(alpha) Rz(theta) Tz(d), with a and alpha of index i - 1; proximal (Craig)."""
    HAYATI = "hayati"
    """A_i = Rz(theta) Tx(a) Rx(alpha) Ry(beta), for nearly parallel axes; distal (Hayati, Mirmirani)."""


class JointType(StrEnum):
    """How a row moves."""

    REVOLUTE = "revolute"
    CONTINUOUS = "continuous"
    PRISMATIC = "prismatic"
    FIXED = "fixed"

    @property
    def moves(self) -> bool:
        """Whether the row has a joint coordinate."""
        return self is not JointType.FIXED

    @property
    def turns(self) -> bool:
        """Whether the joint coordinate is an angle."""
        return self in (JointType.REVOLUTE, JointType.CONTINUOUS)


class ActuatorType(StrEnum):
    """What drives a joint in the MJCF."""

    POSITION = "position"
    VELOCITY = "velocity"
    MOTOR = "motor"
    NONE = "none"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SourceFile:
    """The text a robot was read from."""

    name: str
    """Name of the file, without its folder."""
    path: str
    """The file as the user named it, for messages."""
    text: str = field(repr=False)
    sha256: str
    """Hexadecimal SHA-256 of the file's bytes."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pose:
    """A pose as a robot file gives it: R = Rz(yaw) Ry(pitch) Rx(roll), about fixed x, y, z as in URDF."""

    xyz: Array = field(default_factory=lambda: read_only([0, 0, 0]))
    """Position, m, shape (3,)."""
    rpy: Array = field(default_factory=lambda: read_only([0, 0, 0]))
    """Roll, pitch and yaw, rad, shape (3,)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeshSpec:
    """A mesh file that shows a link."""

    file: Path
    """Absolute path of the file; known to exist when the robot was read."""
    scale: float = 1.0
    """Metres per unit of the file."""
    pose: Pose = field(default_factory=Pose)
    """Pose of the mesh's own frame in the DH frame that carries it."""
    location: str = ""
    """``file:line:column: path`` of the entry in the robot file, to begin an error message with."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Limits:
    """Limits of a joint; None where the file gives none."""

    position: tuple[float, float] | None = None
    """Lower and upper joint coordinate, rad or m."""
    velocity: float | None = None
    """rad/s or m/s."""
    effort: float | None = None
    """N·m or N."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Dynamics:
    """Joint dynamics, SI."""

    damping: float = 0.0
    """N·m·s/rad or N·s/m."""
    friction: float = 0.0
    """Coulomb friction, N·m or N."""
    armature: float = 0.0
    """Rotor inertia seen at the joint, kg·m² or kg."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkSpec:
    """What the file says of a link; None where it says nothing."""

    mass: float | None = None
    """kg."""
    com: Array | None = None
    """Centre of mass in DH frame i, m, shape (3,)."""
    inertia: Array | None = None
    """About the centre of mass, along DH frame i's axes, kg·m², shape (3, 3)."""
    density: float | None = None
    """kg/m³, for shapes made from the table."""
    radius: float | None = None
    """Of the shapes made from the table, m."""
    color: tuple[float, float, float, float] | None = None
    """Red, green, blue, alpha, each from 0 to 1."""
    mesh: MeshSpec | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ActuatorSpec:
    """What the file says of a joint's actuator; gains are None where it says nothing."""

    type: ActuatorType = ActuatorType.POSITION
    kp: float | None = None
    """Position gain, N·m/rad or N/m."""
    kv: float | None = None
    """Velocity gain, N·m·s/rad or N·s/m."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Row:
    """One row of the DH table: the row's transform at coordinate zero, and how it moves.

    The joint coordinate adds to theta (revolute, continuous) or to d (prismatic); with ``flip`` it subtracts.
    """

    name: str
    type: JointType
    convention: Convention
    a: float = 0.0
    """m; of index i - 1 in a modified row."""
    alpha: float = 0.0
    """rad; of index i - 1 in a modified row."""
    d: float = 0.0
    """m."""
    theta: float = 0.0
    """rad."""
    beta: float = 0.0
    """rad; second twist of a Hayati row, about y."""
    flip: bool = False
    limits: Limits = field(default_factory=Limits)
    dynamics: Dynamics = field(default_factory=Dynamics)
    link: LinkSpec = field(default_factory=LinkSpec)
    actuator: ActuatorSpec = field(default_factory=ActuatorSpec)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BaseSpec:
    """What the file says of the base link."""

    pose: Pose = field(default_factory=Pose)
    """Pose of DH frame 0 in base_link."""
    mesh: MeshSpec | None = None
    """Visual, in DH frame 0."""
    color: tuple[float, float, float, float] | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotSpec:
    """A robot as its file describes it; every number is finite and in SI units."""

    name: str
    rows: tuple[Row, ...]
    """The DH table, base first; at least one row."""
    description: str = ""
    source: str = ""
    """Where the numbers come from, in the author's words."""
    convention: Convention = Convention.STANDARD
    """Of rows that name none."""
    units: Units = field(default_factory=Units)
    """Units the robot file is written in; the numbers here are in SI units whatever they are."""
    parameters: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    """Named constants, evaluated, in the file's own units."""
    base: BaseSpec = field(default_factory=BaseSpec)
    tool: Pose = field(default_factory=Pose)
    """Pose of tool0 in DH frame n."""
    gravity: Array = field(default_factory=lambda: read_only([0, 0, -9.81]))
    """m/s² in base_link, shape (3,)."""
    configurations: Mapping[str, Array] = field(default_factory=lambda: MappingProxyType({}))
    """Named joint vectors, each of shape (number of moving rows,)."""
    source_file: SourceFile | None = None
    """None for a robot made in code."""

    @property
    def moving_rows(self) -> tuple[Row, ...]:
        """The rows that have a joint coordinate, in the order of a joint vector."""
        return tuple(row for row in self.rows if row.type.moves)
