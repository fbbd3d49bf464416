"""RobotModel, the one value that every writer reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from dh2sim.kinematics.chain import Joint, KinematicChain
from dh2sim.model.collision_exclusions import ExcludedPair
from dh2sim.model.limits import PositionRange
from dh2sim.model.mass import MassProperties
from dh2sim.model.meshes import MeshAsset
from dh2sim.model.shapes import Shape
from dh2sim.robot.spec import ActuatorType, Dynamics, RobotSpec
from dh2sim.typing import Array

Color = tuple[float, float, float, float]
"""Red, green, blue, alpha, each from 0 to 1."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkModel:
    """A link: what it looks like and weighs, in its joint-placed frame."""

    name: str
    shapes: tuple[Shape, ...]
    color: Color
    """Of the shapes along the table, and of the mesh."""
    joint_color: Color
    """Of the joint bodies."""
    mesh: MeshAsset | None
    """Shows the link instead of its shapes; placed from DH frame i."""
    inertial: MassProperties | None
    """In the joint frame; None for a fixed link without shapes or mass, and for a base link that does not move."""
    estimated: tuple[str, ...]
    """Which of 'mass', 'com' and 'inertia' were estimated from the shapes."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ActuatorModel:
    """What drives a joint, with gains."""

    type: ActuatorType
    kp: float
    """N·m/rad or N/m; 0 where the type has none."""
    kv: float
    """N·m·s/rad or N·s/m; 0 where the type has none."""
    assumed: bool
    """Whether a gain was chosen by dh2sim because the robot file gives none."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointModel:
    """A joint with its limits, dynamics and actuator."""

    joint: Joint
    range: PositionRange | None
    """None for continuous and fixed joints."""
    velocity: float
    """Velocity limit, rad/s or m/s."""
    effort: float
    """Effort limit, N·m or N."""
    assumed: tuple[str, ...]
    """Which of 'position', 'velocity' and 'effort' limits were assumed."""
    dynamics: Dynamics
    actuator: ActuatorModel

    @property
    def name(self) -> str:
        """The joint's name."""
        return self.joint.name


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotModel:
    """Everything the writers need; SI units."""

    spec: RobotSpec
    chain: KinematicChain
    base: LinkModel
    """base_link."""
    links: tuple[LinkModel, ...]
    """link_1 … link_n, one for every row."""
    joints: tuple[JointModel, ...]
    """One for every row."""
    excluded: tuple[ExcludedPair, ...]
    """Pairs of links that do not collide."""
    reach: float
    """Upper bound of the distance from base_link's origin to any frame, m."""
    home: Array
    """The configuration 'home', or zero moved inside the limits; rad or m, shape (m,)."""
    holding: Mapping[str, tuple[float, ...]]
    """For every named configuration the generalised forces that hold the robot still in it, N·m or N."""

    @property
    def name(self) -> str:
        """The robot's name."""
        return self.spec.name

    @property
    def all_links(self) -> tuple[LinkModel, ...]:
        """The base link and the others, base first."""
        return (self.base, *self.links)

    @property
    def moving_joints(self) -> tuple[JointModel, ...]:
        """The joints that have a coordinate, in the order of a joint vector."""
        return tuple(joint for joint in self.joints if joint.joint.type.moves)

    @property
    def mass(self) -> float:
        """Mass of all links that move, kg."""
        return sum(link.inertial.mass for link in self.links if link.inertial is not None)
