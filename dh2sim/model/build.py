"""RobotSpec -> RobotModel: fills in what the robot file leaves open, and records what it filled in."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields, is_dataclass
from typing import Protocol, TypeAlias

import numpy as np

from dh2sim.errors import ModelError
from dh2sim.kinematics.chain import HasChain, Joint, KinematicChain, SpecLike, build_chain, spec_of
from dh2sim.model.actuators import actuator_model, seen_inertias
from dh2sim.model.collision_exclusions import excluded_pairs
from dh2sim.model.limits import Range, filled_limits, load_bound, position_ranges, reach_bound
from dh2sim.model.link_shapes import lay_out, link_scale, neat
from dh2sim.model.mass import link_inertial
from dh2sim.model.meshes import load_mesh
from dh2sim.model.robot_model import Color, JointModel, LinkModel, RobotModel
from dh2sim.model.shapes import Shape
from dh2sim.robot.spec import JointType, RobotSpec, Row

LARGEST = 1e20
"""Size of the largest number that a model is built from, and one over the least mass, density or radius."""
SLENDERNESS = 0.16
"""Radius of the base's shapes as a share of the mean segment."""
TAPER = 0.45
"""Share by which the last link is thinner than the base."""
PALETTE: tuple[Color, ...] = (
    (0.90, 0.45, 0.13, 1.0),
    (0.93, 0.60, 0.18, 1.0),
)
"""Colours of links whose file gives none, in turn."""
BASE_COLOR: Color = (0.25, 0.28, 0.33, 1.0)
JOINT_COLOR: Color = (0.20, 0.22, 0.26, 1.0)


class HasModel(HasChain, Protocol):
    """A robot in a larger form: a ``Robot``."""

    @property
    def model(self) -> RobotModel:
        """The robot with shapes, masses and limits."""
        ...


ModelLike: TypeAlias = RobotModel | RobotSpec | HasModel


def model_of(robot: ModelLike) -> RobotModel:
    """Return the model of a robot, whatever form it is given in.

    Raises:
        TypeError: It is not a robot.
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
        ModelError: A number is too large or too small to compute with.
    """
    spec = spec_of(spec)
    _check_sizes(spec)
    chain = build_chain(spec)
    ranges = position_ranges(chain, spec.rows)
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
    home = spec.named_configurations["home"]
    zero = np.zeros_like(home)
    seen = iter(seen_inertias(chain, bodies, home))
    joints = []
    for i, (row, joint, position) in enumerate(zip(spec.rows, chain.joints, ranges, strict=True)):
        inertia = next(seen) if row.type.moves else 0.0
        limits, assumed = filled_limits(row, position, load_bound(i, chain, ranges, bodies, spec.gravity), inertia)
        actuator = actuator_model(row.actuator, inertia + row.dynamics.armature)
        placed = {field.name: getattr(joint, field.name) for field in fields(Joint)}
        joints.append(JointModel(**placed, limits=limits, assumed=assumed, dynamics=row.dynamics, actuator=actuator))
    return RobotModel(
        spec=spec,
        chain=chain,
        base=base,
        links=links,
        joints=tuple(joints),
        excluded=excluded_pairs(chain, [base.name, *(link.name for link in links)], shapes, (zero, home)),
        reach=reach_bound(chain, spec.rows),
        home=home,
    )


def _check_sizes(spec: RobotSpec) -> None:
    """Refuse numbers whose products would leave the range of doubles.

    Raises:
        ModelError: One is too large, or too small where it is divided by.
    """
    parts = {f"joints[{index}]": row for index, row in enumerate(spec.rows)}
    for part, value in {**parts, "base": spec.base.pose, "tool": spec.tool, "gravity": spec.gravity}.items():
        for path, number in _numbers(part, value):
            divides = path.endswith(("mass", "density", "radius"))
            if abs(number) > LARGEST or (divides and number < 1 / LARGEST):
                bound = f"at most {LARGEST:g}" if abs(number) > LARGEST else f"at least {1 / LARGEST:g}"
                raise ModelError(f"{spec.name}: {path} is {number:g}; a model needs numbers of {bound}")


def _numbers(path: str, value: object) -> Iterator[tuple[str, float]]:
    """Yield every number in a part of a spec with its path."""
    match value:
        case int() | float():
            yield path, value
        case np.ndarray() | tuple():
            for index, item in enumerate(value):
                yield from _numbers(f"{path}[{index}]", item)
        case _ if is_dataclass(value):
            for field in fields(value):
                yield from _numbers(f"{path}.{field.name}", getattr(value, field.name))


def _shapes(spec: RobotSpec, chain: KinematicChain, ranges: Sequence[Range | None]) -> tuple[tuple[Shape, ...], ...]:
    travels = [
        _travel(joint, span) if joint.type is JointType.PRISMATIC and span is not None else (0.0, 0.0)
        for joint, span in zip(chain.joints, ranges, strict=True)
    ]
    scale = link_scale(chain, travels)
    n = len(spec.rows)
    radii = [neat(SLENDERNESS * scale)]
    for i, row in enumerate(spec.rows, start=1):
        radii.append(row.link.radius or neat(SLENDERNESS * scale * (1.0 - TAPER * i / n)))
    return lay_out(chain, travels, radii, scale)


def _travel(joint: Joint, span: Range) -> Range:
    """Return the lowest and highest displacement along the joint frame's +z, m."""
    ends = (joint.sign * span[0], joint.sign * span[1])
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
