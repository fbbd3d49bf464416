"""What the readers make of a URDF, an MJCF or a file of axes: a serial chain with its links, limits and actuators."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Final, TypeAlias

from dh2sim.kinematics.serial_chain import SerialChain
from dh2sim.messages import Notes, listed
from dh2sim.model.mass import MassProperties, thickened
from dh2sim.model.robot_model import Color
from dh2sim.robot.fields import MESH_SUFFIXES
from dh2sim.robot.magnitudes import INERTIA, LARGEST, shown_size
from dh2sim.robot.row import ActuatorSpec, Dynamics, Limits
from dh2sim.typing import Array, read_only

GREATEST: Final = LARGEST
"""Of any number in a file: a product of a few of them is still a finite double."""
_SAME_SCALE: Final = 1e-6
"""By which the three scales of a mesh may differ, relative to the greatest."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SerialMesh:
    """A mesh that shows a link."""

    uri: str
    """As the file names it, such as ``package://pkg/meshes/link.stl``."""
    path: Path | None
    """The file, where it was found."""
    scale: float
    """Metres per unit of the mesh file."""
    T_link_mesh: Array = field(repr=False)
    """Pose of the mesh's own frame in the link's frame, shape (4, 4)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inertial:
    """Mass properties as far as they are known, in a link of the arm; None where the file does not give them."""

    mass: float | None = None
    """kg, greater than 0."""
    com: Array | None = field(default=None, repr=False)
    """m, shape (3,)."""
    inertia: Array | None = field(default=None, repr=False)
    """About the centre of mass, along the axes of the link of the arm, kg·m², shape (3, 3)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Look:
    """The appearance of a link; None where nothing of the file can be carried over."""

    mesh: SerialMesh | None = None
    color: Color | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SerialLink:
    """A link of the chain, with everything that is fixed to it; None where the file does not give it."""

    name: str
    """As in the file."""
    mass: float | None = None
    """kg; 0 for a link that weighs nothing."""
    com: Array | None = None
    """Centre of mass in the link's frame, m, shape (3,)."""
    inertia: Array | None = None
    """About the centre of mass, along the link frame's axes, kg·m², shape (3, 3); possible for a body."""
    mesh: SerialMesh | None = None
    color: Color | None = None

    @classmethod
    def of(cls, name: str, inertial: Inertial, look: Look) -> SerialLink:
        """Return a link of a name, with its mass properties and its looks."""
        return cls(
            name=name,
            mass=inertial.mass,
            com=inertial.com,
            inertia=inertial.inertia,
            mesh=look.mesh,
            color=look.color,
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ChainJoints:
    """The moving joints of an arm, with the limits and the dynamics of each."""

    chain: SerialChain
    limits: tuple[Limits, ...]
    dynamics: tuple[Dynamics, ...]


Mechanics: TypeAlias = Callable[[Array], tuple[Array, Array]]
"""Returns mass matrices without rotor inertia, shape (N, n, n), and the forces that balance gravity, (N, n), of joint
vectors of shape (N, n), rad and m."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SerialRobot:
    """A serial robot as a file of another format describes it; SI units."""

    name: str
    """As in the file; a robot file may not allow it."""
    description: str
    """Such as ``URDF panda.urdf, from panda_link0 to panda_link8``."""
    chain: SerialChain
    """Starts in the base's frame, ends in the tip's."""
    base: SerialLink
    """The base; a robot file has no place for its mass."""
    links: tuple[SerialLink, ...]
    """One for every joint of the chain: the link that it carries, in the frame of ``SerialJoint.T_parent_link``."""
    limits: tuple[Limits, ...]
    """One for every joint."""
    dynamics: tuple[Dynamics, ...]
    """One for every joint."""
    actuators: tuple[ActuatorSpec, ...] | None = None
    """One for every joint; None where the format has no actuators."""
    gravity: Array = field(default_factory=lambda: read_only([0, 0, -9.81]))
    """m/s² in the base's frame, shape (3,)."""
    configurations: Mapping[str, Array] = field(default_factory=lambda: MappingProxyType({}))
    """Named joint vectors, rad and m, each of shape (number of joints,)."""
    mechanics: Mechanics | None = field(default=None, repr=False)
    """By the file's own masses, whatever was read of them; None where it has none."""
    notes: tuple[str, ...] = ()
    """What was chosen, changed or left out, one sentence each, for the user to read."""


def possible_inertial(whole: MassProperties, name: str, notes: Notes) -> Inertial:
    """Return the mass properties of a link; an inertia that no body can have is noted and left out."""
    inertia = thickened(whole.inertia)
    if inertia is None:
        notes.group("Impossible inertias are left out, of links {}.", name)
    elif float(whole.inertia.max()) < INERTIA.least:
        least = shown_size(INERTIA.least)
        notes.group(f"Inertias of less than {least} kg·m² are made greater by that, of links {{}}.", name)
    elif inertia is not whole.inertia:
        notes.group("Inertias of thin rods, zero about the rod, are made greater by 1e-9 of them, of links {}.", name)
    return Inertial(mass=whole.mass, com=whole.com, inertia=inertia)


def can_show(suffix: str, scale: Sequence[float], name: str, notes: Notes) -> bool:
    """Whether a robot file can show a mesh file; if not, it is noted.

    Args:
        suffix: Of the mesh file.
        scale: Along x, y and z.
        name: Of the link.
        notes: Takes what is left out.
    """
    if suffix.lower() not in MESH_SUFFIXES:
        sentence = f"Meshes in formats other than {listed(MESH_SUFFIXES)} are not carried over, of links {{}}."
        notes.group(sentence, name, suffix[:20] or "no suffix")
        return False
    if min(scale) <= 0.0 or max(scale) - min(scale) > _SAME_SCALE * max(scale):
        detail = " ".join(f"{value:g}" for value in scale)
        notes.group("Meshes that are mirrored or scaled unevenly are not carried over: {}.", name, detail)
        return False
    return True
