"""The shapes of every link, made from the arm's skeleton so that it looks like a robot.

Every joint gets a body along its axis. A link runs from its joint along its own axis to where it leaves it, across to
the next axis, and along that to the next joint. A prismatic joint is a rod that slides in a sleeve, or a carriage on
a rail where the rod would run into the mast that carries it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.skeleton import Skeleton
from dh2sim.model.limits import NO_LENGTH
from dh2sim.model.shapes import Shape, ShapeKind, ShapePart, along_z, between, neat, pose_with_z
from dh2sim.robot.spec import JointType
from dh2sim.typing import Array, read_only

NEGLIGIBLE = 1e-6
"""Segments shorter than this share of the arm's length get no shape."""
SLENDERNESS = 0.055
"""Radius of the base's shapes of an arm whose segments are 1 m together, m; it grows with the root of that length:
longer arms are more slender."""
STOUTEST = 0.08
"""That radius is at most this share of the length."""
BEND = 0.3
"""Detours smaller than this share of a tube's radius are left out."""
TAPER = 0.45
"""Share by which the last link is thinner than the base."""


def arm_length(skeleton: Skeleton) -> float:
    """Return the length, m, of all segments that an arm is made of; 1 m for one without any."""
    length = math.fsum(skeleton.segments)
    return length if length > NO_LENGTH else 1.0


def link_radii(length: float, given: Sequence[float | None]) -> list[float]:
    """Return the radii of the base link and of every link, m.

    Args:
        length: From ``arm_length``, m.
        given: Of every link in the robot file, m; None where it gives none.
    """
    widest = min(SLENDERNESS * math.sqrt(length), STOUTEST * length)
    n = len(given)
    return [neat(widest), *(own or neat(widest * (1.0 - TAPER * i / n)) for i, own in enumerate(given, start=1))]


def lay_out(
    chain: KinematicChain, skeleton: Skeleton, radii: Sequence[float], length: float
) -> tuple[tuple[Shape, ...], ...]:
    """Return the shapes of the base link and of every link, each in its link's frame.

    Args:
        chain: The chain, n rows.
        skeleton: Of the same.
        radii: From ``link_radii``, m.
        length: From ``arm_length``, m.

    Returns:
        n + 1 tuples, the base link's first. A link has a shape unless it is fixed and of no length.
    """
    shortest = NEGLIGIBLE * length
    plate = along_z(ShapeKind.CYLINDER, ShapePart.JOINT, neat(2.0 * radii[0]), 0.0, neat(0.6 * radii[0]))
    links: list[list[Shape]] = [[plate], *([] for _ in chain.joints)]
    begin = skeleton.leaving(0)
    for i, joint in enumerate(chain.joints):
        parent, child, r, own = links[i], links[i + 1], radii[i], radii[i + 1]
        T, entry, leaving = joint.T_parent_joint, skeleton.entry_heights[i], skeleton.exit_heights[i]
        slides = joint.type is JointType.PRISMATIC
        meeting = 0.5 * (entry + leaving) if joint.type.turns else leaving
        end = skeleton.entries[i] if slides else _height(T, meeting)
        if i == 0:  # a post, and a bracket where it is not on the axis
            path = [begin, read_only([0.0, 0.0, end[2]]), end]
        else:
            path = [begin, skeleton.leaving(i), skeleton.entries[i], end]
        parent += _tubes(path, 0.8 * r, shortest)
        if slides:
            low, high = skeleton.slides[i] or (0.0, 0.0)
            if i == 0 or _on_mast(T, skeleton, i, shortest):
                rail = min(entry, leaving + low), max(entry, leaving + high)
                parent.append(_on_axis(T, ShapePart.LINK, 0.7 * r, *rail))
                child.append(_joint_body(own, leaving, wide=1.4))
            else:
                parent.append(_on_axis(T, ShapePart.JOINT, 1.3 * r, entry - 1.5 * r, entry + 1.5 * r))
                rod = min(leaving, entry - high - 1.5 * r), max(leaving, entry - low)
                child.append(along_z(ShapeKind.CYLINDER, ShapePart.LINK, neat(0.7 * own), *rod))
            begin = skeleton.leaving(i + 1)
        else:
            if joint.type.turns:
                child.append(_joint_body(own, meeting, wide=1.2))
            begin = read_only([0.0, 0.0, meeting])
    links[-1] += _tubes([begin, skeleton.leaving(len(chain.joints)), skeleton.tip], 0.7 * radii[-1], shortest)
    return tuple(tuple(shapes) for shapes in links)


def _tubes(path: Sequence[Array], r: float, shortest: float) -> list[Shape]:
    """Return tubes along a path, with rounded corners; points close to one before or to the last are left out."""
    kept = [path[0]]
    for point in path[1:-1]:
        if min(math.dist(point, kept[-1]), math.dist(point, path[-1])) > max(BEND * r, shortest):
            kept.append(point)
    if math.dist(kept[-1], path[-1]) > shortest:
        kept.append(path[-1])
    return [between(ShapeKind.CAPSULE, ShapePart.LINK, neat(r), start, end) for start, end in pairwise(kept)]


def _on_mast(T: Array, skeleton: Skeleton, i: int, shortest: float) -> bool:
    """Whether a joint's axis is that of the joint before it, which may turn the mast that it slides on."""
    across = math.hypot(float(T[0, 2]), float(T[1, 2]))
    return across < NEGLIGIBLE and math.dist(skeleton.leaving(i), skeleton.entries[i]) < shortest


def _joint_body(r: float, height: float, wide: float) -> Shape:
    half = neat(1.3 * r)
    return along_z(ShapeKind.CYLINDER, ShapePart.JOINT, neat(wide * r), height - half, height + half)


def _height(T: Array, height: float) -> Array:
    """Return the point at a height, m, on a joint's axis, in the frame of its parent."""
    return read_only([float(T[k, 3]) + height * float(T[k, 2]) for k in range(3)])


def _on_axis(T: Array, part: ShapePart, radius: float, low: float, high: float) -> Shape:
    """Return a cylinder on the next joint's axis, between two heights measured from that joint's origin."""
    return Shape(
        kind=ShapeKind.CYLINDER,
        part=part,
        radius=neat(radius),
        length=high - low,
        T_link_shape=pose_with_z(_height(T, 0.5 * (low + high)).tolist(), [float(T[k, 2]) for k in range(3)]),
    )
