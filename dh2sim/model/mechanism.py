"""MechanismModel: a robot of several chains and closed loops with shapes, masses and limits, for the writers."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from dh2sim.kinematics.loop_closure import assembly, constraint_jacobian, mechanism_size
from dh2sim.kinematics.loop_motion import named_configuration
from dh2sim.kinematics.transforms import move_point
from dh2sim.kinematics.tree import BASE, KinematicTree, body_poses
from dh2sim.model.build import build_model, model_of
from dh2sim.model.collision_exclusions import ExcludedPair, Reason
from dh2sim.model.robot_model import FilledIn, JointModel, LinkModel, RobotModel
from dh2sim.model.shapes import Shape, ShapeKind, ShapePart, between, neat
from dh2sim.robot.links import BaseSpec, ToolSpec
from dh2sim.robot.row import ActuatorType, Row
from dh2sim.robot.spec import RobotSpec, SpecLike, spec_of
from dh2sim.typing import Array, read_only


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BranchModel:
    """The links and joints of a branch; their names begin with the branch's."""

    name: str
    body: int
    """Index of the joint that carries the branch, or ``BASE``."""
    T_body_dh0: Array
    """Pose of the branch's DH frame 0 in that body, shape (4, 4)."""
    links: tuple[LinkModel, ...]
    joints: tuple[JointModel, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MechanismModel:
    """A mechanism with everything that the writers need; SI units."""

    spec: RobotSpec
    tree: KinematicTree
    q: Array
    """The assembly, at which all loops are closed; rad and m, shape (n,)."""
    main: RobotModel
    """The main chain, as a serial robot."""
    branches: tuple[BranchModel, ...]
    excluded: tuple[ExcludedPair, ...]
    """Pairs of links that do not collide: those of loops never do."""

    def __repr__(self) -> str:
        return f"<MechanismModel '{self.name}': {len(self.joints)} joints, {len(self.spec.closures)} closures>"

    @property
    def name(self) -> str:
        """The mechanism's name."""
        return self.spec.name

    @property
    def base(self) -> LinkModel:
        """base_link."""
        return self.main.base

    @property
    def joints(self) -> tuple[JointModel, ...]:
        """One for every row: the main chain's, then those of the branches."""
        return (*self.main.joints, *(joint for branch in self.branches for joint in branch.joints))

    @property
    def moving_joints(self) -> tuple[JointModel, ...]:
        """The joints that have a coordinate, in the order of a joint vector."""
        return tuple(joint for joint in self.joints if joint.type.moves)

    @property
    def links(self) -> tuple[LinkModel, ...]:
        """One for every row."""
        return (*self.main.links, *(link for branch in self.branches for link in branch.links))

    @property
    def all_links(self) -> tuple[LinkModel, ...]:
        """The base link, the links of the rows, and the tool where there is one."""
        tool = () if self.main.tool is None else (self.main.tool,)
        return (self.main.base, *self.links, *tool)

    @property
    def mass(self) -> float:
        """Mass of all links that move, kg."""
        bodies = [link.inertial for link in self.all_links[1:]]
        return sum(body.mass for body in bodies if body is not None)

    @property
    def size(self) -> float:
        """The extent of the chain that reaches furthest, m."""
        return max(self.main.extent, mechanism_size(self.tree))

    @property
    def estimates(self) -> tuple[FilledIn, ...]:
        """What was estimated from the shapes."""
        return replace(self.main, links=self.links, joints=self.joints).estimates

    @property
    def assumptions(self) -> tuple[FilledIn, ...]:
        """Which limits were assumed."""
        found = replace(self.main, links=self.links, joints=self.joints).assumptions
        return tuple(replace(entry, everywhere=len(entry.where) == self.tree.n) for entry in found)

    def configurations(self) -> dict[str, Array]:
        """Return home and the file's configurations, with the loops closed."""
        return {name: named_configuration(self.spec, name) for name in ("home", *self.spec.configurations)}

    def body_name(self, body: int) -> str:
        """Return the name of the link of a joint, or of the base."""
        return self.main.base.name if body == BASE else self.links[body].name

    def gravity_loads(self, q: Array) -> Array:
        """Return the generalised forces, N·m and N, that hold the open tree still at ``q``, shape (n,)."""
        poses = body_poses(self.tree, q)
        tool = None if self.main.tool is None else self.main.tool.inertial
        bodies = [link.inertial for link in self.links]
        loads = np.zeros(self.tree.n)
        end = len(self.main.joints) - 1
        carried = [(body, poses[k], self.tree.path(k)) for k, body in enumerate(bodies)]
        if tool is not None:
            carried.append((tool, poses[end] @ self.main.joints[end].T_joint_dh, self.tree.path(end)))
        for inertial, T, path in carried:
            if inertial is None:
                continue
            com = np.array(move_point(read_only(T), inertial.com))
            for k in path:
                joint, column = self.tree.joints[k], self.tree.coordinates[k]
                if column < 0:
                    continue
                z = joint.sign * poses[k][:3, 2]
                rate = np.cross(z, com - poses[k][:3, 3]) if joint.type.turns else z
                loads[column] -= inertial.mass * float(rate @ self.spec.gravity)
        return loads

    def holding_controls(self, q: Array) -> list[float]:
        """Return the controls, one an actuator, with which the mechanism is at rest at ``q``, shape (n,).

        The forces of the driven joints and of the closures balance gravity; of all that do the least are taken.
        They are rounded to nine digits, which every machine agrees on.
        """
        driven = [k for k, joint in enumerate(self.moving_joints) if joint.actuator.type is not ActuatorType.NONE]
        forces = np.zeros((self.tree.n, len(driven)))
        forces[driven, range(len(driven))] = 1.0
        J = constraint_jacobian(self.tree, q) if self.tree.closures else np.zeros((0, self.tree.n))
        found = np.linalg.lstsq(np.hstack([forces, J.T]), self.gravity_loads(q), rcond=1e-9)[0]
        controls = []
        for k, load in zip(driven, found.tolist(), strict=False):
            joint, position = self.moving_joints[k], float(q[k])
            held = 0.0 if abs(load) < 1e-12 * self.mass * self.size else float(f"{load:.9g}")
            match joint.actuator.type:
                case ActuatorType.POSITION:
                    control = position + (held / joint.actuator.kp if joint.actuator.kp else 0.0)
                case ActuatorType.MOTOR:
                    control = held
                case _:
                    control = 0.0
            limits = joint.control_range
            controls.append(control if limits is None else min(max(control, limits[0]), limits[1]))
        return controls


AnyModel: TypeAlias = RobotModel | MechanismModel


def written_model(robot: SpecLike) -> AnyModel:
    """Return the model of a robot or of a mechanism, whatever form it is given in.

    Raises:
        ArgumentError: It is neither.
        AssemblyError: The loops of a mechanism cannot be closed.
        MeshError: A mesh file cannot be used.
    """
    if isinstance(robot, RobotModel | MechanismModel):
        return robot
    spec = spec_of(robot)
    if not spec.is_mechanism:
        return model_of(robot)
    mechanism = getattr(robot, "mechanism", None)
    return mechanism if isinstance(mechanism, MechanismModel) else build_mechanism(spec)


def build_mechanism(robot: SpecLike) -> MechanismModel:
    """Give a mechanism shapes, masses, limits and actuators: each of its chains is filled in as a serial robot is.

    Raises:
        AssemblyError: Its loops cannot be closed.
        MeshError: A mesh file cannot be used.
        ModelError: The last joint of a chain moves nothing that has mass.
    """
    spec = spec_of(robot)
    tree, q = assembly(spec)
    main = _chain(spec, spec.name, spec.rows, q, 0, main=True)
    branches = []
    first = len(spec.rows)
    for name, branch in spec.branches.items():
        start = sum(joint.type.moves for joint in tree.joints[:first])
        chain = _chain(spec, name, branch.rows, q, start, main=False)
        joints = [
            replace(joint, T_parent_joint=tree.joints[first + k].T_parent_joint)
            for k, joint in enumerate(chain.joints)
        ]
        body, T_body_dh0 = tree.frames[f"{name}/dh_0"]
        links = tuple(_renamed(link, name) for link in chain.links)
        branches.append(BranchModel(name=name, body=body, T_body_dh0=T_body_dh0, links=links, joints=tuple(joints)))
        first += len(branch.rows)
    main = replace(
        main,
        base=_reaching(main.base, tree, BASE),
        links=tuple(_reaching(link, tree, body) for body, link in enumerate(main.links)),
    )
    first = len(main.links)
    for k, part in enumerate(branches):
        links = tuple(_reaching(link, tree, body) for body, link in enumerate(part.links, start=first))
        branches[k] = replace(part, links=links)
        first += len(links)
    built = MechanismModel(spec=spec, tree=tree, q=q, main=main, branches=tuple(branches), excluded=())
    return replace(built, excluded=_excluded(built))


STRUT = 0.012
"""Radius, in sizes of the mechanism, of the struts that hold what is off a chain."""


def _reaching(link: LinkModel, tree: KinematicTree, body: int) -> LinkModel:
    """Return a link with struts to where branches start from it and closures hold it; they are only shown.

    Each goes from the nearest frame of the link's own chain.
    """
    chain = link.name.rpartition("/")[0]
    own = {name: f for name, f in tree.frames.items() if f.body == body and name.rpartition("/")[0] == chain}
    reached = [own["tool0"]] if "tool0" in own else own.values()  # the last link is drawn to tool0, not to its frame
    near = [[0.0, 0.0, 0.0], *(frame.T_body_frame[:3, 3].tolist() for frame in reached)]
    held = [tree.frame(frame) for closure in tree.closures for frame in (closure.a, closure.b)]
    starts = [frame for name, frame in tree.frames.items() if name.endswith("/dh_0")]
    size = mechanism_size(tree)
    struts: list[Shape] = []
    for frame in (*held, *starts):
        end = frame.T_body_frame[:3, 3].tolist()
        start = min(near, key=lambda point: math.dist(point, end))
        if frame.body == body and math.dist(start, end) > STRUT * size:
            struts.append(between(ShapeKind.CAPSULE, ShapePart.TRIM, neat(STRUT * size), start, end))
            near.append(end)
    return replace(link, shapes=(*link.shapes, *struts))


def _chain(spec: RobotSpec, name: str, rows: tuple[Row, ...], q: Array, start: int, *, main: bool) -> RobotModel:
    """Return one chain of a mechanism as the model of a serial robot, at home where it is assembled."""
    moving = sum(row.type.moves for row in rows)
    home = {"home": q[start : start + moving]} if moving else {}
    serial = replace(
        spec,
        name=name,
        rows=rows,
        base=spec.base if main else BaseSpec(),
        tool=spec.tool if main else ToolSpec(),
        branches=MappingProxyType({}),
        closures=(),
        actuated=None,
        assembly=None,
        configurations=home,
    )
    built = build_model(serial)
    if not spec.closures:
        return built
    passive = ActuatorType.NONE
    joints = [_unbounded(joint) if joint.actuator.type is passive else joint for joint in built.joints]
    return replace(built, joints=tuple(joints))


def _unbounded(joint: JointModel) -> JointModel:
    """Return a passive joint without assumed position limits: the loops say how far it goes."""
    if "position" not in joint.assumed:
        return joint
    assumed = tuple(what for what in joint.assumed if what != "position")
    return replace(joint, limits=replace(joint.limits, position=None), assumed=assumed)


def _renamed(link: LinkModel, branch: str) -> LinkModel:
    mesh = None if link.mesh is None else replace(link.mesh, file_name=f"{branch}_{link.mesh.file_name}")
    return replace(link, name=f"{branch}/{link.name}", mesh=mesh)


def _excluded(model: MechanismModel) -> tuple[ExcludedPair, ...]:
    """Return the pairs of the main chain, of neighbours on branches, and of the links of all loops."""
    pairs = {(pair.link1, pair.link2): pair.reason for pair in model.main.excluded}
    tree = model.tree
    for branch in model.branches:
        names = [model.body_name(branch.body), *(link.name for link in branch.links)]
        for a, b in itertools.pairwise(names):
            pairs.setdefault((a, b), Reason.ADJACENT)
    ends = [tree.frame(frame).body for closure in tree.closures for frame in (closure.a, closure.b)]
    loops = {body for end in ends for body in tree.path(end)}
    if loops:
        names = [model.body_name(body) for body in sorted(loops | {BASE})]
        for a, b in itertools.combinations(names, 2):
            pairs.setdefault((a, b), Reason.DEFAULT)
    return tuple(ExcludedPair(link1=a, link2=b, reason=reason) for (a, b), reason in pairs.items())
