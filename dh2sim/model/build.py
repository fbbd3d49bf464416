"""RobotSpec -> RobotModel: fills in what the robot file leaves open, and records what it filled in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from dh2sim.errors import ModelError
from dh2sim.kinematics.chain import Joint, KinematicChain, build_chain
from dh2sim.kinematics.skeleton import build_skeleton
from dh2sim.kinematics.transforms import identity, move_point, pose_from_rpy
from dh2sim.model.actuators import actuator_model, duties, seen_inertias
from dh2sim.model.collision_exclusions import excluded_pairs
from dh2sim.model.limits import duty_bounds, filled_limits, frame_extent, position_ranges, reach_bound, travels_of
from dh2sim.model.link_shapes import arm_length, lay_out, link_radii
from dh2sim.model.mass import TOOL_DENSITY, MassProperties, ball, ball_radius, link_inertial
from dh2sim.model.meshes import load_mesh
from dh2sim.model.robot_model import Color, JointModel, LinkModel, RobotModel, carrying
from dh2sim.model.shapes import Shape, given_shape, placed
from dh2sim.robot.links import LinkSpec
from dh2sim.robot.read import place_in
from dh2sim.robot.row import Row
from dh2sim.robot.spec import RobotSpec, SpecLike, spec_of
from dh2sim.typing import Array, Point, read_only

PALETTE: tuple[Color, ...] = (
    (0.90, 0.45, 0.13, 1.0),
    (0.93, 0.60, 0.18, 1.0),
)
"""Colours of links whose file gives none, in turn."""
BASE_COLOR: Color = (0.25, 0.28, 0.33, 1.0)
JOINT_COLOR: Color = (0.20, 0.22, 0.26, 1.0)
TOOL_COLOR: Color = (0.45, 0.48, 0.53, 1.0)
PAYLOAD_SHARE = 0.2
"""Of the moving mass, that a robot is to carry whose file does not say. Published arms: 0.06 to 0.5."""


def model_of(robot: SpecLike) -> RobotModel:
    """Return the model of a robot, whatever form it is given in.

    Raises:
        ArgumentError: It is not a robot.
        ModelError: The robot has branches or closures.
        MeshError: A mesh file cannot be used.
    """
    if isinstance(robot, RobotModel):
        return robot
    model = getattr(robot, "model", None)
    return model if isinstance(model, RobotModel) else build_model(robot)


def build_model(spec: SpecLike) -> RobotModel:
    """Give a robot shapes, mass, inertia, limits and actuators.

    Args:
        spec: The robot as its file describes it.

    Returns:
        The model, read-only. What was estimated or assumed is marked in it.

    Raises:
        MeshError: A mesh file cannot be used.
        ModelError: The last joint moves nothing that has mass.
    """
    spec = spec_of(spec)
    chain = build_chain(spec)
    travels = travels_of(chain, spec.rows)
    ranges = position_ranges(spec.rows, travels)
    skeleton = build_skeleton(chain, travels)
    length = arm_length(skeleton)
    radii = link_radii(length, [row.link.radius for row in spec.rows])
    start = _drawn_tool(spec)
    drawn = skeleton if start is None else build_skeleton(replace(chain, T_dhn_tool0=start), travels)
    shapes = lay_out(chain, drawn, radii, length)
    links = tuple(
        _link(row, joint, own, skeleton.leaving(i), i)
        for i, (row, joint, own) in enumerate(zip(spec.rows, chain.joints, shapes[1:], strict=True), start=1)
    )
    base = LinkModel(
        name="base_link",
        shapes=shapes[0],
        color=spec.base.color or BASE_COLOR,
        joint_color=spec.base.color or BASE_COLOR,
        mesh=None if spec.base.mesh is None else load_mesh(spec.base.mesh, "base_link"),
        inertial=None,
        estimated=(),
    )
    tool = _tool(spec, chain)
    last = chain.joints[-1]
    bodies = carrying([link.inertial for link in links], None if tool is None else tool.inertial, last)
    home = spec.named_configurations["home"]
    _check_carried(spec, bodies)
    at = [np.zeros_like(home), home] if home.any() else [home]
    names = [base.name, *(link.name for link in links), *([] if tool is None else [tool.name])]
    payload = _payload(spec, chain, math.fsum(body.mass for body in bodies if body is not None))
    loaded = carrying(bodies, payload, last)
    seen = iter(seen_inertias(chain, loaded, home))
    own = duties(
        [row.type for row in spec.rows],
        duty_bounds(skeleton, loaded, spec.gravity),
        [next(seen) if row.type.moves else 0.0 for row in spec.rows],
    )
    joints = []
    for row, joint, position, duty in zip(spec.rows, chain.joints, ranges, own, strict=True):
        limits, assumed = filled_limits(row, position, duty)
        joints.append(
            JointModel(
                **{field.name: getattr(joint, field.name) for field in fields(Joint)},
                limits=limits,
                assumed=assumed,
                dynamics=row.dynamics,
                duty=duty,
                actuator=actuator_model(row.actuator, duty.inertia + row.dynamics.armature),
            )
        )
    return RobotModel(
        spec=spec,
        chain=chain,
        base=base,
        links=links,
        tool=tool,
        payload=payload,
        joints=tuple(joints),
        excluded=excluded_pairs(chain, names, (*shapes, *_tool_shapes(tool, chain)), at),
        reach=reach_bound(skeleton),
        extent=frame_extent(chain, travels),
        home=home,
    )


def _check_carried(spec: RobotSpec, bodies: Sequence[MassProperties | None]) -> None:
    """Refuse a last joint that moves no mass; ``bodies`` are the links', the last with the tool.

    Raises:
        ModelError: It does; the robot file cannot tell where what is fixed to a link is estimated.
    """
    last = max((i for i, row in enumerate(spec.rows) if row.type.moves), default=None)
    if last is not None and not any(bodies[last:]):
        place, source = spec.name, spec.source_file
        if source is not None:
            line, column = place_in(source, ("joints", last, "link", "mass"))
            place = f"{source.path}:{line}:{column}: joints[{last}].link.mass"
        name = spec.rows[last].name
        raise ModelError(f"{place}: {name} moves nothing that has mass; give its link a mass, or the tool")


def _payload(spec: RobotSpec, chain: KinematicChain, moving_mass: float) -> MassProperties | None:
    """Return the nominal payload in DH frame n: a ball that touches tool0, or has its centre where the file says."""
    given = spec.payload.mass
    mass = PAYLOAD_SHARE * moving_mass if given is None else given
    if mass == 0.0:
        return None
    radius = ball_radius(mass)
    before_tool0 = move_point(chain.T_dhn_tool0, read_only([0, 0, radius]))
    return replace(ball(mass, radius), com=read_only(before_tool0 if spec.payload.com is None else spec.payload.com))


def _drawn_tool(spec: RobotSpec) -> Array | None:
    """Return the pose in DH frame n of a tool that is drawn by itself: the last link reaches there, not to tool0."""
    drawn = spec.tool.shape or spec.tool.mesh
    return None if drawn is None else pose_from_rpy(drawn.pose.xyz, drawn.pose.rpy)


def _tool_shapes(tool: LinkModel | None, chain: KinematicChain) -> list[tuple[Shape, ...]]:
    """Return the shapes of the tool in the frame of the last joint, if there is a tool."""
    return [] if tool is None else [tuple(placed(shape, chain.joints[-1].T_joint_dh) for shape in tool.shapes)]


def _tool(spec: RobotSpec, chain: KinematicChain) -> LinkModel | None:
    tool = spec.tool
    if not tool.is_body:
        return None
    shapes = () if tool.shape is None else (given_shape(tool.shape),)
    assumed = LinkSpec(mass=tool.mass, com=tool.com, inertia=tool.inertia, density=TOOL_DENSITY)
    if not shapes:  # a ball at tool0
        mass = tool.mass or 0.0
        com = read_only(chain.T_dhn_tool0[:3, 3]) if tool.com is None else tool.com
        assumed = replace(assumed, mass=mass, com=com, radius=ball_radius(mass))
    inertial, _ = link_inertial(assumed, identity(), shapes, (0.0, 0.0, 0.0))
    estimated = tuple(name for name in ("mass", "com", "inertia") if inertial and getattr(tool, name) is None)
    return LinkModel(
        name="tool",
        shapes=shapes,
        color=tool.color or TOOL_COLOR,
        joint_color=tool.color or TOOL_COLOR,
        mesh=None if tool.mesh is None else load_mesh(tool.mesh, "tool"),
        inertial=inertial,
        estimated=estimated,
    )


def _link(row: Row, joint: Joint, shapes: tuple[Shape, ...], anchor: Point, i: int) -> LinkModel:
    name = f"link_{i}"
    inertial, estimated = link_inertial(row.link, joint.T_joint_dh, shapes, anchor)
    return LinkModel(
        name=name,
        shapes=shapes,
        color=row.link.color or PALETTE[(i - 1) % len(PALETTE)],
        joint_color=JOINT_COLOR,
        mesh=None if row.link.mesh is None else load_mesh(row.link.mesh, name),
        inertial=inertial,
        estimated=estimated,
    )
