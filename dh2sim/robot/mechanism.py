"""What makes a mechanism of a chain: branches, the closures of its loops, and how they are assembled."""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated

from dh2sim.robot.fields import Choice, Name, Text, Texts, Vector
from dh2sim.robot.links import Pose
from dh2sim.robot.parts import FILLED_IN, Internal, Part, Parts
from dh2sim.robot.row import Row
from dh2sim.typing import Array


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

    name: Annotated[str, Name("Default closure_<i>, counted from 1.")] = FILLED_IN
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
