"""RobotSpec -> RobotModel: fills in whatever the robot file leaves open, and says what it filled in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import MappingProxyType

from dh2sim.kinematics.chain import Joint, KinematicChain, build_chain
from dh2sim.model.actuators import actuator_model, gravity_loads, seen_inertias
from dh2sim.model.collision_exclusions import excluded_pairs
from dh2sim.model.limits import ASSUMED_SLIDE_RATE, ASSUMED_TURN_RATE, PositionRange, position_range, reach_bound
from dh2sim.model.link_shapes import lay_out, link_scale, neat
from dh2sim.model.mass import link_inertial
from dh2sim.model.meshes import load_mesh
from dh2sim.model.robot_model import Color, JointModel, LinkModel, RobotModel
from dh2sim.model.shapes import Shape
from dh2sim.robot.spec import JointType, RobotSpec, Row
from dh2sim.typing import Array, read_only

ASSUMED_ACCELERATION = 10.0
"""rad/s² or m/s²: an assumed effort limit lifts twice the arm's weight, stretched, at this acceleration."""
SLENDERNESS = 0.16
"""Radius of the base's shapes as a share of the mean segment."""
TAPER = 0.45
"""By which share the last link is thinner than the base."""
PALETTE: tuple[Color, ...] = (
    (0.90, 0.45, 0.13, 1.0),
    (0.93, 0.60, 0.18, 1.0),
)
"""Colours of links whose file gives none, in turn."""
BASE_COLOR: Color = (0.25, 0.28, 0.33, 1.0)
JOINT_COLOR: Color = (0.20, 0.22, 0.26, 1.0)


def build_model(spec: RobotSpec) -> RobotModel:
    """Give a robot shapes, mass, inertia, limits and actuators.

    Args:
        spec: the robot as its file describes it.

    Returns:
        The model, read-only. What was estimated or assumed is marked in it.

    Raises:
        MeshError: a mesh file cannot be used.
    """
    chain = build_chain(spec)
    ranges = [position_range(row, chain, spec.rows) for row in spec.rows]
    shapes = _shapes(spec, chain, ranges)
    links = tuple(
        _link(row, joint, own, i)
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
    bodies = [link.inertial for link in links]
    home = _home(spec, ranges)
    zero = read_only([0.0] * chain.n)
    seen = iter(seen_inertias(chain, bodies, home))
    reach = reach_bound(chain, spec.rows)
    joints = tuple(
        _joint(row, joint, limit, next(seen) if row.type.moves else 0.0, _load_bound(i, chain, links, ranges, spec))
        for i, (row, joint, limit) in enumerate(zip(spec.rows, chain.joints, ranges, strict=True))
    )
    return RobotModel(
        spec=spec,
        chain=chain,
        base=base,
        links=links,
        joints=joints,
        excluded=excluded_pairs(chain, [base.name, *(link.name for link in links)], shapes, (zero, home)),
        reach=reach,
        home=home,
        holding=MappingProxyType(
            {name: gravity_loads(chain, bodies, q, spec.gravity) for name, q in spec.configurations.items()}
        ),
    )


def _home(spec: RobotSpec, ranges: Sequence[PositionRange | None]) -> Array:
    if "home" in spec.configurations:
        return spec.configurations["home"]
    inside = []
    for row, limit in zip(spec.rows, ranges, strict=True):
        if row.type.moves:
            inside.append(0.0 if limit is None else min(max(0.0, limit.lower), limit.upper))
    return read_only(inside)


def _shapes(
    spec: RobotSpec, chain: KinematicChain, ranges: Sequence[PositionRange | None]
) -> tuple[tuple[Shape, ...], ...]:
    travels = [
        _travel(joint, limit) if joint.type is JointType.PRISMATIC and limit is not None else (0.0, 0.0)
        for joint, limit in zip(chain.joints, ranges, strict=True)
    ]
    scale = link_scale(chain, travels)
    n = len(spec.rows)
    radii = [neat(SLENDERNESS * scale)]
    for i, row in enumerate(spec.rows, start=1):
        radii.append(row.link.radius or neat(SLENDERNESS * scale * (1.0 - TAPER * i / n)))
    return lay_out(chain, travels, radii, scale)


def _travel(joint: Joint, limit: PositionRange) -> tuple[float, float]:
    """Lowest and highest displacement along the joint frame's +z, m."""
    ends = (joint.sign * limit.lower, joint.sign * limit.upper)
    return min(ends), max(ends)


def _link(row: Row, joint: Joint, shapes: tuple[Shape, ...], i: int) -> LinkModel:
    name = f"link_{i}"
    inertial, estimated = link_inertial(row.link, joint, shapes)
    return LinkModel(
        name=name,
        shapes=shapes,
        color=row.link.color or PALETTE[(i - 1) % len(PALETTE)],
        joint_color=JOINT_COLOR,
        mesh=None if row.link.mesh is None else load_mesh(row.link.mesh, name),
        inertial=inertial,
        estimated=estimated,
    )


def _joint(row: Row, joint: Joint, limit: PositionRange | None, seen: float, load_bound: float) -> JointModel:
    assumed = []
    velocity, effort = row.limits.velocity, row.limits.effort
    if limit is not None and limit.assumed:
        assumed.append("position")
    if velocity is None:
        velocity = ASSUMED_TURN_RATE if row.type.turns else ASSUMED_SLIDE_RATE
        assumed.append("velocity")
    if effort is None:
        effort = _round_up(2 * (load_bound + seen * ASSUMED_ACCELERATION)) or 1.0
        assumed.append("effort")
    return JointModel(
        joint=joint,
        range=limit,
        velocity=velocity,
        effort=effort,
        assumed=tuple(assumed) if row.type.moves else (),
        dynamics=row.dynamics,
        actuator=actuator_model(row.actuator, seen + row.dynamics.armature),
    )


def _load_bound(
    i: int,
    chain: KinematicChain,
    links: Sequence[LinkModel],
    ranges: Sequence[PositionRange | None],
    spec: RobotSpec,
) -> float:
    """Upper bound of what gravity asks of joint ``i`` in any pose, N·m or N."""
    g = math.sqrt(math.fsum(float(x) * float(x) for x in spec.gravity)) or 9.81
    terms, distance = [], 0.0
    for joint, limit, link in zip(chain.joints[i:], ranges[i:], links[i:], strict=True):
        if joint is not chain.joints[i]:
            distance += _length(joint.T_parent_joint[:3, 3])
            if joint.type is JointType.PRISMATIC and limit is not None:
                distance += max(abs(limit.lower), abs(limit.upper))
        if link.inertial is not None:
            arm = distance + _length(link.inertial.com) if spec.rows[i].type.turns else 1.0
            terms.append(link.inertial.mass * g * arm)
    return math.fsum(terms)


def _length(vector: Array) -> float:
    x, y, z = (float(component) for component in vector)
    return math.sqrt(x * x + y * y + z * z)


def _round_up(value: float) -> float:
    """Up to two significant digits."""
    if value == 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.ceil(value / unit - 1e-9) * unit:.6g}")
