"""The shapes of every link, made from the chain alone so that it looks like a robot.

Every joint gets a body along its axis. From a link's frame the solid runs to the next joint by way of the elbow, the
point of the next axis nearest to the link's own z axis: along the link's axis, across (|a|), and along the
next axis (|d|). A prismatic joint is a rod that slides in a sleeve, or a carriage on a rail where the rod would run
into the mast that carries it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.transforms import compose
from dh2sim.model.limits import NO_LENGTH
from dh2sim.model.shapes import Shape, ShapeKind, ShapePart, along_z, between, pose_with_z
from dh2sim.robot.spec import JointType
from dh2sim.typing import Array, read_only

NEGLIGIBLE = 1e-6
"""Segments shorter than this share of the robot's scale get no shape."""
DETOUR = 3.0
"""A route over the elbow is at most this many times the straight one; the elbow of nearly parallel axes is far."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Route:
    """The route from a link's frame to the next joint's origin."""

    foot: float
    """Height on the link's own z axis where the common normal starts, m."""
    elbow: Array
    """Where it meets the next axis, m, shape (3,)."""
    run: float
    """From the elbow along the next axis to the next joint's origin, m; signed."""
    coaxial: bool
    """Whether the next axis is the link's own z axis."""


def link_scale(chain: KinematicChain, travels: Sequence[tuple[float, float]]) -> float:
    """Return the mean length, m, of the segments and travels that a robot is made of; 1 m for a robot without any.

    Args:
        chain: The chain.
        travels: Lowest and highest displacement along +z of every joint, m; (0, 0) for those that do not slide.
    """
    lengths = [
        length
        for joint, (low, high) in zip(chain.joints, travels, strict=True)
        for route in [_route(joint.T_parent_joint)]
        for length in (
            abs(route.foot),
            math.hypot(route.elbow[0], route.elbow[1]),
            abs(route.run),
            high - low,
        )
    ]
    lengths.append(_norm(compose(chain.joints[-1].T_joint_dh, chain.T_dhn_tool0)[:3, 3]))
    largest = max(lengths)
    counted = [length for length in lengths if length > max(1e-3 * largest, NO_LENGTH)]
    return math.fsum(counted) / len(counted) if counted else 1.0


def lay_out(
    chain: KinematicChain, travels: Sequence[tuple[float, float]], radii: Sequence[float], scale: float
) -> tuple[tuple[Shape, ...], ...]:
    """Return the shapes of the base link and of every link, each in its link's frame.

    Args:
        chain: The chain, n rows.
        travels: As for ``link_scale``.
        radii: Of the base link and the n links, m.
        scale: From ``link_scale``, m.

    Returns:
        n + 1 tuples, the base link's first. A link has a shape unless it is fixed and of no length.
    """
    shortest = NEGLIGIBLE * scale
    T_tool = compose(chain.joints[-1].T_joint_dh, chain.T_dhn_tool0)
    links: list[list[Shape]] = [[_base_plate(radii[0])]]
    links += [[] for _ in chain.joints]
    for i, joint in enumerate(chain.joints):
        parent, child, r = links[i], links[i + 1], radii[i]
        route = _route(joint.T_parent_joint)
        if joint.type is JointType.PRISMATIC:
            parent += _to_elbow(route, r, shortest)
            if i == 0 or route.coaxial:
                parent.append(_rail(joint.T_parent_joint, route, travels[i], r))
                child.append(_joint_body(radii[i + 1], wide=1.4))
            else:
                parent.append(_sleeve(joint.T_parent_joint, route, r))
                child.append(_rod(route, travels[i], radii[i + 1], r))
        else:
            parent += _to_elbow(route, r, shortest) + _to_joint(joint.T_parent_joint, route, r, shortest)
            if joint.type.turns:
                child.append(_joint_body(radii[i + 1], wide=1.2))
    tip = read_only(T_tool[:3, 3])
    if _norm(tip) > shortest:
        links[-1].append(
            between(ShapeKind.CYLINDER, ShapePart.LINK, neat(0.7 * radii[-1]), read_only([0, 0, 0]), tip)
        )
    return tuple(tuple(shapes) for shapes in links)


def _route(T_parent_joint: Array) -> _Route:
    p = [float(x) for x in T_parent_joint[:3, 3]]
    z = [float(x) for x in T_parent_joint[:3, 2]]
    slope = z[0] * z[0] + z[1] * z[1]
    if slope < 1e-18:
        run = p[2] * z[2]
    else:
        run = (p[0] * z[0] + p[1] * z[1]) / slope
    elbow = [p[i] - run * z[i] for i in range(3)]
    straight = _norm(p)
    foot = elbow[2]
    if abs(run) + abs(foot) + math.hypot(elbow[0], elbow[1]) > DETOUR * straight:
        run, elbow, foot = 0.0, p, 0.0
    coaxial = slope < 1e-18 and math.hypot(p[0], p[1]) < 1e-9 * max(1.0, straight)
    return _Route(foot=foot, elbow=read_only(elbow), run=run, coaxial=coaxial)


def _to_elbow(route: _Route, r: float, shortest: float) -> list[Shape]:
    shapes = []
    foot = read_only([0, 0, route.foot])
    if abs(route.foot) > shortest:
        shapes.append(between(ShapeKind.CYLINDER, ShapePart.LINK, neat(0.8 * r), read_only([0, 0, 0]), foot))
    if _norm([float(a) - float(b) for a, b in zip(route.elbow, foot, strict=True)]) > shortest:
        shapes.append(between(ShapeKind.CAPSULE, ShapePart.LINK, neat(0.8 * r), foot, route.elbow))
    return shapes


def _to_joint(T: Array, route: _Route, r: float, shortest: float) -> list[Shape]:
    if abs(route.run) <= shortest:
        return []
    return [between(ShapeKind.CYLINDER, ShapePart.LINK, neat(0.8 * r), route.elbow, read_only(T[:3, 3]))]


def _base_plate(r: float) -> Shape:
    return along_z(ShapeKind.CYLINDER, ShapePart.JOINT, neat(2.0 * r), 0.0, neat(0.6 * r))


def _joint_body(r: float, wide: float) -> Shape:
    half = neat(1.3 * r)
    return along_z(ShapeKind.CYLINDER, ShapePart.JOINT, neat(wide * r), -half, half)


def _rail(T: Array, route: _Route, travel: tuple[float, float], r: float) -> Shape:
    low, high = min(-route.run, travel[0]), max(-route.run, travel[1])
    return _on_axis(T, ShapePart.LINK, neat(0.7 * r), low, high)


def _sleeve(T: Array, route: _Route, r: float) -> Shape:
    return _on_axis(T, ShapePart.JOINT, neat(1.3 * r), -route.run - 1.5 * r, -route.run + 1.5 * r)


def _rod(route: _Route, travel: tuple[float, float], r: float, r_sleeve: float) -> Shape:
    """Return a rod from the joint's origin back through the sleeve, long enough for the whole travel."""
    low, high = -route.run - travel[1] - 1.5 * r_sleeve, -route.run - travel[0]
    return along_z(ShapeKind.CYLINDER, ShapePart.LINK, neat(0.7 * r), min(0.0, low), max(0.0, high))


def _on_axis(T: Array, part: ShapePart, radius: float, low: float, high: float) -> Shape:
    """Return a cylinder on the next joint's axis, between two heights measured from that joint's origin."""
    z = [float(T[i, 2]) for i in range(3)]
    centre = [float(T[i, 3]) + 0.5 * (low + high) * z[i] for i in range(3)]
    return Shape(
        kind=ShapeKind.CYLINDER,
        part=part,
        radius=radius,
        length=high - low,
        T_link_shape=pose_with_z(centre, z),
    )


def neat(size: float) -> float:
    """Round to three significant digits, which are enough for a size that was chosen."""
    return float(f"{size:.3g}")


def _norm(vector: Sequence[float] | Array) -> float:
    x, y, z = (float(component) for component in vector)
    return math.sqrt(x * x + y * y + z * z)
