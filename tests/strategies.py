"""Random robots, and joint vectors for them, built as values: no file is read.

Right angles hide errors: odd twists, offsets, flips, prismatic and fixed rows, all conventions come mixed.
"""

from __future__ import annotations

import math
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.robot.links import BaseSpec, LinkSpec, PayloadSpec, Pose, ShapeSpec, ShapeType, ToolSpec
from dh2sim.robot.row import Convention, Dynamics, JointType, Limits, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only

ODD_TWIST = math.radians(37.3)

angles: SearchStrategy[float] = st.sampled_from(
    [0.0, math.pi / 2, -math.pi / 2, math.pi, ODD_TWIST, -ODD_TWIST, math.radians(123.4)]
) | st.floats(-math.pi, math.pi, allow_subnormal=False)
"""Angles, rad: right ones, odd ones, any."""

lengths: SearchStrategy[float] = st.sampled_from([0.0, 0.4318, -0.15]) | st.floats(-1.0, 1.0, allow_subnormal=False)
"""Lengths, m."""

names: SearchStrategy[str] = st.from_regex(r"[A-Za-z][A-Za-z0-9_-]{0,11}", fullmatch=True)


@st.composite
def vectors(draw: DrawFn, elements: SearchStrategy[float], size: int = 3) -> Array:
    """Read-only arrays of shape (size,)."""
    return read_only(draw(st.lists(elements, min_size=size, max_size=size)))


poses: SearchStrategy[Pose] = st.just(Pose()) | st.builds(Pose, xyz=vectors(lengths), rpy=vectors(angles))
"""The identity, or any pose."""


@st.composite
def inertias(draw: DrawFn) -> Array:
    """Inertia tensors that a body can have, kg·m², shape (3, 3): second moments s > 0 along turned axes."""
    s = draw(vectors(st.floats(1e-4, 0.5)))
    R = pose_from_rpy([0.0, 0.0, 0.0], draw(vectors(angles)))[:3, :3]
    tensor = R @ np.diag(s.sum() - s) @ R.T
    return read_only((tensor + tensor.T) / 2)


@st.composite
def link_specs(draw: DrawFn) -> LinkSpec:
    """Links of which the file says nothing, little, or all."""
    match draw(st.sampled_from(["nothing", "shape", "mass", "com", "inertia"])):
        case "nothing":
            return LinkSpec()
        case "shape":
            return LinkSpec(
                density=draw(st.none() | st.floats(100.0, 8000.0)),
                radius=draw(st.none() | st.floats(0.01, 0.1)),
                color=draw(st.none() | st.just((0.8, 0.4, 0.1, 1.0))),
            )
        case "mass":
            return LinkSpec(mass=draw(st.floats(0.1, 30.0)))
        case "com":
            return LinkSpec(mass=draw(st.floats(0.1, 30.0)), com=draw(vectors(lengths)))
        case _:
            return LinkSpec(mass=draw(st.floats(0.1, 30.0)), com=draw(vectors(lengths)), inertia=draw(inertias()))


@st.composite
def shape_specs(draw: DrawFn) -> ShapeSpec:
    """Boxes, cylinders and balls anywhere near the frame that they are given in."""
    kind, sizes = draw(st.sampled_from(ShapeType)), st.floats(0.01, 0.2)
    pose = draw(poses)
    match kind:
        case ShapeType.BOX:
            return ShapeSpec(type=kind, size=draw(vectors(sizes)), pose=pose)
        case ShapeType.CYLINDER:
            return ShapeSpec(type=kind, radius=draw(sizes), length=draw(sizes), pose=pose)
        case _:
            return ShapeSpec(type=kind, radius=draw(sizes), pose=pose)


@st.composite
def tool_specs(draw: DrawFn) -> ToolSpec:
    """A frame tool0 alone; or with a tool of which the file says little or all."""
    frame, masses = draw(poses), st.floats(0.1, 3.0)
    known: dict[str, Any] = {}
    match draw(st.sampled_from(["frame", "mass", "com", "inertia", "shape", "both"])):
        case "mass":
            known = {"mass": draw(masses)}
        case "com":
            known = {"mass": draw(masses), "com": draw(vectors(lengths))}
        case "inertia":
            known = {"mass": draw(masses), "com": draw(vectors(lengths)), "inertia": draw(inertias())}
        case "shape":
            known = {"shape": draw(shape_specs())}
        case "both":
            known = {"mass": draw(st.just(0.0) | masses), "shape": draw(shape_specs()), "color": (0.1, 0.2, 0.3, 1.0)}
    return ToolSpec(xyz=frame.xyz, rpy=frame.rpy, **known)


payloads: SearchStrategy[PayloadSpec] = st.builds(
    PayloadSpec, mass=st.none() | st.just(0.0) | st.floats(0.1, 20.0), com=st.none() | vectors(lengths)
)
"""Payloads that assumed efforts and gains hold."""


@st.composite
def limits_for(draw: DrawFn, joint_type: JointType) -> Limits:
    """Limits that a joint of this type can have; a continuous one has none of position."""
    if not joint_type.moves:
        return Limits()
    positive = st.none() | st.floats(0.1, 200.0)
    position = None
    if joint_type is not JointType.CONTINUOUS and draw(st.booleans()):
        reach = math.pi if joint_type.turns else 0.5
        lower = draw(st.floats(-reach, 0.25 * reach, allow_subnormal=False))
        position = (lower, lower + draw(st.floats(0.1 * reach, reach)))
    return Limits(position=position, velocity=draw(positive), effort=draw(positive))


@st.composite
def rows(draw: DrawFn, name: str, types: SearchStrategy[JointType] | None = None) -> Row:
    """Rows of the table, of any convention; a Hayati row has a d only if it slides."""
    joint_type = draw(types if types is not None else st.sampled_from(JointType))
    convention = draw(st.sampled_from(Convention))
    hayati, moves = convention is Convention.HAYATI, joint_type.moves
    return Row(
        name=name,
        type=joint_type,
        convention=convention,
        a=draw(lengths),
        alpha=draw(angles),
        d=0.0 if hayati and joint_type is not JointType.PRISMATIC else draw(lengths),
        theta=draw(angles),
        beta=draw(angles) if hayati else 0.0,
        flip=moves and draw(st.booleans()),
        limits=draw(limits_for(joint_type)),
        dynamics=Dynamics(damping=0.1, friction=0.05, armature=0.01) if moves and draw(st.booleans()) else Dynamics(),
        link=draw(link_specs()),
    )


@st.composite
def robot_specs(draw: DrawFn, *, max_rows: int = 12, must_move: bool = True) -> RobotSpec:
    """Robots of 1 to ``max_rows`` rows; with ``must_move`` at least one has a joint coordinate."""
    count = draw(st.integers(1, max_rows))
    mover = draw(st.integers(0, count - 1)) if must_move else -1
    moving_types = st.sampled_from([joint_type for joint_type in JointType if joint_type.moves])
    prefix = draw(names)
    table = tuple(draw(rows(f"{prefix}{i}", moving_types if i == mover else None)) for i in range(count))
    spec = RobotSpec(
        name=draw(names),
        rows=table,
        convention=draw(st.sampled_from(Convention)),
        base=BaseSpec(pose=draw(poses)),
        tool=draw(tool_specs()),
        payload=draw(payloads),
    )
    if draw(st.booleans()):
        return spec
    return RobotSpec(
        name=spec.name,
        rows=table,
        convention=spec.convention,
        base=spec.base,
        tool=spec.tool,
        payload=spec.payload,
        configurations=MappingProxyType({"home": draw(joint_vectors_for(spec))}),
    )


@st.composite
def joint_vectors_for(draw: DrawFn, spec: RobotSpec) -> Array:
    """Joint vectors within the limits, read-only, shape (n,); without limits within ±pi rad or ±1 m."""
    coordinates = []
    for row in spec.moving_rows:
        if row.limits.position is not None:
            coordinates.append(draw(st.floats(*row.limits.position)))
        else:
            coordinates.append(draw(angles if row.type.turns else lengths))
    return read_only(coordinates)


@st.composite
def robots_with_joint_vectors(draw: DrawFn, *, max_rows: int = 12, must_move: bool = True) -> tuple[RobotSpec, Array]:
    """A robot, and 1 to 4 joint vectors for it, shape (count, n)."""
    spec = draw(robot_specs(max_rows=max_rows, must_move=must_move))
    drawn = draw(st.lists(joint_vectors_for(spec), min_size=1, max_size=4))
    return spec, read_only(np.reshape(drawn, (len(drawn), len(spec.moving_rows))))


@st.composite
def massless_robot_specs(draw: DrawFn) -> RobotSpec:
    """Robots some of whose links weigh nothing, with a tool that carries mass behind them."""
    spec = draw(robot_specs(max_rows=5))
    massless = draw(st.lists(st.booleans(), min_size=len(spec.rows), max_size=len(spec.rows)))
    rows = tuple(
        replace(row, link=LinkSpec(mass=0.0)) if nothing else row
        for row, nothing in zip(spec.rows, massless, strict=True)
    )
    mass = draw(st.floats(0.5, 3.0))
    com, inertia = draw(vectors(lengths)), draw(inertias())
    return replace(spec, rows=rows, tool=replace(spec.tool, mass=mass, com=com, inertia=inertia))
