"""What a robot file says, in SI units (m, rad, kg, N, N·m): the one description of a robot's fields.

Each field is annotated with its kind (``fields``): what it means, its unit in files and what is allowed. A
``RobotSpec`` checks itself and all its parts when it is made, from a file or in code; parts are checked as part of
a robot.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Final

import numpy as np

from dh2sim.errors import ConfigurationError, Problem, RobotError
from dh2sim.messages import Loc, did_you_mean, listed, path_of, shown
from dh2sim.robot.checks import check, default_name
from dh2sim.robot.fields import (
    COORDINATE,
    Choice,
    Color,
    Configurations,
    Dimension,
    Flag,
    MeshFile,
    Name,
    Number,
    Numbers,
    Parameters,
    Range,
    Scope,
    Text,
    Texts,
    Tree,
    UnitsLike,
    Vector,
)
from dh2sim.robot.magnitudes import (
    ACCELERATION,
    ARMATURE,
    DAMPING,
    DENSITY,
    EFFORT,
    FRICTION,
    MASS,
    POSITION_GAIN,
    SCALE,
    VELOCITY_GAIN,
)
from dh2sim.robot.mechanism_checks import check_mechanism, default_closure_name
from dh2sim.robot.parts import Inertia, Internal, NamedParts, Part, Parts, kept, plain_part
from dh2sim.typing import Array, read_only

_FILLED_IN: Final[Any] = None
"""Default of a field that the RobotSpec fills in: in its rows there is always a value."""


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
    """Units of the angles and lengths in this file."""

    angle: Annotated[AngleUnit, Choice("Unit of angles.", AngleUnit)] = AngleUnit.RAD
    length: Annotated[LengthUnit, Choice("Unit of lengths.", LengthUnit)] = LengthUnit.M

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

    def to_si(self, value: float, dimension: Dimension | None, *, turns: bool) -> float:
        """Return a number of the file in SI units; ``turns`` says whether a joint coordinate is an angle."""
        match dimension:
            case Dimension.ANGLE:
                return self.radians(value)
            case Dimension.LENGTH:
                return self.metres(value)
            case Dimension.COORDINATE:
                return self.coordinate(value, turns=turns)
            case None:
                return value


class Convention(StrEnum):
    """Order of the factors of a row's transform."""

    STANDARD = "standard"
    """A_i = Rz(theta) Tz(d) Tx(a) Rx(alpha); distal (Paul, Spong)."""
    MODIFIED = "modified"
    """A_i = Tx(a) Rx(alpha) Rz(theta) Tz(d), with a and alpha of index i - 1; proximal (Craig)."""
    HAYATI = "hayati"
    """A_i = Rz(theta) Tx(a) Rx(alpha) Ry(beta), for nearly parallel axes; distal (Hayati, Mirmirani)."""


CONVENTIONS: Final = {
    "craig": "modified",
    "mdh": "modified",
    "proximal": "modified",
    "khalil": "modified",
    "dh": "standard",
    "sdh": "standard",
    "classic": "standard",
    "classical": "standard",
    "distal": "standard",
    "paul": "standard",
    "spong": "standard",
}
"""What the conventions are called elsewhere."""


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


JOINT_LETTERS: Final = {"r": "revolute", "p": "prismatic", "f": "fixed"}
"""Joint types as many tables abbreviate them."""


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


LENGTHS: Final = Number("", Dimension.LENGTH)
_ANGLES: Final = Number("", Dimension.ANGLE)
GRAVITY: Final = Number("", size=ACCELERATION)
_RPY: Final = "roll, pitch, yaw"


def _zeros() -> Array:
    return read_only([0, 0, 0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pose:
    """A pose: position, and angles about fixed x, y, z as in URDF."""

    xyz: Annotated[Array, Numbers("Position, in the file's length unit.", LENGTHS)] = field(default_factory=_zeros)
    rpy: Annotated[Array, Numbers("Roll, pitch, yaw, in the file's angle unit.", _ANGLES, of=_RPY)] = field(
        default_factory=_zeros
    )
    """R = Rz(yaw) Ry(pitch) Rx(roll)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeshSpec:
    """A mesh file that shows a link."""

    file: Annotated[
        Path, MeshFile("STL, OBJ, PLY, GLB or DAE file; relative to the folder of this file.", required=True)
    ]
    """Of a robot that was read from a file: absolute, and known to have existed then."""
    scale: Annotated[
        float, Number("Metres per unit of the mesh file; a DAE file has its own unit already.", size=SCALE, above=0)
    ] = 1.0
    pose: Annotated[Pose, Part("Pose of the mesh file's own frame in the DH frame.", Pose, inline=True)] = field(
        default_factory=Pose
    )
    location: Annotated[str, Internal("", str)] = ""
    """``file:line:column: path`` of the entry in the robot file, to begin an error message with."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Limits:
    """Limits of a joint, in the file's units."""

    position: Annotated[
        tuple[float, float] | None,
        Range("Lower and upper joint coordinate, in the file's angle or length unit.", COORDINATE),
    ] = None
    velocity: Annotated[
        float | None,
        Number("In the file's angle or length unit per second.", Dimension.COORDINATE, rate=1, above=0),
    ] = None
    effort: Annotated[float | None, Number("N·m or N.", size=EFFORT, above=0)] = None
    acceleration: Annotated[
        float | None,
        Number("Of trajectories, in the file's angle or length unit per s².", Dimension.COORDINATE, rate=2, above=0),
    ] = None
    jerk: Annotated[
        float | None,
        Number("Of trajectories, in the file's angle or length unit per s³.", Dimension.COORDINATE, rate=3, above=0),
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Dynamics:
    """Joint dynamics, in SI units."""

    damping: Annotated[float, Number("N·m·s/rad or N·s/m.", size=DAMPING, least=0)] = 0.0
    friction: Annotated[float, Number("Coulomb friction, N·m or N.", size=FRICTION, least=0)] = 0.0
    armature: Annotated[float, Number("Rotor inertia seen at the joint, kg·m² or kg.", size=ARMATURE, least=0)] = 0.0


_Rgba = tuple[float, float, float, float]
_COLOR: Final = Color("Red, green, blue and optionally alpha, each 0 to 1.")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkSpec:
    """The link that a joint moves."""

    mass: Annotated[
        float | None, Number("kg; 0 for a link that weighs nothing, between others.", size=MASS, least=0)
    ] = None
    com: Annotated[Array | None, Numbers("Centre of mass in DH frame i, in the file's length unit.", LENGTHS)] = None
    inertia: Annotated[Array | None, Inertia("About com, along DH frame i's axes, kg·m².")] = None
    density: Annotated[
        float | None,
        Number("kg/m³, for shapes made from the table; used where mass is not given.", size=DENSITY, above=0),
    ] = None
    radius: Annotated[
        float | None,
        Number("Of the shapes made from the table, in the file's length unit.", Dimension.LENGTH, above=0),
    ] = None
    color: Annotated[_Rgba | None, _COLOR] = None
    mesh: Annotated[MeshSpec | None, Part("Visual mesh, in DH frame i.", MeshSpec)] = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ActuatorSpec:
    """What drives a joint in the MJCF."""

    type: Annotated[
        ActuatorType, Choice("What the control signal is; default position.", ActuatorType, inherited=True)
    ] = ActuatorType.POSITION
    kp: Annotated[
        float | None, Number("Position gain, N·m/rad or N/m; for position.", size=POSITION_GAIN, above=0)
    ] = None
    kv: Annotated[
        float | None,
        Number(
            "Velocity gain, N·m·s/rad or N·s/m; for position (0: no damping) and velocity (not 0).",
            size=VELOCITY_GAIN,
            least=0,
        ),
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Row:
    """A row of the DH table: its transform at coordinate zero, how it moves and what it carries."""

    name: Annotated[str, Name("Default joint_<i>, counted from 1.")] = _FILLED_IN
    type: Annotated[
        JointType,
        Choice(
            "How the row moves; R, P and F are short for revolute, prismatic and fixed.",
            JointType,
            short=JOINT_LETTERS,
            required=True,
        ),
    ]
    convention: Annotated[
        Convention, Choice("Overrides the file's for this row.", Convention, other_names=CONVENTIONS)
    ] = _FILLED_IN
    a: Annotated[float, Number("a_i (modified: a_{i-1}), in the file's length unit.", Dimension.LENGTH)] = 0.0
    alpha: Annotated[float, Number("alpha_i (modified: alpha_{i-1}), in the file's angle unit.", Dimension.ANGLE)] = (
        0.0
    )
    d: Annotated[
        float,
        Number(
            "d_i, in the file's length unit; a prismatic coordinate adds to it. "
            "A Hayati row has one only if it is prismatic.",
            Dimension.LENGTH,
        ),
    ] = 0.0
    theta: Annotated[
        float, Number("theta_i, in the file's angle unit; a revolute coordinate adds to it.", Dimension.ANGLE)
    ] = 0.0
    beta: Annotated[
        float,
        Number("beta_i, second twist, about y, in the file's angle unit; of a Hayati row only.", Dimension.ANGLE),
    ] = 0.0
    flip: Annotated[bool, Flag("True: the joint coordinate subtracts instead.")] = False
    limits: Annotated[
        Limits, Part("Limits, in the file's units; [lower, upper] are those of position.", Limits, list_is="position")
    ] = field(default_factory=Limits)
    dynamics: Annotated[Dynamics, Part("Joint dynamics, SI.", Dynamics)] = field(default_factory=Dynamics)
    link: Annotated[LinkSpec, Part("The link that this joint moves.", LinkSpec)] = field(default_factory=LinkSpec)
    actuator: Annotated[ActuatorSpec, Part("Overrides the file's actuators.", ActuatorSpec)] = field(
        default_factory=ActuatorSpec
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BaseSpec:
    """Pose of DH frame 0 in base_link, and how the base looks."""

    pose: Annotated[Pose, Part("Pose of DH frame 0 in base_link.", Pose, inline=True)] = field(default_factory=Pose)
    color: Annotated[_Rgba | None, _COLOR] = None
    mesh: Annotated[MeshSpec | None, Part("Visual mesh, in DH frame 0.", MeshSpec)] = None


class ShapeType(StrEnum):
    """A solid that a tool is made of."""

    BOX = "box"
    CYLINDER = "cylinder"
    SPHERE = "sphere"


_SIDES: Final = Number("", Dimension.LENGTH, above=0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShapeSpec:
    """A solid: it shows a tool, collides, and gives the tool the mass and inertia that are not given."""

    type: Annotated[ShapeType, Choice("Its axis is its own z.", ShapeType, required=True)]
    size: Annotated[Array | None, Numbers("Of a box, along x, y, z, in the file's length unit.", _SIDES)] = None
    radius: Annotated[
        float | None,
        Number("Of a cylinder or a sphere, in the file's length unit.", Dimension.LENGTH, above=0),
    ] = None
    length: Annotated[
        float | None, Number("Of a cylinder, in the file's length unit.", Dimension.LENGTH, above=0)
    ] = None
    pose: Annotated[Pose, Part("Pose of its centre in DH frame n.", Pose, inline=True)] = field(default_factory=Pose)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ToolSpec(Pose):
    """Pose of tool0 in DH frame n, and what the last link carries: a gripper, say. All of it in DH frame n."""

    mass: Annotated[float | None, Number("kg", size=MASS, least=0)] = None
    com: Annotated[
        Array | None,
        Numbers("Centre of mass in DH frame n, in the file's length unit; default the shape's, or tool0.", LENGTHS),
    ] = None
    inertia: Annotated[Array | None, Inertia("About com, along DH frame n's axes, kg·m².")] = None
    color: Annotated[_Rgba | None, _COLOR] = None
    shape: Annotated[
        ShapeSpec | None, Part("Solid in DH frame n, to which the last link then reaches.", ShapeSpec)
    ] = None
    mesh: Annotated[MeshSpec | None, Part("Visual mesh, in DH frame n.", MeshSpec)] = None

    @classmethod
    def at(cls, pose: Pose) -> "ToolSpec":
        """Return a tool0 without a tool."""
        return cls(xyz=pose.xyz, rpy=pose.rpy)

    @property
    def pose(self) -> Pose:
        """Pose of tool0 in DH frame n, alone."""
        return Pose(xyz=self.xyz, rpy=self.rpy)

    @property
    def is_body(self) -> bool:
        """Whether there is a tool besides the frame tool0."""
        given = (self.mass, self.com, self.inertia, self.color, self.shape, self.mesh)
        return any(value is not None for value in given)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PayloadSpec:
    """What the arm is to carry besides its tool: assumed efforts and gains hold it, but no export contains it."""

    mass: Annotated[float | None, Number("kg; default a share of the arm's moving mass.", size=MASS, least=0)] = None
    com: Annotated[
        Array | None,
        Numbers("Centre of mass in DH frame n, in the file's length unit; default just before tool0.", LENGTHS),
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BranchSpec:
    """A further chain of rows, which starts from a frame of the main chain or of a branch before it."""

    origin: Annotated[
        str,
        Text("Frame that it starts from: base_link, link_1, dh_2, tool0, rocker/dh_1.", required=True, key="from"),
    ]
    pose: Annotated[Pose, Part("Pose of the branch's DH frame 0 in that frame.", Pose)] = field(default_factory=Pose)
    rows: Annotated[
        tuple[Row, ...], Parts("The branch's DH table, a row each.", Part("", Row), required=True, key="joints")
    ]


class ClosureType(StrEnum):
    """A joint that closes a loop; its axis is the z axis of both frames."""

    REVOLUTE = "revolute"
    """The origins and the z axes coincide."""
    SPHERICAL = "spherical"
    """The origins coincide."""
    UNIVERSAL = "universal"
    """The origins coincide and the z axes, those of the cross, are perpendicular."""
    CYLINDRICAL = "cylindrical"
    """The z axes are on one line."""
    PRISMATIC = "prismatic"
    """The z axes are on one line, and the frames have the same orientation."""
    FIXED = "fixed"
    """The frames coincide."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClosureSpec:
    """Two frames that must coincide, up to the freedom of a joint."""

    name: Annotated[str, Name("Default closure_<i>, counted from 1.")] = _FILLED_IN
    between: Annotated[
        tuple[str, str],
        Texts("The two frames, such as [dh_2, rocker/dh_1].", of="frames", count=2, required=True),
    ]
    type: Annotated[ClosureType, Choice("The joint between them.", ClosureType, required=True)]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AssemblySpec:
    """A configuration near which the loops are closed: it picks one of the ways to assemble the mechanism."""

    q: Annotated[
        Array,
        Vector(
            "A joint vector, in the file's units: of the moving rows of the main chain, then of the branches.",
            required=True,
        ),
    ]
    """Shape (n,), rad and m, as given: a guess."""
    location: Annotated[str, Internal("", str)] = ""
    """``file:line:column: path`` of the vector in the robot file, to begin an error message with."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotSpec:
    """A robot described by its Denavit-Hartenberg table.

    Strings are taken where an enumeration is meant, and any real numbers and sequences of them; the spec that is
    made holds enumerations, floats and read-only arrays.

    Raises:
        RobotError: Something is wrong; the error holds everything that is, with its path as in a robot file.
    """

    name: Annotated[str, Name("Name of the robot; names the exported files.", required=True)]
    description: Annotated[str, Text("What the robot is.")] = ""
    source: Annotated[str, Text("Where the numbers come from.")] = ""
    convention: Annotated[
        Convention,
        Choice(
            "standard: Rz(theta) Tz(d) Tx(a) Rx(alpha); modified: Tx(a) Rx(alpha) Rz(theta) Tz(d); "
            "hayati: Rz(theta) Tx(a) Rx(alpha) Ry(beta).",
            Convention,
            other_names=CONVENTIONS,
            required=True,
        ),
    ] = Convention.STANDARD
    """Of rows that name none."""
    units: Annotated[Units, Part("Units of this file; default rad and m.", Units)] = field(default_factory=Units)
    """Of the file that the robot was read from, and of its parameters; everything else here is in SI units."""
    parameters: Annotated[
        Mapping[str, float], Parameters("Named constants for expressions, in the file's units.")
    ] = field(default_factory=lambda: MappingProxyType({}))
    """Evaluated."""
    base: Annotated[BaseSpec, Part("DH frame 0 in base_link.", BaseSpec)] = field(default_factory=BaseSpec)
    tool: Annotated[ToolSpec, Part("tool0 in DH frame n, and the tool.", ToolSpec)] = field(default_factory=ToolSpec)
    payload: Annotated[
        PayloadSpec,
        Part(
            "Nominal payload, which assumed efforts and gains hold; a number is its mass, kg.",
            PayloadSpec,
            number_is="mass",
        ),
    ] = field(default_factory=PayloadSpec)
    gravity: Annotated[Array, Numbers("m/s² in base_link.", GRAVITY)] = field(
        default_factory=lambda: read_only([0, 0, -9.81])
    )
    rows: Annotated[
        tuple[Row, ...],
        Parts("The DH table, a row each, base first.", Part("", Row), required=True, key="joints"),
    ]
    configurations: Annotated[
        Mapping[str, Array],
        Configurations("Named joint vectors, a number for each moving row, in the file's units."),
    ] = field(default_factory=lambda: MappingProxyType({}))
    """Each of shape (number of moving rows,)."""
    branches: Annotated[
        Mapping[str, BranchSpec],
        NamedParts("Further chains by name, each from a frame of those before it.", Part("", BranchSpec)),
    ] = field(default_factory=lambda: MappingProxyType({}))
    closures: Annotated[
        tuple[ClosureSpec, ...],
        Parts("Joints that close loops: frames that must coincide.", Part("", ClosureSpec), may_be_empty=True),
    ] = ()
    actuated: Annotated[
        tuple[str, ...] | None,
        Texts("Names of the joints that are driven; the others are passive. Default all.", of="joint names"),
    ] = None
    assembly: Annotated[AssemblySpec | None, Part("How the loops are assembled.", AssemblySpec)] = None
    source_file: Annotated[SourceFile | None, Internal("", SourceFile)] = None
    """None for a robot made in code."""

    def __repr__(self) -> str:
        conventions = " and ".join(dict.fromkeys(row.convention.value for row in self.all_rows))
        return f"<RobotSpec '{self.name}': {len(self.all_rows)} rows, {conventions}>"

    def __post_init__(self) -> None:
        """Check the robot and fill in what is left out."""
        problems = _Problems()
        scope = Scope(report=problems, parameters=None, directory=Path())
        tree = ROBOT.check({"convention": Convention.STANDARD.value, **plain_part(self)}, (), scope)
        check_robot(tree, scope)
        if problems.found:
            raise RobotError(problems.found)
        for name, value in robot_fields(tree, Units()).items():
            object.__setattr__(self, name, kept(getattr(self, name), value))

    def __reduce__(self) -> tuple[Any, ...]:
        """Let a robot be pickled and copied: read-only mappings cannot be."""
        given = {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}
        plain = {name: dict(value) if isinstance(value, Mapping) else value for name, value in given.items()}
        return _restored, (plain,)

    @property
    def all_rows(self) -> tuple[Row, ...]:
        """The rows of the main chain, then those of the branches."""
        return (*self.rows, *(row for branch in self.branches.values() for row in branch.rows))

    @property
    def moving_rows(self) -> tuple[Row, ...]:
        """The rows that have a joint coordinate, in the order of a joint vector: main chain first, then branches."""
        return tuple(row for row in self.all_rows if row.type.moves)

    @property
    def is_mechanism(self) -> bool:
        """Whether there is more than one serial chain."""
        return bool(self.branches or self.closures)

    @property
    def named_configurations(self) -> Mapping[str, Array]:
        """Home and zero, which every serial robot has, and those of the robot file: rad and m, each of shape (n,).

        Where the file has no ``home``, it is the assembly, or zero moved inside the limits. Where there are loops,
        these are what they are closed from, and there is no zero but the file's.
        """
        limits = [row.limits.position or (0.0, 0.0) for row in self.moving_rows]
        home = read_only([min(max(0.0, lower), upper) for lower, upper in limits])
        if self.closures:
            return MappingProxyType(
                {"home": home if self.assembly is None else self.assembly.q, **self.configurations}
            )
        return MappingProxyType({"home": home, "zero": read_only([0.0] * len(limits)), **self.configurations})

    def configuration(self, name: str) -> Array:
        """Return one of ``named_configurations``, rad and m, shape (n,).

        Raises:
            ConfigurationError: There is none of that name.
        """
        known = self.named_configurations
        if name not in known:
            raise ConfigurationError(
                f"{self.name} has no configuration {shown(name)}.{did_you_mean(name, known)} "
                f"Configurations: {listed(known)}"
            )
        return known[name]


ROBOT: Final = Part("", RobotSpec, more={"actuators": Part("What drives every joint.", ActuatorSpec)})
"""The robot file as a whole."""


def robot_of_checked(given: Mapping[str, Any]) -> RobotSpec:
    """Return the robot of fields that ``robot_fields`` made of a tree without problems, without another check."""
    robot = object.__new__(RobotSpec)
    for each in dataclasses.fields(RobotSpec):
        if each.name in given or each.default is not dataclasses.MISSING:
            value = given.get(each.name, each.default)
            value = MappingProxyType(value) if isinstance(value, dict) else value
        else:
            assert each.default_factory is not dataclasses.MISSING
            value = each.default_factory()
        object.__setattr__(robot, each.name, value)
    return robot


def _restored(given: Mapping[str, Any]) -> RobotSpec:
    """Return a robot that was pickled; numpy lets arrays be written to then."""
    robot = robot_of_checked(given)
    _freeze(robot)
    return robot


def _freeze(value: object) -> None:
    """Make all arrays of a robot, or of a part of it, read-only."""
    if isinstance(value, np.ndarray):
        value.setflags(write=False)
    elif isinstance(value, Mapping | tuple):
        for inner in value.values() if isinstance(value, Mapping) else value:
            _freeze(inner)
    elif dataclasses.is_dataclass(value):
        for each in dataclasses.fields(value):
            _freeze(getattr(value, each.name))


class _Problems:
    """Takes the problems of a robot made in code."""

    def __init__(self) -> None:
        self.found: list[Problem] = []

    def __call__(self, loc: Loc, message: str, *, at_key: bool = False, path: Loc | None = None) -> None:  # noqa: ARG002
        self.found.append(Problem(path=path_of(loc if path is None else path), message=message))

    def line(self, *locs: Loc) -> str:  # noqa: ARG002
        return ""


def check_robot(tree: Tree, scope: Scope) -> None:
    """Report what does not go together in a robot."""
    check(tree, scope)
    check_mechanism(tree, scope)


def robot_fields(tree: Tree, units: UnitsLike) -> dict[str, Any]:
    """Return the fields of the robot that a checked tree describes: what is left out is filled in.

    Args:
        tree: Without anything wrong.
        units: That its values are in.
    """
    rows = filled_in(tree["joints"], tree)
    branches = {
        name: {**branch, "joints": filled_in(branch["joints"], tree, name)}
        for name, branch in tree.get("branches", {}).items()
    }
    closures = [
        {"name": default_closure_name(index), **closure} for index, closure in enumerate(tree.get("closures", ()))
    ]
    whole = {**tree, "joints": rows, "branches": branches, "closures": closures}
    fields = ROBOT.fields(whole, units)
    every = [*rows, *(row for branch in branches.values() for row in branch["joints"])]
    fields["configurations"] = joint_vectors(tree, every, units)
    if "assembly" in tree:
        q = joint_vector_si(tree["assembly"]["q"], every, units)
        fields["assembly"] = AssemblySpec(q=q, location=tree["assembly"].get("location", ""))
    return fields


def filled_in(rows: Sequence[Tree], robot: Tree, branch: str = "") -> list[Tree]:
    """Return the rows of a checked tree, each with a name, a convention and an actuator."""
    shared = {"type": ActuatorType.POSITION, **robot.get("actuators", {})}
    convention = robot.get("convention", Convention.STANDARD)
    filled = [
        {"name": default_name(index, branch), "convention": convention, **row, "actuator": _actuator(row, shared)}
        for index, row in enumerate(rows)
    ]
    actuated = robot.get("actuated")
    if actuated is None:
        return filled
    passive = {"type": ActuatorType.NONE}
    return [row if row["name"] in actuated else {**row, "actuator": passive} for row in filled]


def joint_vectors(robot: Tree, rows: Sequence[Tree], units: UnitsLike) -> Mapping[str, Array]:
    """Return the configurations of a checked tree in SI units."""
    vectors = robot.get("configurations", {})
    return MappingProxyType({name: joint_vector_si(vector, rows, units) for name, vector in vectors.items()})


def joint_vector_si(vector: Sequence[float], rows: Sequence[Tree], units: UnitsLike) -> Array:
    """Return a joint vector of a checked tree in SI units."""
    turns = [row["type"].turns for row in rows if row["type"].moves]
    pairs = zip(vector, turns, strict=True)
    return read_only([units.to_si(value, Dimension.COORDINATE, turns=turn) for value, turn in pairs])


def _actuator(row: Tree, shared: Tree) -> Tree:
    """Return a row's actuator: its own, else the file's; gains are inherited where the types agree."""
    if row["type"] is JointType.FIXED:
        return {"type": ActuatorType.NONE}
    own = row.get("actuator", {})
    return {**shared, **own} if own.get("type", shared["type"]) is shared["type"] else own
