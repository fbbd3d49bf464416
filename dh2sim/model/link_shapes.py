"""The shapes of every link, made from the arm's skeleton so that it looks like a robot.

Every joint has a housing along its axis, with a hub that shows at both ends. A link runs from its own housing along
its axis to where it leaves it, across to the next axis, and along that to the next housing, by tubes with rounded
corners. A prismatic joint is a rod that slides in a sleeve, or a carriage on a rail where the rod would run into the
mast that carries it. The base is a column on a plate, which is at base_link's origin, or as far below as the first
housing takes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.skeleton import Skeleton
from dh2sim.model.limits import NO_LENGTH
from dh2sim.model.shapes import Shape, ShapeKind, ShapePart, between, neat
from dh2sim.robot.row import JointType
from dh2sim.typing import Array, Point

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
HOUSING = 1.15
"""Radius of a housing, and half its length, over the radius of its link."""
TUBE = 0.8
"""Radius of tubes over that of their link."""


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
    meetings = _meetings(chain, skeleton, radii)
    links: list[list[Shape]] = [[] for _ in radii]
    begin = skeleton.leaving(0)
    for i, joint in enumerate(chain.joints):
        parent, child, r, own = links[i], links[i + 1], radii[i], radii[i + 1]
        T, entry, leaving = joint.T_parent_joint, skeleton.entry_heights[i], skeleton.exit_heights[i]
        slides = joint.type is JointType.PRISMATIC
        low, high = skeleton.slides[i] or (0.0, 0.0)
        on_rail = slides and (i == 0 or _on_mast(T, skeleton, i, shortest))
        end = _point(T, entry if slides else meetings[i])
        if i == 0:
            heights = [_point(T, leaving + slide)[2] for slide in (low, high)]
            lowest = min(heights) if slides else end[2]
            parent += _base(r, _upright_half(T, own), lowest, end, _hangs(heights, T, own), shortest)
        else:
            parent += _tubes([begin, skeleton.leaving(i), skeleton.entries[i], end], TUBE * r, shortest)
        if on_rail:
            rail = min(entry, leaving + low), max(entry, leaving + high)
            parent.append(_on_axis(T, ShapeKind.CYLINDER, ShapePart.LINK, 0.7 * r, *rail))
            child += _housing(own, leaving, HOUSING)
        elif slides:
            parent += _sleeve(T, r, entry)
            rod = min(leaving, entry - high - 1.5 * r), max(leaving, entry - low)
            child.append(_on_axis(None, ShapeKind.CYLINDER, ShapePart.LINK, 0.6 * own, *rod))
        elif joint.type.turns:
            child += _housing(own, meetings[i], HOUSING)
        begin = skeleton.leaving(i + 1) if slides else (0.0, 0.0, meetings[i])
    links[-1] += _tip([begin, skeleton.leaving(len(chain.joints)), skeleton.tip], radii[-1], shortest)
    return tuple(tuple(shapes) for shapes in links)


def _meetings(chain: KinematicChain, skeleton: Skeleton, radii: Sequence[float]) -> list[float]:
    """Return the height on every axis at which its joint's housing is, m along z of its link.

    Halfway between where the axis is entered and left. The first is as high above base_link as it needs to be, or
    below a housing that it would be inside; the last is moved on from such a one, as at a wrist whose axes meet.
    """
    heights = []
    for i, joint in enumerate(chain.joints):
        entry, leaving = skeleton.entry_heights[i], skeleton.exit_heights[i]
        middle = 0.5 * (entry + leaving)
        if not joint.type.turns:
            heights.append(leaving)
            continue
        if i == 0:
            middle = _first_meeting(chain, skeleton, radii, middle)
        elif i == len(chain.joints) - 1 and chain.joints[i - 1].type.turns:
            clear = HOUSING * (radii[i] + 0.5 * radii[i + 1])
            before = (0.0, 0.0, heights[-1])
            if math.dist(before, skeleton.entries[i]) < 0.5 * clear and abs(leaving - entry) < 2.0 * clear:
                ahead = leaving - entry if abs(leaving - entry) > NEGLIGIBLE * clear else joint.sign
                middle = entry + math.copysign(clear, ahead)
        heights.append(middle)
    return heights


def _first_meeting(chain: KinematicChain, skeleton: Skeleton, radii: Sequence[float], middle: float) -> float:
    T, leaving = chain.joints[0].T_parent_joint, skeleton.exit_heights[0]
    up = float(T[2, 2])
    if abs(up) <= 0.5:
        return middle
    if len(chain.joints) > 1 and chain.joints[1].type.turns:
        clear = HOUSING * (radii[1] + radii[2])
        height = 0.5 * (skeleton.entry_heights[1] + skeleton.exit_heights[1])
        beyond = _point(chain.joints[1].T_parent_joint, height)
        if math.dist(beyond, (0.0, 0.0, middle)) < 0.5 * clear:
            below = -clear if _hangs([_point(T, leaving)[2]], T, radii[1]) else clear
            return beyond[2] - math.copysign(1.0, up) * below
    z, top = (_point(T, height)[2] for height in (middle, leaving))
    missing = _plate(radii[0]) + _upright_half(T, radii[1]) - z
    return middle + min(missing, top - z) / up if z >= 0.0 and missing > 0.0 and top > z else middle


def _hangs(heights: Sequence[float], T: Array, r: float) -> bool:
    """Whether the arm hangs from its base: its first link leaves the axis below, at these heights in base_link, m."""
    return max(heights) < -_upright_half(T, r)


def _base(r: float, half: float, lowest: float, end: Point, hangs: bool, shortest: float) -> list[Shape]:
    """Return a plate, a column, and a bracket to the first housing where that is not above the plate.

    Args:
        r: Radius of the base, m.
        half: How far the first housing is below its centre at most, m.
        lowest: Lowest height of its centre, m.
        end: Where the column ends, m.
        hangs: Whether the plate is above the arm.
        shortest: Length of what is drawn, m.
    """
    x, y, top = end
    if hangs:
        side, z = -1.0, max(0.0, top + half + _plate(r))
    else:
        side, z = 1.0, min(0.0, lowest - half - _plate(r))
    thick = neat(0.3 * r)
    column = (0.0, 0.0, z + side * thick)
    shapes = [
        _cylinder(ShapePart.JOINT, 1.9 * r, (0.0, 0.0, z), column),
        _cylinder(ShapePart.LINK, 1.4 * r, column, (0.0, 0.0, z + side * neat(0.6 * r))),
    ]
    corner = (0.0, 0.0, top)
    if abs(top - column[2]) > shortest:
        shapes.append(_cylinder(ShapePart.LINK, 0.85 * r, column, corner))
    return shapes + _tubes([corner, end], TUBE * r, shortest) if math.hypot(x, y) > BEND * r else shapes


def _plate(r: float) -> float:
    """Return the least height of the first housing's end above the foot of the base, m."""
    return neat(0.7 * r)


def _upright_half(T: Array, r: float) -> float:
    """Return how far a housing is below its centre, m."""
    up = abs(float(T[2, 2]))
    return HOUSING * r * (up + math.sqrt(max(0.0, 1.0 - up * up)))


def _on_mast(T: Array, skeleton: Skeleton, i: int, shortest: float) -> bool:
    """Whether a joint's axis is that of the joint before it, which may turn the mast that it slides on."""
    across = math.hypot(float(T[0, 2]), float(T[1, 2]))
    return across < NEGLIGIBLE and math.dist(skeleton.leaving(i), skeleton.entries[i]) < shortest


def _tubes(path: Sequence[Point], r: float, shortest: float) -> list[Shape]:
    """Return tubes along a path, with rounded corners; points close to one before or to the last are left out."""
    kept = [path[0]]
    for point in path[1:-1]:
        if min(math.dist(point, kept[-1]), math.dist(point, path[-1])) > max(BEND * r, shortest):
            kept.append(point)
    if math.dist(kept[-1], path[-1]) > shortest:
        kept.append(path[-1])
    radius = neat(r)
    return [between(ShapeKind.CAPSULE, ShapePart.LINK, radius, start, end) for start, end in pairwise(kept)]


def _tip(path: Sequence[Point], r: float, shortest: float) -> list[Shape]:
    """Return the tubes to tool0, and a flange at their end."""
    tubes = _tubes(path, 0.7 * r, shortest)
    housing = HOUSING * r
    if not tubes or math.dist(path[0], path[-1]) < 1.3 * housing:
        return tubes if math.dist(path[0], path[-1]) > housing else []
    start, end = (p.tolist() for p in tubes[-1].ends)
    share = min(1.0, 0.4 * r / tubes[-1].length)
    inner = [b + share * (a - b) for a, b in zip(start, end, strict=True)]
    tubes[-1:] = [between(ShapeKind.CYLINDER, ShapePart.LINK, neat(0.7 * r), start, end)]
    return [*tubes, _cylinder(ShapePart.TRIM, 0.9 * r, inner, end)]


def _housing(r: float, height: float, wide: float) -> list[Shape]:
    half = neat(HOUSING * r)
    hub = half + neat(0.12 * r)
    return [
        _on_axis(None, ShapeKind.CYLINDER, ShapePart.LINK, wide * r, height - half, height + half),
        _on_axis(None, ShapeKind.CYLINDER, ShapePart.TRIM, 0.75 * wide * r, height - hub, height + hub),
    ]


def _sleeve(T: Array, r: float, height: float) -> list[Shape]:
    half, ring = 1.5 * r, 1.62 * r
    return [
        _on_axis(T, ShapeKind.CYLINDER, ShapePart.TRIM, 0.8 * r, height - ring, height + ring),
        _on_axis(T, ShapeKind.CYLINDER, ShapePart.JOINT, r, height - half, height + half),
    ]


def _point(T: Array, height: float) -> Point:
    """Return the point at a height, m, on a joint's axis, in the frame of its parent."""
    (a, x), (b, y), (c, z) = T[:3, 2:].tolist()
    return x + height * a, y + height * b, z + height * c


def _cylinder(part: ShapePart, radius: float, start: Sequence[float], end: Sequence[float]) -> Shape:
    return between(ShapeKind.CYLINDER, part, neat(radius), start, end)


def _on_axis(T: Array | None, kind: ShapeKind, part: ShapePart, radius: float, low: float, high: float) -> Shape:
    """Return a shape between two heights on the next joint's axis, or on the link's own if T is None."""
    start, end = ((0.0, 0.0, low), (0.0, 0.0, high)) if T is None else (_point(T, low), _point(T, high))
    return between(kind, part, neat(radius), start, end)
