"""What links are: where a base, a tool and a mesh sit, what weighs, and how it looks."""

from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Final

from dh2sim.robot.fields import ANGLES, LENGTHS, Choice, Color, Dimension, MeshFile, Number, Numbers
from dh2sim.robot.magnitudes import DENSITY, MASS, SCALE
from dh2sim.robot.parts import Inertia, Internal, Part
from dh2sim.typing import Array, read_only

_Rgba = tuple[float, float, float, float]
_COLOR: Final = Color("Red, green, blue and optionally alpha, each 0 to 1.")
_SIDES: Final = Number("", Dimension.LENGTH, above=0)


def _zeros() -> Array:
    return read_only([0, 0, 0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pose:
    """A pose: position, and angles about fixed x, y, z as in URDF."""

    xyz: Annotated[Array, Numbers("Position, in the file's length unit.", LENGTHS)] = field(default_factory=_zeros)
    rpy: Annotated[Array, Numbers("Roll, pitch, yaw, in the file's angle unit.", ANGLES, of="roll, pitch, yaw")] = (
        field(default_factory=_zeros)
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
