"""RobotModel, the one value that every writer reads."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from dh2sim.kinematics.chain import Joint, KinematicChain, joint_vector
from dh2sim.kinematics.transforms import identity
from dh2sim.model.actuators import ActuatorModel, Duty, gravity_loads
from dh2sim.model.collision_exclusions import ExcludedPair
from dh2sim.model.limits import Range, clamped
from dh2sim.model.mass import MassProperties, combine, in_frame
from dh2sim.model.meshes import MeshAsset
from dh2sim.model.shapes import Shape
from dh2sim.robot.row import ActuatorType, Dynamics, Limits
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only

Color = tuple[float, float, float, float]
"""Red, green, blue, alpha, each from 0 to 1."""


class FilledInHow(StrEnum):
    """How dh2sim came by a number that the robot file does not give."""

    ESTIMATED = "Estimated from the shapes, not measured"
    ASSUMED = "Assumed, not given"


@dataclass(frozen=True, slots=True, kw_only=True)
class FilledIn:
    """Properties that the robot file leaves open, filled in for some links or joints."""

    how: FilledInHow
    what: tuple[str, ...]
    """Such as 'mass' and 'com', or 'velocity' and 'effort'."""
    where: tuple[str, ...]
    """Names of the links or joints."""
    everywhere: bool = False
    """Whether these are all moving joints."""

    def __str__(self) -> str:
        """Return ``mass, com, inertia of link_1 to link_6``, or ``velocity, effort limits of all joints``."""
        what = ", ".join(self.what)
        if self.how is FilledInHow.ESTIMATED:
            return f"{what} of {_spans(self.where)}"
        return f"{what} limits of {'all joints' if self.everywhere else ', '.join(self.where)}"

    @property
    def sentence(self) -> str:
        """The same as a whole sentence."""
        return f"{self.how}: {self}."


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkModel:
    """A link: what it looks like and weighs, in its joint-placed frame, or DH frame n for the tool."""

    name: str
    shapes: tuple[Shape, ...]
    color: Color
    """Of the shapes along the table, and of the mesh."""
    joint_color: Color
    """Of the joint bodies."""
    mesh: MeshAsset | None
    """Shows the link instead of its shapes; placed from DH frame i."""
    inertial: MassProperties | None
    """In the link's frame; None for one that weighs nothing, and for a base link that does not move."""
    estimated: tuple[str, ...]
    """Which of 'mass', 'com' and 'inertia' were estimated from the shapes."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointModel(Joint):
    """A joint of the chain with its limits, dynamics and actuator."""

    limits: Limits
    """The robot file's, with what it leaves open filled in; continuous and fixed joints have no position limits."""
    assumed: tuple[str, ...]
    """Which of the limits 'position', 'velocity' and 'effort' were assumed."""
    dynamics: Dynamics
    duty: Duty
    """What the joint is to hold and to move, with the nominal payload."""
    actuator: ActuatorModel

    @property
    def position_range(self) -> Range | None:
        """Lowest and highest coordinate, rad or m; None for continuous and fixed joints."""
        return self.limits.position

    @property
    def travel(self) -> Range:
        """Coordinates to sample or to show, rad or m: the position range, or one turn for a continuous joint."""
        return (-math.pi, math.pi) if self.position_range is None else self.position_range

    @property
    def velocity(self) -> float:
        """Velocity limit, rad/s or m/s; infinite without one."""
        return math.inf if self.limits.velocity is None else self.limits.velocity

    @property
    def effort(self) -> float:
        """Effort limit, N·m or N; infinite without one."""
        return math.inf if self.limits.effort is None else self.limits.effort

    @property
    def control_range(self) -> Range | None:
        """Range of the actuator's control, from the limits: rad or m, their rate, N·m or N; None if unlimited."""
        match self.actuator.type:
            case ActuatorType.POSITION:
                return self.position_range
            case ActuatorType.VELOCITY:
                return -self.velocity, self.velocity
            case ActuatorType.MOTOR:
                return -self.effort, self.effort
            case ActuatorType.NONE:
                return None

    def clamped(self, position: float) -> float:
        """Return a coordinate, rad or m, moved inside the position range."""
        return clamped(position, self.position_range)


MANY_TURNS = 100.0
"""rad: smaller angles are rounded by less than 1e-14."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotModel:
    """A robot with everything that the writers need; SI units."""

    spec: RobotSpec
    chain: KinematicChain
    base: LinkModel
    """base_link."""
    links: tuple[LinkModel, ...]
    """link_1 … link_n, one for every row."""
    payload: MassProperties | None
    """The nominal payload, in DH frame n; it is in no export. None where it is 0 kg."""
    tool: LinkModel | None
    """What the last link carries, in DH frame n; None without a tool besides the frame tool0."""
    joints: tuple[JointModel, ...]
    """One for every row."""
    excluded: tuple[ExcludedPair, ...]
    """Pairs of links that do not collide."""
    reach: float
    """Upper bound of the distance from base_link's origin to tool0, m."""
    extent: float
    """The same to any joint or DH frame, which a table may put far from the arm, m; rounding errors grow with it."""
    home: Array
    """The configuration 'home', or zero moved inside the limits; rad or m, shape (m,)."""

    def __repr__(self) -> str:
        return f"<RobotModel '{self.name}': {len(self.links)} links, {self.mass:.4g} kg, reach {self.reach:.4g} m>"

    @property
    def name(self) -> str:
        """The robot's name."""
        return self.spec.name

    @property
    def moving_links(self) -> tuple[LinkModel, ...]:
        """The links of the rows, and the tool where there is one."""
        return self.links if self.tool is None else (*self.links, self.tool)

    @property
    def all_links(self) -> tuple[LinkModel, ...]:
        """The base link, the links of the rows and the tool, base first."""
        return (self.base, *self.moving_links)

    @property
    def T_link_dh(self) -> tuple[Array, ...]:
        """Pose of the DH frame that carries its mesh in each of ``all_links``, shape (4, 4)."""
        own = (self.chain.T_base_link_dh0, *(joint.T_joint_dh for joint in self.joints))
        return own if self.tool is None else (*own, identity())

    @property
    def moving_joints(self) -> tuple[JointModel, ...]:
        """The joints that have a coordinate, in the order of a joint vector."""
        return tuple(joint for joint in self.joints if joint.type.moves)

    @property
    def bodies(self) -> tuple[MassProperties | None, ...]:
        """Mass properties of link_1 … link_n, each in its joint frame, the last with the tool."""
        tool = None if self.tool is None else self.tool.inertial
        return carrying([link.inertial for link in self.links], tool, self.joints[-1])

    @property
    def mass(self) -> float:
        """Mass of all links that move, kg."""
        return sum(body.mass for body in self.bodies if body is not None)

    @property
    def travel(self) -> tuple[Array, Array]:
        """Lower and upper joint coordinates to sample between, rad and m, shape (m,) each; see ``JointModel``."""
        travels = [joint.travel for joint in self.moving_joints]
        return read_only([lower for lower, _ in travels]), read_only([upper for _, upper in travels])

    def gravity_loads(self, q: Array) -> tuple[float, ...]:
        """Return the generalised forces, N·m or N, that hold the robot still at ``q`` (rad or m, shape (m,))."""
        return gravity_loads(self.chain, self.bodies, joint_vector(self.chain, q)[None], self.spec.gravity)[0]

    def holding_controls(self, q: Array) -> list[float]:
        """Return the controls, one an actuator, with which the robot is at rest at ``q`` (rad or m, shape (m,))."""
        [controls] = self.holding_controls_of([q])
        return controls

    def holding_controls_of(self, configurations: Sequence[Array]) -> list[list[float]]:
        """Return the controls, one an actuator, with which the robot is at rest in each configuration.

        A position actuator is asked for a little more than the joint's position, so that its pull balances gravity.
        Clipped to the control's range.
        """
        vectors = np.array([joint_vector(self.chain, q) for q in configurations])
        loads = gravity_loads(self.chain, self.bodies, vectors, self.spec.gravity)
        return [self._holding(q, load) for q, load in zip(vectors.tolist(), loads, strict=True)]

    def _holding(self, q: Sequence[float], loads: Sequence[float]) -> list[float]:
        controls = []
        for joint, position, load in zip(self.moving_joints, q, loads, strict=True):
            match joint.actuator.type:
                case ActuatorType.POSITION:
                    control = position + (load / joint.actuator.kp if joint.actuator.kp else 0.0)
                case ActuatorType.VELOCITY:
                    control = 0.0
                case ActuatorType.MOTOR:
                    control = load
                case ActuatorType.NONE:
                    continue
            controls.append(clamped(control, joint.control_range))
        return controls

    @property
    def angle_rounding(self) -> float:
        """Upper bound of the error, rad, of orientations where theta and a coordinate of many turns are added.

        0 where no angle is larger than ``MANY_TURNS``.
        """
        rows = zip(self.spec.rows, self.joints, strict=True)
        angles = [abs(row.theta) + max(map(abs, joint.travel)) for row, joint in rows if joint.type.turns]
        return sys.float_info.epsilon * math.fsum(angle for angle in angles if angle > MANY_TURNS)

    @property
    def longest_lever(self) -> float:
        """The extent, or how far a centre of mass is from its joint, whichever is greater, m."""
        bodies = [link.inertial for link in self.moving_links]
        return max(self.extent, *(math.hypot(*body.com.tolist()) for body in bodies if body is not None), 0.0)

    @property
    def estimates(self) -> tuple[FilledIn, ...]:
        """What was estimated from the shapes; links of which the same was estimated together."""
        found = ((link.name, link.estimated) for link in self.moving_links)
        return tuple(FilledIn(how=FilledInHow.ESTIMATED, what=what, where=names) for what, names in _grouped(found))

    @property
    def assumptions(self) -> tuple[FilledIn, ...]:
        """Which limits were assumed; joints of which the same were assumed together."""
        found = _grouped((joint.name, joint.assumed) for joint in self.moving_joints)
        n = self.chain.n
        return tuple(
            FilledIn(how=FilledInHow.ASSUMED, what=what, where=names, everywhere=len(names) == n)
            for what, names in found
        )


def carrying(
    bodies: Sequence[MassProperties | None], load: MassProperties | None, last: Joint
) -> tuple[MassProperties | None, ...]:
    """Return the mass properties of the links, each in its joint frame, the last with a load given in DH frame n."""
    if load is None:
        return tuple(bodies)
    *others, link = bodies
    carried = in_frame(last.T_joint_dh, load)
    return (*others, carried if link is None else combine([link, carried]))


def _grouped(entries: Iterable[tuple[str, tuple[str, ...]]]) -> list[tuple[tuple[str, ...], tuple[str, ...]]]:
    """Names by the properties that were filled in for them, in the order in which these first occur."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, what in entries:
        if what:
            groups.setdefault(what, []).append(name)
    return [(what, tuple(names)) for what, names in groups.items()]


def _spans(names: Iterable[str]) -> str:
    """Return ``link_1 to link_3, link_5`` for link_1, link_2, link_3, link_5."""
    runs: list[list[str]] = []
    for name in names:
        number = name.rpartition("_")[2]
        if runs and number.isdecimal() and runs[-1][-1] == f"link_{int(number) - 1}":
            runs[-1].append(name)
        else:
            runs.append([name])
    return ", ".join(" to ".join(dict.fromkeys((run[0], run[-1]))) for run in runs)
