"""The content of a robot file to a RobotSpec: defaults filled in, SI units, read-only arrays."""

from __future__ import annotations

from collections.abc import Sequence
from types import MappingProxyType

from dh2sim.robot.document import Node
from dh2sim.robot.report import Loc, path_of
from dh2sim.robot.rows import default_name
from dh2sim.robot.schema import (
    ActuatorEntry,
    DynamicsEntry,
    JointEntry,
    LimitsEntry,
    LinkEntry,
    MeshEntry,
    PoseEntry,
    RobotEntry,
)
from dh2sim.robot.spec import (
    ActuatorSpec,
    ActuatorType,
    BaseSpec,
    Convention,
    Dynamics,
    JointType,
    Limits,
    LinkSpec,
    MeshSpec,
    Pose,
    RobotSpec,
    Row,
    SourceFile,
)
from dh2sim.robot.units import Units
from dh2sim.typing import Array, read_only


def to_spec(entry: RobotEntry, root: Node, source: SourceFile) -> RobotSpec:
    """Return the robot that a file describes.

    Args:
        entry: The file's content, valid as a whole.
        root: The tree it was read from, for the places that later messages name.
        source: The file.
    """
    return _Converter(entry, root, source).robot()


class _Converter:
    """Knows the units of one file."""

    def __init__(self, entry: RobotEntry, root: Node, source: SourceFile) -> None:
        self._entry = entry
        self._root = root
        self._source = source
        self._units = Units(angle=entry.units.angle, length=entry.units.length)

    def robot(self) -> RobotSpec:
        entry = self._entry
        rows = tuple(self._row(index, joint) for index, joint in enumerate(entry.joints))
        moving = [row for row in rows if row.type.moves]
        return RobotSpec(
            name=entry.name,
            rows=rows,
            description=entry.description,
            source=entry.source,
            convention=entry.convention,
            parameters=MappingProxyType(dict(entry.parameters)),
            base=BaseSpec(
                pose=self._pose(entry.base),
                mesh=self._mesh(entry.base.mesh, ("base", "mesh")),
                color=_color(entry.base.color),
            ),
            tool=self._pose(entry.tool),
            gravity=read_only(entry.gravity),
            configurations=MappingProxyType(
                {name: self._coordinates(values, moving) for name, values in entry.configurations.items()}
            ),
            source_file=self._source,
        )

    def _row(self, index: int, joint: JointEntry) -> Row:
        units = self._units
        return Row(
            name=joint.name or default_name(index),
            type=joint.type,
            convention=Convention(joint.convention or self._entry.convention),
            a=units.metres(joint.a),
            alpha=units.radians(joint.alpha),
            d=units.metres(joint.d),
            theta=units.radians(joint.theta),
            beta=units.radians(joint.beta),
            flip=joint.flip,
            limits=self._limits(joint.limits, turns=joint.type.turns),
            dynamics=_dynamics(joint.dynamics),
            link=self._link(joint.link, ("joints", index, "link")),
            actuator=_actuator(joint, self._entry.actuators),
        )

    def _limits(self, limits: LimitsEntry, *, turns: bool) -> Limits:
        position, velocity = limits.position, limits.velocity
        to_si = self._units.coordinate
        return Limits(
            position=(to_si(position[0], turns=turns), to_si(position[1], turns=turns)) if position else None,
            velocity=None if velocity is None else to_si(velocity, turns=turns),
            effort=limits.effort,
        )

    def _link(self, link: LinkEntry, loc: Loc) -> LinkSpec:
        return LinkSpec(
            mass=link.mass,
            com=None if link.com is None else self._lengths(link.com),
            inertia=None if link.inertia is None else read_only(link.inertia.matrix),
            density=link.density,
            radius=None if link.radius is None else self._units.metres(link.radius),
            color=_color(link.color),
            mesh=self._mesh(link.mesh, (*loc, "mesh")),
        )

    def _mesh(self, mesh: MeshEntry | None, loc: Loc) -> MeshSpec | None:
        if mesh is None:
            return None
        loc = (*loc, "file")
        node = self._root.at(*loc)
        place = f":{node.line}:{node.column}" if node else ""
        location = f"{self._source.path}{place}: {path_of(loc)}"
        return MeshSpec(file=mesh.file, scale=mesh.scale, pose=self._pose(mesh), location=location)

    def _pose(self, pose: PoseEntry | MeshEntry) -> Pose:
        return Pose(xyz=self._lengths(pose.xyz), rpy=read_only([self._units.radians(x) for x in pose.rpy]))

    def _lengths(self, values: Sequence[float]) -> Array:
        return read_only([self._units.metres(value) for value in values])

    def _coordinates(self, values: Sequence[float], moving: Sequence[Row]) -> Array:
        pairs = zip(values, moving, strict=True)
        return read_only([self._units.coordinate(value, turns=row.type.turns) for value, row in pairs])


def _dynamics(dynamics: DynamicsEntry) -> Dynamics:
    return Dynamics(damping=dynamics.damping, friction=dynamics.friction, armature=dynamics.armature)


def _color(color: Sequence[float] | None) -> tuple[float, float, float, float] | None:
    """Return a colour with its alpha, opaque where the file gives none."""
    if color is None:
        return None
    red, green, blue, alpha = (*color, 1.0)[:4]
    return red, green, blue, alpha


def _actuator(joint: JointEntry, shared: ActuatorEntry) -> ActuatorSpec:
    """Return a joint's actuator: its own, else the file's; gains are inherited where the types agree."""
    if joint.type is JointType.FIXED:
        return ActuatorSpec(type=ActuatorType.NONE)
    shared_type = shared.type or ActuatorType.POSITION
    own = joint.actuator
    kind = own.type or shared_type
    same = kind is shared_type
    return ActuatorSpec(
        type=kind,
        kp=own.kp if own.kp is not None or not same else shared.kp,
        kv=own.kv if own.kv is not None or not same else shared.kv,
    )
